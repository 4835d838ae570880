"""Values of a known type in a launch description: written as they are, or as substitutions that give their text.

What is accepted, and the words of a refusal, are those of launch 3.4.3.
"""

from __future__ import annotations

import typing
from collections.abc import Iterable
from typing import Any

import yaml

from .context import LaunchContext
from .entities import Substitution, is_substitution, perform, substitutions

SCALARS = (int, float, bool, str)


def _item(kind: Any) -> tuple[Any, bool]:
    """Return the type of a scalar, or of the items of a list type, and whether it is a list type."""
    items = typing.get_args(kind)
    return (items[0], True) if items else (kind, False)


def given(value: Any, kind: Any) -> Any:
    """Return a value for `performed`: a scalar, a list of substitutions, or a list of scalars and of such lists.

    Args:
        value: a scalar, a substitution (texts and substitutions in a list are one), or a list of these.
        kind: bool, int, float, str, a list type of one of them, or None for any.

    Raises:
        TypeError: the value is not of that type.
    """
    item, is_list = _item(kind)
    if isinstance(value, SCALARS):
        if kind is not None and (is_list or not isinstance(value, item)):
            raise TypeError(f"value='{value}' is not an instance of {kind}")
        return value
    if is_substitution(value):
        return substitutions(value)
    if not isinstance(value, Iterable):
        raise TypeError(
            "value should be either a scalar, a substitutions, or a mixed list of scalars and substitutions. "
            f"Got `value={value}` of type `{type(value)}`."
        )
    entries = list(value)
    if not all(isinstance(one, SCALARS) or is_substitution(one) for one in entries):
        raise TypeError(
            "value is a list, and one of the items is not a scalar, a Substitution or a list of substitutions. "
            f"Got value='{value}'"
        )
    if kind is not None and not is_list:
        raise TypeError(
            "The provided value resolves to a list, though the required type is a scalar. "
            f"Got value='{value}', data_type='{kind}'."
        )
    kinds = {type(one) for one in entries if isinstance(one, SCALARS)}
    if kinds == {int, float}:
        kinds = {float}
    if len(kinds) > 1:
        raise TypeError(f"Input value is not an acceptable 'SomeValueType'.Got value='{value}': mix no types in a list")
    found = kinds.pop() if kinds else None
    if found is not None and item not in (None, found):
        raise TypeError(f"Got a list of '{found}', expected a list of '{item}'. value='{value}'")
    return [substitutions(one) if is_substitution(one) else float(one) if found is float else one for one in entries]


def performed(context: LaunchContext, value: Any, kind: Any) -> Any:
    """Return the current value of what `given` has returned.

    Raises:
        ValueError: a text does not stand for a value of the type.
    """
    if not isinstance(value, list):
        return value
    if value and all(isinstance(one, Substitution) for one in value):
        return read(perform(context, value), kind)
    item, _ = _item(kind)
    found = [read(perform(context, one), item) if isinstance(one, list) else one for one in value]
    if not _uniform(found):
        raise ValueError("The output list is not uniform")
    return found


def read(text: str, kind: Any) -> Any:
    """Return the value of a type that a text stands for; without a type, the value that it is as YAML."""
    item, is_list = _item(kind)
    if is_list:
        found = _yaml(text, f"Cannot convert value '{text}' to a list of '{item}'")
        if not isinstance(found, list) or not all(isinstance(one, item) for one in found):
            raise ValueError(f"Cannot convert value '{text}' to a list of '{item}'")
        return found
    if kind is None:
        return _yaml(text, f"Failed to convert '{text}' using yaml rules")
    if kind is bool:
        found = _yaml({"1": "true", "0": "false"}.get(text, text), f"Failed to convert '{text}' to '{kind}'")
        if not isinstance(found, bool):
            raise ValueError(f"Cannot convert value '{text}' to '{kind}'")
        return found
    return kind(text)


def _yaml(text: str, refusal: str) -> Any:
    if not text:
        return text
    try:
        found = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(f"{refusal}: yaml.safe_load() failed\n{error}") from error
    if not isinstance(found, SCALARS) and not (isinstance(found, list) and _uniform(found)):
        raise ValueError(f"{refusal}: output type is not allowed, got {type(found)}")
    return found


def _uniform(values: list[Any]) -> bool:
    return not values or (isinstance(values[0], SCALARS) and all(isinstance(one, type(values[0])) for one in values))
