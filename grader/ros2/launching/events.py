"""Events of a launch, their handlers, and the actions of `launch.actions` that deal with them.

A handler runs in the state of the moment of its event, not of its registration.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Any

from .entities import (
    Action,
    Entities,
    LaunchContext,
    LaunchDescriptionEntity,
    SomeSubstitutionsType,
    perform,
    substitutions,
)


# -- events -----------------------------------------------------------------------------------------------------------
class Event:
    """Something that happened."""


class ShutdownEvent(Event):
    """The launch is to end: `Shutdown` of launch.events."""

    def __init__(self, *, reason: str = "reason not given", due_to_sigint: bool = False) -> None:
        self.reason, self.due_to_sigint = reason, due_to_sigint


class TimerEvent(Event):
    """A timer's period is over."""

    def __init__(self, *, timer_action: Any) -> None:
        self.timer_action = timer_action


class RunningProcessEvent(Event):
    """Something happened to a process that was started by `action`."""

    def __init__(
        self, *, action: Any, name: str, cmd: list[str], cwd: str | None = None, env: Any = None, pid: int = 0
    ) -> None:
        self.action = self.execute_process_action = action
        self.process_name, self.cmd, self.cwd, self.env, self.pid = name, cmd, cwd, env, pid


class ProcessStarted(RunningProcessEvent):
    """A process has been started."""


class ProcessExited(RunningProcessEvent):
    """A process has ended; `returncode` is negative for a signal."""

    def __init__(self, *, returncode: int, **details: Any) -> None:
        super().__init__(**details)
        self.returncode = returncode


# -- handlers ---------------------------------------------------------------------------------------------------------
Reaction = Callable[[Any, LaunchContext], Any] | Iterable[LaunchDescriptionEntity] | LaunchDescriptionEntity | None


class EventHandler:
    """Entities to visit for the events that a matcher picks."""

    def __init__(
        self, *, matcher: Callable[[Event], bool], entities: Reaction = None, handle_once: bool = False
    ) -> None:
        if isinstance(entities, Iterable):
            entities = list(entities)
            for one in entities:
                if not isinstance(one, LaunchDescriptionEntity):
                    raise TypeError(
                        "expected all items in 'on_event' iterable to be of type 'LaunchDescriptionEntity' "
                        f"but got '{type(one)}'"
                    )
        self.matcher, self.entities, self.handle_once = matcher, entities, handle_once
        self.handled = False

    def matches(self, event: Event) -> bool:
        """Return whether the handler is waiting for this event."""
        return not (self.handle_once and self.handled) and self.matcher(event)

    def handle(self, event: Event, context: LaunchContext) -> Entities:
        """Return the entities to visit now; a callable is asked with event and context."""
        self.handled = True
        if self.handle_once:
            context.unregister_event_handler(self)
        found = self.entities
        return _listed(found(event, context) if callable(found) else found)

    def described(self) -> Entities:
        """Return the entities that are known beforehand."""
        return [] if callable(self.entities) else _listed(self.entities)


def _listed(found: Any) -> Entities:
    """Return entities as a list, from one, several or none."""
    if found is None:
        return []
    return [found] if isinstance(found, LaunchDescriptionEntity) else list(found)


class _OnProcess(EventHandler):
    """Waits for a kind of event about one process, those that a function picks, or all."""

    def __init__(self, kind: type[RunningProcessEvent], target: Any, entities: Reaction, **rest: Any) -> None:
        is_process = isinstance(target, Action) and hasattr(target, "process_details")
        if target is not None and not callable(target) and not is_process:
            raise TypeError(f"action_matcher must be an 'ExecuteLocal' instance or a callable, got {target!r}")

        def matches(event: Event) -> bool:
            if not isinstance(event, kind):
                return False
            return target is None or (event.action is target if is_process else bool(target(event.action)))

        super().__init__(matcher=matches, entities=entities, **rest)


