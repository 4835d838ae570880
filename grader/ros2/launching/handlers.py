"""Event handlers: what to do when something happens, in the state of that moment, not of the registration."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from . import events
from .entities import Action, Entities, LaunchDescriptionEntity

if TYPE_CHECKING:
    from .context import LaunchContext

Matcher = Callable[[events.Event], bool]
Reaction = Callable[[Any, "LaunchContext"], Any] | Iterable[LaunchDescriptionEntity] | LaunchDescriptionEntity | None


class EventHandler:
    """Entities to visit for the events that a matcher picks."""

    def __init__(self, *, matcher: Matcher, entities: Reaction = None, handle_once: bool = False) -> None:
        self.matcher = matcher
        self.entities = entities
        self.handle_once = handle_once
        self.handled = False

    def matches(self, event: events.Event) -> bool:
        """Say whether the handler waits for this event."""
        return not (self.handle_once and self.handled) and self.matcher(event)

    def handle(self, event: events.Event, context: LaunchContext) -> Entities:
        """Return what is to be visited now."""
        self.handled = True
        if self.handle_once:
            context.unregister_event_handler(self)
        return reaction(self.entities, event, context)

    def described(self) -> Entities:
        """Return the entities that are known beforehand."""
        return [] if callable(self.entities) else entity_list(self.entities)


def entity_list(found: Any) -> Entities:
    """Return entities as a list, from one, several or none."""
    if found is None:
        return []
    return [found] if isinstance(found, LaunchDescriptionEntity) else list(found)


def reaction(wanted: Reaction, event: events.Event, context: LaunchContext) -> Entities:
    """Return the entities that a handler's argument stands for; a callable is asked with event and context."""
    if callable(wanted) and not isinstance(wanted, LaunchDescriptionEntity):
        return entity_list(wanted(event, context))
    return entity_list(wanted)


def _of_action(kind: type[events.Event], target: Any, target_type: type = Action) -> Matcher:
    """Return a matcher of one kind of event of one action, of those that a function picks, or of all."""
    if target is not None and not callable(target) and not isinstance(target, target_type):
        raise TypeError(f"the target of an event handler is an action, got {target!r}")

    def matches(event: events.Event) -> bool:
        if not isinstance(event, kind):
            return False
        action = event.action  # type: ignore[attr-defined]  # both kinds used here have one
        if target is None:
            return True
        return bool(target(action)) if not isinstance(target, Action) else action is target

    return matches


class OnExecutionComplete(EventHandler):
    """Waits for an action to finish."""

    def __init__(self, *, target_action: Any = None, on_completion: Reaction = None, **rest: Any) -> None:
        super().__init__(matcher=_of_action(events.ExecutionComplete, target_action), entities=on_completion, **rest)


class OnProcessStart(EventHandler):
    """Waits for a process to start."""

    def __init__(self, *, target_action: Any = None, on_start: Reaction = None, **rest: Any) -> None:
        super().__init__(matcher=_of_action(events.ProcessStarted, target_action), entities=on_start, **rest)


class OnProcessExit(EventHandler):
    """Waits for a process to end."""

    def __init__(self, *, target_action: Any = None, on_exit: Reaction = None, **rest: Any) -> None:
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

    def __init__(self, *, on_shutdown: Reaction = None, **rest: Any) -> None:
        super().__init__(matcher=lambda event: isinstance(event, events.Shutdown), entities=on_shutdown, **rest)
