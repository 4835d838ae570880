"""Start a process, pass on its output, report how it ended, and end it: SIGINT, then SIGTERM, then SIGKILL."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import shlex
import signal
import subprocess
import time
from collections.abc import Iterable, Mapping
from functools import partial
from signal import Signals as _Signals
from typing import Any

from . import events, forked, typed
from .context import LaunchContext
from .entities import Action, Entities, SomeSubstitutionsType, Substitution, perform, substitutions, truth
from .errors import LaunchError
from .event_handling import EventHandler, OnProcessExit, OnShutdown
from .guard import die_with_parent
from .output import LineReader, routes
from .substitutions import LaunchConfiguration

TIMEOUT_S = 5.0  # how long each signal has to work before the next one, as in the real launch


class ExecuteProcess(Action):
    """A process, given as the words of its command."""

    def __init__(
        self,
        *,
        cmd: Iterable[SomeSubstitutionsType],
        prefix: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        cwd: SomeSubstitutionsType | None = None,
        env: Mapping[Any, Any] | None = None,
        additional_env: Mapping[Any, Any] | None = None,
        shell: bool = False,
        sigterm_timeout: Any = None,
        sigkill_timeout: Any = None,
        emulate_tty: Any = False,
        output: Any = "log",
        output_format: str = "[{this.process_description.final_name}] {line}",
        cached_output: bool = False,  # noqa: ARG002 - accepted; launch files cannot ask for the text here
        log_cmd: bool = False,
        on_exit: Any = None,
        respawn: Any = False,
        respawn_delay: float | None = None,
        respawn_max_retries: int = -1,
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        self.cmd = [substitutions(word) for word in cmd]
        self.prefix, self.label, self.cwd = (None if x is None else substitutions(x) for x in (prefix, name, cwd))
        self.env, self.additional_env = (None if x is None else _pairs(x) for x in (env, additional_env))
        self.shell, self.output_format, self.log_cmd, self.emulate_tty = shell, output_format, log_cmd, emulate_tty
        self.output = output if isinstance(output, dict) else substitutions(output)
        self.timeouts = [
            substitutions(LaunchConfiguration(f"{name}_timeout", default=TIMEOUT_S) if limit is None else limit)
            for name, limit in (("sigterm", sigterm_timeout), ("sigkill", sigkill_timeout))
        ]
        self.on_exit = on_exit
        self.respawn = typed.given(respawn, bool)
        self.respawn_delay_s, self.respawn_max_retries = respawn_delay, respawn_max_retries
        self.process_details: dict[str, Any] = {}
        self.facts: dict[str, Any] = {}  # what the record says of the process besides its command
        self._context: LaunchContext | None = None
        self._process: subprocess.Popen[bytes] | forked.Forked | None = None
        self._done: asyncio.Future[None] | None = None
        self._timers: list[asyncio.TimerHandle] = []
        self._handlers: list[EventHandler] = []
        self._readers: list[LineReader] = []
        self._sent: list[str] = []
        self._stopping = False
        self._restarts = 0
        self._started_s = 0.0

    @property
    def name(self) -> Any:
        """The label with its number, once the process is known."""
        return self.process_details.get("name")

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        return self._done

    # -- starting --------------------------------------------------------------------------------------------------
    def command(self, context: LaunchContext) -> list[str]:
        """Return the command's current words, without the prefix."""
        return [perform(context, word) for word in self.cmd]

    def _prefixed(self, context: LaunchContext, cmd: list[str]) -> list[str]:
        """Return the command behind its prefix."""
        return cmd if self.prefix is None else [*shlex.split(perform(context, self.prefix)), *cmd]

    def _environment(self, context: LaunchContext) -> dict[str, str]:
        """Return the environment to run in."""
        found = dict(context.environment) if self.env is None else {}
        for name, value in [*(self.env or ()), *(self.additional_env or ())]:
            found[perform(context, name)] = perform(context, value)
        return found

    def execute(self, context: LaunchContext) -> Entities | None:
        """Settle command and environment now; the process starts after the whole description has been visited."""
        if self._done is not None:
            raise LaunchError(f"{type(self).__name__} action '{self.describe()}': executed more than once")
        if context.is_shutdown:
            return None
        self._context = context
        cmd = self._prefixed(context, self.command(context))
        base = os.path.basename(cmd[0]) if self.label is None else perform(context, self.label)  # noqa: PTH119 - text
        self.process_details = {
            "name": f"{base}-{context.runner.next_number()}",
            "cmd": cmd,
            "cwd": None if self.cwd is None else perform(context, self.cwd),
            "env": self._environment(context),
            "pid": 0,
        }
        self._routes = routes(self.output if isinstance(self.output, dict) else perform(context, self.output))
        everywhere = context.launch_configurations.get("emulate_tty")
        self._tty = bool(self.emulate_tty) if everywhere is None else truth(context, everywhere)
        self._respawns = typed.performed(context, self.respawn, bool)
        self._limits_s = [float(perform(context, limit)) for limit in self.timeouts]
        assert context.asyncio_loop is not None
        self._done = context.asyncio_loop.create_future()
        self._register(context)
        context.asyncio_loop.call_soon(self._start)
        return None

    def _register(self, context: LaunchContext) -> None:
        self._handlers = [OnShutdown(on_shutdown=lambda *_: self.stop())]
        if self.on_exit is not None:
            self._handlers.append(OnProcessExit(target_action=self, on_exit=self.on_exit))
        for handler in self._handlers:
            context.register_event_handler(handler)

    def _event(self, kind: type[Any], **more: Any) -> None:
        assert self._context is not None
        self._context.emit_event_sync(kind(action=self, **self.process_details, **more))

    def _start(self) -> None:
        context = self._context
        assert context is not None
        assert context.asyncio_loop is not None
        if context.is_shutdown or self._stopping:
            self._finish()
            return
        runner, name, cmd = context.runner, self.process_details["name"], self.process_details["cmd"]
        ours, theirs = _channels(self._tty)
        if self.log_cmd:
            runner.output.info(name, f"process details: cmd='{' '.join(cmd)}', cwd='{self.process_details['cwd']}'")
        try:
            self._process = self._started(cmd, theirs)
        except OSError as error:
            for fd in (*ours, *theirs):
                os.close(fd)
            runner.output.error(name, f"exception occurred while executing process: {error}")
            runner.record.add("failed", process=name, cmd=cmd, error=str(error), **self.facts)
            self._finish()
            return
        for fd in theirs:
            os.close(fd)
        self._started_s = time.monotonic()
        self._sent = []
        self.process_details["pid"] = self._process.pid
        runner.guard.group(self._process.pid)
        runner.watch(self)
        self._readers = [reader for reader in self._readers if not reader.closed]
        for fd, channel in zip(ours, ("stdout", "stderr"), strict=True):
            self._readers.append(LineReader(fd, context.asyncio_loop, partial(self._written, channel)))
        runner.output.info(name, f"process started with pid [{self._process.pid}]")
        runner.record.add("started", process=name, pid=self._process.pid, cmd=cmd, **self.facts)
        self._event(events.ProcessStarted)

    def _started(self, cmd: list[str], streams: tuple[int, int]) -> subprocess.Popen[bytes] | forked.Forked:
        environment, cwd = self.process_details["env"], self.process_details["cwd"]
        if not (self.shell or self._tty) and (process := forked.start(cmd, environment, cwd, *streams)):
            return process
        return subprocess.Popen(
            " ".join(cmd) if self.shell else cmd,
            shell=self.shell,
            cwd=cwd,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=streams[0],
            stderr=streams[1],
            start_new_session=True,
            preexec_fn=die_with_parent(),
        )

    def _written(self, channel: str, text: bytes, lines: list[str]) -> None:
        """Pass on what the process has written."""
        assert self._context is not None
        name = self.process_details["name"]
        self._context.runner.output.lines(name, channel, self._routes, lines, self.output_format)
        if text:
            kind, fd = (events.ProcessStdout, 1) if channel == "stdout" else (events.ProcessStderr, 2)
            self._event(kind, text=text, fd=fd)

    # -- ending ----------------------------------------------------------------------------------------------------
    def signal(self, number: _Signals) -> None:
        """Send the process a signal if it is running; SIGINT goes to its whole group, as Ctrl-C in a terminal does.

        A node below `ros2 run` or a shell would not hear of it otherwise: those wait for their child to end.
        """
        if self._process is None or self._process.returncode is not None or self._process.poll() is not None:
            return
        assert self._context is not None
        name = self.process_details["name"]
        self._context.runner.output.info(name, f"sending signal '{number.name}' to process[{name}]")
        self._sent.append(number.name)
        if number is signal.SIGINT:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)
        else:
            self._process.send_signal(number)

    def stop(self) -> None:
        """Ask the process to end; insist after each time limit. A second call does nothing."""
        if self._stopping:
            return
        self._stopping = True
        if self._process is None or self._process.returncode is not None:
            self._cancel_timers()
            if self._restarts:  # waiting for its next start
                self._finish()
            return
        self.signal(signal.SIGINT)
        self._insist("SIGINT", [(signal.SIGTERM, self._limits_s[0]), (signal.SIGKILL, self._limits_s[1])])

    def _insist(self, last: str, steps: list[tuple[_Signals, float]]) -> None:
        assert self._context is not None
        loop, output = self._context.asyncio_loop, self._context.runner.output
        assert loop is not None
        if not steps:
            return
        (number, limit_s), *later = steps

        def act() -> None:
            name = self.process_details["name"]
            output.error(
                name,
                f"process[{name}] failed to terminate '{limit_s:g}' seconds after receiving '{last}', "
                f"escalating to '{number.name}'",
            )
            self.signal(number)
            self._insist(number.name, later)

        self._timers.append(loop.call_later(limit_s, act))

    def _cancel_timers(self) -> None:
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()

    def poll(self) -> bool:
        """Return whether the process has ended; if so, report it, and start the process again if it respawns."""
        process, context = self._process, self._context
        if process is None or context is None or process.poll() is None:
            return False
        self._cancel_timers()
        for reader in self._readers:
            reader.drain()
        if process.stdin is not None:
            process.stdin.close()
        code, runner, name = process.poll() or 0, context.runner, self.process_details["name"]
        if code == 0:
            runner.output.info(name, f"process has finished cleanly [pid {process.pid}]")
        else:
            cmd = " ".join(self.process_details["cmd"])
            runner.output.error(name, f"process has died [pid {process.pid}, exit code {code}, cmd '{cmd}'].")
        runner.record.add(
            "ended",
            process=name,
            pid=process.pid,
            exit_code=code if code >= 0 else None,
            signal=_Signals(-code).name if code < 0 else None,
            sent=self._sent,
            ran_s=round(time.monotonic() - self._started_s, 3),
        )
        self._event(events.ProcessExited, returncode=code)
        self._again_or_finish(context)
        return True

    def _again_or_finish(self, context: LaunchContext) -> None:
        again = self._respawns and not self._stopping and not context.is_shutdown
        if again and (self.respawn_max_retries < 0 or self._restarts < self.respawn_max_retries):
            self._restarts += 1
            assert context.asyncio_loop is not None
            self._timers.append(context.asyncio_loop.call_later(self.respawn_delay_s or 0.0, self._start))
        else:
            self._finish()

    def _finish(self) -> None:
        """Declare the action over, once the events about its end have been handled."""
        context, done = self._context, self._done
        assert context is not None
        assert done is not None

        def over() -> None:
            if not done.done():
                done.set_result(None)
            for handler in self._handlers:
                context.unregister_event_handler(handler)
            context.wake()

        context.runner.after_events(over)


def _pairs(mapping: Mapping[Any, Any]) -> list[tuple[list[Substitution], list[Substitution]]]:
    return [(substitutions(name), substitutions(value)) for name, value in mapping.items()]


def _channels(tty: bool) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return our ends and the process's ends of its stdout and stderr."""
    (out_r, out_w), (err_r, err_w) = (pty.openpty(), pty.openpty()) if tty else (os.pipe(), os.pipe())
    return (out_r, err_r), (out_w, err_w)
