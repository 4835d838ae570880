"""Conditions of actions; evaluated right before the action would run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .context import LaunchContext
from .entities import SomeSubstitutionsType, perform
from .errors import LaunchError


class InvalidConditionExpressionError(LaunchError):
    """The text of a condition is neither true nor false."""


def truth(context: LaunchContext, expression: SomeSubstitutionsType) -> bool:
    """Return the truth of a text: true, false, 1 or 0 in any case."""
    text = perform(context, expression)
    value = {"true": True, "1": True, "false": False, "0": False}.get(text.strip().lower())
    if value is None:
        raise InvalidConditionExpressionError(
            f"invalid condition expression '{text}': a condition is true, false, 1 or 0"
        )
    return value


class Condition:
    """A question about the context."""

    def __init__(self, *, predicate: Callable[[LaunchContext], bool]) -> None:
        self.predicate = predicate

    def evaluate(self, context: LaunchContext) -> bool:
        """Return the answer as of now."""
        return bool(self.predicate(context))


class IfCondition(Condition):
    """Holds when the expression is true."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        super().__init__(predicate=lambda context: truth(context, predicate_expression))


class UnlessCondition(Condition):
    """Holds when the expression is false."""

    def __init__(self, predicate_expression: SomeSubstitutionsType) -> None:
        super().__init__(predicate=lambda context: not truth(context, predicate_expression))


class LaunchConfigurationEquals(Condition):
    """Holds when a configuration has this value; `None` stands for one that is not set."""

    def __init__(self, launch_configuration_name: str, expected_value: SomeSubstitutionsType | None) -> None:
        super().__init__(predicate=lambda context: _is(context, launch_configuration_name, expected_value))


class LaunchConfigurationNotEquals(Condition):
    """Holds when a configuration has another value, or none."""

    def __init__(self, launch_configuration_name: str, expected_value: SomeSubstitutionsType | None) -> None:
        super().__init__(predicate=lambda context: not _is(context, launch_configuration_name, expected_value))


def _is(context: LaunchContext, name: str, expected: SomeSubstitutionsType | None) -> bool:
    value: Any = context.launch_configurations.get(name)
    return bool(value is None if expected is None else value == perform(context, expected))
