"""Faults of the programs that a package installs: those of the contract that it lacks, and those that cannot start."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import PurePosixPath

from grader.course import role
from grader.evidence import Fault
from grader.quality.cmake_text import Command
from grader.quality.package_sources import PackageSources
from grader.quality.parsed_module import Module

_CMAKE, _SETUP = "CMakeLists.txt", "setup.py"
_SCRIPTS = re.compile(r"console_scripts|project\.scripts|^[ \t]*scripts[ \t]*=", re.MULTILINE)
_ENDS_INSTALL = {
    "DESTINATION", "TYPE", "PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "USE_SOURCE_PERMISSIONS",
    "CONFIGURATIONS", "COMPONENT", "RENAME", "OPTIONAL", "PATTERN", "REGEX", "EXCLUDE", "FILES_MATCHING",
    "MESSAGE_NEVER", "NO_SOURCE_PERMISSIONS",
}  # fmt: skip


def program_faults(sources: PackageSources, modules: Sequence[Module]) -> Iterator[Fault]:
    """Yield why the contract's executables are not there or cannot start, that of a package that has neither first."""
    made, nodes = programs(sources), sources.course.nodes
    files = {node: _file(sources, modules, node) for node in nodes}
    texts = "\n".join(map(sources.read, (_CMAKE, _SETUP, "setup.cfg", "pyproject.toml")))
    missing = [node for node in nodes if (node not in made if made is not None else not _names(texts, node))]
    yield from _without(sources, [node for node in missing if not files[node]])
    if sources.has_cmake and not sources.by_cmake:
        return  # package.xml comes first
    there = {node: files[node] for node in missing if files[node] and made is not None}
    if there and sources.by_cmake:
        yield from _not_installed(sources, there, made or set())
    elif there:
        yield _no_entry_point(sources, modules, there)
    yield from _scripts(sources)


def programs(sources: PackageSources) -> set[str] | None:
    """Return the names of the programs that the package installs for `ros2 run`, None where they cannot be read off."""
    if sources.by_cmake:
        if sources.cmake.unclosed is not None or is_unclear(sources):
            return None
        return _made_by(sources, _installs(sources))
    setup, elsewhere = sources.setup, sources.read("setup.cfg") + sources.read("pyproject.toml")
    return None if setup is None or setup.programs is None or _SCRIPTS.search(elsewhere) else set(setup.programs)


def _names(text: str, word: str) -> bool:
    return re.search(rf"(?<!\w){word}(?!\w)", text) is not None


def _file(sources: PackageSources, modules: Sequence[Module], node: str) -> str:
    """Return the path of the program or the module of a node, "" if there is neither; CMake installs the program."""
    paths = {module.path for module in modules} | {path for path in sources.paths if path.endswith(".py")}
    named = [path for path in paths if PurePosixPath(path).name in (node, f"{node}.py")]
    files = [path for path in named if role(path, sources.course.package) in ("module", "script")]
    return min(files, key=lambda path: (path.endswith(".py") == sources.by_cmake, path), default="")


def _without(sources: PackageSources, missing: list[str]) -> Iterator[Fault]:
    """Yield that the package lacks modules of the assignment: and which package it is."""
    if not missing:
        return
    course, folders = sources.course, {path.partition("/")[0] for path in sources.paths}
    folder = sources.name if sources.name in folders else course.package
    wanted = " and ".join(f"{folder}/{node}.py" for node in missing)
    which = f"this is the package `{sources.name}`, and it" if sources.name != course.package else "the package"
    text = f"{which} has no {' and no '.join(f'{node}.py' for node in missing)}"
    cure = f"write {wanted}, or hand in the package that has them"
    yield Fault("package.xml", sources.line_of("package.xml", "<name>"), "install", text, cure, lacks=missing)


def _not_installed(sources: PackageSources, files: Mapping[str, str], made: Collection[str]) -> Iterator[Fault]:
    """Yield which nodes CMakeLists.txt does not install, though their files are there."""
    for node in [node for node in files if f"{node}.py" in made]:
        line = next(c.line for c in _installs(sources) for f in installed_files(c) if PurePosixPath(f).stem == node)
        text = f"it installs `{node}.py`, and `ros2 run` looks for `{node}`"
        cure = f"RENAME {node} in an install(PROGRAMS ...) of its own"
        yield Fault(_CMAKE, line, "install", text, cure, lacks=[node])
    if left := [node for node in files if f"{node}.py" not in made]:
        text = f"nothing installs {_executables(left)}"
        if sources.setup is not None and {*left} & (sources.setup.programs or frozenset()):
            text += "; entry points of setup.py make executables in ament_python packages only"
        install = "install(PROGRAMS {} DESTINATION lib/${{PROJECT_NAME}}{})"
        cures = [install.format(files[n], "" if files[n].endswith(f"/{n}") else f" RENAME {n}") for n in left]
        yield Fault(_CMAKE, 0, "install", text, " and ".join(cures), lacks=left)


