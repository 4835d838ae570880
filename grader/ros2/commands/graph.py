"""The ROS graph, seen by a node of ours, and letting that node work.

There is no daemon: each call waits until discovery has come to rest.
"""

# mypy: disallow-untyped-calls=False
# rclpy is only partly typed, so calling its untyped functions is allowed here.

from __future__ import annotations

import contextlib
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from . import SETUP, Refusal, near

T = TypeVar("T")
NamesAndTypes = list[tuple[str, list[str]]]

# Discovery takes 10 to 150 ms on an idle machine. The graph counts as known when it has not changed for this long…
REST_S = 0.25
# …and this long while no other node is in it: nodes announce themselves every 3 s, so by then each has been heard,
# even one whose first answer was lost (see below).
ALONE_S = 3.3
# The longest wait for a graph to come to rest, and for a name that was asked for.
LONGEST_S = 4.5
STEP_S = 0.02
# By then existing names have been found, and a missing one is worth a remark.
REMARK_S = 2.0


# Fast DDS announces a new participant at once, before it can receive the answers. On one machine these arrive within a
# millisecond and are lost; the other nodes think they have answered, and are found only at their own next announcement,
# up to 3 s later. So this participant's first announcement is delayed until it can listen (tried: six of six found).
FIRST_ANNOUNCEMENT_S = 0.35
PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com"><profiles>
<participant profile_name="ros2_command" is_default_profile="true"><rtps><builtin><discovery_config>
<leaseDuration><sec>20</sec></leaseDuration>
<leaseAnnouncement><sec>{s}</sec><nanosec>{ns}</nanosec></leaseAnnouncement>
<initialAnnouncements><count>0</count><period><sec>0</sec><nanosec>100000000</nanosec></period></initialAnnouncements>
</discovery_config></builtin></rtps></participant></profiles></dds>
"""
DISCOVERY = re.compile("<discovery_config>.*</discovery_config>", re.DOTALL)
PROFILE_VARIABLES = ("FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE")
WORKSPACES = 'profile_name="this_machine"'  # in the profile of the notebooks' nodes


@contextlib.contextmanager
def quick_discovery(slowness: float) -> Iterator[None]:
    """Let a node created in this block find the others soon; a profile that the user has set is kept."""
    before = {name: os.environ[name] for name in PROFILE_VARIABLES if name in os.environ}
    theirs = "".join(Path(path).read_text(errors="replace") for path in before.values() if Path(path).is_file())
    if before and WORKSPACES not in theirs:
        yield
        return
    delay_ns = int(FIRST_ANNOUNCEMENT_S * slowness * 1e9)
    profile = PROFILE.format(s=delay_ns // 10**9, ns=delay_ns % 10**9)
    if theirs:
        profile = DISCOVERY.sub(DISCOVERY.findall(profile)[0], theirs)
    with tempfile.NamedTemporaryFile("w", prefix="ros2-discovery-", suffix=".xml") as file:
        file.write(profile)
        file.flush()
        os.environ.update(dict.fromkeys(PROFILE_VARIABLES, file.name))
        try:
            yield
        finally:
            for name in PROFILE_VARIABLES:
                del os.environ[name]
            os.environ.update(before)


@dataclass(frozen=True)
class Graph:
    """The graph as `node` sees it.

    Attributes:
        node: our rclpy node.
        rest_s: how long to wait for discovery, exactly; None to wait until the graph has come to rest.
        slowness: the factor by which this machine is slower than an idle one.
    """

    node: Any
    rest_s: float | None = None
    slowness: float = 1.0

    def settle(self) -> None:
        """Wait until the graph has stopped changing."""
        began = changed = time.monotonic()
        last: Any = None
        while True:
            now, seen = time.monotonic(), self._seen()
            if seen != last:
                last, changed = seen, now
            if now - began >= (LONGEST_S if self.rest_s is None else self.rest_s):
                return
            if self.rest_s is None and now - changed >= REST_S * self.slowness and self._whole():
                if len(last[0]) > 1:  # others are there
                    return
                if now - began >= ALONE_S:
                    if said := of_silence(SETUP):
                        print(said, file=sys.stderr)
                    return
            time.sleep(STEP_S)

    def _seen(self) -> Any:
        return (
            sorted(self.node.get_node_names_and_namespaces()),
            sorted((name, tuple(types)) for name, types in self.node.get_topic_names_and_types()),
            sorted(name for name, _ in self.node.get_service_names_and_types()),
        )

    def _whole(self) -> bool:
        """Return whether names and endpoints agree: they travel apart, and each node publishes /parameter_events."""
        return bool(self.node.count_publishers("/parameter_events") == len(self.node.get_node_names()))

    def wait_for(self, ask: Callable[[], T], timeout_s: float = LONGEST_S) -> T:
        """Return the answer of `ask` as soon as it is not empty, or the empty answer after the time limit."""
        limit = time.monotonic() + (self.rest_s if self.rest_s is not None else timeout_s)
        while True:
            answer = ask()
            if answer or time.monotonic() > limit:
                return answer
            time.sleep(STEP_S)

    # -- names -----------------------------------------------------------------------------------------------------
    def nodes(self, hidden: bool = False) -> list[str]:
        """Return the full names of the nodes; without hidden ones, ours is left out too."""
        found = [f"{space.rstrip('/')}/{name}" for name, space in self.node.get_node_names_and_namespaces()]
        return sorted(name for name in found if hidden or not is_hidden(name))

    def has_node(self, name: str, hidden: bool = True) -> bool:
        """Wait for a node, also for one that is hidden if `hidden`; return whether it appeared."""
        return self.wait_for(lambda: full_name(name) in self.nodes(hidden))

    def names(self, kind: str, hidden: bool = False) -> NamesAndTypes:
        """Return the names of a kind (topic, service or action) with their types."""
        if kind == "action":
            from rclpy.action.graph import get_action_names_and_types

            found = get_action_names_and_types(self.node)
        elif kind == "topic":
            found = self.node.get_topic_names_and_types()
        else:
            found = self.node.get_service_names_and_types()
        return sorted((name, types) for name, types in found if hidden or not is_hidden(name))

    def types(self, kind: str, name: str) -> list[str]:
        """Wait for a topic, service or action, and return its types; [] if it does not appear."""
        return self.wait_for(lambda: dict(self.names(kind, hidden=True)).get(full_name(name), []))

    def others(self) -> list[tuple[str, str]]:
        """Return name and namespace of every node but ours."""
        return [one for one in self.node.get_node_names_and_namespaces() if one[0] != self.node.get_name()]


def of_silence(setup: Path) -> str:
    """Return why the nodes of the notebooks are not heard here, "" in a terminal that is prepared to hear them."""
    if "ROS_DOMAIN_ID" in os.environ or not (setup.parent.parent.parent / "ws" / "src").is_dir():
        return ""
    return f"No node is heard. Those of the notebooks are in a domain of their own; to join it: source {setup}"


def matching(offered: Sequence[Any], depth: int = 10) -> Any:
    """Return a profile that is compatible with every offered one, of rclpy or rosbags; reliable if there is none."""
    from rclpy import qos

    best_effort = any(one.reliability.name == "BEST_EFFORT" for one in offered)
    local = bool(offered) and all(one.durability.name == "TRANSIENT_LOCAL" for one in offered)
    return qos.QoSProfile(
        depth=depth,
        reliability=qos.ReliabilityPolicy.BEST_EFFORT if best_effort else qos.ReliabilityPolicy.RELIABLE,
        durability=qos.DurabilityPolicy.TRANSIENT_LOCAL if local else qos.DurabilityPolicy.VOLATILE,
    )


def wait(ready: Callable[[], bool], name: str, wanted: str, there: Callable[[], NamesAndTypes]) -> None:
    """Wait until `ready` returns true; remark once on a type that differs, or on a name that is nearly the same.

    Args:
        ready: whether the wait is over.
        name: the name that is waited for.
        wanted: its type.
        there: the names and types that others have.
    """
    began = looked = time.monotonic()
    remarked = False
    while not ready():
        now = time.monotonic()
        if not remarked and now - began >= REMARK_S and now - looked >= 0.5:
            looked, found = now, there()
            types = [kind for one, kinds in found if one == full_name(name) for kind in kinds]
            remark = (
                other_type(name, wanted, types) if types else near(full_name(name), (one for one, _ in found)).strip()
            )
            if remark:
                print(remark, file=sys.stderr, flush=True)
                remarked = True
        time.sleep(STEP_S)


def other_type(name: str, wanted: str, types: Iterable[str]) -> str:
    """Return a warning if none of the types that a name has is the wanted one, else ""."""
    there = sorted(set(types))
    parts = wanted.split("/")
    if not there or any(one.split("/")[0] == parts[0] and one.split("/")[-1] == parts[-1] for one in there):
        return ""
    return f"WARNING: {full_name(name)} is of type {', '.join(there)}, not {wanted}"


def full_name(name: str) -> str:
    """Return a name with the slash that it has in the graph."""
    return name if name.startswith("/") else "/" + name


def split_name(name: str) -> tuple[str, str]:
    """Return the name and the namespace of a node's full name."""
    space, _, base = full_name(name).rpartition("/")
    return base, space or "/"


