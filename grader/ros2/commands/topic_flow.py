"""`ros2 topic echo | pub | hz | bw | delay`: what flows through topics."""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from collections import deque
from itertools import pairwise
from typing import Any

from . import messages
from .answers import Refusal
from .graph import Graph, add_graph_arguments, full_name, graph, spin
from .qos import add_qos_arguments, asked


def add_verbs(verbs: Any) -> None:
    """Declare words and flags."""
    from .topic import topic_argument

    echo = verbs.add_parser("echo", help="Output messages from a topic")
    add_graph_arguments(echo)
    topic_argument(echo)
    echo.add_argument("message_type", nargs="?", help="Type of the ROS message (e.g. 'std_msgs/msg/String')")
    add_qos_arguments(echo, "matched to the publishers")
    echo.add_argument("--csv", action="store_true", help="Output all recursive fields separated by commas")
    echo.add_argument("--field", metavar="FIELD", help="Echo a selected field of a message")
    echo.add_argument("--full-length", "-f", action="store_true", help="Output all elements of arrays, bytes, strings")
    echo.add_argument("--truncate-length", "-l", type=int, default=messages.FULL, help="The length to truncate to")
    echo.add_argument("--no-arr", action="store_true", help="Don't print array fields of messages")
    echo.add_argument("--no-str", action="store_true", help="Don't print string fields of messages")
    echo.add_argument("--flow-style", action="store_true", help="Print collections in the block style")
    echo.add_argument("--no-lost-messages", action="store_true", help="Don't report when a message is lost")
    echo.add_argument("--raw", action="store_true", help="Echo the raw binary representation")
    echo.add_argument("--filter", dest="filter_expr", help="Python expression to filter messages, which it knows as m")
    echo.add_argument("--once", action="store_true", help="Print the first message received and then exit")
    echo.add_argument("--timeout", metavar="N", type=float, help="Seconds after which to give up waiting")
    echo.add_argument("--include-message-info", "-i", action="store_true", help="Shows the associated message info")
    echo.set_defaults(run=run_echo)

    pub = verbs.add_parser("pub", help="Publish a message to a topic")
    topic_argument(pub)
    kind = pub.add_argument("message_type", help="Type of the ROS message (e.g. 'std_msgs/String')")
    kind.completer = complete_messages
    pub.add_argument("values", nargs="?", default="{}", help="Values to fill the message with in YAML format")
    pub.add_argument("-r", "--rate", metavar="N", type=positive, default=1.0, help="Publishing rate in Hz (default: 1)")
    pub.add_argument("-p", "--print", metavar="N", type=int, default=1, help="Only print every N-th message")
    group = pub.add_mutually_exclusive_group()
    group.add_argument("-1", "--once", action="store_true", help="Publish one message and exit")
    group.add_argument("-t", "--times", type=int, default=0, help="Publish this number of times and then exit")
    pub.add_argument("-w", "--wait-matching-subscriptions", type=int, help="Wait until finding this many subscriptions")
    pub.add_argument("--max-wait-time-secs", type=float, help="The longest time to wait for subscriptions")
    pub.add_argument("--keep-alive", metavar="N", type=float, default=0.1, help="Keep publishing node alive for N s")
    pub.add_argument("-n", "--node-name", help="Name of the created publishing node")
    pub.add_argument("--spin-time", type=float, help=argparse.SUPPRESS)
    pub.add_argument("-s", "--use-sim-time", action="store_true", help="Enable ROS simulation time")
    add_qos_arguments(pub)
    pub.set_defaults(run=run_pub)

    for name, text, run in (
        ("hz", "Print the average publishing rate to screen", run_hz),
        ("bw", "Display bandwidth used by topic", run_bw),
        ("delay", "Display delay of topic from timestamp in header", run_delay),
    ):
        meter = verbs.add_parser(name, help=text)
        add_graph_arguments(meter)
        topic_argument(meter)
        meter.add_argument("--window", "-w", type=int, default=100 if name == "bw" else 10000, help="Window size")
        meter.add_argument("--filter", dest="filter_expr", help=argparse.SUPPRESS)
        meter.add_argument("--wall-time", action="store_true", help=argparse.SUPPRESS)
        meter.set_defaults(run=run)


