"""Faults that keep a package from being built, or from installing what ROS looks for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from grader import python_ast
from grader.contract import definition
from grader.contract.foreign_packages import absent
from grader.contract.layout import LAYOUT
from grader.contract.spec import NODES
from grader.evidence import Fault
from grader.quality.cmake_text import CMakeText, Command
from grader.quality.package_sources import EntryPoint, PackageSources, similar

_CMAKE, _XML, _SETUP = "CMakeLists.txt", "package.xml", "setup.py"
_ENDS_INSTALL = {
    "DESTINATION", "TYPE", "PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "USE_SOURCE_PERMISSIONS",
    "CONFIGURATIONS", "COMPONENT", "RENAME", "OPTIONAL", "PATTERN", "REGEX", "EXCLUDE", "FILES_MATCHING",
    "MESSAGE_NEVER", "NO_SOURCE_PERMISSIONS",
}  # fmt: skip
_SHARED = tuple(path for path in LAYOUT if path.startswith(("launch/", "config/")))
_INSTALL_SHARED = "install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME})"
_FIELD = re.compile(r"^[ \t]*([a-z]\w*)/(?:msg/)?[A-Z]\w*", re.MULTILINE)
_CMAKE_OWN = ("ament", "rosidl", "python", "Python", "Threads", "PkgConfig")


def build_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield what keeps the package from being built, and then what it does not install."""
    yield from interface_build_faults(sources)
    if sources.cmake is not None and sources.by_cmake:
        if sources.cmake.unclosed is None:
            yield from _uninstalled(sources, sources.cmake)
    elif sources.cmake is not None:
        line = sources.line_of(_XML, "<build_type>")
        text = "it says `ament_python`, so colcon ignores CMakeLists.txt: it makes no interfaces from it"
        yield Fault(_XML, line, "install", text, "<build_type>ament_cmake</build_type>")
    if not sources.by_cmake:
        yield from _in_setup(sources)


