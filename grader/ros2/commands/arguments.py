"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from .graph import NamesAndTypes, graph

AddVerb = Callable[..., argparse.ArgumentParser]

EXAMPLES = {"topic": "/chatter", "service": "/add_two_ints", "action": "/fibonacci"}


def verbs(parser: argparse.ArgumentParser, command: str) -> AddVerb:
    """Return a function that adds a verb to a command: name, help, function to run; `graph=True` adds graph flags."""
    made = parser.add_subparsers(
        title="Commands", metavar=f"Call `ros2 {command} <command> -h` for more detailed usage."
    )

    def add_verb(
        name: str, text: str, run: Callable[[argparse.Namespace], int | None], graph: bool = False
    ) -> argparse.ArgumentParser:
        verb: argparse.ArgumentParser = made.add_parser(name, help=text)
        if graph:
            text = "Seconds to wait for discovery, exactly"
            verb.add_argument("--spin-time", type=float, metavar="SPIN_TIME", help=text)
            verb.add_argument("-s", "--use-sim-time", action="store_true", help="Enable ROS simulation time")
        verb.set_defaults(run=run, spin_time=None)
        return verb

    return add_verb


def name_argument(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the name of a topic, service or action."""
    parser.add_argument(f"{kind}_name", help=f"Name of the ROS {kind} (e.g. '{EXAMPLES[kind]}')")


def node_argument(parser: argparse.ArgumentParser, **rest: Any) -> None:
    """Declare the name of a node."""
    parser.add_argument("node_name", help="Node name to request information", **rest)


def positive(text: str) -> float:
    """Return a number above zero."""
    value = float(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than zero")
    return value


# -- the verb `list` --------------------------------------------------------------------------------------------------
def list_arguments(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the flags of a verb that lists names of a kind, such as topic."""
    parser.add_argument("-t", "--show-types", action="store_true", help=f"Additionally show the {kind} type")
    parser.set_defaults(kind=kind)


def settled(args: argparse.Namespace) -> NamesAndTypes:
    """Wait until the graph has come to rest, and return the names of a kind."""
    with graph(args.spin_time) as seen:
        seen.settle()
        return seen.names(args.kind)


def show_list(args: argparse.Namespace) -> None:
    """Print the names of a kind, with their types if the flag asks for that."""
    for name, types in settled(args):
        print(f"{name} [{', '.join(types)}]" if args.show_types else name)
