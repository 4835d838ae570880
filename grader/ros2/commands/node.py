"""`ros2 node`: what nodes there are, and what each offers and asks for."""

from __future__ import annotations

import argparse
from typing import Any

from . import completing, hints
from .answers import Refusal
from .graph import NamesAndTypes, add_graph_arguments, full_name, graph, is_hidden, split_name


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    verbs = parser.add_subparsers(title="Commands", metavar="Call `ros2 node <command> -h` for more detailed usage.")
    listing = verbs.add_parser("list", help="Output a list of available nodes")
    add_graph_arguments(listing)
    listing.add_argument("-a", "--all", action="store_true", help="Display all nodes even hidden ones")
    listing.add_argument("-c", "--count-nodes", action="store_true", help="Only display the number of nodes discovered")
    listing.set_defaults(run=show_list)
    info = verbs.add_parser("info", help="Output information about a node")
    add_graph_arguments(info)
    node_argument(info)
    info.add_argument("--include-hidden", action="store_true", help="Display hidden topics, services, and actions")
    info.set_defaults(run=show_info)


def node_argument(parser: argparse.ArgumentParser, **rest: Any) -> None:
    """Declare the name of a node, which the shell completes."""
    complete = completing.from_graph(lambda seen: seen.nodes())
    completing.add(parser, "node_name", complete, help="Node name to request information", **rest)


def show_list(args: argparse.Namespace) -> int:
    """Print the nodes."""
    with graph(args.spin_time) as seen:
        seen.settle()
        names = seen.nodes(hidden=args.all)
    if args.count_nodes:
        print(len(names))
        return 0
    for name in names:
        print(name)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        import sys

        print(
            "\nWARNING: Be aware that there are nodes in the graph that share an exact name, which can have "
            f"unintended side effects: {', '.join(twice)}",
            file=sys.stderr,
        )
    return 0


def show_info(args: argparse.Namespace) -> int:
    """Print what a node offers and asks for."""
    from rclpy.action import graph as actions

    with graph(args.spin_time) as seen:
        if not seen.has_node(args.node_name):
            raise Refusal(
                f"Unable to find node '{args.node_name}'{hints.near(full_name(args.node_name), seen.nodes())}"
            )
        seen.settle()
        node, (base, space) = seen.node, split_name(args.node_name)
        lists: list[tuple[str, NamesAndTypes]] = [
            ("Subscribers", node.get_subscriber_names_and_types_by_node(base, space)),
            ("Publishers", node.get_publisher_names_and_types_by_node(base, space)),
            ("Service Servers", node.get_service_names_and_types_by_node(base, space)),
            ("Service Clients", node.get_client_names_and_types_by_node(base, space)),
            ("Action Servers", actions.get_action_server_names_and_types_by_node(node, base, space)),
            ("Action Clients", actions.get_action_client_names_and_types_by_node(node, base, space)),
        ]
    print(full_name(args.node_name))
    for title, found in lists:
        print(f"  {title}:")
        for name, types in sorted(found):
            if args.include_hidden or not is_hidden(name):
                print(f"    {name}: {', '.join(types)}")
        if title in ("Service Clients", "Action Clients"):
            print()
    return 0
