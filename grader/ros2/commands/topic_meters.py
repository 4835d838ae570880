"""`ros2 topic hz | bw | delay`: measure the rate, bandwidth and delay of a topic."""

from __future__ import annotations

import argparse
import statistics
import time
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from . import arguments
from .graph import graph
from .refusals import Refusal
from .spinning import spin, steady_clock
from .topic_pubsub import subscription

WINDOWS = {"hz": 10000, "bw": 100, "delay": 10000}  # messages, as with the real command


def add_verbs(add_verb: arguments.AddVerb) -> None:
    """Declare verbs and flags."""
    for name, text, meter in (
        ("hz", "Print the average publishing rate to screen", Rate),
        ("bw", "Display bandwidth used by topic", Bandwidth),
        ("delay", "Display delay of topic from timestamp in header", Delay),
    ):
        verb = add_verb(name, text, lambda args, meter=meter: meter(args).run(), graph=True)
        arguments.name_argument(verb, "topic")
        verb.add_argument("--window", "-w", type=int, default=WINDOWS[name], help="Window size, in messages")


class Meter:
    """Samples the messages of a topic, and prints a summary each second."""

    raw = True
    """Whether messages are received as bytes, which costs less."""
    greeting = ""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.samples: deque[tuple[float, float]] = deque(maxlen=args.window)
        self.count = 0
        self.clock: Any = None

    def run(self) -> int:
        """Listen until Ctrl-C."""
        with graph(self.args.spin_time, sim_time=self.args.use_sim_time) as seen:
            self.clock = seen.node.get_clock()
            from rclpy.qos import qos_profile_sensor_data

            name, kind, _ = subscription(seen, self.args, wait_for_it=True)
            # Best effort and volatile, whatever is offered: so does Jazzy's command, and every publisher fits.
            seen.node.create_subscription(kind, name, self.take, qos_profile_sensor_data, raw=self.raw)
            if self.greeting:
                print(self.greeting.format(name), flush=True)
            reported = 0

            def report() -> None:
                nonlocal reported
                if self.count == reported:
                    if reported:
                        print("no new messages", flush=True)
                    return
                reported = self.count
                self.summarise(list(self.samples))

            seen.node.create_timer(1.0, report, clock=steady_clock())
            spin(seen.node, lambda: False)
        return 0

    def take(self, message: Any) -> None:
        """Sample a message; before simulated time is known it would be of no use."""
        if self.args.use_sim_time and self.clock.now().nanoseconds == 0:
            return
        self.samples.append((self.now(), self.measure(message)))
        self.count += 1

    def now(self) -> float:
        """Return the time that samples are stamped with, in seconds."""
        return time.monotonic()

    def measure(self, message: Any) -> float:  # noqa: ARG002 - for subclasses
        """Return the measure of a message."""
        return 0.0

    def summarise(self, samples: list[tuple[float, float]]) -> None:
        """Print a summary of the last messages, given as pairs of time and measure."""
        raise NotImplementedError


class Rate(Meter):
    """How often messages arrive."""

    def now(self) -> float:
        """Return simulated time if it was asked for, else wall time."""
        return float(self.clock.now().nanoseconds * 1e-9) if self.args.use_sim_time else time.monotonic()

    def summarise(self, samples: list[tuple[float, float]]) -> None:
        """Print the rate, and how regular it is."""
        gaps = [b - a for (a, _), (b, _) in pairwise(samples)]
        if not gaps:
            return
        mean = statistics.fmean(gaps)
        print(f"average rate: {1 / mean if mean else 0:.3f}\n\t{spread(gaps, len(samples))}", flush=True)


class Bandwidth(Meter):
    """How many bytes arrive."""

    greeting = "Subscribed to [{}]"

    def measure(self, message: Any) -> float:
        """Return the message's size in bytes."""
        return len(message)

    def summarise(self, samples: list[tuple[float, float]]) -> None:
        """Print bytes per second, and the sizes of messages."""
        if len(samples) < 2:
            return
        sizes = [number for _, number in samples]
        rate = size(sum(sizes) / max(time.monotonic() - samples[0][0], 1e-9), "/s")
        print(f"{rate} from {len(samples)} messages")
        low, high = size(min(sizes)), size(max(sizes))
        print(f"\tMessage size mean: {size(statistics.fmean(sizes))} min: {low} max: {high}", flush=True)


class Delay(Meter):
    """How old the messages' stamps are when they arrive."""

    raw = False

    def measure(self, message: Any) -> float:
        """Return the age in seconds, by the clock that was asked for."""
        if not hasattr(message, "header"):
            raise Refusal("msg does not have header")
        stamp = message.header.stamp
        return float(self.clock.now().nanoseconds - stamp.sec * 10**9 - stamp.nanosec) * 1e-9

    def summarise(self, samples: list[tuple[float, float]]) -> None:
        """Print the age."""
        delays = [delay for _, delay in samples]
        print(f"average delay: {statistics.fmean(delays):.3f}\n\t{spread(delays, len(delays))}", flush=True)


def spread(values: Sequence[float], window: int) -> str:
    """Return the spread of durations in seconds, as the real command prints it."""
    return f"min: {min(values):.3f}s max: {max(values):.3f}s std dev: {statistics.pstdev(values):.5f}s window: {window}"


def size(value: float, per: str = "") -> str:
    """Return a number of bytes with a readable unit."""
    for unit, of in (("MB", 1000**2), ("KB", 1000)):
        if value >= of:
            return f"{value / of:.2f} {unit}{per}"
    return f"{value:.0f} B{per}"
