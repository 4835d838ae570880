"""Event handlers, and the actions of `launch.actions` that deal with events: timers, registering, emitting.

A handler runs in the state of the moment of its event, not of its registration.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Any

from . import events, typed
from .context import LaunchContext
from .entities import Action, Entities, LaunchDescriptionEntity, Substitution

Matcher = Callable[[events.Event], bool]
Reaction = Callable[[Any, LaunchContext], Any] | Iterable[LaunchDescriptionEntity] | LaunchDescriptionEntity | None


class EventHandler:
    """Entities to visit for the events that a matcher picks."""

    def __init__(self, *, matcher: Matcher, entities: Reaction = None, handle_once: bool = False) -> None:
        if isinstance(entities, Iterable):
            entities = list(entities)
            for one in entities:
                if not isinstance(one, LaunchDescriptionEntity):
                    raise TypeError(
                        "expected all items in 'on_event' iterable to be of type 'LaunchDescriptionEntity' "
                        f"but got '{type(one)}'"
                    )
        self.matcher = matcher
        self.entities = entities
        self.handle_once = handle_once
        self.handled = False

    def matches(self, event: events.Event) -> bool:
        """Return whether the handler is waiting for this event."""
        return not (self.handle_once and self.handled) and self.matcher(event)

    def handle(self, event: events.Event, context: LaunchContext) -> Entities:
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


def _of_action(kind: type[events.Event], target: Any) -> Matcher:
    """Return a matcher of one kind of event, for one action, for those that a function picks, or for all."""
    # An action that has finished may be any; the other events are about processes.
    fits = isinstance(target, Action) and (kind is events.ExecutionComplete or hasattr(target, "process_details"))
    if target is not None and not callable(target) and not fits:
        wanted = "Action" if kind is events.ExecutionComplete else "ExecuteLocal"
        raise TypeError(f"action_matcher must be an '{wanted}' instance or a callable, got {target!r}")

    def matches(event: events.Event) -> bool:
        if not isinstance(event, kind):
            return False
        action = event.action  # type: ignore[attr-defined]  # both kinds used here have one
        if target is None:
            return True
        return action is target if isinstance(target, Action) else bool(target(action))

    return matches


class OnExecutionComplete(EventHandler):
    """Waits for an action to finish."""

    def __init__(self, *, target_action: Any = None, on_completion: Reaction, **rest: Any) -> None:
        super().__init__(matcher=_of_action(events.ExecutionComplete, target_action), entities=on_completion, **rest)


class OnProcessStart(EventHandler):
    """Waits for a process to start."""

    def __init__(self, *, target_action: Any = None, on_start: Reaction, **rest: Any) -> None:
        super().__init__(matcher=_of_action(events.ProcessStarted, target_action), entities=on_start, **rest)


class OnProcessExit(EventHandler):
    """Waits for a process to end."""

    def __init__(self, *, target_action: Any = None, on_exit: Reaction, **rest: Any) -> None:
        super().__init__(matcher=_of_action(events.ProcessExited, target_action), entities=on_exit, **rest)


class OnProcessIO(EventHandler):
    """Waits for a process to write something."""

    def __init__(
        self,
        *,
        target_action: Any = None,
        on_stdin: Callable[[Any], Any] | None = None,
        on_stdout: Callable[[Any], Any] | None = None,
        on_stderr: Callable[[Any], Any] | None = None,
        **rest: Any,
    ) -> None:
        by_fd = {0: on_stdin, 1: on_stdout, 2: on_stderr}

        def react(event: events.ProcessIO, _context: LaunchContext) -> Any:
            wanted = by_fd[event.fd]
            return wanted(event) if wanted else None

        super().__init__(matcher=_of_action(events.ProcessIO, target_action), entities=react, **rest)


class OnShutdown(EventHandler):
    """Waits for the launch to end."""

    def __init__(self, *, on_shutdown: Reaction, **rest: Any) -> None:
        super().__init__(matcher=lambda event: isinstance(event, events.Shutdown), entities=on_shutdown, **rest)


class TimerAction(Action):
    """Runs its actions after a period in seconds, in the state of that moment."""

    def __init__(self, *, period: Any, actions: Iterable[Action], cancel_on_shutdown: Any = True, **rest: Any) -> None:
        super().__init__(**rest)
        if not isinstance(period, float | Iterable | Substitution):
            raise TypeError(
                "'TimerAction' expected 'period' to be one of [<class 'str'>, "
                "<class 'launch.substitution.Substitution'>, "
                f"<class 'collections.abc.Iterable'>, <class 'float'>], but got '{period}' of type '{type(period)}'"
                + (f": write {period}.0" if isinstance(period, int) else "")
            )
        self.period = typed.given(float(period) if isinstance(period, str) else period, float)
        self.actions, self.cancel_on_shutdown = list(actions), typed.given(cancel_on_shutdown, bool)
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
        period_s = typed.performed(context, self.period, float)
        self._done = done = loop.create_future()
        fired = EventHandler(
            matcher=lambda e: isinstance(e, events.TimerEvent) and e.timer_action is self,
            entities=self.actions,
            handle_once=True,
        )
        context.register_event_handler(fired)
        if typed.performed(context, self.cancel_on_shutdown, bool):
            context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self.cancel(), handle_once=True))

        def fire() -> None:
            context.emit_event_sync(events.TimerEvent(timer_action=self))
            if not done.done():
                done.set_result(None)

        self._handle = loop.call_later(period_s, fire)


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

    def __init__(self, *, event: events.Event, **rest: Any) -> None:
        super().__init__(**rest)
        if not isinstance(event, events.Event | type):
            raise RuntimeError(f"EmitEvent() expected an event instance, got '{event}'.")
        self.event = event

    def execute(self, context: LaunchContext) -> None:
        context.emit_event_sync(self.event)


class Shutdown(EmitEvent):
    """Ends the launch."""

    def __init__(self, *, reason: str = "reason not given", **rest: Any) -> None:
        super().__init__(event=events.Shutdown(reason=reason), **rest)

    def execute(self, context: LaunchContext) -> None:
        """End the launch, and say so if the end of a process is the occasion."""
        event = getattr(context.locals, "event", None)
        if isinstance(event, events.ProcessExited):
            said = f"process[{event.process_name}] was required: shutting down launched system"
            context.runner.output.info("launch", said)
        super().execute(context)
