"""Arguments that several commands share, and what the shell offers for them when Tab is pressed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from typing import Any

from . import messages, packages
from .graph import Graph, graph

Completer = Callable[..., list[str]]
AddVerb = Callable[..., argparse.ArgumentParser]

# By kind of interface: the word of the command line that names the topic, service or action, and its types.
NAMED: dict[str, tuple[str, Callable[[Graph, str], list[str]]]] = {
    "msg": ("topic_name", Graph.topic_types),
    "srv": ("service_name", Graph.service_types),
    "action": ("action_name", Graph.action_types),
}


def verbs(parser: argparse.ArgumentParser, command: str) -> AddVerb:
    """Return a function that adds a verb to a command: name, help, function to run; `graph=True` adds graph flags."""
    made = parser.add_subparsers(
        title="Commands", metavar=f"Call `ros2 {command} <command> -h` for more detailed usage."
    )

    def add_verb(
        name: str, text: str, run: Callable[[argparse.Namespace], int], graph: bool = False
    ) -> argparse.ArgumentParser:
        verb: argparse.ArgumentParser = made.add_parser(name, help=text)
        if graph:
            graph_arguments(verb)
        verb.set_defaults(run=run)
        return verb

    return add_verb


def add(parser: Any, name: str, completer: Completer, **rest: Any) -> None:
    """Declare an argument that the shell completes."""
    parser.add_argument(name, **rest).completer = completer  # read by argcomplete


# -- names in the graph -------------------------------------------------------------------------------------------
def from_graph(names: Callable[[Graph], Iterable[str]]) -> Completer:
    """Return a completer that offers names in the running graph."""

    def complete(prefix: str, **_: Any) -> list[str]:
        with graph() as seen:
            seen.settle()
            return [name for name in names(seen) if name.startswith(prefix)]

    return complete


complete_topic = from_graph(lambda seen: [name for name, _types in seen.topics()])


def topic_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of a topic."""
    add(parser, "topic_name", complete_topic, help="Name of the ROS topic (e.g. '/chatter')")


def service_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of a service."""
    complete = from_graph(lambda seen: [name for name, _types in seen.services()])
    add(parser, "service_name", complete, help="Name of the ROS service (e.g. '/add_two_ints')")


def action_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of an action."""
    complete = from_graph(lambda seen: [name for name, _types in seen.actions()])
    add(parser, "action_name", complete, help="Name of the ROS action (e.g. '/fibonacci')")


def node_argument(parser: argparse.ArgumentParser, **rest: Any) -> None:
    """Declare the name of a node."""
    complete = from_graph(lambda seen: seen.nodes())
    add(parser, "node_name", complete, help="Node name to request information", **rest)


def graph_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the flags that the real commands take for their daemon; there is none, so `--no-daemon` has no effect."""
    parser.add_argument("--spin-time", type=float, metavar="SPIN_TIME", help="Seconds to wait for discovery, exactly")
    parser.add_argument("-s", "--use-sim-time", action="store_true", help="Enable ROS simulation time")
    parser.add_argument("--no-daemon", action="store_true", help="Do not spawn nor use an already running daemon")


def list_arguments(parser: argparse.ArgumentParser, kind: str, types: bool = True, hidden: bool = False) -> None:
    """Declare the flags of a verb that lists names of a kind, such as topic."""
    if types:
        parser.add_argument("-t", "--show-types", action="store_true", help=f"Additionally show the {kind} type")
    text = f"Only display the number of {kind}s discovered"
    parser.add_argument("-c", f"--count-{kind}s", action="store_true", dest="count", help=text)
    if hidden:  # without a default: the flag may also come before the verb
        text = f"Consider hidden {kind}s as well"
        parser.add_argument(f"--include-hidden-{kind}s", action="store_true", default=argparse.SUPPRESS, help=text)


# -- interfaces ---------------------------------------------------------------------------------------------------
def type_argument(parser: argparse.ArgumentParser, name: str, kind: str, text: str, **rest: Any) -> None:
    """Declare the type of the topic, service or action named before it.

    The shell offers the type that it has in the graph, else all types of the kind: msg, srv or action.
    """
    of, types = NAMED[kind]

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
        with graph() as seen:
            there = types(seen, getattr(parsed_args, of))
        return [name for name in there or packages.interfaces(kind) if name.startswith(prefix)]

    add(parser, name, complete, help=text, **rest)


def values_arguments(parser: argparse.ArgumentParser, kind: str, of: str, text: str, name: str = "values") -> None:
    """Declare the values of a message of the type that the argument `of` names: as a word, or read from stdin.

    The shell offers all fields of the type, to be filled in.
    """

    def complete(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
        text = messages.to_yaml(messages.prototype(getattr(parsed_args, of), kind), flow=True).strip()
        return [text] if text.startswith(prefix) else []

    group = parser.add_mutually_exclusive_group()
    add(group, name, complete, nargs="?", default=None, help=text)
    group.add_argument("--stdin", action="store_true", help="Read values from standard input")
    parser.set_defaults(values_word=name)


def given_values(args: argparse.Namespace) -> Any:
    """Return the values that a command line gives."""
    return messages.from_yaml(sys.stdin.read() if args.stdin else getattr(args, args.values_word) or "")
