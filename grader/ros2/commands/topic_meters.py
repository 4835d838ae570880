"""`ros2 topic hz | delay`: measure the rate and the delay of a topic."""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque
from collections.abc import Callable
from itertools import pairwise
from typing import Any

from . import arguments
from .graph import graph
from .refusals import Refusal
from .spinning import spin, steady_clock
from .topic_pubsub import subscription

WINDOW = 10000  # messages, as with the real command


def add_verbs(add_verb: arguments.AddVerb) -> None:
    """Declare verbs and flags."""
    for name, text, run in (
        ("hz", "Print the average publishing rate to screen", run_hz),
        ("delay", "Display delay of topic from timestamp in header", run_delay),
    ):
        verb = add_verb(name, text, run, graph=True)
        arguments.name_argument(verb, "topic")
        verb.add_argument("--window", "-w", type=int, default=WINDOW, help="Window size, in messages")


def run_hz(args: argparse.Namespace) -> int:
    """Print how often messages arrive, by simulated time if it was asked for."""

    def arrival_s(_message: Any, now_ns: int) -> float:
        return now_ns * 1e-9 if args.use_sim_time else time.monotonic()

    def gaps(arrivals: list[float]) -> list[float]:
        return [after - before for before, after in pairwise(arrivals)]

    return _measure(args, arrival_s, gaps, lambda mean: f"average rate: {1 / mean if mean else 0:.3f}", raw=True)


def run_delay(args: argparse.Namespace) -> int:
    """Print how old the messages' stamps are when they arrive."""

    def age_s(message: Any, now_ns: int) -> float:
        if not hasattr(message, "header"):
            raise Refusal("msg does not have header")
        stamp = message.header.stamp
        return float(now_ns - stamp.sec * 10**9 - stamp.nanosec) * 1e-9

    return _measure(args, age_s, list, "average delay: {:.3f}".format, raw=False)


def _measure(
    args: argparse.Namespace,
    measure: Callable[[Any, int], float],
    durations_s: Callable[[list[float]], list[float]],
    title: Callable[[float], str],
    *,
    raw: bool,
) -> int:
    """Measure the messages of a topic, and print a summary of the last ones each second until Ctrl-C."""
    from rclpy.qos import qos_profile_sensor_data

    samples: deque[float] = deque(maxlen=args.window)
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
            if found := durations_s(list(samples)):
                print(
                    f"{title(statistics.fmean(found))}\n\tmin: {min(found):.3f}s max: {max(found):.3f}s "
                    f"std dev: {statistics.pstdev(found):.5f}s window: {len(samples)}",
                    flush=True,
                )

        name, kind, _ = subscription(seen, args, wait_for_it=True)
        # Best effort and volatile, whatever is offered: so does Jazzy's command, and every publisher fits.
        seen.node.create_subscription(kind, name, take, qos_profile_sensor_data, raw=raw)
        seen.node.create_timer(1.0, report, clock=steady_clock())
        spin(seen.node, lambda: False)
    return 0
