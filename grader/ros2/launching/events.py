"""What can happen during a launch."""

from __future__ import annotations

import signal
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .entities import Action
    from .process import ExecuteLocal


class Event:
    """Something that happened."""

    name = "launch.Event"


class ExecutionComplete(Event):
    """An action has finished."""

    name = "launch.events.ExecutionComplete"

    def __init__(self, *, action: Action) -> None:
        self.action = action


class Shutdown(Event):
    """The launch is to end."""

    name = "launch.events.Shutdown"

    def __init__(self, *, reason: str = "reason not given", due_to_sigint: bool = False) -> None:
        self.reason = reason
        self.due_to_sigint = due_to_sigint


class TimerEvent(Event):
    """A timer's period is over."""

    name = "launch.events.TimerEvent"

    def __init__(self, *, timer_action: Action) -> None:
        self.timer_action = timer_action


class RunningProcessEvent(Event):
    """Something happened to a process that was started."""

    name = "launch.events.process.RunningProcessEvent"

    def __init__(
        self,
        *,
        action: ExecuteLocal,
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

    name = "launch.events.process.ProcessStarted"


class ProcessExited(RunningProcessEvent):
    """A process has ended; `returncode` is negative for a signal."""

    name = "launch.events.process.ProcessExited"

    def __init__(self, *, returncode: int, **details: Any) -> None:
        super().__init__(**details)
        self.returncode = returncode


class ProcessIO(RunningProcessEvent):
    """A process has written something."""

    name = "launch.events.process.ProcessIO"

    def __init__(self, *, text: bytes, fd: int, **details: Any) -> None:
        super().__init__(**details)
        self.text, self.fd = text, fd
        self.from_stdin, self.from_stdout, self.from_stderr = fd == 0, fd == 1, fd == 2


class ProcessStdout(ProcessIO):
    """A process has written to its standard output."""

    name = "launch.events.process.ProcessStdout"


class ProcessStderr(ProcessIO):
    """A process has written to its standard error."""

    name = "launch.events.process.ProcessStderr"


class ProcessTargetedEvent(Event):
    """Something is to be done to the processes that a matcher picks."""

    name = "launch.events.process.ProcessTargetedEvent"

    def __init__(self, *, process_matcher: Callable[[Any], bool]) -> None:
        self.process_matcher = process_matcher


class SignalProcess(ProcessTargetedEvent):
    """A process is to be sent a signal."""

    name = "launch.events.process.SignalProcess"

    def __init__(self, *, signal_number: str | int, process_matcher: Callable[[Any], bool]) -> None:
        super().__init__(process_matcher=process_matcher)
        self.signal = signal.Signals[signal_number] if isinstance(signal_number, str) else signal.Signals(signal_number)
        self.signal_name = self.signal.name


class ShutdownProcess(ProcessTargetedEvent):
    """A process is to end, by force if need be."""

    name = "launch.events.process.ShutdownProcess"


def matches_action(action: Any) -> Callable[[Any], bool]:
    """Return a matcher of this very action."""
    return lambda candidate: candidate is action


def matches_name(name: str) -> Callable[[Any], bool]:
    """Return a matcher of processes by their label."""
    return lambda candidate: bool(candidate.process_details.get("name") == name)


def matches_pid(pid: int) -> Callable[[Any], bool]:
    """Return a matcher of the process with this id."""
    return lambda candidate: bool(candidate.process_details.get("pid") == pid)


def matches_executable(executable: str) -> Callable[[Any], bool]:
    """Return a matcher of processes by their command's first word."""
    return lambda candidate: executable in (candidate.process_details.get("cmd") or [""])[0].rsplit("/", 1)
