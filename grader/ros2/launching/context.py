"""The state that the actions of one launch share: configurations, environment, event queue and handlers."""

from __future__ import annotations

import asyncio
import os
from collections import deque
from collections.abc import Mapping, MutableMapping
from types import SimpleNamespace
from typing import Any


class LaunchContext:
    """The state of one launch. Configurations are one flat dictionary; only a group restores them afterwards."""

    environment: MutableMapping[str, str] = os.environ
    """The environment that processes inherit: this process's own."""
    asyncio_loop: asyncio.AbstractEventLoop
    runner: Any = None
    """The service that runs this context, with the output, the record and the counter."""

    def __init__(self) -> None:
        self.launch_configurations: dict[str, Any] = {}
        self.locals = SimpleNamespace()
        """The current local values, such as the event being handled or the launch file being read."""
        self.is_shutdown = False
        self.events: asyncio.Queue[Any] = asyncio.Queue()
        """A None among them makes the service look whether anything is left to wait for."""
        self.handlers: deque[Any] = deque()
        self.first_environment = dict(os.environ)

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

    def register_event_handler(self, handler: Any) -> None:
        """Ask the handler about every further event, before those registered earlier."""
        self.handlers.appendleft(handler)

    def unregister_event_handler(self, handler: Any) -> None:
        """Stop asking the handler about events."""
        if handler in self.handlers:
            self.handlers.remove(handler)

    def emit_event_sync(self, event: Any) -> None:
        """Queue an event."""
        self.events.put_nowait(event)
