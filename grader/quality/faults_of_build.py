"""Faults that keep a package from being built, or from installing what ROS looks for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePosixPath

from grader.course import definition
from grader.course.foreign_packages import absent
from grader.evidence import Fault
from grader.quality.cmake_text import Command
from grader.quality.faults_of_programs import installed, installed_files, is_unclear
from grader.quality.package_sources import PackageSources, similar

_CMAKE, _XML, _SETUP = "CMakeLists.txt", "package.xml", "setup.py"
_INSTALL_SHARED = "install(DIRECTORY launch config DESTINATION share/${PROJECT_NAME})"
_CMAKE_OWN = ("ament", "rosidl", "python", "Python", "Threads", "PkgConfig")


def build_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield what keeps the package from being built, and then what it does not install."""
    yield from interface_build_faults(sources)
    if sources.by_cmake:
        if sources.cmake.unclosed is None:
            yield from _uninstalled(sources)
    elif not sources.has_cmake:
        yield from _in_setup(sources)
    else:
        line = sources.line_of(_XML, "<build_type>")
        text = "it says `ament_python`, so colcon ignores CMakeLists.txt and all that it makes and installs"
        stops = "install" if _SETUP in sources.paths else "build"
        cure = "<build_type>ament_cmake</build_type>: that of a package with a CMakeLists.txt"
        course = sources.course
        lost = [*course.nodes, *(path for path in course.shared if path in sources.paths), *sources.interfaces]
        yield Fault(_XML, line, stops, text, cure, shown_as=["can't open file 'setup.py'"], lacks=lost)


