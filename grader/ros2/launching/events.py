"""What can happen during a launch. `action` is always the launch action that the event is about."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import Any


class Event:
    """Something that happened."""


class ExecutionComplete(Event):
    """An action has finished."""

    def __init__(self, *, action: Any) -> None:
        self.action = action


class Shutdown(Event):
    """The launch is to end."""

    def __init__(self, *, reason: str = "reason not given", due_to_sigint: bool = False) -> None:
        self.reason = reason
        self.due_to_sigint = due_to_sigint


class TimerEvent(Event):
    """A timer's period is over."""

    def __init__(self, *, timer_action: Any) -> None:
        self.timer_action = timer_action


class RunningProcessEvent(Event):
    """Something happened to a process that was started."""

    def __init__(
        self,
        *,
        action: Any,
        name: str,
        cmd: list[str],
        cwd: str | None = None,
        env: dict[str, str] | None = None,
        pid: int = 0,
    ) -> None:
        self.action = self.execute_process_action = action
        self.process_name = name
        self.cmd, self.cwd, self.env, self.pid = cmd, cwd, env, pid


class ProcessStarted(RunningProcessEvent):
    """A process has been started."""


class ProcessExited(RunningProcessEvent):
    """A process has ended; `returncode` is negative for a signal."""

    def __init__(self, *, returncode: int, **details: Any) -> None:
        super().__init__(**details)
        self.returncode = returncode


class ProcessIO(RunningProcessEvent):
    """A process has written something."""

    def __init__(self, *, text: bytes, fd: int, **details: Any) -> None:
        super().__init__(**details)
        self.text, self.fd = text, fd
        self.from_stdin, self.from_stdout, self.from_stderr = fd == 0, fd == 1, fd == 2


class ProcessStdout(ProcessIO):
    """A process has written to its standard output."""


class ProcessStderr(ProcessIO):
    """A process has written to its standard error."""


class ShutdownProcess(Event):
    """The processes that a matcher picks are to end, by force if necessary."""

    def __init__(self, *, process_matcher: Callable[[Any], bool]) -> None:
        self.process_matcher = process_matcher


class SignalProcess(Event):
    """The processes that a matcher picks are to get a signal, given by its number or its name."""

    def __init__(self, *, signal_number: str | signal.Signals, process_matcher: Callable[[Any], bool]) -> None:
        if not isinstance(signal_number, str | signal.Signals):
            raise TypeError(
                "'SignalProcess' expected 'signal_number' to be one of [<class 'str'>, <enum 'Signals'>], "
                f"but got '{signal_number}' of type '{type(signal_number)}'"
            )
        self.signal = signal.Signals[signal_number] if isinstance(signal_number, str) else signal_number
        self.process_matcher = process_matcher


def matches_pid(pid: int) -> Callable[[Any], bool]:
    """Return a matcher of the process with a number."""
    return lambda action: bool(action.process_details.get("pid") == pid)


def matches_name(name: str) -> Callable[[Any], bool]:
    """Return a matcher of the process with a label, such as talker-1."""
    return lambda action: bool(action.process_details.get("name") == name)


def matches_executable(executable: str) -> Callable[[Any], bool]:
    """Return a matcher of the processes whose program's path ends in this."""
    return lambda action: bool(action.process_details) and action.process_details["cmd"][0].endswith(executable)


def matches_action(action: Any) -> Callable[[Any], bool]:
    """Return a matcher of one action."""
    return lambda candidate: candidate is action