def positive(text: str) -> float:
    """Return a number above zero."""
    value = float(text)
    if not value > 0:
        raise argparse.ArgumentTypeError(f"{text} is not greater than zero")
    return value


def complete_messages(prefix: str, **_: Any) -> list[str]:
    """Return the message types that begin so."""
    from .interface import every

    return [name for name in every("msg") if name.startswith(prefix)]


def _subscription(seen: Graph, args: argparse.Namespace, given: str | None = None) -> tuple[str, Any, list[Any]]:
    """Return the topic's full name, its message class and its publishers."""
    name = full_name(args.topic_name)
    kind = given or seen.topic_type(name)
    if kind is None:
        print(f"WARNING: topic [{name}] does not appear to be published yet", file=sys.stderr)
        raise Refusal("Could not determine the type for the passed topic")
    message = messages.load(kind, "msg")
    publishers = seen.wait_for(lambda: seen.node.get_publishers_info_by_topic(name), 0.3)
    return name, message, publishers


def run_echo(args: argparse.Namespace) -> int:
    """Print messages as they come."""
    limits = messages.Limits(None if args.full_length else args.truncate_length, not args.no_arr, not args.no_str)
    keep = compile(args.filter_expr, "--filter", "eval") if args.filter_expr else None
    count = 0

    def show(message: Any, info: Any = None) -> None:
        nonlocal count
        if args.once and count:
            return
        if args.raw:
            print(f"{message!r}\n---", flush=True)
            count += 1
            return
        if keep is not None and not eval(keep, {"m": message}):
            return
        count += 1
        part = messages.field(message, args.field) if args.field else message
        if args.include_message_info and info is not None:
            print(f"- {info}" if args.csv else messages.to_yaml(dict(info)), end="\n" if args.csv else "")
        if args.csv:
            print(messages.to_csv(part, limits), flush=True)
        else:
            print(f"{messages.to_yaml(part, limits, args.flow_style)}---", flush=True)

    with graph(args.spin_time) as seen:
        name, kind, publishers = _subscription(seen, args, args.message_type)
        # What it delivers depends on who asks: with the callback's second argument rclpy tells about the message too.
        callback = show if args.include_message_info else lambda message: show(message)
        subscription = seen.node.create_subscription(kind, name, callback, asked(args, publishers), raw=args.raw)
        done = spin(seen.node, lambda: args.once and count > 0, args.timeout)
        seen.node.destroy_subscription(subscription)
    return 0 if done or args.timeout is None else 1


def run_pub(args: argparse.Namespace) -> int:
    """Publish a message, once or again and again."""
    kind = messages.load(args.message_type, "msg")
    values = messages.from_yaml(args.values)
    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if times else 0
    with graph() as seen:
        message = kind()
        messages.fill(message, values, seen.node.get_clock().now().to_msg())
        stamped = any(value in ("now", "auto") for value in _values(values))
        publisher = seen.node.create_publisher(kind, args.topic_name, asked(args))
        _wait_for_subscribers(publisher, wanted, args.max_wait_time_secs)
        print("publisher: beginning loop", flush=True)
        count, begin = 0, time.monotonic()
        while True:
            if stamped:
                messages.fill(message, values, seen.node.get_clock().now().to_msg())
            count += 1
            if count % args.print == 0:
                print(f"publishing #{count}: {message!r}\n", flush=True)
            publisher.publish(message)
            if times and count >= times:
                break
            # Against the first message, so that small delays do not add up.
            time.sleep(max(0.0, begin + count / args.rate - time.monotonic()))
        time.sleep(args.keep_alive)
    return 0


def _values(values: Any) -> Any:
    for one in values.values() if isinstance(values, dict) else values:
        if isinstance(one, dict | list):
            yield from _values(one)
        elif isinstance(one, str):
            yield one


