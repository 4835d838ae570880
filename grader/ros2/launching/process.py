"""Start a process, pass on its output, report how it ended, and end it: SIGINT, then SIGTERM, then SIGKILL."""

from __future__ import annotations

import asyncio
import contextlib
import os
import shlex
import signal
import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from signal import Signals as _Signals
from typing import Any

from ..commands import die_with_parent  # noqa: TID252 - the folder has no fixed name
from . import events
from .entities import (
    Action,
    Entities,
    LaunchContext,
    SomeSubstitutionsType,
    Substitution,
    perform,
    substitutions,
    truth,
)
from .errors import LaunchError
from .output import KINDS

# How long each signal has to work before the next one, as in the real launch; `sigterm_timeout:=` sets another limit.
TIMEOUT_S = 5.0
_LAST_WORDS_S = 0.5  # for the output of a process that has ended, which what it started may keep open
# Keywords without an effect here: they say how output looks, or how long an end may take.
_WITHOUT_EFFECT = ("sigterm_timeout", "sigkill_timeout", "output_format", "cached_output", "log_cmd")


class ExecuteProcess(Action):
    """A process, given as the words of its command."""

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        name: SomeSubstitutionsType | None = None,
        prefix: SomeSubstitutionsType | None = None,
        cwd: SomeSubstitutionsType | None = None,
        env: Mapping[Any, Any] | None = None,
        additional_env: Mapping[Any, Any] | None = None,
        shell: bool = False,
        emulate_tty: Any = False,
        output: SomeSubstitutionsType = "log",
        on_exit: Any = None,
        respawn: Any = False,
        respawn_delay: float | None = None,
        respawn_max_retries: int = -1,
        **rest: Any,
    ) -> None:
        super().__init__(**{name: value for name, value in rest.items() if name not in _WITHOUT_EFFECT})
        if not isinstance(respawn, bool | Substitution):
            raise TypeError(f"value='{respawn}' is not an instance of <class 'bool'>")
        self.cmd = [substitutions(word) for word in cmd]
        self.label, self.cwd, self.prefix = (None if x is None else substitutions(x) for x in (name, cwd, prefix))
        self.env, self.additional_env = (None if x is None else _pairs(x) for x in (env, additional_env))
        self.shell, self.emulate_tty = shell, emulate_tty
        # Of each stream, or of both together.
        self.output = substitutions("screen" if isinstance(output, dict) else output)
        self.on_exit, self.respawn = on_exit, respawn
        self.respawn_delay_s, self.respawn_max_retries = respawn_delay, respawn_max_retries
        self.process_details: dict[str, Any] = {}
        self.facts: dict[str, Any] = {}  # what the record says of the process besides its command
        self._context: LaunchContext
        self._process: asyncio.SubprocessTransport
        self._watched: _Watched
        self._life: asyncio.Task[None] | None = None
        self._stop = asyncio.Event()
        self._sent: list[str] = []

    @property
    def name(self) -> Any:
        """The label with its number, once the process is known."""
        return self.process_details.get("name")

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        return self._life

    # -- starting --------------------------------------------------------------------------------------------------
    def command(self, context: LaunchContext) -> list[str]:
        """Return the command's current words."""
        return [perform(context, word) for word in self.cmd]

    def _environment(self, context: LaunchContext) -> dict[str, str]:
        """Return the environment to run in."""
        found = dict(context.environment) if self.env is None else {}
        for name, value in [*(self.env or ()), *(self.additional_env or ())]:
            found[perform(context, name)] = perform(context, value)
        return found

    def execute(self, context: LaunchContext) -> Entities | None:
        """Settle command and environment now; the process starts after the whole description has been visited."""
        if self._life is not None:
            raise LaunchError(f"{type(self).__name__} action '{self.describe()}': executed more than once")
        if context.is_shutdown:
            return None
        self._context = context
        cmd = self.command(context)
        base = os.path.basename(cmd[0]) if self.label is None else perform(context, self.label)  # noqa: PTH119 - text
        cmd = [*(shlex.split(perform(context, self.prefix)) if self.prefix else ()), *cmd]
        self.process_details = {
            "name": f"{base}-{context.runner.next_number()}",
            "cmd": cmd,
            "cwd": None if self.cwd is None else perform(context, self.cwd),
            "env": self._environment(context),
            "pid": 0,
        }
        self._output = perform(context, self.output)
        if self._output not in KINDS:
            raise ValueError(f"'{self._output}' is not a valid standard output config i.e. one of: {', '.join(KINDS)}")
        everywhere = context.launch_configurations.get("emulate_tty")
        if self.emulate_tty if everywhere is None else truth(context, everywhere):
            self.process_details["env"].setdefault("PYTHONUNBUFFERED", "1")  # what a terminal is asked for
        self._respawns = self.respawn if isinstance(self.respawn, bool) else truth(context, self.respawn)
        limits = (context.launch_configurations.get(f"{name}_timeout", TIMEOUT_S) for name in ("sigterm", "sigkill"))
        self._limits_s = [float(limit) for limit in limits]
        handlers: list[events.EventHandler] = [events.OnShutdown(on_shutdown=lambda *_: self._stop.set())]
        if self.on_exit is not None:
            handlers.append(events.OnProcessExit(target_action=self, on_exit=self.on_exit))
        for handler in handlers:
            context.register_event_handler(handler)
        self._life = context.asyncio_loop.create_task(self._live(handlers))
        return None

    async def _live(self, handlers: list[events.EventHandler]) -> None:
        """Run the process, again as often as it respawns; then declare the action over."""
        context, restarts = self._context, 0
        try:
            while not (self._stop.is_set() or context.is_shutdown) and await self._start():
                await self._end()
                if not self._respawns or 0 <= self.respawn_max_retries <= restarts:
                    break
                restarts += 1
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._stop.wait(), self.respawn_delay_s or 0.0)
            await context.events.join()  # those about its end have been handled
        finally:
            for handler in handlers:
                context.unregister_event_handler(handler)

    def _event(self, kind: type[Any], **more: Any) -> None:
        self._context.emit_event_sync(kind(action=self, **self.process_details, **more))

    async def _start(self) -> bool:
        """Start the process and return True; report why that fails and return False."""
        runner, name, cmd = self._context.runner, self.process_details["name"], self.process_details["cmd"]
        loop = self._context.asyncio_loop
        start, words = (loop.subprocess_shell, [" ".join(cmd)]) if self.shell else (loop.subprocess_exec, cmd)
        try:
            self._process, self._watched = await start(
                lambda: _Watched(partial(runner.output.lines, name, self._output)),
                *words,
                cwd=self.process_details["cwd"],
                env=self.process_details["env"],
                start_new_session=True,
                preexec_fn=die_with_parent(),
            )
        except OSError as error:
            runner.output.error(name, f"exception occurred while executing process: {error}")
            runner.record.add("failed", process=name, cmd=cmd, error=str(error), **self.facts)
            return False
        self._started_s = time.monotonic()
        self._sent = []
        self.process_details["pid"] = pid = self._process.get_pid()
        runner.groups.append(pid)
        runner.output.info(name, f"process started with pid [{pid}]")
        runner.record.add("started", process=name, pid=pid, cmd=cmd, **self.facts)
        self._event(events.ProcessStarted)
        return True

    # -- ending ----------------------------------------------------------------------------------------------------
    async def _end(self) -> None:
        """Wait for the process to end, insist once the launch ends, and report how it ended."""
        ended = asyncio.ensure_future(self._watched.ended.wait())
        stopped = asyncio.ensure_future(self._stop.wait())
        await asyncio.wait({ended, stopped}, return_when=asyncio.FIRST_COMPLETED)
        stopped.cancel()
        name = self.process_details["name"]
        for number, stronger, limit_s in (
            (signal.SIGINT, signal.SIGTERM, self._limits_s[0]),
            (signal.SIGTERM, signal.SIGKILL, self._limits_s[1]),
        ):
            if not ended.done():
                self._signal(number)
                await asyncio.wait({ended}, timeout=limit_s)
            if ended.done():
                break
            self._context.runner.output.error(
                name,
                f"process[{name}] failed to terminate '{limit_s:g}' seconds after receiving '{number.name}', "
                f"escalating to '{stronger.name}'",
            )
        else:
            self._signal(signal.SIGKILL)
        await ended
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self._watched.silent.wait(), _LAST_WORDS_S)
        self._report()

    def _signal(self, number: _Signals) -> None:
        """Send the process a signal if it is running; SIGINT goes to its whole group, as Ctrl-C in a terminal does.

        A node below `ros2 run` or a shell would not hear of it otherwise: those wait for their child to end.
        """
        if self._process.get_returncode() is not None:
            return
        name = self.process_details["name"]
        self._context.runner.output.info(name, f"sending signal '{number.name}' to process[{name}]")
        self._sent.append(number.name)
        if number is signal.SIGINT:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.get_pid(), number)
        else:
            self._process.send_signal(number)

    def _report(self) -> None:
        """Report how the process ended."""
        runner, name, pid = self._context.runner, self.process_details["name"], self.process_details["pid"]
        code = self._process.get_returncode() or 0
        if code == 0:
            runner.output.info(name, f"process has finished cleanly [pid {pid}]")
        else:
            cmd = " ".join(self.process_details["cmd"])
            runner.output.error(name, f"process has died [pid {pid}, exit code {code}, cmd '{cmd}'].")
        runner.record.add(
            "ended",
            process=name,
            pid=pid,
            exit_code=code if code >= 0 else None,
            signal=_Signals(-code).name if code < 0 else None,
            sent=self._sent,
            ran_s=round(time.monotonic() - self._started_s, 3),
        )
        self._event(events.ProcessExited, returncode=code)


def _pairs(mapping: Mapping[Any, Any]) -> list[tuple[list[Substitution], list[Substitution]]]:
    return [(substitutions(name), substitutions(value)) for name, value in mapping.items()]


class _Watched(asyncio.SubprocessProtocol):
    """Cuts what a process writes into lines, passes them on, and tells when it has ended and when all is read."""

    def __init__(self, written: Callable[[bool, list[str]], None]) -> None:
        self.ended, self.silent = asyncio.Event(), asyncio.Event()
        self._written = written
        self._rest = {1: b"", 2: b""}  # the line that has no end yet, by the file descriptor

    def pipe_data_received(self, fd: int, data: bytes) -> None:
        *lines, self._rest[fd] = (self._rest[fd] + data).split(b"\n")
        self._written(fd == 2, [line.decode(errors="replace").rstrip("\r") for line in lines])

    def pipe_connection_lost(self, fd: int, _error: Exception | None) -> None:
        if self._rest.get(fd):
            self.pipe_data_received(fd, b"\n")
        self._rest.pop(fd, None)
        if not self._rest:
            self.silent.set()

    def process_exited(self) -> None:
        self.ended.set()
