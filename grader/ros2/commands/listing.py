"""The verbs `list`, `type` and `find`, which topics, services and actions share."""

from __future__ import annotations

import argparse

from . import arguments
from .graph import Graph, NamesAndTypes, graph


def list_arguments(parser: argparse.ArgumentParser, kind: str, types: bool = True, hidden: bool = True) -> None:
    """Declare the flags of a verb that lists names of a kind, such as topic."""
    if types:
        parser.add_argument("-t", "--show-types", action="store_true", help=f"Additionally show the {kind} type")
    text = f"Only display the number of {kind}s discovered"
    parser.add_argument("-c", f"--count-{kind}s", action="store_true", dest="count", help=text)
    if hidden:  # without a default: the flag may also come before the verb
        text = f"Consider hidden {kind}s as well"
        parser.add_argument(
            f"--include-hidden-{kind}s", action="store_true", dest="hidden", default=argparse.SUPPRESS, help=text
        )
    parser.set_defaults(kind=kind)


def hidden_argument(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the flag of a command, before its verb, that includes hidden names."""
    text = f"Consider hidden {kind}s as well"
    parser.add_argument(f"--include-hidden-{kind}s", action="store_true", dest="hidden", help=text)


def type_arguments(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the arguments of the verb `type`."""
    arguments.name_argument(parser, kind)
    parser.set_defaults(kind=kind)


def find_arguments(parser: argparse.ArgumentParser, kind: str, example: str) -> None:
    """Declare the arguments of the verb `find`."""
    parser.add_argument("wanted", metavar=f"{kind}_type", help=f"Name of the ROS {kind} type to filter for ({example})")
    list_arguments(parser, kind, types=False)


def settled(args: argparse.Namespace, seen: Graph) -> NamesAndTypes:
    """Wait until the graph has come to rest, and return the names that the flags ask for."""
    seen.settle()
    return seen.names(args.kind, getattr(args, "hidden", False))


def show_list(args: argparse.Namespace) -> int:
    """Print the names of a kind."""
    with graph(getattr(args, "spin_time", None)) as seen:
        return show(settled(args, seen), args)


def show_found(args: argparse.Namespace) -> int:
    """Print the names that have a type."""
    with graph(args.spin_time) as seen:
        return show([one for one in settled(args, seen) if args.wanted in one[1]], args)


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a name; return 1 if there is no such name."""
    with graph(getattr(args, "spin_time", None)) as seen:
        types = seen.types(args.kind, getattr(args, f"{args.kind}_name"))
    for one in types:
        print(one)
    return 0 if types else 1


def show(found: NamesAndTypes, args: argparse.Namespace) -> int:
    """Print names, with their types or only their number if the flags ask for that; return the exit code."""
    if args.count:
        print(len(found))
        return 0
    for name, types in found:
        print(f"{name} [{', '.join(types)}]" if getattr(args, "show_types", False) else name)
    return 0
