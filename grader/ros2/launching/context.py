"""The state that the actions of one launch share: configurations, environment, event queue and handlers."""

from __future__ import annotations

import asyncio
import os
from collections import deque
from collections.abc import Iterable, Mapping, MutableMapping
from types import SimpleNamespace
from typing import Any


class LaunchContext:
    """The state of one launch. Configurations are one flat dictionary; only a group restores them afterwards."""

    def __init__(self, *, argv: Iterable[str] | None = None, noninteractive: bool = False) -> None:
        self.argv = list(argv or [])
        self.noninteractive = noninteractive
        self.launch_configurations: dict[str, Any] = {}
        self.is_shutdown = False
        self.asyncio_loop: asyncio.AbstractEventLoop | None = None
        self.events: deque[Any] = deque()
        self.handlers: deque[Any] = deque()
        self.runner: Any = None  # the service that runs this context, with the output, the record and the counter
        self._locals: dict[str, Any] = {}
        self._locals_stack: list[dict[str, Any]] = []
        self.first_environment = dict(os.environ)
        self._wake: asyncio.Event | None = None

    # -- values that live as long as the entity being visited -----------------------------------------------------
    @property
    def locals(self) -> SimpleNamespace:
        """The current local values, such as the event being handled or the launch file being read."""
        return SimpleNamespace(**self._locals)

    def get_locals_as_dict(self) -> dict[str, Any]:
        """Return a copy of the locals."""
        return dict(self._locals)

    def extend_locals(self, extension: dict[str, Any]) -> None:
        """Set some locals."""
        self._locals.update(extension)

    def push_locals(self) -> None:
        """Save the locals."""
        self._locals_stack.append(dict(self._locals))

    def pop_locals(self) -> None:
        """Restore the locals saved last."""
        self._locals = self._locals_stack.pop()

    # -- configurations and environment ---------------------------------------------------------------------------
    @property
    def environment(self) -> MutableMapping[str, str]:
        """The environment that processes inherit: this process's own."""
        return os.environ

    def restore(self, configurations: Mapping[str, Any], environment: Mapping[str, str]) -> None:
        """Set configurations and environment to these."""
        configurations = dict(configurations)
        self.launch_configurations.clear()
        self.launch_configurations.update(configurations)
        for name in os.environ.keys() - environment.keys():
            del os.environ[name]
        os.environ.update(environment)

    def perform_substitution(self, substitution: Any) -> str:
        """Return the substitution's current text."""
        return str(substitution.perform(self))

    # -- events ---------------------------------------------------------------------------------------------------
    def register_event_handler(self, handler: Any) -> None:
        """Ask the handler about every further event, before those registered earlier."""
        self.handlers.appendleft(handler)

    def unregister_event_handler(self, handler: Any) -> None:
        """Stop asking the handler about events."""
        if handler in self.handlers:
            self.handlers.remove(handler)

    def emit_event_sync(self, event: Any) -> None:
        """Queue an event."""
        self.events.append(event)
        self.wake()

    def would_handle_event(self, event: Any) -> bool:
        """Return whether some handler is waiting for such an event."""
        return any(handler.matches(event) for handler in self.handlers)

    def wake(self) -> None:
        """Tell the service to look again: an event has arrived or something has ended."""
        if self._wake is not None:
            self._wake.set()

    async def awake(self) -> None:
        """Wait for a call of `wake`; return at once if there has been one since the last wait."""
        if self._wake is None:
            self._wake = asyncio.Event()
            return
        await self._wake.wait()
        self._wake.clear()
