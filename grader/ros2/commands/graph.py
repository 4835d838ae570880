"""A node that looks at the ROS graph. There is no daemon: each call waits until discovery has come to rest."""

# mypy: disallow-untyped-calls=False
# rclpy is typed in parts: a call of an untyped function there says nothing about our code.

from __future__ import annotations

import contextlib
import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from .answers import Refusal

T = TypeVar("T")
NamesAndTypes = list[tuple[str, list[str]]]

# Discovery takes 10 to 150 ms on an idle machine. The graph counts as known when it has not changed for this long…
REST_S = 0.25
# …and this long while nobody else is in it: nodes announce themselves every 3 s, so by then each has been heard,
# also one whose first answer was lost (see below). An empty graph is worth being sure of.
ALONE_S = 3.3
# The longest wait for a graph to come to rest, and for a name that was asked for.
LONGEST_S = 4.5
STEP_S = 0.02


# Fast DDS announces a new participant at once, before it can take in the answers. On one machine they come back within
# a millisecond and are lost; the others think they have answered, and are found only at their own next announcement,
# up to 3 s later. So this participant's first announcement is put off until it can listen (tried: six of six found).
FIRST_ANNOUNCEMENT_S = 0.35
PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com"><profiles>
<participant profile_name="ros2_command" is_default_profile="true"><rtps><builtin><discovery_config>
<leaseDuration><sec>20</sec></leaseDuration>
<leaseAnnouncement><sec>{s}</sec><nanosec>{ns}</nanosec></leaseAnnouncement>
<initialAnnouncements><count>0</count><period><sec>0</sec><nanosec>100000000</nanosec></period></initialAnnouncements>
</discovery_config></builtin></rtps></participant></profiles></dds>
"""
PROFILE_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")


@contextlib.contextmanager
def quick_discovery(slowness: float) -> Iterator[None]:
    """Have a node that is created meanwhile find the others soon; a profile that the user has set is left alone."""
    if any(name in os.environ for name in PROFILE_VARIABLES):
        yield
        return
    delay_ns = int(FIRST_ANNOUNCEMENT_S * slowness * 1e9)
    with tempfile.NamedTemporaryFile("w", prefix="ros2-discovery-", suffix=".xml") as file:
        file.write(PROFILE.format(s=delay_ns // 10**9, ns=delay_ns % 10**9))
        file.flush()
        os.environ.update(dict.fromkeys(PROFILE_VARIABLES, file.name))
        try:
            yield
        finally:
            for name in PROFILE_VARIABLES:
                del os.environ[name]


class Slowness:
    """How many times slower than an idle machine this one is, judged by a piece of this process's own work.

    Importing rclpy is nearly all computing. Where it takes longer than the processor works for it, others are computing
    too, and the nodes that have to answer will be as late.
    """

    def __init__(self) -> None:
        self.began_s, self.computed_s = time.perf_counter(), time.process_time()

    def factor(self) -> float:
        """Return the factor over the time since the start; a file cache that is cold is no sign of a busy machine."""
        took_s, computed_s = time.perf_counter() - self.began_s, time.process_time() - self.computed_s
        return 1.0 if took_s < 0.1 else min(max(took_s / max(computed_s, 0.1), 1.0), 3.0)


class Graph:
    """A node of ours and what it sees."""

    def __init__(self, node: Any, rest_s: float | None = None, slowness: float = 1.0) -> None:
        self.node = node
        self.rest_s = rest_s
        self.slowness = slowness

    def settle(self) -> None:
        """Wait until the graph has stopped changing."""
        began = changed = time.monotonic()
        last: Any = None
        while True:
            now, seen = time.monotonic(), self._seen()
            if seen != last:
                last, changed = seen, now
            if self.rest_s is not None:
                if now - began >= self.rest_s:
                    return
            elif now - began >= LONGEST_S:
                return
            elif now - changed >= REST_S * self.slowness and self._whole():
                others = len(last[0]) > 1
                if others or now - began >= ALONE_S:
                    return
            time.sleep(STEP_S)

    def _seen(self) -> Any:
        return (
            sorted(self.node.get_node_names_and_namespaces()),
            sorted((name, tuple(types)) for name, types in self.node.get_topic_names_and_types()),
            sorted(name for name, _ in self.node.get_service_names_and_types()),
        )

    def _whole(self) -> bool:
        """Say whether names and endpoints agree: they travel apart, and each node publishes its parameters' events."""
        return bool(self.node.count_publishers("/parameter_events") == len(self.node.get_node_names()))

    def wait_for(self, ask: Callable[[], T], timeout_s: float = LONGEST_S) -> T:
        """Return the answer as soon as it is not empty, or the empty answer after the time limit."""
        limit = time.monotonic() + (self.rest_s if self.rest_s is not None else timeout_s)
        while True:
            answer = ask()
            if answer or time.monotonic() > limit:
                return answer
            time.sleep(STEP_S)

    # -- names -----------------------------------------------------------------------------------------------------
    def nodes(self, hidden: bool = False) -> list[str]:
        """Return the full names of the nodes, with this one left out unless hidden ones are asked for."""
        found = [f"{space.rstrip('/')}/{name}" for name, space in self.node.get_node_names_and_namespaces()]
        return sorted(name for name in found if hidden or not is_hidden(name))

    def has_node(self, name: str) -> bool:
        """Wait for a node; say whether it came."""
        return self.wait_for(lambda: full_name(name) in self.nodes(hidden=True))

    def topics(self, hidden: bool = False) -> NamesAndTypes:
        """Return the topics with their types."""
        return sorted((n, t) for n, t in self.node.get_topic_names_and_types() if hidden or not is_hidden(n))

    def services(self, hidden: bool = False) -> NamesAndTypes:
        """Return the services with their types."""
        return sorted((n, t) for n, t in self.node.get_service_names_and_types() if hidden or not is_hidden(n))

    def others(self) -> list[tuple[str, str]]:
        """Return name and namespace of every node but this one."""
        return [one for one in self.node.get_node_names_and_namespaces() if one[0] != self.node.get_name()]

    def topic_type(self, topic: str) -> str | None:
        """Wait for a topic, and return its type."""
        found = self.wait_for(lambda: dict(self.node.get_topic_names_and_types()).get(full_name(topic)))
        return found[0] if found else None

    def service_type(self, service: str) -> str | None:
        """Wait for a service, and return its type."""
        found = self.wait_for(lambda: dict(self.node.get_service_names_and_types()).get(full_name(service)))
        return found[0] if found else None


