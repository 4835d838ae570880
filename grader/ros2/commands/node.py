"""`ros2 node`: list the nodes, and show what each offers and uses."""

from __future__ import annotations

import argparse
import sys

from . import Refusal, arguments, near
from .graph import NamesAndTypes, full_name, graph, is_hidden, split_name


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "node")
    add_verb("list", "Output a list of available nodes", show_list, graph=True)
    info = add_verb("info", "Output information about a node", show_info, graph=True)
    arguments.node_argument(info)


def show_list(args: argparse.Namespace) -> None:
    """Print the nodes."""
    with graph(args.spin_time) as seen:
        seen.settle()
        names = seen.nodes()
    for name in names:
        print(name)
    if twice := sorted({name for name in names if names.count(name) > 1}):
        print(
            "\nWARNING: Be aware that there are nodes in the graph that share an exact name, which can have "
            f"unintended side effects: {', '.join(twice)}",
            file=sys.stderr,
        )


def show_info(args: argparse.Namespace) -> None:
    """Print what a node offers and uses."""
    from rclpy.action import graph as actions

    with graph(args.spin_time) as seen:
        if not seen.has_node(args.node_name):
            raise Refusal(f"Unable to find node '{args.node_name}'{near(full_name(args.node_name), seen.nodes())}")
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
        shown = [one for one in sorted(found) if not is_hidden(one[0])]
        # Like the real command, an empty line where there is nothing.
        print("\n".join(f"    {name}: {', '.join(types)}" for name, types in shown))
