"""The actions of `launch.actions` that have to do with events: timers, handlers, and making an event happen."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from . import events
from .entities import Action, Entities, perform
from .handlers import EventHandler, OnShutdown

if TYPE_CHECKING:
    from .context import LaunchContext


class TimerAction(Action):
    """Does its actions after a period in seconds, in the state that holds then."""

    def __init__(self, *, period: Any, actions: Iterable[Action], cancel_on_shutdown: Any = True, **rest: Any) -> None:
        super().__init__(**rest)
        self.period, self.actions, self.cancel_on_shutdown = period, list(actions), cancel_on_shutdown
        self._done: asyncio.Future[None] | None = None
        self._handle: asyncio.TimerHandle | None = None

    def describe_conditional_sub_entities(self) -> list[tuple[str, Entities]]:
        """Return the actions."""
        return [("after some time", self.actions)]

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        """Return what is done when the timer has fired or was cancelled."""
        return self._done

    def cancel(self) -> None:
        """Stop the timer before it fires."""
        if self._handle is not None:
            self._handle.cancel()
        if self._done is not None and not self._done.done():
            self._done.set_result(None)

    def execute(self, context: LaunchContext) -> None:
        """Start the timer."""
        if context.is_shutdown:
            return
        loop = context.asyncio_loop
        assert loop is not None
        plain = isinstance(self.period, int | float)
        period_s = float(self.period if plain else perform(context, self.period))
        self._done = done = loop.create_future()
        fired = EventHandler(
            matcher=lambda e: isinstance(e, events.TimerEvent) and e.timer_action is self,
            entities=self.actions,
            handle_once=True,
        )
        context.register_event_handler(fired)
        stop = self.cancel_on_shutdown
        if stop if isinstance(stop, bool) else perform(context, stop).lower() == "true":
            context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self.cancel(), handle_once=True))

        def fire() -> None:
            context.emit_event_sync(events.TimerEvent(timer_action=self))
            if not done.done():
                done.set_result(None)

        self._handle = loop.call_later(period_s, fire)


class RegisterEventHandler(Action):
    """Has an event handler asked from now on."""

    def __init__(self, event_handler: EventHandler, **rest: Any) -> None:
        super().__init__(**rest)
        self.event_handler = event_handler

    def describe_conditional_sub_entities(self) -> list[tuple[str, Entities]]:
        """Return what the handler would do."""
        return [("on an event", self.event_handler.described())]

    def execute(self, context: LaunchContext) -> None:
        """Register it."""
        context.register_event_handler(self.event_handler)


class UnregisterEventHandler(Action):
    """Has an event handler asked no more."""

    def __init__(self, event_handler: EventHandler, **rest: Any) -> None:
        super().__init__(**rest)
        self.event_handler = event_handler

    def execute(self, context: LaunchContext) -> None:
        """Take it away."""
        context.unregister_event_handler(self.event_handler)


class EmitEvent(Action):
    """Makes an event happen."""

    def __init__(self, *, event: events.Event, **rest: Any) -> None:
        super().__init__(**rest)
        self.event = event

    def execute(self, context: LaunchContext) -> None:
        """Queue it."""
        context.emit_event_sync(self.event)


class Shutdown(EmitEvent):
    """Ends the launch."""

    def __init__(self, *, reason: str = "reason not given", **rest: Any) -> None:
        super().__init__(event=events.Shutdown(reason=reason), **rest)

    def execute(self, context: LaunchContext) -> None:
        """End it, and say so where a process's end is the occasion."""
        event = context.get_locals_as_dict().get("event")
        if isinstance(event, events.ProcessExited):
            said = f"process[{event.process_name}] was required: shutting down launched system"
            context.runner.output.info("launch", said)
        super().execute(context)
