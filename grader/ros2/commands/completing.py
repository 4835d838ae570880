"""What the shell offers when Tab is pressed: names in the running graph, interfaces, and values to start from."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from typing import Any

from .graph import Graph, graph

Completer = Callable[..., list[str]]


def from_graph(names: Callable[[Graph], Iterable[str]]) -> Completer:
    """Return a completer that looks at the graph and asks for names in it."""

    def complete(prefix: str, **_: Any) -> list[str]:
        with graph() as seen:
            seen.settle()
            return [name for name in names(seen) if name.startswith(prefix)]

    return complete


def types(kind: str, of: str, found: Callable[[Graph, str], str | None]) -> Completer:
    """Return a completer for the type of what the word `of` names: the type it has in the graph, else all of a kind.

    Args:
        kind: msg, srv or action.
        of: the word of the command line that comes before.
        found: gives the type in the graph, waiting for it a little.
    """

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
        from .interface import every

        with graph() as seen:
            there = found(seen, getattr(parsed_args, of))
        return [name for name in ([there] if there else every(kind)) if name.startswith(prefix)]

    return complete


def values(kind: str, of: str) -> Completer:
    """Return a completer that gives all fields of the type which the word `of` names, to be filled in."""

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
        from . import messages

        made = messages.load(getattr(parsed_args, of), kind)
        inner = {"msg": lambda: made(), "srv": lambda: made.Request(), "action": lambda: made.Goal()}[kind]()
        text = messages.to_yaml(inner, flow=True).strip()
        return [text] if text.startswith(prefix) else []

    return complete


def add(parser: Any, name: str, completer: Completer, **rest: Any) -> None:
    """Declare a word of the command line that the shell completes."""
    argument = parser.add_argument(name, **rest)
    argument.completer = completer
