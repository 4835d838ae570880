"""`ros2 topic`: what topics there are."""

from __future__ import annotations

import argparse
from typing import Any

from . import completing, hints, topic_flow, topic_meters
from .answers import Refusal
from .graph import add_graph_arguments, full_name, graph, show_names

RELIABILITY = {1: "RELIABLE", 2: "BEST_EFFORT"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the words and flags."""
    parser.add_argument("--include-hidden-topics", action="store_true", help="Consider hidden topics as well")
    verbs = parser.add_subparsers(title="Commands", metavar="Call `ros2 topic <command> -h` for more detailed usage.")

    listing = verbs.add_parser("list", help="Output a list of available topics")
    add_graph_arguments(listing)
    listing.add_argument("-t", "--show-types", action="store_true", help="Additionally show the topic type")
    listing.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics")
    listing.add_argument(
        "--include-hidden-topics", action="store_true", default=argparse.SUPPRESS, help="Consider hidden topics as well"
    )
    listing.add_argument("-v", "--verbose", action="store_true", help="List full details about each topic")
    listing.set_defaults(run=show_list)

    info = verbs.add_parser("info", help="Print information about a topic")
    add_graph_arguments(info)
    topic_argument(info)
    info.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like QoS profiles")
    info.set_defaults(run=show_info)

    kind = verbs.add_parser("type", help="Print a topic's type")
    add_graph_arguments(kind)
    topic_argument(kind)
    kind.set_defaults(run=show_type)

    find = verbs.add_parser("find", help="Output a list of available topics of a given type")
    add_graph_arguments(find)
    find.add_argument("topic_type", help="Name of the ROS topic type to filter for (e.g. 'std_msgs/msg/String')")
    find.add_argument("-c", "--count-topics", action="store_true", help="Only display the number of topics discovered")
    find.add_argument("--include-hidden-topics", action="store_true", default=argparse.SUPPRESS)
    find.set_defaults(run=show_found)

    topic_flow.add_verbs(verbs)
    topic_meters.add_verbs(verbs)


def topic_argument(parser: argparse.ArgumentParser) -> None:
    """Declare the name of a topic, which the shell completes."""
    completing.add(parser, "topic_name", complete, help="Name of the ROS topic (e.g. '/chatter')")


complete = completing.from_graph(lambda seen: [name for name, _types in seen.topics()])


def show_list(args: argparse.Namespace) -> int:
    """Print the topics."""
    with graph(args.spin_time) as seen:
        seen.settle()
        topics = seen.topics(args.include_hidden_topics)
        if args.verbose and not args.count_topics:
            for title, count, what in (
                ("Published topics:", seen.node.count_publishers, "publisher"),
                ("Subscribed topics:", seen.node.count_subscribers, "subscriber"),
            ):
                print(title)
                for name, types in topics:
                    if number := count(name):
                        print(f" * {name} [{', '.join(types)}] {number} {what}{'s' if number > 1 else ''}")
                print()
            return 0
    return show_names(topics, args.show_types, args.count_topics)


def show_info(args: argparse.Namespace) -> int:
    """Print who publishes and who subscribes."""
    name = full_name(args.topic_name)
    with graph(args.spin_time) as seen:
        if seen.topic_type(name) is None:
            raise Refusal(f"Unknown topic '{args.topic_name}'{hints.near(name, dict(seen.topics()))}")
        seen.settle()
        types = dict(seen.topics(hidden=True)).get(name, [])
        print("Type:", types[0] if len(types) == 1 else types)
        publishers, subscribers = (
            seen.node.get_publishers_info_by_topic(name),
            seen.node.get_subscriptions_info_by_topic(name),
        )
        for title, ends in (("Publisher", publishers), ("Subscription", subscribers)):
            if args.verbose:
                print()
            print(f"{title} count: {len(ends)}")
            if args.verbose:
                for end in ends:
                    print(f"\n{endpoint(end)}")
        if args.verbose:
            print()
    return 0


def endpoint(end: Any) -> str:
    """Return what is known of one publisher or subscription."""
    qos = end.qos_profile

    def time(duration: Any) -> str:
        return "Infinite" if duration.nanoseconds >= 2**63 - 1 else f"{duration.nanoseconds} nanoseconds"

    depth = f" ({qos.depth})" if qos.history.name == "KEEP_LAST" else ""
    hash_ = end.topic_type_hash
    return "\n".join(
        [
            f"Node name: {end.node_name}",
            f"Node namespace: {end.node_namespace}",
            f"Topic type: {end.topic_type}",
            f"Topic type hash: RIHS{hash_.version:02}_{bytes(hash_.value).hex()}",
            f"Endpoint type: {end.endpoint_type.name}",
            f"GID: {'.'.join(f'{byte:02x}' for byte in end.endpoint_gid)}",
            "QoS profile:",
            f"  Reliability: {qos.reliability.name}",
            f"  History (Depth): {qos.history.name}{depth}",
            f"  Durability: {qos.durability.name}",
            f"  Lifespan: {time(qos.lifespan)}",
            f"  Deadline: {time(qos.deadline)}",
            f"  Liveliness: {qos.liveliness.name}",
            f"  Liveliness lease duration: {time(qos.liveliness_lease_duration)}",
        ]
    )


def show_type(args: argparse.Namespace) -> int:
    """Print the types of a topic."""
    with graph(args.spin_time) as seen:
        if seen.topic_type(args.topic_name) is None:
            return 1
        for one in dict(seen.topics(hidden=True))[full_name(args.topic_name)]:
            print(one)
    return 0


def show_found(args: argparse.Namespace) -> int:
    """Print the topics of a type."""
    with graph(args.spin_time) as seen:
        seen.settle()
        found = [one for one in seen.topics(args.include_hidden_topics) if args.topic_type in one[1]]
    return show_names(found, False, args.count_topics)
