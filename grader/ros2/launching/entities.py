"""The state of a launch, and the parts of its description: descriptions, actions, conditions and substitutions."""

from __future__ import annotations

import asyncio
import os
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, MutableMapping, Sequence
from types import SimpleNamespace
from typing import Any

from .errors import InvalidConditionExpressionError, caller

Entities = Sequence["LaunchDescriptionEntity"]


class LaunchContext:
    """The state of one launch. Configurations are one flat dictionary; only a group restores them afterwards."""

    environment: MutableMapping[str, str] = os.environ  # that processes inherit: this process's own
    asyncio_loop: asyncio.AbstractEventLoop
    runner: Any = None  # the service that runs this context, with the output, the record and the counter

    def __init__(self) -> None:
        self.launch_configurations: dict[str, Any] = {}
        self.locals = SimpleNamespace()  # has the event that is being handled
        self.is_shutdown = False
        self.events: asyncio.Queue[Any] = asyncio.Queue()  # None: look whether anything is left to wait for
        self.handlers: deque[Any] = deque()

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


# -- substitutions ------------------------------------------------------------------------------------------------
class Substitution:
    """A text that is known only when it is used.

    `shown` is what `--show-args` prints of it, with the names of the attributes that are described in their turn.
    """

    shown = ""

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        raise NotImplementedError

    def describe(self) -> str:
        """Return the substitution as `--show-args` prints it."""
        parts = {name: describe(value) for name, value in vars(self).items() if f"{{{name}}}" in self.shown}
        return self.shown.format(**parts) or f"{type(self).__name__}()"


SomeSubstitutionsType = str | Substitution | Iterable[str | Substitution]


class TextSubstitution(Substitution):
    """A text known beforehand."""

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f"TextSubstitution expected Text object got '{type(text)}' instead.")
        self.text = text

    def perform(self, context: LaunchContext) -> str:  # noqa: ARG002 - as every substitution
        return self.text

    def describe(self) -> str:
        return f"'{self.text}'"


def substitutions(value: Any) -> list[Substitution]:
    """Return a list of substitutions from a text, a substitution, or several of them.

    Raises:
        TypeError: it is something else, such as a Path or a list in a list: the real launch refuses it in these words.
    """
    if not isinstance(value, Iterable | Substitution):
        raise TypeError(f"'{type(value).__name__}' object is not iterable: {_instead(value)}")
    items = [value] if isinstance(value, str | Substitution) else list(value)
    for item in items:
        if not isinstance(item, str | Substitution):
            raise TypeError(
                f"Failed to normalize given item of type '{type(item)}', when only 'str' or 'launch.Substitution' were "
                f"expected: {_instead(item)}"
            )
    return [TextSubstitution(text=item) if isinstance(item, str) else item for item in items]


def _instead(value: Any) -> str:
    """Return what to write in place of a value that is not text."""
    if isinstance(value, list | tuple):
        return "put its parts into the list around it"
    return f"write str(…) around {value!r}" if value is not None else "leave it out, or write a text"


def perform(context: LaunchContext, value: Any) -> str:
    """Return the current text of a value; several parts are joined."""
    return "".join(one.perform(context) for one in substitutions(value))


def perform_alone(parts: Any) -> str | None:
    """Return the text that a value has where no configuration is set, None if it has none there."""
    try:
        return perform(LaunchContext(), parts)
    except Exception:
        return None


def describe(value: Any) -> str:
    """Return a value as `--show-args` prints it."""
    return " + ".join(one.describe() for one in substitutions(value))


def is_substitution(value: Any) -> bool:
    """Return whether `value` is a substitution, or a list of substitutions and texts that gives one text."""
    if isinstance(value, Substitution):
        return True
    return (
        isinstance(value, Collection)
        and all(isinstance(one, str | Substitution) for one in value)
        and any(isinstance(one, Substitution) for one in value)
    )


