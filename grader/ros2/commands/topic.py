"""`ros2 topic`: list the topics, show who publishes and subscribes, print and publish messages, measure a topic."""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections import deque
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from . import Refusal, arguments, messages, near
from .graph import Graph, full_name, graph, matching, other_type, spin, steady_clock

KEEP_ALIVE_S = 0.1  # after the last message, for it to arrive
WINDOW = 10000  # messages, as with the real command


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "topic")
    list_ = add_verb("list", "Output a list of available topics", arguments.show_list, graph=True)
    arguments.list_arguments(list_, "topic")
    info = add_verb("info", "Print information about a topic", show_info, graph=True)
    arguments.name_argument(info, "topic")
    info.add_argument("-v", "--verbose", action="store_true", help="Prints detailed information like QoS profiles")

    echo = add_verb("echo", "Output messages from a topic", run_echo, graph=True)
    arguments.name_argument(echo, "topic")
    echo.add_argument("message_type", nargs="?", help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
    echo.add_argument("--field", metavar="FIELD", help="Echo a selected field of a message")
    echo.add_argument("--no-arr", action="store_true", help="Don't print array fields of messages")
    echo.add_argument("--once", action="store_true", help="Print the first message received and then exit")

    pub = add_verb("pub", "Publish a message to a topic", run_pub)
    arguments.name_argument(pub, "topic")
    pub.add_argument("message_type", help="Type of the ROS message (e.g. 'std_msgs/String')")
    pub.add_argument("values", nargs="?", default="", help="Values to fill the message with in YAML format")
    pub.add_argument(
        "-r", "--rate", metavar="N", type=arguments.positive, default=1.0, help="Publishing rate in Hz (default: 1)"
    )
    group = pub.add_mutually_exclusive_group()
    group.add_argument("-1", "--once", action="store_true", help="Publish one message and exit")
    group.add_argument("-t", "--times", type=int, default=0, help="Publish this number of times and then exit")
    pub.add_argument("-w", "--wait-matching-subscriptions", type=int, help="Wait until finding this many subscriptions")

    hz = add_verb("hz", "Print the average publishing rate to screen", run_hz, graph=True)
    arguments.name_argument(hz, "topic")
    delay = add_verb("delay", "Display delay of topic from timestamp in header", run_delay, graph=True)
    arguments.name_argument(delay, "topic")


def show_info(args: argparse.Namespace) -> None:
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


def endpoint(end: Any) -> str:
    """Return a description of one publisher or subscription."""
    qos = end.qos_profile

    def time(duration: Any) -> str:
        return "Infinite" if duration.nanoseconds >= 2**63 - 1 else f"{duration.nanoseconds} nanoseconds"

    depth = f" ({qos.depth})" if qos.history.name == "KEEP_LAST" else ""
    return "\n".join(
        [
            f"Node name: {end.node_name}",
            f"Node namespace: {end.node_namespace}",
            f"Topic type: {end.topic_type}",
            f"Topic type hash: {messages.hash_text(end)}",
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


# -- echo and pub -----------------------------------------------------------------------------------------------------
def subscription(
    seen: Graph, args: argparse.Namespace, given: str | None = None, wait_for_it: bool = False
) -> tuple[str, Any, list[Any]]:
    """Return the topic's full name, its message class and its publishers.

    Without a given type, a topic that does not exist is waited for if `wait_for_it`, else refused.
    """
    name = full_name(args.topic_name)
    types = [given] if given else seen.types("topic", name)
    if not types:
        hint = near(name, dict(seen.names("topic")))
        print(f"WARNING: topic [{name}] does not appear to be published yet", file=sys.stderr)
        if not wait_for_it:
            raise Refusal(f"Could not determine the type for the passed topic{hint}")
        print(hint.strip(), end="\n" if hint else "", file=sys.stderr, flush=True)
        while not types:
            types = seen.types("topic", name)
    message = messages.load(types[0], "msg")
    publishers = seen.wait_for(lambda: seen.node.get_publishers_info_by_topic(name), 0.3)
    if warning := other_type(name, types[0], (end.topic_type for end in publishers)):
        print(warning, file=sys.stderr, flush=True)
    return name, message, publishers


def run_echo(args: argparse.Namespace) -> None:
    """Print messages as they arrive."""
    count = 0

    def show(message: Any) -> None:
        nonlocal count
        if args.once and count:
            return
        count += 1
        part = message if args.field is None else messages.field(message, args.field)
        print(shown(part, not args.no_arr), flush=True)

    with graph(args.spin_time, sim_time=args.use_sim_time) as seen:
        name, kind, publishers = subscription(seen, args, args.message_type)
        profile = matching([end.qos_profile for end in publishers])
        listening = seen.node.create_subscription(kind, name, show, profile)
        spin(seen.node, lambda: args.once and count > 0)
        seen.node.destroy_subscription(listening)


def shown(part: Any, arrays: bool = True) -> str:
    """Return a message, or the field of one that was asked for, as `echo` prints it.

    Like the real command, it prints a field that is no message itself as Python does, in full.
    """
    if not hasattr(part, "__slots__"):
        return f"{part}\n---"
    return f"{messages.to_yaml(part, messages.FULL, arrays)}---"


def run_pub(args: argparse.Namespace) -> None:
    """Publish a message, once or repeatedly."""
    kind = messages.load(args.message_type, "msg")
    values = messages.from_yaml(args.values)
    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if times else 0
    with graph() as seen:
        message = kind()
        messages.fill(message, values, seen.node.get_clock().now().to_msg())
        publisher = seen.node.create_publisher(kind, args.topic_name, matching([]))
        # A subscription that exists is found at once; only a missing one is worth a remark.
        while seen.wait_for(publisher.get_subscription_count, 0.2) < wanted:
            print(f"Waiting for at least {wanted} matching subscription(s)...", flush=True)
            time.sleep(1.0)
        print("publisher: beginning loop", flush=True)
        count, begin = 0, time.monotonic()
        while True:
            messages.fill(message, values, seen.node.get_clock().now().to_msg())
            count += 1
            print(f"publishing #{count}: {message!r}\n", flush=True)
            publisher.publish(message)
            if times and count >= times:
                break
            # Against the first message, so that small delays do not add up.
            time.sleep(max(0.0, begin + count / args.rate - time.monotonic()))
        time.sleep(KEEP_ALIVE_S)


# -- hz and delay -----------------------------------------------------------------------------------------------------
def run_hz(args: argparse.Namespace) -> None:
    """Print how often messages arrive, by simulated time if it was asked for."""
    _measure(args, lambda _, now_ns: now_ns * 1e-9 if args.use_sim_time else time.monotonic(), rate=True)


def run_delay(args: argparse.Namespace) -> None:
    """Print how old the messages' stamps are when they arrive."""

    def age_s(message: Any, now_ns: int) -> float:
        if not hasattr(message, "header"):
            raise Refusal("msg does not have header")
        stamp = message.header.stamp
        return float(now_ns - stamp.sec * 10**9 - stamp.nanosec) * 1e-9

    _measure(args, age_s, rate=False)


def _measure(args: argparse.Namespace, measure: Callable[[Any, int], float], *, rate: bool) -> None:
    """Measure the messages of a topic, and print a summary of the last ones each second until Ctrl-C.

    For a `rate`, their times of arrival are measured, and the gaps between these are what counts.
    """
    from rclpy.qos import qos_profile_sensor_data

    samples: deque[float] = deque(maxlen=WINDOW)
    count = reported = 0
    with graph(args.spin_time, sim_time=args.use_sim_time) as seen:
        clock = seen.node.get_clock()

        def take(message: Any) -> None:
            nonlocal count
            now_ns = clock.now().nanoseconds
            if args.use_sim_time and now_ns == 0:
                return  # before simulated time is known, a sample would be of no use
            samples.append(measure(message, now_ns))
            count += 1

        def report() -> None:
            nonlocal reported
            if count == reported:
                if reported:
                    print("no new messages", flush=True)
                return
            reported = count
            if found := [after - before for before, after in pairwise(samples)] if rate else list(samples):
                mean = statistics.fmean(found)
                title = f"average rate: {1 / mean if mean else 0:.3f}" if rate else f"average delay: {mean:.3f}"
                print(
                    f"{title}\n\tmin: {min(found):.3f}s max: {max(found):.3f}s "
                    f"std dev: {statistics.pstdev(found):.5f}s window: {len(samples)}",
                    flush=True,
                )

        name, kind, _ = subscription(seen, args, wait_for_it=True)
        # Best effort and volatile, whatever is offered: so does Jazzy's command, and every publisher fits.
        seen.node.create_subscription(kind, name, take, qos_profile_sensor_data, raw=rate)
        seen.node.create_timer(1.0, report, clock=steady_clock())
        spin(seen.node, lambda: False)
