"""What a launch description is made of: descriptions, actions, substitutions, and how they are told from plain text."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import caller

if TYPE_CHECKING:
    from .context import LaunchContext
    from .state_actions import DeclareLaunchArgument

Entities = Sequence["LaunchDescriptionEntity"]


class Substitution:
    """A text that is known only when it is used."""

    # True where the text depends on no launch configuration and costs nothing to find.
    fixed = False

    def perform(self, context: LaunchContext) -> str:
        """Return the text."""
        raise NotImplementedError

    def describe(self) -> str:
        """Return how `--show-args` shows it."""
        return f"{type(self).__name__}()"


SomeSubstitutionsType = str | Path | Substitution | Iterable[str | Path | Substitution]


class TextSubstitution(Substitution):
    """A text known beforehand."""

    fixed = True

    def __init__(self, *, text: str) -> None:
        if not isinstance(text, str):
            raise TypeError(f"TextSubstitution expected Text object got '{type(text)}' instead.")
        self.text = text

    def perform(self, context: LaunchContext | None) -> str:  # noqa: ARG002 - as every substitution
        """Return the text."""
        return self.text

    def describe(self) -> str:
        """Return the text in quotes."""
        return f"'{self.text}'"


def substitutions(value: Any) -> list[Substitution]:
    """Return a list of substitutions from a text, a path, a substitution, or several of them."""
    if isinstance(value, str | Path):
        return [TextSubstitution(text=str(value))]
    if isinstance(value, Substitution):
        return [value]
    if isinstance(value, Iterable):
        return [one for item in value for one in substitutions(item)]
    raise TypeError(
        f"expected a text, a path, a substitution or a list of them, got {value!r} ({type(value).__name__})"
    )


def perform(context: LaunchContext, value: Any) -> str:
    """Return the text of a value as of now; several parts are put together."""
    return "".join(one.perform(context) for one in substitutions(value))


def describe(value: Any) -> str:
    """Return how `--show-args` shows a value."""
    return " + ".join(one.describe() for one in substitutions(value))


def is_substitution(value: Any) -> bool:
    """Return all that a launch file might have written as a text that is found later."""
    if isinstance(value, Substitution):
        return True
    return isinstance(value, Iterable) and not isinstance(value, str | bytes) and any(map(is_substitution, value))


class LaunchDescriptionEntity:
    """Something that a launch description may hold."""

    def __init__(self) -> None:
        self.place = caller()

    def visit(self, context: LaunchContext) -> Entities | None:
        """Do it, and return what is to be visited next, depth first."""
        raise NotImplementedError

    def get_asyncio_future(self) -> asyncio.Future[Any] | None:
        """Return what is done when the entity has finished, or nothing if it has already."""
        return None

    def describe_sub_entities(self) -> Entities:
        """Return what is certain to be visited next."""
        return []

    def describe_conditional_sub_entities(self) -> list[tuple[str, Entities]]:
        """Return what may be visited next, and when."""
        return []


class LaunchDescription(LaunchDescriptionEntity):
    """A list of entities in the order in which they are done."""

    def __init__(
        self, initial_entities: Iterable[LaunchDescriptionEntity] | None = None, *, deprecated_reason: str | None = None
    ) -> None:
        super().__init__()
        self.entities = list(initial_entities or [])
        self.deprecated_reason = deprecated_reason

    def visit(self, context: LaunchContext) -> Entities:  # noqa: ARG002 - as every entity
        """Return the entities."""
        return self.entities

    def describe_sub_entities(self) -> Entities:
        """Return the entities."""
        return self.entities

    def add_entity(self, entity: LaunchDescriptionEntity) -> None:
        """Add one at the end."""
        self.entities.append(entity)

    def add_action(self, action: Action) -> None:
        """Add an action at the end."""
        self.add_entity(action)

    def get_launch_arguments(self, conditional_inclusion: bool = False) -> list[DeclareLaunchArgument]:
        """Return the declared arguments, each name once, those of includes among them."""
        found: dict[str, DeclareLaunchArgument] = {}
        for argument, _ in declared(self.entities, conditional_inclusion):
            found.setdefault(argument.name, argument)
        return list(found.values())


def declared(entities: Entities, conditional: bool = False) -> Iterator[tuple[DeclareLaunchArgument, bool]]:
    """Yield the arguments that entities declare, and whether only under a condition."""
    from .state_actions import DeclareLaunchArgument

    for entity in entities:
        under = conditional or getattr(entity, "condition", None) is not None
        if isinstance(entity, DeclareLaunchArgument):
            entity.conditional = under
            yield entity, under
        yield from declared(entity.describe_sub_entities(), under)
        for _, inner in entity.describe_conditional_sub_entities():
            yield from declared(inner, True)


class Action(LaunchDescriptionEntity):
    """Something to do, if its condition holds when its turn comes."""

    def __init__(self, *, condition: Any = None) -> None:
        super().__init__()
        self.condition = condition

    def describe(self) -> str:
        """Return the name of the action."""
        return f"{type(self).__name__}()"

    def visit(self, context: LaunchContext) -> Entities | None:
        """Do it if the condition holds."""
        from .events import ExecutionComplete

        if self.condition is not None and not self.condition.evaluate(context):
            return None
        try:
            return self.execute(context)
        finally:
            event = ExecutionComplete(action=self)
            if context.would_handle_event(event):
                future = self.get_asyncio_future()
                if future is None:
                    context.emit_event_sync(event)
                else:
                    future.add_done_callback(lambda _: context.emit_event_sync(event))

    def execute(self, context: LaunchContext) -> Entities | None:  # noqa: ARG002 - for those below
        """Do it, and return what is to be visited next."""
        return None