def interface_build_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield what keeps a package, which may have nothing but interfaces, from being built."""
    yield from _in_xml(sources)
    if sources.by_cmake:
        yield from _in_cmake(sources)


def _in_xml(sources: PackageSources) -> Iterator[Fault]:
    problem = sources.xml.problem
    if problem:
        place = re.search(r": line (\d+), column (\d+)", problem)
        cure = "each <tag> needs its </tag>: look there, and at the line before it" if place else "write package.xml"
        text = f"it {problem.replace('is not XML: ', 'is not XML: `')}`" if place else f"it {problem}"
        shown = [problem.removeprefix("is not XML: ")]
        yield Fault(_XML, int(place[1]) if place else 0, "build", text, cure, shown_as=shown)
        return
    needed = [tag for tag in ("name", "version", "description", "maintainer", "license") if not sources.xml.texts(tag)]
    if needed:
        tags = ", ".join(f"<{tag}>" for tag in needed)
        shown = [f'"{tag}" tag' for tag in needed]
        yield Fault(_XML, 0, "build", f"it has no {tags}", "every package.xml needs these elements", shown_as=shown)
    group = sources.xml.texts("member_of_group")
    if (
        sources.xml.format == "3"
        and sources.by_cmake
        and sources.interfaces
        and "rosidl_interface_packages" not in group
    ):
        cure = "add <member_of_group>rosidl_interface_packages</member_of_group> before <export>"
        text = "a package with interfaces must be in `rosidl_interface_packages`"
        yield Fault(_XML, 0, "build", text, cure, shown_as=["rosidl_interface_packages"])


def _in_cmake(sources: PackageSources) -> Iterator[Fault]:
    cmake = sources.cmake
    if cmake.unclosed is not None:
        return  # which CMake says
    yield from _packages(sources)
    yield from _generated(sources)
    yield from _installed_paths(sources)
    if not cmake.named("ament_package", "ament_auto_package"):
        yield Fault(_CMAKE, 0, "build", "it does not end with `ament_package()`, so ROS cannot find the package",
                    "write ament_package() as its last line")  # fmt: skip


def _packages(sources: PackageSources) -> Iterator[Fault]:
    """Yield the packages that CMakeLists.txt needs and that are not here."""
    if "std_msgs" not in sources.known:
        return  # this machine has its ROS packages elsewhere
    for command in sources.cmake.named("find_package"):
        name = command.arguments[0] if command.arguments else ""
        if not command.is_plain or not name or "REQUIRED" not in command.arguments:
            continue
        if name not in sources.known | sources.built and not name.startswith(_CMAKE_OWN):
            text, cure = absent(name)
            yield Fault(_CMAKE, command.line, "build", text, cure, shown_as=[f'"{name}"'])


def _generated(sources: PackageSources) -> Iterator[Fault]:
    """Yield what is wrong with the interfaces that are to be generated."""
    commands = sources.cmake.named("rosidl_generate_interfaces")
    if not commands:
        if sources.interfaces and not is_unclear(sources):
            text = f"there is no `rosidl_generate_interfaces`, so {sources.interfaces[0]} becomes no type"
            cure = "rosidl_generate_interfaces(${PROJECT_NAME} with the files"
            yield Fault(_CMAKE, 0, "interfaces", text, cure, lacks=sources.interfaces)
        return
    if not any("rosidl_default_generators" in found.arguments[:1] for found in sources.cmake.named("find_package")):
        cure = "find_package(rosidl_default_generators REQUIRED) before it"
        text = "`rosidl_generate_interfaces` is not known here"
        yield Fault(_CMAKE, commands[0].line, "build", text, cure, shown_as=['command "rosidl_generate_interfaces"'])
    for command in commands:
        if not command.is_plain:
            return
        for name in command.arguments:
            if name.endswith((".msg", ".srv", ".action")) and name not in sources.paths:
                meant = similar(name, sources.interfaces)
                cure = f"the file is called {meant}" if meant else "write the file, or take its name out"
                text = f"it names `{name}`, which is not there"
                yield Fault(_CMAKE, command.line, "build", text, cure, shown_as=[name])
        yield from _dependencies(sources, command)
    named = {name for command in commands for name in command.arguments}
    for path in sources.interfaces:
        if path in sources.course.layout and path not in named:
            cure = f'add "{path}" to rosidl_generate_interfaces'
            yield Fault(_CMAKE, commands[0].line, "interfaces", f"it does not name `{path}`", cure, lacks=[path])


def _dependencies(sources: PackageSources, command: Command) -> Iterator[Fault]:
    """Yield the packages whose types the fields have and that are not among the DEPENDENCIES.

    A dependency of a dependency is found, too, so only a list that names none of them is a fault.
    """
    if "DEPENDENCIES" in command.arguments:
        return
    used = {name: path for path in sources.interfaces for _, name in definition.packages(sources.read(path))}
    used.pop(sources.name, None)
    if used:
        name = min(used)
        text = f"`rosidl_generate_interfaces` has no DEPENDENCIES, and {used[name]} uses `{name}`"
        cure = f"DEPENDENCIES {' '.join(sorted(used))} as its last line"
        yield Fault(_CMAKE, command.line, "build", text, cure, shown_as=[f"'{other}'" for other in used])


def _installed_paths(sources: PackageSources) -> Iterator[Fault]:
    """Yield what install() names and what is not there."""
    folders = {str(parent) for path in sources.paths for parent in PurePosixPath(path).parents}
    for command in sources.cmake.named("install"):
        if not command.is_plain or "OPTIONAL" in command.arguments:
            continue
        for name in installed_files(command):
            path = name.rstrip("/")
            if path not in folders and path not in sources.paths and not path.startswith("/"):
                meant = similar(path, folders if "/" not in path else sources.paths)
                cure = f"is {meant} meant?" if meant else "write it, or take its name out of install()"
                text = f"it installs `{path}`, which is not there"
                yield Fault(_CMAKE, command.line, "build", text, cure, shown_as=[path])


def _uninstalled(sources: PackageSources) -> Iterator[Fault]:
    """Yield the contract's launch and config files that nothing installs where `ros2 launch` looks."""
    places = [place for command in sources.cmake.named("install") for _, place in installed(sources, command)]
    shares = [("share", name) for name in sources.names]
    shared = {place.name for place in places if place.parts[:2] in shares}
    wanted = (path for path in sources.course.shared if path in sources.paths)
    lost = [path for path in wanted if PurePosixPath(path).name not in shared]
    if lost and not is_unclear(sources):
        text = f"nothing installs {', '.join(f'`{path}`' for path in lost)} in share/{sources.name}"
        yield Fault(_CMAKE, 0, "install", text, _INSTALL_SHARED, lacks=lost)


def _in_setup(sources: PackageSources) -> Iterator[Fault]:
    """Yield the faults of a package that setup.py builds."""
    if sources.setup is None:
        text = "it is not there, or does not call setup(); without it colcon cannot build the package"
        cure = "compare it with the one that `ros2 pkg create` writes"
        yield Fault(_SETUP, 0, "build", text, cure, shown_as=["can't open file 'setup.py'", "SyntaxError"])