def is_hidden(name: str) -> bool:
    """Return whether some part of the name begins with an underscore."""
    return any(part.startswith("_") for part in name.split("/"))


@contextlib.contextmanager
def graph(rest_s: float | None = None, sim_time: bool = False) -> Iterator[Graph]:
    """Yield the graph with a hidden node of ours in it.

    Raises:
        Refusal: a name given on the command line is not valid in ROS.
    """
    began_s, computed_s = time.perf_counter(), time.process_time()
    import rclpy
    from rclpy.exceptions import NameValidationException
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import try_shutdown

    # Importing rclpy is nearly all computing. If it takes longer than its CPU time, other processes are computing too,
    # and the nodes that have to answer will be late by the same factor. A cold file cache is not a sign of that.
    took_s, computed_s = time.perf_counter() - began_s, time.process_time() - computed_s
    slowness = 1.0 if took_s < 0.1 else min(max(took_s / max(computed_s, 0.1), 1.0), 3.0)
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)  # Python's own Ctrl-C ends it
    try:
        # No other node asks this one for parameters: without their services it starts faster and clutters nothing.
        with quick_discovery(slowness):
            node = rclpy.create_node(
                f"_ros2cli_{os.getpid()}",
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


# -- letting a node work ----------------------------------------------------------------------------------------------
@contextlib.contextmanager
def interrupt_later() -> Iterator[Callable[[], None]]:
    """Delay Ctrl-C; yield a function that delivers it if it has been pressed, as the end of the block does.

    In the middle of rclpy's C++ a KeyboardInterrupt would become a RuntimeError about a failed conversion.
    """
    pressed: list[int] = []
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    before = {number: handler for number, handler in found.items() if callable(handler)}

    def check() -> None:
        if pressed:
            before[signal.Signals(pressed[0])](pressed[0], None)

    for number in before:
        signal.signal(number, lambda number, _frame: pressed.append(number))
    try:
        yield check
        check()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def spin(node: Any, until: Callable[[], bool], timeout_s: float | None = None) -> bool:
    """Let the node work until `until` returns true; return False if the time limit came first."""
    import rclpy

    limit = None if timeout_s is None else time.monotonic() + timeout_s
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    try:
        with interrupt_later() as check:
            while not until():
                check()
                if limit is not None and time.monotonic() > limit:
                    return False
                executor.spin_once(timeout_sec=0.1)
            return True
    finally:
        executor.remove_node(node)
        executor.shutdown()


def steady_clock() -> Any:
    """Return a clock for timers that must go on while simulated time stands still."""
    from rclpy.clock import Clock
    from rclpy.clock_type import ClockType

    return Clock(clock_type=ClockType.STEADY_TIME)
