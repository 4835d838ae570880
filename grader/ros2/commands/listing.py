"""The verbs `list`, `type` and `find`, which topics, services and actions share."""

from __future__ import annotations

import argparse

from . import arguments
from .graph import Graph, NamesAndTypes, graph


def list_arguments(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the flags of a verb that lists names of a kind, such as topic."""
    parser.add_argument("-t", "--show-types", action="store_true", help=f"Additionally show the {kind} type")
    text = f"Consider hidden {kind}s as well"
    parser.add_argument(f"--include-hidden-{kind}s", action="store_true", dest="hidden", help=text)
    parser.set_defaults(kind=kind)


def type_arguments(parser: argparse.ArgumentParser, kind: str) -> None:
    """Declare the arguments of the verb `type`."""
    arguments.name_argument(parser, kind)
    parser.set_defaults(kind=kind)


def find_arguments(parser: argparse.ArgumentParser, kind: str, example: str) -> None:
    """Declare the arguments of the verb `find`."""
    parser.add_argument("wanted", metavar=f"{kind}_type", help=f"Name of the ROS {kind} type to filter for ({example})")
    list_arguments(parser, kind)


def settled(args: argparse.Namespace, seen: Graph) -> NamesAndTypes:
    """Wait until the graph has come to rest, and return the names that the flags ask for."""
    seen.settle()
    return seen.names(args.kind, args.hidden)


def show_list(args: argparse.Namespace) -> int:
    """Print the names of a kind."""
    with graph(getattr(args, "spin_time", None)) as seen:
        show(settled(args, seen), args)
    return 0


def show_found(args: argparse.Namespace) -> int:
    """Print the names that have a type."""
    with graph(args.spin_time) as seen:
        show([one for one in settled(args, seen) if args.wanted in one[1]], args)
    return 0


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a name; return 1 if there is no such name."""
    with graph(getattr(args, "spin_time", None)) as seen:
        types = seen.types(args.kind, getattr(args, f"{args.kind}_name"))
    for one in types:
        print(one)
    return 0 if types else 1


def show(found: NamesAndTypes, args: argparse.Namespace) -> None:
    """Print names, with their types if the flag asks for that."""
    for name, types in found:
        print(f"{name} [{', '.join(types)}]" if args.show_types else name)