# -- conditions ---------------------------------------------------------------------------------------------------
def truth(context: LaunchContext, expression: SomeSubstitutionsType) -> bool:
    """Return the truth value of a text: true, false, 1 or 0, in upper or lower case."""
    text = perform(context, expression)
    value = {"true": True, "1": True, "false": False, "0": False}.get(text.strip().lower())
    if value is None:
        raise InvalidConditionExpressionError(
            f"invalid condition expression, expected one of [true, 1, false, 0] but got '{text}'"
        )
    return value


class Condition:
    """A condition of an action, evaluated right before the action would run."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool]) -> None:
        self.predicate = predicate

    def evaluate(self, context: LaunchContext) -> bool:
        """Return whether the condition holds now."""
        return bool(self.predicate(context))


class IfCondition(Condition):
    """Holds if the expression is true."""

    wanted = True

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        expression = substitutions(predicate_expression)
        super().__init__(predicate=lambda context: truth(context, expression) is self.wanted)


class UnlessCondition(IfCondition):
    """Holds if the expression is false."""

    wanted = False


class LaunchConfigurationEquals(Condition):
    """Holds if a configuration has this value; `None` means that it is not set."""

    def __init__(self, launch_configuration_name: str, expected_value: SomeSubstitutionsType | None) -> None:
        expected = None if expected_value is None else substitutions(expected_value)

        def holds(context: LaunchContext) -> bool:
            wanted = None if expected is None else perform(context, expected)
            return bool(context.launch_configurations.get(launch_configuration_name) == wanted)

        super().__init__(predicate=holds)


class LaunchConfigurationNotEquals(LaunchConfigurationEquals):
    """Holds if a configuration has another value, or none."""

    def evaluate(self, context: LaunchContext) -> bool:
        """Return whether it holds now."""
        return not super().evaluate(context)


# -- entities -----------------------------------------------------------------------------------------------------
class LaunchDescriptionEntity:
    """Anything that a launch description can hold."""

    condition: Any = None

    def __init__(self) -> None:
        self.place = caller()

    def visit(self, context: LaunchContext) -> Entities | None:
        """Run the entity and return the entities to visit next, depth first."""
        raise NotImplementedError

    def get_asyncio_future(self) -> asyncio.Future[Any] | None:
        """Return a future that is done when the entity has finished, or None if it already has."""
        return None

    def describe_sub_entities(self) -> Entities:
        """Return the entities that are certain to be visited next."""
        return []

    def describe_conditional_sub_entities(self) -> Entities:
        """Return the entities that may be visited later."""
        return []

    def declared_arguments(self, conditional: bool = False) -> Iterator[tuple[Any, bool]]:
        """Yield the arguments declared here and below, each with whether that depends on a condition."""
        conditional = conditional or self.condition is not None
        for entity in self.describe_sub_entities():
            yield from entity.declared_arguments(conditional)
        for entity in self.describe_conditional_sub_entities():
            yield from entity.declared_arguments(True)


class LaunchDescription(LaunchDescriptionEntity):
    """A list of entities in the order in which they are visited."""

    def __init__(self, initial_entities: Iterable[LaunchDescriptionEntity] | None = None) -> None:
        super().__init__()
        self.entities = list(initial_entities or [])

    def visit(self, context: LaunchContext) -> Entities:  # noqa: ARG002 - as every entity
        return self.entities

    def describe_sub_entities(self) -> Entities:
        return self.entities

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        """Add one at the end."""
        self.entities.append(entity)

    add_action = add_entity


class Action(LaunchDescriptionEntity):
    """Something to do, if its condition holds when its turn comes."""

    def __init__(self, *, condition: Any = None) -> None:
        super().__init__()
        self.condition = condition

    def describe(self) -> str:
        return f"{type(self).__name__}()"

    def visit(self, context: LaunchContext) -> Entities | None:
        """Execute the action if its condition holds."""
        if self.condition is not None and not self.condition.evaluate(context):
            return None
        return self.execute(context)

    def execute(self, context: LaunchContext) -> Entities | None:  # noqa: ARG002 - for subclasses
        """Execute the action and return the entities to visit next."""
        return None