def interface_build_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield what keeps a package, which may have nothing but interfaces, from being built."""
    yield from _in_xml(sources)
    if sources.cmake is not None and sources.by_cmake:
        yield from _in_cmake(sources, sources.cmake)
    yield from _illegal_fields(sources)


def _in_xml(sources: PackageSources) -> Iterator[Fault]:
    problem = sources.xml.problem
    if problem:
        place = re.search(r": line (\d+), column (\d+)", problem)
        cure = "each <tag> needs its </tag>: look there, and at the line before it" if place else "write package.xml"
        text = f"it {problem.replace('is not XML: ', 'is not XML: `')}`" if place else f"it {problem}"
        yield Fault(_XML, int(place[1]) if place else 0, "build", text, cure)
        return
    needed = [tag for tag in ("name", "version", "description", "maintainer", "license") if not sources.xml.texts(tag)]
    if needed:
        tags = ", ".join(f"<{tag}>" for tag in needed)
        yield Fault(_XML, 0, "build", f"it has no {tags}", "every package.xml needs these elements")
    group = sources.xml.texts("member_of_group")
    if (
        sources.xml.format == "3"
        and sources.by_cmake
        and sources.interfaces
        and "rosidl_interface_packages" not in group
    ):
        cure = "add <member_of_group>rosidl_interface_packages</member_of_group> before <export>"
        yield Fault(_XML, 0, "build", "a package with interfaces must be in `rosidl_interface_packages`", cure)


def _in_cmake(sources: PackageSources, cmake: CMakeText) -> Iterator[Fault]:
    if cmake.unclosed is not None:
        text = f"`{cmake.unclosed.name}(` is never closed"
        yield Fault(_CMAKE, cmake.unclosed.line, "build", text, "put a closing parenthesis after its last argument")
        return
    projects = cmake.named("project")
    if not projects:
        yield Fault(_CMAKE, 0, "build", "there is no `project(...)`", f"project({sources.name}) in the second line")
    yield from _packages(sources, cmake)
    yield from _generated(sources, cmake)
    yield from _installed_paths(sources, cmake)
    if not cmake.named("ament_package", "ament_auto_package"):
        yield Fault(_CMAKE, 0, "build", "it does not end with `ament_package()`, so ROS cannot find the package",
                    "write ament_package() as its last line")  # fmt: skip


def _illegal_fields(sources: PackageSources) -> Iterator[Fault]:
    """Yield the lines of interface files that rosidl cannot read."""
    for path in sources.interfaces:
        kind = path.partition("/")[0]
        for line, words in definition.illegal(kind, sources.read(path)):
            yield Fault(path, line, "build", words, "a line is a type and a name: float32 speed")


def _packages(sources: PackageSources, cmake: CMakeText) -> Iterator[Fault]:
    """Yield the packages that CMakeLists.txt needs and that are not here."""
    if "std_msgs" not in sources.known:
        return  # this machine has its ROS packages elsewhere
    for command in cmake.named("find_package"):
        name = command.arguments[0] if command.arguments else ""
        if not command.is_plain or not name or "REQUIRED" not in command.arguments:
            continue
        if name not in sources.known | sources.handed_in and not name.startswith(_CMAKE_OWN):
            text, cure = absent(name)
            yield Fault(_CMAKE, command.line, "build", text, cure)


def _generated(sources: PackageSources, cmake: CMakeText) -> Iterator[Fault]:
    """Yield what is wrong with the interfaces that are to be generated."""
    commands = cmake.named("rosidl_generate_interfaces")
    if not commands:
        if sources.interfaces and not _is_unclear(cmake):
            text = f"there is no `rosidl_generate_interfaces`, so {sources.interfaces[0]} becomes no type"
            yield Fault(_CMAKE, 0, "interfaces", text, "rosidl_generate_interfaces(${PROJECT_NAME} with the files")
        return
    if not any("rosidl_default_generators" in found.arguments[:1] for found in cmake.named("find_package")):
        cure = "find_package(rosidl_default_generators REQUIRED) before it"
        yield Fault(_CMAKE, commands[0].line, "build", "`rosidl_generate_interfaces` is not known here", cure)
    for command in commands:
        if not command.is_plain:
            return
        for name in command.arguments:
            if name.endswith((".msg", ".srv", ".action")) and name not in sources.paths:
                meant = similar(name, sources.interfaces)
                cure = f"the file is called {meant}" if meant else "write the file, or take its name out"
                yield Fault(_CMAKE, command.line, "build", f"it names `{name}`, which is not there", cure)
        yield from _dependencies(sources, command)
    named = {name for command in commands for name in command.arguments}
    for path in sources.interfaces:
        if path in LAYOUT and path not in named:
            cure = f'add "{path}" to rosidl_generate_interfaces'
            yield Fault(_CMAKE, commands[0].line, "interfaces", f"it does not name `{path}`", cure)


def _dependencies(sources: PackageSources, command: Command) -> Iterator[Fault]:
    """Yield the packages whose types the fields have and that are not among the DEPENDENCIES.

    A dependency of a dependency is found, too, so only a list that names none of them is a fault.
    """
    if "DEPENDENCIES" in command.arguments:
        return
    used = {
        match[1]: path
        for path in sources.interfaces
        for match in _FIELD.finditer(sources.read(path))
        if match[1] != sources.name
    }
    if used:
        name = min(used)
        text = f"`rosidl_generate_interfaces` has no DEPENDENCIES, and {used[name]} uses `{name}`"
        yield Fault(_CMAKE, command.line, "build", text, f"DEPENDENCIES {' '.join(sorted(used))} as its last line")


def _installed_paths(sources: PackageSources, cmake: CMakeText) -> Iterator[Fault]:
    """Yield what install() names and what is not there."""
    folders = {str(parent) for path in sources.paths for parent in PurePosixPath(path).parents}
    for command in cmake.named("install"):
        if not command.is_plain or "OPTIONAL" in command.arguments:
            continue
        for name in _files(command):
            path = name.rstrip("/")
            if path not in folders and path not in sources.paths and not path.startswith("/"):
                meant = similar(path, folders if "/" not in path else sources.paths)
                cure = f"is {meant} meant?" if meant else "write it, or take its name out of install()"
                yield Fault(_CMAKE, command.line, "build", f"it installs `{path}`, which is not there", cure)


def _uninstalled(sources: PackageSources, cmake: CMakeText) -> Iterator[Fault]:
    """Yield the contract's executables, launch and config files that nothing installs."""
    if _is_unclear(cmake):
        return
    installs = cmake.named("install")
    programs = {_program(sources, command, name): command for command in installs for name in _files(command)}
    for node in NODES:
        command = programs.get(node)
        if command is None and f"{node}.py" in programs:
            found = programs[f"{node}.py"]
            text = f"it installs `{node}.py`, and `ros2 run` looks for `{node}`"
            yield Fault(_CMAKE, found.line, "install", text, f"RENAME {node} in an install(PROGRAMS ...) of its own")
        elif command is None:
            text = f"nothing installs an executable `{node}`"
            if sources.setup is not None and any(entry.name == node for entry in sources.setup.entry_points):
                text += "; entry points of setup.py make executables in ament_python packages only"
            cure = f"install(PROGRAMS scripts/{node} DESTINATION lib/${{PROJECT_NAME}})"
            yield Fault(_CMAKE, 0, "install", text, cure)
        elif command.arguments[0] == "FILES" and "PERMISSIONS" not in command.arguments:
            text = f"install(FILES ...) makes `{node}` no program: it lacks the executable bit"
            yield Fault(_CMAKE, command.line, "install", text, "install(PROGRAMS ...) instead of install(FILES ...)")
    shared = {path for command in installs for path in _shared(sources, command)}
    for path in _SHARED:
        if path in sources.paths and path not in shared:
            yield Fault(_CMAKE, 0, "install", f"nothing installs `{path}`", _INSTALL_SHARED)


