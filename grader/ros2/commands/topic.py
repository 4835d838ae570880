"""`ros2 topic`: list the topics, and show who publishes and subscribes."""

from __future__ import annotations

import argparse
from typing import Any

from . import arguments, topic_meters, topic_pubsub
from .graph import full_name, graph
from .refusals import Refusal, near


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "topic")
    list_ = add_verb("list", "Output a list of available topics", arguments.show_list, graph=True)
    arguments.list_arguments(list_, "topic")
    info = add_verb("info", "Print information about a topic", show_info, graph=True)
    arguments.name_argument(info, "topic")
    info.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like QoS profiles")
    topic_pubsub.add_verbs(add_verb)
    topic_meters.add_verbs(add_verb)


def show_info(args: argparse.Namespace) -> int:
    """Print who publishes and who subscribes."""
    name = full_name(args.topic_name)
    with graph(args.spin_time) as seen:
        if not seen.types("topic", name):
            raise Refusal(f"Unknown topic '{args.topic_name}'{near(name, dict(seen.names('topic')))}")
        seen.settle()
        types = seen.types("topic", name)
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