def _no_entry_point(sources: PackageSources, modules: Sequence[Module], files: Mapping[str, str]) -> Fault:
    """Return the fault that setup.py has no entry points for nodes whose modules, `files`, are there."""
    by_path = {module.path: module for module in modules}
    names = {node: by_path[path].name if path in by_path else _dotted(path) for node, path in files.items()}
    entries = [f"'{node} = {name}:main'" for node, name in names.items()]
    line = sources.setup.line if sources.setup is not None else 0
    cure = f"{', '.join(entries)} in console_scripts"
    text = f"no entry point makes {_executables(list(files))}"
    return Fault(_SETUP, line, "install", text, cure, lacks=list(files))


def _executables(nodes: Sequence[str]) -> str:
    return f"the executable{'s' * (len(nodes) > 1)} {' and '.join(f'`{node}`' for node in nodes)}"


def _dotted(path: str) -> str:
    return path.removeprefix("src/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _scripts(sources: PackageSources) -> Iterator[Fault]:
    """Yield what is wrong with the first line of the programs that CMakeLists.txt installs."""
    places = dict(pair for command in _installs(sources) for pair in installed(sources, command))
    nodes = [path for path, place in places.items() if place.name in sources.course.nodes]
    for path in sorted(program_files(sources), key=lambda path: (path not in nodes, path)):
        first, _, _ = sources.read(path).partition("\n")
        if not first.startswith("#!"):
            text = "its first line does not say which program runs it, so the system cannot start it"
            cure = "write `#!/usr/bin/env python3` as its first line"
            yield Fault(path, 1, "start", text, cure, shown_as=["Exec format error"])
        elif first.endswith("\r"):
            text = "its lines end as on Windows, so the system looks for a program called `python3\\r`"
            cure = f"save it with Unix line ends (LF): sed -i 's/\\r$//' {path}"
            yield Fault(path, 1, "start", text, cure, shown_as=["python3\\r", "python3\r"])


# -- CMakeLists.txt ---------------------------------------------------------------------------------------------------


def _installs(sources: PackageSources) -> list[Command]:
    return sources.cmake.named("install") if sources.by_cmake else []


def is_unclear(sources: PackageSources) -> bool:
    """Return whether something may be installed that cannot be read off: by variables, loops or other commands."""
    others = ("ament_python_install_package", "ament_auto_package", "include", "add_subdirectory", "function", "macro")
    unclear = [command for command in _installs(sources) if not command.is_plain]
    return bool(sources.cmake.named(*others)) or any(
        "${PYTHON_INSTALL_DIR}" not in " ".join(command.arguments) for command in unclear
    )


def installed_files(command: Command) -> list[str]:
    """Return the files or folders that an install() names."""
    if command.arguments[:1] not in (("FILES",), ("PROGRAMS",), ("DIRECTORY",)):
        return []
    return list(itertools.takewhile(lambda argument: argument not in _ENDS_INSTALL, command.arguments[1:]))


def installed(sources: PackageSources, command: Command) -> Iterator[tuple[str, PurePosixPath]]:
    """Yield each file that an install() names or that is in a folder that it names, and where it puts that."""
    destination = PurePosixPath(_value(command, "DESTINATION"))
    for name in installed_files(command):
        if command.arguments[0] != "DIRECTORY":
            yield name, destination / (_value(command, "RENAME") or PurePosixPath(name).name)
            continue
        top = destination if name.endswith("/") else destination / PurePosixPath(name).name
        inside = (path for path in sources.paths if path.startswith(f"{name.rstrip('/')}/"))
        yield from ((path, top / PurePosixPath(path).relative_to(name)) for path in inside)


def program_folders(sources: PackageSources) -> list[PurePosixPath]:
    """Return where `ros2 run` looks for the programs of a package."""
    return [PurePosixPath("lib", name) for name in sources.names]


def _value(command: Command, keyword: str) -> str:
    """Return the argument of a command that follows `keyword`, "" if there is none."""
    after = iter(command.arguments)
    return next((next(after, "") for argument in after if argument == keyword), "")


def _made_by(sources: PackageSources, commands: Iterable[Command]) -> set[str]:
    """Return the names of the files that install() commands put where `ros2 run` looks."""
    folders = program_folders(sources)
    places = (place for command in commands for _, place in installed(sources, command))
    return {place.name for place in places if place.parent in folders}


def program_files(sources: PackageSources) -> set[str]:
    """Return the paths of the programs that CMakeLists.txt installs."""
    commands = [command for command in _installs(sources) if command.arguments[:1] == ("PROGRAMS",)]
    return {name for command in commands for name in command.arguments} & set(sources.paths)
