"""Read the commands of a CMakeLists.txt without running it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

_TOKEN = re.compile(
    r"""\#\[(?P<marks>=*)\[                      # begins a bracket comment
    |\#[^\n]*                                   # a comment
    |"(?:[^"\\]|\\.){0,2000}"                  # a quoted argument
    |[()]
    |[^\s()#"]+""",
    re.VERBOSE | re.DOTALL,
)
_NAME = re.compile(r"[A-Za-z_]\w*")
_VARIABLE = re.compile(r"\$\{(\w+)\}")
_BLOCKS = {"if": 1, "foreach": 1, "function": 1, "macro": 1, "while": 1}
# Far above what people write: variables that contain themselves grow without an end.
_MAX_COMMANDS, _MAX_ARGUMENTS, _MAX_VALUE = 500, 200, 2000


@dataclass(frozen=True)
class Command:
    """One command. `in_block` is True inside if(), foreach() and the like, where it may not run as it stands."""

    name: str
    arguments: tuple[str, ...]
    line: int
    in_block: bool = False

    @property
    def is_plain(self) -> bool:
        """Return whether its arguments are what they will be when it runs: no variable of unknown value."""
        return not self.in_block and not any("$" in argument for argument in self.arguments)


@dataclass(frozen=True)
class CMakeText:
    """The commands in order; `unclosed` is the command whose closing parenthesis is missing, None if there is none."""

    commands: tuple[Command, ...]
    unclosed: Command | None = None

    def named(self, *names: str) -> list[Command]:
        """Return the commands of these names, which are lower case."""
        return [command for command in self.commands if command.name in names]


def read(text: str) -> CMakeText:
    """Return the commands of a CMakeLists.txt, with the project's name and variables of literal value filled in."""
    variables: dict[str, str] = {}
    commands: list[Command] = []
    depth = 0
    for command, closed in _commands(text):
        if not closed:
            return CMakeText(tuple(commands), command)
        opens = command.name in _BLOCKS
        depth -= command.name.startswith("end") and command.name[3:] in _BLOCKS
        written = command.arguments[:_MAX_ARGUMENTS]
        arguments = tuple(part for argument in written for part in _filled(argument, variables))[:_MAX_ARGUMENTS]
        commands.append(Command(command.name, arguments, command.line, in_block=depth > 0))
        depth += opens
        if command.name == "project" and arguments:
            variables["PROJECT_NAME"] = arguments[0]
        elif command.name == "set" and len(arguments) > 1 and depth == 0:
            variables[arguments[0]] = " ".join(arguments[1:])[:_MAX_VALUE]
        if len(commands) == _MAX_COMMANDS:
            break
    return CMakeText(tuple(commands))


def _filled(argument: str, variables: Mapping[str, str]) -> list[str]:
    """Return an argument with known variables filled in; an unquoted list becomes several arguments."""
    quoted = argument.startswith('"')
    text = _VARIABLE.sub(lambda match: variables.get(match[1], match[0]), argument.strip('"'))
    for here in ("${CMAKE_CURRENT_SOURCE_DIR}/", "${PROJECT_SOURCE_DIR}/", "${CMAKE_SOURCE_DIR}/"):
        text = text.removeprefix(here)
    return [text] if quoted else text.replace(";", " ").split()


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    """Yield each token that is not a comment, and where it begins; a bracket comment may have no end."""
    place = 0
    while match := _TOKEN.search(text, place):
        place = match.end()
        if match["marks"] is not None:
            closing = f"]{match['marks']}]"
            end = text.find(closing, place)
            place = end + len(closing) if end >= 0 else len(text)
        elif not match[0].startswith("#"):
            yield match[0], match.start()


def _commands(text: str) -> Iterator[tuple[Command, bool]]:
    """Yield each command as it is written, and whether its parenthesis is closed."""
    tokens = list(_tokens(text))
    at = 0
    while at + 1 < len(tokens):
        name, start = tokens[at]
        at += 1
        if tokens[at][0] != "(" or not _NAME.fullmatch(name):
            continue
        line = text.count("\n", 0, start) + 1
        depth, arguments = 1, []
        at += 1
        while at < len(tokens) and depth:
            token = tokens[at][0]
            depth += (token == "(") - (token == ")")
            if token not in "()":
                arguments.append(token)
            at += 1
        command = Command(name.lower(), tuple(arguments), line)
        yield command, depth == 0
        if depth:
            return