class OnProcessStart(_OnProcess):
    """Waits for a process to start."""

    def __init__(self, *, target_action: Any = None, on_start: Reaction, **rest: Any) -> None:
        super().__init__(ProcessStarted, target_action, on_start, **rest)


class OnProcessExit(_OnProcess):
    """Waits for a process to end."""

    def __init__(self, *, target_action: Any = None, on_exit: Reaction, **rest: Any) -> None:
        super().__init__(ProcessExited, target_action, on_exit, **rest)


class OnShutdown(EventHandler):
    """Waits for the launch to end."""

    def __init__(self, *, on_shutdown: Reaction, **rest: Any) -> None:
        super().__init__(matcher=lambda event: isinstance(event, ShutdownEvent), entities=on_shutdown, **rest)


# -- actions ----------------------------------------------------------------------------------------------------------
class TimerAction(Action):
    """Runs its actions after a period in seconds, in the state of that moment."""

    def __init__(self, *, period: SomeSubstitutionsType | float, actions: Iterable[Action], **rest: Any) -> None:
        super().__init__(**rest)
        if isinstance(period, int):
            raise TypeError(
                "'TimerAction' expected 'period' to be one of [<class 'str'>, "
                "<class 'launch.substitution.Substitution'>, <class 'collections.abc.Iterable'>, <class 'float'>], "
                f"but got '{period}' of type '{type(period)}': write {period}.0"
            )
        self.period = substitutions(str(period) if isinstance(period, float) else period)
        self.actions = list(actions)
        self._done: asyncio.Future[None] | None = None
        self._handle: asyncio.TimerHandle | None = None

    def describe_conditional_sub_entities(self) -> Entities:
        return self.actions

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        return self._done

    def cancel(self) -> None:
        """Stop the timer before it fires."""
        if self._handle is not None:
            self._handle.cancel()
        if self._done is not None and not self._done.done():
            self._done.set_result(None)

    def execute(self, context: LaunchContext) -> None:
        if context.is_shutdown:
            return
        loop = context.asyncio_loop
        self._done = done = loop.create_future()
        fired = EventHandler(
            matcher=lambda e: isinstance(e, TimerEvent) and e.timer_action is self,
            entities=self.actions,
            handle_once=True,
        )
        context.register_event_handler(fired)
        context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self.cancel(), handle_once=True))

        def fire() -> None:
            context.emit_event_sync(TimerEvent(timer_action=self))
            if not done.done():
                done.set_result(None)

        self._handle = loop.call_later(float(perform(context, self.period)), fire)


class RegisterEventHandler(Action):
    """Registers an event handler."""

    def __init__(self, event_handler: EventHandler, **rest: Any) -> None:
        super().__init__(**rest)
        self.event_handler = event_handler

    def describe_conditional_sub_entities(self) -> Entities:
        return self.event_handler.described()

    def execute(self, context: LaunchContext) -> None:
        context.register_event_handler(self.event_handler)


class EmitEvent(Action):
    """Emits an event."""

    def __init__(self, *, event: Event, **rest: Any) -> None:
        super().__init__(**rest)
        if not isinstance(event, Event | type):
            raise RuntimeError(f"EmitEvent() expected an event instance, got '{event}'.")
        self.event = event

    def execute(self, context: LaunchContext) -> None:
        context.emit_event_sync(self.event)


class Shutdown(EmitEvent):
    """Ends the launch."""

    def __init__(self, *, reason: str = "reason not given", **rest: Any) -> None:
        super().__init__(event=ShutdownEvent(reason=reason), **rest)

    def execute(self, context: LaunchContext) -> None:
        """End the launch, and say so if the end of a process is the occasion."""
        event = getattr(context.locals, "event", None)
        if isinstance(event, ProcessExited):
            said = f"process[{event.process_name}] was required: shutting down launched system"
            context.runner.output.info("launch", said)
        super().execute(context)
