"""The parameters of a node: their values, the types of these, and the file that carries them."""

from __future__ import annotations

import re
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from .context import LaunchContext
from .entities import SomeSubstitutionsType, Substitution, is_on, is_substitution, perform, substitutions
from .errors import LaunchError, UnsupportedError, caller
from .ros_substitutions import FindPackagePrefix, FindPackageShare
from .substitutions import EnvironmentVariable, LaunchConfiguration, ThisLaunchFile, ThisLaunchFileDir

AS_TEXT = (
    "If the parameter is meant to be a string, try wrapping it in "
    "launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)"
)
SCALARS = (bool, int, float, str, bytes)


class ParameterValue:
    """A value whose type is given, rather than found by reading its text as YAML."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.value_type = value, value_type

    def evaluate(self, context: LaunchContext) -> Any:
        """Return the current value."""
        if not is_substitution(self.value):
            return value_of(context, self.value) if self.value_type is None else _typed(self.value, self.value_type)
        text = perform(context, self.value)
        return read(text) if self.value_type is None else _typed(text, self.value_type)


class ParameterFile:
    """A parameter file; with `allow_substs=True`, expressions such as `$(var x)` in it are replaced first."""

    def __init__(self, param_file: SomeSubstitutionsType, *, allow_substs: Any = False) -> None:
        self.param_file, self.allow_substs = substitutions(param_file), allow_substs
        self.place = caller()

    def evaluate(self, context: LaunchContext) -> Path:
        """Return the path of the file to pass on."""
        path = Path(perform(context, self.param_file))
        if not is_on(context, self.allow_substs):
            return path
        text = re.sub(r"\$\(([^()]*)\)", lambda found: self._replace(context, found[1]), path.read_text())
        return Path(context.runner.parameter_file(text))

    def _replace(self, context: LaunchContext, expression: str) -> str:
        kind, *words = expression.split()
        words = [word.strip("'\"") for word in words]
        known: dict[str, Callable[..., Substitution]] = {
            "var": lambda name, *default: LaunchConfiguration(name, default=default[0] if default else None),
            "env": lambda name, *default: EnvironmentVariable(name, default_value=default[0] if default else None),
            "find-pkg-share": FindPackageShare,
            "find-pkg-prefix": FindPackagePrefix,
            "dirname": ThisLaunchFileDir,
            "filename": ThisLaunchFile,
        }
        if kind not in known:
            raise UnsupportedError(
                f"$({expression}) in a parameter file",
                f"Use one of {', '.join(f'$({name} …)' for name in known)}.",
                self.place,
            )
        return known[kind](*words).perform(context)


def read(text: str) -> Any:
    """Return the value of a text that a substitution gave, read as YAML."""
    if not text:
        return ""
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ValueError(f"Unable to parse the value '{text}' as yaml. {AS_TEXT}") from error
    return checked(value, f"'{text}'")


def checked(value: Any, shown: str) -> Any:
    """Return a value that a parameter can hold: a scalar, or a list of one type; int among float becomes float."""
    if isinstance(value, SCALARS):
        return value
    if not isinstance(value, Sequence):
        raise TypeError(
            f"Allowed value types are bytes, bool, int, float, str, Sequence[bool], Sequence[int], Sequence[float], "
            f"Sequence[str]. Got {type(value)} for {shown}. {AS_TEXT}"
        )
    kinds = {type(one) for one in value}
    if kinds == {int, float}:
        return [float(one) for one in value]
    if len(kinds) != 1 or not kinds <= set(SCALARS):
        raise TypeError(f"Expected a non-empty sequence of one type (bool, int, float, str), got {shown}")
    return list(value)


def _typed(value: Any, kind: Any) -> Any:
    """Return a value converted to the given type."""
    if kind is str:
        return str(value)
    found = yaml.safe_load(value) if isinstance(value, str) else value
    inner = typing.get_args(kind)
    if inner and isinstance(found, Sequence) and not isinstance(found, str):
        return [str(one) if inner[0] is str else _typed(one, inner[0]) for one in found]
    if kind is float and isinstance(found, int | str) and not isinstance(found, bool):
        return float(found)
    if not inner and type(found) is kind:
        return found
    raise ValueError(f"Cannot convert input '{value}' of type '{type(value)}' to '{kind}'")


def value_of(context: LaunchContext, value: Any) -> Any:
    """Return the current value of an entry of a parameter dictionary."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if is_substitution(value):
        return read(perform(context, value))
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping) or not isinstance(value, (*SCALARS, Iterable)):
        return checked(value, repr(value))
    return checked(value if isinstance(value, SCALARS) else list(value), repr(value))


def flat(context: LaunchContext, values: Mapping[Any, Any], above: str = "") -> dict[str, Any]:
    """Return the dictionary's values by dotted names."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        if not isinstance(key, str) and not is_substitution(key):
            raise TypeError(f"the name of a parameter is a string, got {key!r}")
        name = above + perform(context, key)
        if isinstance(value, Mapping):
            found.update(flat(context, value, name + "."))
        else:
            found[name] = value_of(context, value)
    return found


def document(values: Mapping[str, Any], node: str) -> str:
    """Return the parameter file for a node."""
    return yaml.safe_dump({node: {"ros__parameters": dict(values)}}, default_flow_style=False, allow_unicode=True)


def listed(parameters: Any) -> list[Any]:
    """Return the `parameters=` of a node as a list; raise if it is not one of dictionaries and files."""
    if isinstance(parameters, str | Path | Mapping | Substitution) or not isinstance(parameters, Iterable):
        raise TypeError(f"Expected 'parameters' to be a list of dictionaries and files, got {parameters!r}")
    found = list(parameters)
    for one in found:
        if not (isinstance(one, str | Path | Mapping | ParameterFile) or is_substitution(one)):
            raise LaunchError(f"'parameters' holds {one!r}: give a dictionary, or the path of a YAML file")
    return found
