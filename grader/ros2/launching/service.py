"""Run launch descriptions: the queue of events, the signals, and the end."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import shutil
import signal
import tempfile
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from . import events
from .entities import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from .errors import explain
from .output import Output, Record

ENDING = (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


class LaunchService:
    """Runs descriptions until nothing is left running or waiting."""

    def __init__(self, *, record: Path | None = None) -> None:
        self.context = LaunchContext()
        self.output = Output()
        self.record = Record(record)
        self.groups: list[int] = []  # the process groups that were started
        self._descriptions: list[LaunchDescription] = []
        self.next_number = itertools.count(1).__next__  # of a process, counted over the whole launch
        self._pending: list[asyncio.Future[Any]] = []
        self._error: str | None = None
        self._signal: int | None = None
        self._folder: Path | None = None

    # -- for the processes -----------------------------------------------------------------------------------------
    def parameter_file(self, text: str) -> Path:
        """Write a temporary parameter file and return its path; it is removed when the launch ends."""
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="launch_params_"))
        path = self._folder / f"launch_params_{len(list(self._folder.iterdir()))}.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    # -- for the command -------------------------------------------------------------------------------------------
    def include_launch_description(self, launch_description: LaunchDescription) -> None:
        """Add a description to run."""
        self._descriptions.append(launch_description)

    def run(self) -> int:
        """Run everything and return the exit code: 1 for an error of the launch itself, else 0."""
        self.context.runner = self
        try:
            code = asyncio.run(self._run())
        finally:
            self._clear_away()
        self.record.add("launch_ended", exit_code=code, error=self._error)
        if self._signal is not None:  # the processes are gone: die of the signal, so that the parent sees it
            signal.signal(self._signal, signal.SIG_DFL)
            os.kill(os.getpid(), self._signal)
        return code

    def _clear_away(self) -> None:
        """Kill what processes have started and left, and remove the parameter files."""
        for group in self.groups:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(group, signal.SIGKILL)
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    # -- the loop --------------------------------------------------------------------------------------------------
    async def _run(self) -> int:
        context = self.context
        context.asyncio_loop = loop = asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGINT, self._interrupted)
        for number in ENDING:
            loop.add_signal_handler(number, self._terminated, number)
        for description in self._descriptions:
            self._guarded(partial(self._visit, description))
        context.emit_event_sync(None)
        while self._pending or not context.is_shutdown or not context.events.empty():
            if (event := await context.events.get()) is not None:
                self._guarded(partial(self._handle, event))
                await asyncio.sleep(0)  # let what was started start
            context.events.task_done()
            self._pending = [future for future in self._pending if not future.done()]
            if not (self._pending or context.is_shutdown) and context.events.empty():
                self._shut_down("idle")
        for number in (signal.SIGINT, *ENDING):
            loop.remove_signal_handler(number)
        return 1 if self._error is not None else 0

    def _handle(self, event: events.Event) -> None:
        context = self.context
        if isinstance(event, events.ShutdownEvent):
            if context.is_shutdown:
                return
            context.is_shutdown = True
        for handler in [handler for handler in context.handlers if handler.matches(event)]:
            before = context.locals
            context.locals = type(before)(**vars(before), event=event)
            try:
                for entity in handler.handle(event, context):
                    self._visit(entity)
            finally:
                context.locals = before

    def _visit(self, entity: LaunchDescriptionEntity) -> None:
        """Visit the entity and the entities that it returns, depth first."""
        try:
            found = entity.visit(self.context)
            future = entity.get_asyncio_future()
        except Exception as error:
            if not hasattr(error, "launch_place"):
                error.launch_place = getattr(entity, "place", None)  # type: ignore[attr-defined]  # read by `explain`
            raise
        if future is not None and not future.done():
            future.add_done_callback(lambda _: self.context.emit_event_sync(None))
            self._pending.append(future)
        for inner in found or ():
            self._visit(inner)

    def _guarded(self, step: Callable[[], None]) -> None:
        """Run code of a launch file; an error in it ends the launch, and the processes with it."""
        try:
            step()
        except Exception as error:
            self._error = explain(error)
            self.output.error("launch", f"Caught exception in launch (its traceback is in launch.log): {self._error}")
            self.output.debug("launch", traceback.format_exc())
            self._shut_down(f"Caught exception in launch: {self._error}")

    def _shut_down(self, reason: str, due_to_sigint: bool = False) -> None:
        self.context.emit_event_sync(events.ShutdownEvent(reason=reason, due_to_sigint=due_to_sigint))

    # -- signals ---------------------------------------------------------------------------------------------------
    def _interrupted(self) -> None:
        again = " again, ignoring..." if self.context.is_shutdown else ""
        self.output.warn("launch", f"user interrupted with ctrl-c (SIGINT){again}")
        if not again:
            self._shut_down("ctrl-c (SIGINT)", due_to_sigint=True)

    def _terminated(self, number: int) -> None:
        name = signal.Signals(number).name
        if self._signal is not None:  # the second time: no more patience
            self.output.error("launch", f"{name} again: killing every process")
            self._clear_away()
            os._exit(128 + number)
        self._signal = number
        self.output.warn("launch", f"{name}: ending every process")
        self._shut_down(name)