def _is_unclear(cmake: CMakeText) -> bool:
    """Return whether something may be installed that cannot be read off: by variables, loops or other commands."""
    others = ("ament_python_install_package", "ament_auto_package", "include", "add_subdirectory", "function", "macro")
    return bool(cmake.named(*others)) or any(not command.is_plain for command in cmake.named("install") if (
        "${PYTHON_INSTALL_DIR}" not in " ".join(command.arguments)
    ))  # fmt: skip


def _files(command: Command) -> list[str]:
    """Return the files or folders that an install() names."""
    if command.arguments[:1] not in (("FILES",), ("PROGRAMS",), ("DIRECTORY",)):
        return []
    found = []
    for argument in command.arguments[1:]:
        if argument in _ENDS_INSTALL:
            break
        found.append(argument)
    return found


def _value(command: Command, keyword: str) -> str:
    after = iter(command.arguments)
    return next((next(after, "") for argument in after if argument == keyword), "")


def _program(sources: PackageSources, command: Command, name: str) -> str:
    """Return the name under which install() puts a file where `ros2 run` looks, "" if it does not."""
    places = {f"lib/{own}" for own in sources.names}
    if command.arguments[0] == "DIRECTORY" or _value(command, "DESTINATION").rstrip("/") not in places:
        return ""
    return _value(command, "RENAME") or PurePosixPath(name).name


def _shared(sources: PackageSources, command: Command) -> Iterator[str]:
    """Yield the contract's paths of launch and config files that install() puts into the share folder."""
    destination = PurePosixPath(_value(command, "DESTINATION"))
    if destination.parts[:1] != ("share",) or not set(destination.parts[1:2]) & sources.names:
        return
    inside = PurePosixPath(*destination.parts[2:])
    for name in _files(command):
        if command.arguments[0] != "DIRECTORY":
            yield str(inside / PurePosixPath(name).name)
            continue
        top = inside if name.endswith("/") else inside / PurePosixPath(name).name
        for path in sources.paths:
            if path.startswith(f"{name.rstrip('/')}/"):
                yield str(top / PurePosixPath(path).relative_to(name))


def _in_setup(sources: PackageSources) -> Iterator[Fault]:
    """Yield the faults of a package that setup.py builds."""
    setup = sources.setup
    if setup is None:
        line, text = _unreadable_setup(sources)
        yield Fault(_SETUP, line, "build", text, "compare it with the one that `ros2 pkg create` writes")
        return
    if setup.name and sources.xml.name and setup.name != sources.xml.name:
        text = f"its name is `{setup.name}`, and package.xml has `{sources.xml.name}`"
        yield Fault(_SETUP, setup.line, "install", text, f"name='{sources.xml.name}'")
    for entry in setup.entry_points:
        if fault := _entry_point(sources, entry):
            yield fault
    names = {entry.name for entry in setup.entry_points}
    for node in NODES:
        if node not in names and not any(node in entry.text for entry in setup.entry_points if not entry.name):
            text = f"no entry point makes the executable `{node}`"
            cure = f"'{node} = {sources.name}.{node}:main' in console_scripts"
            yield Fault(_SETUP, setup.line, "install", text, cure)
    for folder in ("launch", "config"):
        has = any(path.startswith(f"{folder}/") for path in sources.paths)
        if has and folder not in (setup.data_files or ""):
            cure = f"data_files: (os.path.join('share', '{sources.name}', '{folder}'), glob('{folder}/*'))"
            yield Fault(_SETUP, setup.line, "install", f"its data_files do not install `{folder}/`", cure)


def _unreadable_setup(sources: PackageSources) -> tuple[int, str]:
    """Return the line in setup.py, and in words why nothing can be read from it."""
    if _SETUP not in sources.paths:
        return 0, "it is not there, and without it colcon cannot build the package"
    try:
        python_ast.tree_of(sources.read(_SETUP))
    except SyntaxError as error:
        return error.lineno or 1, f"it is not valid Python: `{error.msg}`"
    except python_ast.TOO_COMPLEX:
        return 0, "it is too complex to be read"
    return 0, "it does not call setup()"


def _entry_point(sources: PackageSources, entry: EntryPoint) -> Fault | None:
    if not entry.name:
        cure = f"'name = {sources.name}.module:function'"
        return Fault(_SETUP, entry.line, "start", f"`{entry.text}` is not an entry point", cure)
    path = entry.module.replace(".", "/")
    if f"{path}.py" in sources.paths or f"{path}/__init__.py" in sources.paths:
        return None
    modules = [other.removesuffix(".py").replace("/", ".") for other in sources.paths if other.endswith(".py")]
    meant = similar(entry.module, modules)
    cure = f"is {meant} meant?" if meant else "write the module, or correct the entry"
    return Fault(_SETUP, entry.line, "start", f"the entry point `{entry.text}` names no module of the package", cure)