def show_names(found: NamesAndTypes, types: bool, count: bool) -> int:
    """Print names, with their types or only their number, as all lists do; return the exit code."""
    if count:
        print(len(found))
        return 0
    for name, kinds in found:
        print(f"{name} [{', '.join(kinds)}]" if types else name)
    return 0


def full_name(name: str) -> str:
    """Return a name as the graph has it."""
    return name if name.startswith("/") else "/" + name


def split_name(name: str) -> tuple[str, str]:
    """Return the name and the namespace of a node's full name."""
    space, _, base = full_name(name).rpartition("/")
    return base, space or "/"


def is_hidden(name: str) -> bool:
    """Say whether some part of the name begins with an underscore."""
    return any(part.startswith("_") for part in name.split("/"))


@contextlib.contextmanager
def graph(rest_s: float | None = None, name: str | None = None, sim_time: bool = False) -> Iterator[Graph]:
    """Yield a graph, with a node of our own in it, a hidden one unless it is given a name.

    Raises:
        Refusal: a name that was asked for cannot be one in ROS.
    """
    work = Slowness()
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import try_shutdown

    slowness = work.factor()
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)  # Ctrl-C ends the command, by Python's own rule
    try:
        # Nobody asks this node for parameters: without their services it starts faster and clutters nothing.
        with quick_discovery(slowness):
            node = rclpy.create_node(
                name or f"_ros2cli_{os.getpid()}",
                start_parameter_services=False,
                parameter_overrides=[Parameter("use_sim_time", value=True)] if sim_time else [],
            )
        try:
            yield Graph(node, rest_s, slowness)
        finally:
            node.destroy_node()
    except NameValidationException as error:
        raise Refusal(str(error)) from None
    finally:
        try_shutdown()


@contextlib.contextmanager
def interrupt_later() -> Iterator[Callable[[], None]]:
    """Put Ctrl-C off; yield a function that lets it through if it has been pressed, as the end does too.

    In the middle of rclpy's C++ a KeyboardInterrupt would come out as a RuntimeError about a failed conversion.
    A second Ctrl-C does not wait.
    """
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    pressed: list[int] = []

    def press(number: int, frame: Any) -> None:
        pressed.append(number)
        if len(pressed) > 1:
            deliver(number, frame)

    def deliver(number: int, frame: Any) -> None:
        handler = before[signal.Signals(number)]
        assert callable(handler)
        handler(number, frame)

    def check() -> None:
        if pressed:
            deliver(pressed[0], None)

    put_off = [number for number, handler in before.items() if callable(handler)]
    for number in put_off:
        signal.signal(number, press)
    try:
        yield check
        check()
    finally:
        for number in put_off:
            signal.signal(number, before[number])


def spin(node: Any, until: Callable[[], bool], timeout_s: float | None = None) -> bool:
    """Let the node work until something holds; return whether it does."""
    import rclpy

    limit = None if timeout_s is None else time.monotonic() + timeout_s
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    try:
        with interrupt_later() as check:
            return _spin(executor, until, limit, check)
    finally:
        executor.remove_node(node)
        executor.shutdown()


def _spin(executor: Any, until: Callable[[], bool], limit: float | None, check: Callable[[], None]) -> bool:
    while not until():
        check()
        if limit is not None and time.monotonic() > limit:
            return False
        executor.spin_once(timeout_sec=0.1)
    return True


def steady_clock() -> Any:
    """Return a clock for timers that go on while simulated time stands still."""
    from rclpy.clock import Clock
    from rclpy.clock_type import ClockType

    return Clock(clock_type=ClockType.STEADY_TIME)


def add_graph_arguments(parser: Any) -> None:
    """Declare what the real commands take for their daemon; without one it is accepted and has no effect."""
    parser.add_argument("--spin-time", type=float, metavar="SPIN_TIME", help="Seconds to wait for discovery, exactly")
    parser.add_argument("-s", "--use-sim-time", action="store_true", help="Enable ROS simulation time")
    parser.add_argument("--no-daemon", action="store_true", help="Do not spawn nor use an already running daemon")
