"""What is read of a package beside its Python: its paths, package.xml, and CMakeLists.txt, which is not run."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path, PurePosixPath

from grader.course import Course
from grader.host import ros_env
from grader.intake.package_xml import PackageXml, read_package_xml
from grader.quality.source_files import package_files

INTERFACE_SUFFIXES = (".msg", ".srv", ".action")
_MAX_TEXT = 256 * 1024
_QUOTED = r'"(?:[^"\\]|\\.){0,2000}"'
_COMMENT = re.compile(rf"({_QUOTED})|\#\[(?P<marks>=*)\[.*?(?:\](?P=marks)\]|\Z)|\#[^\n]*", re.DOTALL)
_PART = rf'[^()"]++|{_QUOTED}'
_COMMAND = re.compile(rf"\b([A-Za-z_]\w*)\s*\(((?:{_PART}|\((?:{_PART})*+\))*+)\)", re.DOTALL)
_ARGUMENT = re.compile(rf'{_QUOTED}|[^\s()"]+', re.DOTALL)
_VARIABLE = re.compile(r"\$\{(\w+)\}")
# Far above what people write: variables that contain themselves grow without an end.
_MAX_COMMANDS, _MAX_ARGUMENTS, _MAX_VALUE = 500, 200, 2000


@dataclass(frozen=True)
class Command:
    """One command, as it would be without if(), foreach() and the like around it."""

    name: str
    arguments: tuple[str, ...]
    line: int


@dataclass(frozen=True)
class PackageSources:
    """A package's text. `built` are the names of the packages that are built together, its own among them."""

    course: Course
    folder: Path
    paths: tuple[str, ...]
    xml: PackageXml
    cmake: tuple[Command, ...]
    built: frozenset[str]
    known: frozenset[str] = field(repr=False)
    """The ROS packages that are installed here."""

    @property
    def name(self) -> str:
        """Return the package's name by package.xml, or else the contract's."""
        return self.xml.name or self.course.package

    @property
    def names(self) -> frozenset[str]:
        """Return its names by package.xml and by project(), which are the same in a package that is right."""
        return frozenset({self.name, *(c.arguments[0] for c in self.commands("project") if c.arguments)})

    @property
    def has_cmake(self) -> bool:
        """Return whether it has a CMakeLists.txt."""
        return "CMakeLists.txt" in self.paths

    @cached_property
    def interfaces(self) -> list[str]:
        """Return the paths of its interface files: srv/SetSpeed.srv."""
        parts = [PurePosixPath(path) for path in self.paths]
        return [
            str(path) for path in parts
            if path.suffix in INTERFACE_SUFFIXES and len(path.parts) == 2 and path.parts[0] == path.suffix[1:]
        ]  # fmt: skip

    def commands(self, name: str) -> list[Command]:
        """Return the commands of CMakeLists.txt of this name, which is in lower case."""
        return [command for command in self.cmake if command.name == name]

    def programs(self) -> set[str]:
        """Return the paths of the programs that CMakeLists.txt installs."""
        installs = [c.arguments for c in self.commands("install") if self.xml.build_type != "ament_python"]
        return {path for kind, *names in filter(None, installs) if kind == "PROGRAMS" for path in names} & {*self.paths}

    def read(self, path: str) -> str:
        """Return the start of a file's text, "" if it cannot be read."""
        try:
            with (self.folder / path).open("rb") as stream:
                return stream.read(_MAX_TEXT).decode("utf-8", "replace")
        except OSError:
            return ""

    def line_of(self, path: str, words: str) -> int:
        """Return the first line of a file with these words, 0 if there is none."""
        before, found, _ = self.read(path).partition(words)
        return before.count("\n") + 1 if found else 0


def read_sources(folder: Path, interfaces: Path | None, course: Course) -> PackageSources:
    """Return the text of the package in `folder`; `interfaces` is its package of interfaces, if it has one."""
    paths = tuple(package_files(folder, course))
    has_xml = "package.xml" in paths
    xml = read_package_xml(folder / "package.xml") if has_xml else PackageXml(problem="is not there")
    known = frozenset(path.parent.name for path in (ros_env.PREFIX / "share").glob("*/package.xml"))
    sources = PackageSources(course, folder, paths, xml, (), frozenset(), known)
    beside = [read_package_xml(interfaces / "package.xml").name or interfaces.name] if interfaces is not None else []
    cmake = commands(sources.read("CMakeLists.txt")) if sources.has_cmake else ()
    return replace(sources, cmake=cmake, built=frozenset([sources.name, *beside]))


def commands(text: str) -> tuple[Command, ...]:
    """Return the commands of a CMakeLists.txt, with the project's name and variables of literal value filled in.

    One whose closing parenthesis is missing is left out.
    """
    variables: dict[str, str] = {}
    commands: list[Command] = []
    for command in itertools.islice(_commands(text), _MAX_COMMANDS):
        written = command.arguments[:_MAX_ARGUMENTS]
        arguments = tuple(part for argument in written for part in _filled(argument, variables))[:_MAX_ARGUMENTS]
        commands.append(Command(command.name, arguments, command.line))
        if command.name == "project" and arguments:
            variables["PROJECT_NAME"] = arguments[0]
        elif command.name == "set" and len(arguments) > 1:
            variables[arguments[0]] = " ".join(arguments[1:])[:_MAX_VALUE]
    return tuple(commands)


def _filled(argument: str, variables: Mapping[str, str]) -> list[str]:
    """Return an argument with known variables filled in; an unquoted list becomes several arguments."""
    quoted = argument.startswith('"')
    text = _VARIABLE.sub(lambda match: variables.get(match[1], match[0]), argument.strip('"'))
    for here in ("${CMAKE_CURRENT_SOURCE_DIR}/", "${PROJECT_SOURCE_DIR}/", "${CMAKE_SOURCE_DIR}/"):
        text = text.removeprefix(here)
    return [text] if quoted else text.replace(";", " ").split()


def _commands(text: str) -> Iterator[Command]:
    """Yield each command as it is written."""
    text = _COMMENT.sub(lambda match: match[1] or "\n" * match[0].count("\n"), text)
    for match in _COMMAND.finditer(text):
        line = text.count("\n", 0, match.start()) + 1
        yield Command(match[1].lower(), tuple(_ARGUMENT.findall(match[2])), line)
