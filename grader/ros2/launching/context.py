"""The state that a launch file's actions share: configurations, environment, event queue and handlers."""

from __future__ import annotations

import asyncio
import os
from collections import deque
from collections.abc import Iterable, MutableMapping
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .entities import Substitution
    from .events import Event
    from .handlers import EventHandler


class LaunchContext:
    """The state of one run. Configurations are one flat dictionary: only a group puts it back afterwards."""

    def __init__(self, *, argv: Iterable[str] | None = None, noninteractive: bool = False) -> None:
        self.argv = list(argv or [])
        self.noninteractive = noninteractive
        self.launch_configurations: dict[str, Any] = {}
        self.is_shutdown = False
        self.asyncio_loop: asyncio.AbstractEventLoop | None = None
        self.events: deque[Event] = deque()
        self.handlers: deque[EventHandler] = deque()
        self.runner: Any = None  # the service that runs this context; processes find output, record and counter there
        self._locals: dict[str, Any] = {}
        self._locals_stack: list[dict[str, Any]] = []
        self._configuration_stack: list[dict[str, Any]] = []
        self._environment_stack: list[dict[str, str]] = []
        self._first_environment = dict(os.environ)
        self._wake: asyncio.Event | None = None

    # -- values that live as long as the thing being visited ------------------------------------------------------
    @property
    def locals(self) -> SimpleNamespace:
        """The values that hold here, such as the event being handled or the launch file being read."""
        return SimpleNamespace(**self._locals)

    def get_locals_as_dict(self) -> dict[str, Any]:
        """Return a copy of the locals."""
        return dict(self._locals)

    def extend_locals(self, extension: dict[str, Any]) -> None:
        """Set some locals."""
        self._locals.update(extension)

    def push_locals(self) -> None:
        """Remember the locals."""
        self._locals_stack.append(dict(self._locals))

    def pop_locals(self) -> None:
        """Go back to the locals last remembered."""
        self._locals = self._locals_stack.pop()

    # -- configurations and environment ---------------------------------------------------------------------------
    @property
    def environment(self) -> MutableMapping[str, str]:
        """The environment that processes inherit: this process's own."""
        return os.environ

    def push_configurations(self) -> None:
        """Remember the configurations."""
        self._configuration_stack.append(dict(self.launch_configurations))

    def pop_configurations(self) -> None:
        """Go back to the configurations last remembered."""
        self.launch_configurations.clear()
        self.launch_configurations.update(self._configuration_stack.pop())

    def push_environment(self) -> None:
        """Remember the environment."""
        self._environment_stack.append(dict(os.environ))

    def pop_environment(self) -> None:
        """Go back to the environment last remembered."""
        _restore(self._environment_stack.pop())

    def reset_environment(self) -> None:
        """Go back to the environment that the launch started with."""
        _restore(self._first_environment)

    def perform_substitution(self, substitution: Substitution) -> str:
        """Return the substitution's text as of now."""
        return substitution.perform(self)

    # -- events ---------------------------------------------------------------------------------------------------
    def register_event_handler(self, handler: EventHandler, append: bool = False) -> None:
        """Have the handler asked about every further event; the one registered last is asked first."""
        (self.handlers.append if append else self.handlers.appendleft)(handler)

    def unregister_event_handler(self, handler: EventHandler) -> None:
        """Have the handler asked no more."""
        if handler in self.handlers:
            self.handlers.remove(handler)

    def emit_event_sync(self, event: Event) -> None:
        """Queue an event."""
        self.events.append(event)
        self.wake()

    async def emit_event(self, event: Event) -> None:
        """Queue an event."""
        self.emit_event_sync(event)

    def would_handle_event(self, event: Event) -> bool:
        """Say whether some handler waits for such an event."""
        return any(handler.matches(event) for handler in self.handlers)

    def wake(self) -> None:
        """Have the service look again: an event has come or something has ended."""
        if self._wake is not None:
            self._wake.set()

    async def awake(self) -> None:
        """Wait until `wake` is called, also if it was called since the last time."""
        if self._wake is None:
            self._wake = asyncio.Event()
            return
        await self._wake.wait()
        self._wake.clear()


def _restore(environment: dict[str, str]) -> None:
    for name in os.environ.keys() - environment.keys():
        del os.environ[name]
    os.environ.update(environment)