def _wait_for_subscribers(publisher: Any, wanted: int, limit_s: float | None) -> None:
    begin = said = time.monotonic()
    first = True
    while publisher.get_subscription_count() < wanted:
        now = time.monotonic()
        if limit_s is not None and now - begin > limit_s:
            raise Refusal(
                f"Timed out waiting for subscribers: Expected {wanted} subscribers but only got "
                f"{publisher.get_subscription_count()} subscribers"
            )
        # A subscription that exists is found at once; only a missing one is worth a word.
        if now - begin >= 0.2 and (first or now - said >= 1.0):
            print(f"Waiting for at least {wanted} matching subscription(s)...", flush=True)
            first, said = False, now
        time.sleep(0.02)


class _Meter:
    """Counts what comes, and says something each second."""

    def __init__(self, args: argparse.Namespace, raw: bool) -> None:
        self.args, self.raw = args, raw
        self.samples: deque[tuple[float, Any]] = deque(maxlen=args.window)
        self.count = 0

    def take(self, message: Any) -> None:
        self.samples.append((time.monotonic(), message if not self.raw else len(message)))
        self.count += 1

    def run(self, say: Any, before: str = "") -> int:
        with graph(self.args.spin_time) as seen:
            name, kind, publishers = _subscription(seen, self.args)
            flags = argparse.Namespace(
                qos_profile=None, qos_depth=-1, qos_history=None, qos_reliability=None, qos_durability=None
            )
            seen.node.create_subscription(kind, name, self.take, asked(flags, publishers), raw=self.raw)
            if before:
                print(before.format(name), flush=True)
            seen_before = 0

            def tell() -> None:
                nonlocal seen_before
                if self.count == seen_before:
                    if seen_before:
                        print("no new messages", flush=True)
                    return
                seen_before = self.count
                say(list(self.samples))

            seen.node.create_timer(1.0, tell)
            spin(seen.node, lambda: False)
        return 0


def run_hz(args: argparse.Namespace) -> int:
    """Print the rate each second."""

    def say(samples: list[tuple[float, Any]]) -> None:
        times = [at for at, _ in samples]
        gaps = [b - a for a, b in pairwise(times)]
        if not gaps:
            return
        mean = statistics.fmean(gaps)
        print(f"average rate: {1 / mean if mean else 0:.3f}")
        print(
            f"\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s std dev: {statistics.pstdev(gaps):.5f}s "
            f"window: {len(samples)}",
            flush=True,
        )

    return _Meter(args, raw=True).run(say)


def size(value: float, per: str = "") -> str:
    """Return a number of bytes for people."""
    for unit, of in (("MB", 1000**2), ("KB", 1000)):
        if value >= of:
            return f"{value / of:.2f} {unit}{per}"
    return f"{value:.0f} B{per}"


def run_bw(args: argparse.Namespace) -> int:
    """Print the bandwidth each second."""

    def say(samples: list[tuple[float, int]]) -> None:
        if len(samples) < 2:
            return
        sizes = [number for _, number in samples]
        rate = size(sum(sizes) / max(time.monotonic() - samples[0][0], 1e-9), "/s")
        print(f"{rate} from {len(samples)} messages")
        low, high = size(min(sizes)), size(max(sizes))
        print(f"\tMessage size mean: {size(statistics.fmean(sizes))} min: {low} max: {high}", flush=True)

    return _Meter(args, raw=True).run(say, "Subscribed to [{}]")


def run_delay(args: argparse.Namespace) -> int:
    """Print how old the messages' stamps are when they come."""
    delays: deque[float] = deque(maxlen=args.window)

    class Stamped(_Meter):
        def take(self, message: Any) -> None:
            if not hasattr(message, "header"):
                raise Refusal("msg does not have header")
            stamp = message.header.stamp
            delays.append(time.time() - stamp.sec - stamp.nanosec * 1e-9)
            self.count += 1
            self.samples.append((time.monotonic(), None))

    def say(_samples: Any) -> None:
        print(f"average delay: {statistics.fmean(delays):.3f}")
        print(
            f"\tmin: {min(delays):.3f}s max: {max(delays):.3f}s std dev: {statistics.pstdev(delays):.5f}s "
            f"window: {len(delays)}",
            flush=True,
        )

    return Stamped(args, raw=False).run(say)
