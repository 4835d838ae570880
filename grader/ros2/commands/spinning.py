"""Let a node work until something holds. Ctrl-C never arrives in the middle of rclpy's C++."""

from __future__ import annotations

import contextlib
import signal
import time
from collections.abc import Callable, Iterator
from typing import Any


@contextlib.contextmanager
def interrupt_later() -> Iterator[Callable[[], None]]:
    """Delay Ctrl-C; yield a function that delivers it if it has been pressed, as the end of the block does.

    In the middle of rclpy's C++ a KeyboardInterrupt would become a RuntimeError about a failed conversion.
    A second Ctrl-C is not delayed.
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

    delayed = [number for number, handler in before.items() if callable(handler)]
    for number in delayed:
        signal.signal(number, press)
    try:
        yield check
        check()
    finally:
        for number in delayed:
            signal.signal(number, before[number])


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
