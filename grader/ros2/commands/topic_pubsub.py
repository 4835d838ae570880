"""`ros2 topic echo | pub`: print the messages of a topic, and publish messages to one."""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

from . import arguments, messages
from .graph import Graph, NamesAndTypes, full_name, graph, matching, other_type, wait
from .refusals import Refusal, near
from .spinning import spin

KEEP_ALIVE_S = 0.1  # after the last message, for it to arrive


def add_verbs(add_verb: arguments.AddVerb) -> None:
    """Declare verbs and flags."""
    echo = add_verb("echo", "Output messages from a topic", run_echo, graph=True)
    arguments.name_argument(echo, "topic")
    text = "Type of the ROS message (e.g. 'std_msgs/msg/String')"
    arguments.type_argument(echo, "message_type", "topic", text, nargs="?")
    echo.add_argument("--field", metavar="FIELD", help="Echo a selected field of a message")
    echo.add_argument("--full-length", "-f", action="store_true", help="Output all elements of arrays, bytes, strings")
    echo.add_argument("--no-arr", action="store_true", help="Don't print array fields of messages")
    echo.add_argument("--once", action="store_true", help="Print the first message received and then exit")
    echo.add_argument("--timeout", metavar="N", type=float, help="Seconds after which to give up waiting")

    pub = add_verb("pub", "Publish a message to a topic", run_pub)
    arguments.name_argument(pub, "topic")
    arguments.type_argument(pub, "message_type", "topic", "Type of the ROS message (e.g. 'std_msgs/String')")
    arguments.values_arguments(pub, "topic", "message_type", "Values to fill the message with in YAML format")
    pub.add_argument("-r", "--rate", metavar="N", type=positive, default=1.0, help="Publishing rate in Hz (default: 1)")
    group = pub.add_mutually_exclusive_group()
    group.add_argument("-1", "--once", action="store_true", help="Publish one message and exit")
    group.add_argument("-t", "--times", type=int, default=0, help="Publish this number of times and then exit")
    pub.add_argument("-w", "--wait-matching-subscriptions", type=int, help="Wait until finding this many subscriptions")


def positive(text: str) -> float:
    """Return a number above zero."""
    value = float(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than zero")
    return value


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


def run_echo(args: argparse.Namespace) -> int:
    """Print messages as they arrive."""
    limits = messages.Limits(None if args.full_length else messages.FULL, not args.no_arr)
    count = 0

    def show(message: Any) -> None:
        nonlocal count
        if args.once and count:
            return
        count += 1
        part = message if args.field is None else messages.field(message, args.field)
        print(shown(part, limits), flush=True)

    with graph(args.spin_time, sim_time=args.use_sim_time) as seen:
        name, kind, publishers = subscription(seen, args, args.message_type)
        profile = matching([end.qos_profile for end in publishers])
        listening = seen.node.create_subscription(kind, name, show, profile)
        spin(seen.node, lambda: args.once and count > 0, args.timeout)
        seen.node.destroy_subscription(listening)
    return 0


def shown(part: Any, limits: messages.Limits) -> str:
    """Return a message, or the field of one that was asked for, as `echo` prints it.

    Like the real command, it prints a field that is no message itself as Python does, in full.
    """
    if not hasattr(part, "__slots__"):
        return f"{part}\n---"
    return f"{messages.to_yaml(part, limits)}---"


def run_pub(args: argparse.Namespace) -> int:
    """Publish a message, once or repeatedly."""
    kind = messages.load(args.message_type, "msg")
    values = arguments.given_values(args)
    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if times else 0
    with graph() as seen:
        message = kind()
        messages.fill(message, values, seen.node.get_clock().now().to_msg())
        publisher = seen.node.create_publisher(kind, args.topic_name, matching([]))
        _wait_for_subscribers(seen, publisher, args, wanted)
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
    return 0


def _wait_for_subscribers(seen: Graph, publisher: Any, args: argparse.Namespace, wanted: int) -> None:
    begin = time.monotonic()
    said = begin - 1.0

    def others() -> NamesAndTypes:
        """Return the topic with the types that subscriptions want of it, then the other topics."""
        heard = {end.topic_type for end in seen.node.get_subscriptions_info_by_topic(full_name(args.topic_name))}
        here = [(full_name(args.topic_name), sorted(heard))] if heard else []
        return [*here, *(one for one in seen.names("topic") if one[0] != full_name(args.topic_name))]

    def enough() -> bool:
        nonlocal said
        if publisher.get_subscription_count() >= wanted:
            return True
        now = time.monotonic()
        # A subscription that exists is found at once; only a missing one is worth a remark.
        if now - begin >= 0.2 and now - said >= 1.0:
            print(f"Waiting for at least {wanted} matching subscription(s)...", flush=True)
            said = now
        return False

    wait(enough, args.topic_name, args.message_type, others)
