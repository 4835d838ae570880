"""Read the commands of a CMakeLists.txt without running it."""

from __future__ import annotations

import itertools
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
# Far above what people write: variables that contain themselves grow without an end.
_MAX_COMMANDS, _MAX_ARGUMENTS, _MAX_VALUE = 500, 200, 2000


@dataclass(frozen=True)
class Command:
    """One command, as it would be without if(), foreach() and the like around it."""

    name: str
    arguments: tuple[str, ...]
    line: int


def read(text: str) -> tuple[Command, ...]:
    """Return the commands of a CMakeLists.txt, with the project's name and variables of literal value filled in.

    One whose closing parenthesis is missing is left out, with all that it takes along.
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


def _commands(text: str) -> Iterator[Command]:
    """Yield each command as it is written."""
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
        if not depth:
            yield Command(name.lower(), tuple(arguments), line)
