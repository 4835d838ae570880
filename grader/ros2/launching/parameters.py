"""The parameters of a node: their values, the types of these, and the file that carries them.

What is accepted, and the words of a refusal, are those of launch 3.4.3.
"""

from __future__ import annotations

import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from .entities import (
    LaunchContext,
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
    is_substitution,
    perform,
    substitutions,
)
from .errors import UnsupportedError

AS_TEXT = (
    "If the parameter is meant to be a string, try wrapping it in "
    "launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)"
)


class ParameterValue:
    """A value whose type is given, rather than found by reading its text as YAML."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.value_type = _given(value, value_type), value_type

    def evaluate(self, context: LaunchContext) -> Any:
        return _performed(context, self.value, self.value_type)


class ParameterFile:
    """A parameter file."""

    def __init__(self, param_file: SomeSubstitutionsType | Path, *, allow_substs: bool = False) -> None:
        if allow_substs:
            raise UnsupportedError(
                "allow_substs= of ParameterFile", "Write the values as a dictionary in `parameters`."
            )
        if not isinstance(param_file, str | Path | Substitution | Iterable):
            raise TypeError(
                "'ParameterFile()' expected 'param_file' to be one of [<class 'str'>, "
                "<class 'launch.substitution.Substitution'>, <class 'collections.abc.Iterable'>, "
                f"<class 'os.PathLike'>], but got '{param_file}' of type '{type(param_file)}'"
            )
        self.param_file = substitutions(str(param_file) if isinstance(param_file, Path) else param_file)

    def evaluate(self, context: LaunchContext) -> Path:
        """Return the file's path."""
        return Path(perform(context, self.param_file))


class Parameters:
    """A dictionary of parameters, checked when it is written and evaluated when its node starts."""

    def __init__(self, values: Mapping[Any, Any]) -> None:
        self.entries = list(_flat(values, []))

    def evaluate(self, context: LaunchContext) -> dict[str, Any]:
        """Return the current values by dotted names.

        Raises:
            TypeError: the text of a substitution is, as YAML, no value of a parameter.
        """
        found: dict[str, Any] = {}
        for parts, value in self.entries:
            name = perform(context, parts)
            try:
                found[name] = value.evaluate(context)
                if found[name] == []:
                    raise ValueError("a list without items has no type")
            except ValueError as error:
                raise TypeError(f"Unable to parse the value of parameter {name} as yaml: {error}\n{AS_TEXT}") from error
        return found


def _flat(values: Mapping[Any, Any], above: list[Substitution]) -> Iterator[tuple[list[Substitution], ParameterValue]]:
    """Yield the entries of nested dictionaries with the parts of their dotted names."""
    for key, value in values.items():
        name = [*above, *substitutions(key)]
        if isinstance(value, Mapping):
            yield from _flat(value, [*name, TextSubstitution(text=".")])
        elif isinstance(value, ParameterValue):
            yield name, value
        elif isinstance(value, Substitution | bool | int | float | Sequence):
            yield name, ParameterValue(value)
        else:
            raise TypeError(f"Unexpected type for parameter value {value!r}")


def document(values: Mapping[str, Any], node: str) -> str:
    """Return the parameter file for a node."""
    return yaml.safe_dump({node: {"ros__parameters": dict(values)}}, default_flow_style=False, allow_unicode=True)


def listed(parameters: Any) -> list[Parameters | ParameterFile]:
    """Return the `parameters=` of a node, checked; raise TypeError for what is not a list of dictionaries and files."""
    if not isinstance(parameters, list):
        raise TypeError(
            f"'Node' expected 'parameters' to be one of [<class 'list'>], but got '{parameters}' of type "
            f"'{type(parameters)}': write parameters=[…]"
        )
    return [
        Parameters(one) if isinstance(one, Mapping) else one if isinstance(one, ParameterFile) else ParameterFile(one)
        for one in parameters
    ]


# -- values of a known type -------------------------------------------------------------------------------------------
SCALARS = (int, float, bool, str)


def _item(kind: Any) -> tuple[Any, bool]:
    """Return the type of a scalar, or of the items of a list type, and whether it is a list type."""
    items = typing.get_args(kind)
    return (items[0], True) if items else (kind, False)


def _given(value: Any, kind: Any) -> Any:
    """Return a value for `_performed`: a scalar, a list of substitutions, or a list of scalars and of such lists.

    `kind` is bool, int, float, str, a list type of one of them, or None for any.

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
    entries = [substitutions(one) if is_substitution(one) else one for one in value]
    kinds = {type(one) for one in entries if not isinstance(one, list)}
    if kinds == {int, float}:
        kinds, entries = {float}, [one if isinstance(one, list) else float(one) for one in entries]
    if len(kinds) > 1 or not kinds <= set(SCALARS) or (kind is not None and not is_list):
        raise TypeError(f"Input value is not an acceptable 'SomeValueType'.Got value='{value}': mix no types in a list")
    if item is not None and not kinds <= {item}:
        raise TypeError(f"Got a list of '{kinds.pop()}', expected a list of '{item}'. value='{value}'")
    return entries


def _performed(context: LaunchContext, value: Any, kind: Any) -> Any:
    """Return the current value of what `_given` has returned; raise ValueError for a text that stands for no such."""
    if not isinstance(value, list):
        return value
    if value and all(isinstance(one, Substitution) for one in value):
        return _read(perform(context, value), kind)
    found = [_read(perform(context, one), _item(kind)[0]) if isinstance(one, list) else one for one in value]
    if not _uniform(found):
        raise ValueError("The output list is not uniform")
    return found


def _read(text: str, kind: Any) -> Any:
    """Return the value of a type that a text stands for; without a type, the value that it is as YAML."""
    item, is_list = _item(kind)
    if kind in (int, float, str):
        return kind(text)
    if kind is None and not text:
        return text
    try:
        found = yaml.safe_load({"1": "true", "0": "false"}.get(text, text) if kind is bool else text)
    except yaml.YAMLError as error:
        raise ValueError(f"Failed to convert '{text}' using yaml rules: yaml.safe_load() failed\n{error}") from error
    if is_list and not (isinstance(found, list) and all(isinstance(one, item) for one in found)):
        raise ValueError(f"Cannot convert value '{text}' to a list of '{item}'")
    if kind is bool and not isinstance(found, bool):
        raise ValueError(f"Cannot convert value '{text}' to '{kind}'")
    if not isinstance(found, SCALARS) and not (isinstance(found, list) and _uniform(found)):
        raise ValueError(f"Failed to convert '{text}' using yaml rules: output type is not allowed, got {type(found)}")
    return found


def _uniform(values: list[Any]) -> bool:
    return not values or (isinstance(values[0], SCALARS) and all(isinstance(one, type(values[0])) for one in values))
