"""`ros2 topic`: list the topics, and show who publishes and subscribes."""

from __future__ import annotations

import argparse
from typing import Any

from . import arguments, topic_meters, topic_pubsub
from .graph import full_name, graph, show_names, show_types
from .refusals import Refusal, near


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    parser.add_argument("--include-hidden-topics", action="store_true", help="Consider hidden topics as well")
    add_verb = arguments.verbs(parser, "topic")
    listing = add_verb("list", "Output a list of available topics", show_list, graph=True)
    arguments.list_arguments(listing, "topic", hidden=True)
    listing.add_argument("-v", "--verbose", action="store_true", help="List full details about each topic")
    info = add_verb("info", "Print information about a topic", show_info, graph=True)
    arguments.topic_argument(info)
    info.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like QoS profiles")
    arguments.topic_argument(add_verb("type", "Print a topic's type", show_type, graph=True))
    find = add_verb("find", "Output a list of available topics of a given type", show_found, graph=True)
    find.add_argument("topic_type", help="Name of the ROS topic type to filter for (e.g. 'std_msgs/msg/String')")
    arguments.list_arguments(find, "topic", types=False, hidden=True)
    topic_pubsub.add_verbs(add_verb)
    topic_meters.add_verbs(add_verb)


def show_list(args: argparse.Namespace) -> int:
    """Print the topics."""
    with graph(args.spin_time) as seen:
        seen.settle()
        topics = seen.topics(args.include_hidden_topics)
        if args.verbose and not args.count:
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
    return show_names(topics, args.show_types, args.count)


def show_info(args: argparse.Namespace) -> int:
    """Print who publishes and who subscribes."""
    name = full_name(args.topic_name)
    with graph(args.spin_time) as seen:
        if not seen.topic_types(name):
            raise Refusal(f"Unknown topic '{args.topic_name}'{near(name, dict(seen.topics()))}")
        seen.settle()
        types = seen.topic_types(name)
        print("Type:", types[0] if len(types) == 1 else types)
        for title, ends in (
            ("Publisher", seen.node.get_publishers_info_by_topic(name)),
            ("Subscription", seen.node.get_subscriptions_info_by_topic(name)),
        ):
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
    """Return a description of one publisher or subscription."""
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
        return show_types(seen.topic_types(args.topic_name))


def show_found(args: argparse.Namespace) -> int:
    """Print the topics of a type."""
    with graph(args.spin_time) as seen:
        seen.settle()
        found = [one for one in seen.topics(args.include_hidden_topics) if args.topic_type in one[1]]
    return show_names(found, False, args.count)
