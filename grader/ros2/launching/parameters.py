"""The parameters of a node: their values, the types of these, and the file that carries them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from . import typed
from .context import LaunchContext
from .entities import (
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
    is_substitution,
    perform,
    substitutions,
)
from .errors import UnsupportedError, caller
from .ros_substitutions import FindPackagePrefix, FindPackageShare
from .substitutions import EnvironmentVariable, LaunchConfiguration, ThisLaunchFile, ThisLaunchFileDir

AS_TEXT = (
    "If the parameter is meant to be a string, try wrapping it in "
    "launch_ros.parameter_descriptions.ParameterValue(value, value_type=str)"
)


class ParameterValue:
    """A value whose type is given, rather than found by reading its text as YAML."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.value_type = typed.given(value, value_type), value_type

    def evaluate(self, context: LaunchContext) -> Any:
        return typed.performed(context, self.value, self.value_type)


class ParameterFile:
    """A parameter file; with `allow_substs=True`, expressions such as `$(var x)` in it are replaced first."""

    def __init__(self, param_file: SomeSubstitutionsType | Path, *, allow_substs: bool = False) -> None:
        if not isinstance(param_file, str | Path | Substitution | Iterable):
            raise TypeError(
                "'ParameterFile()' expected 'param_file' to be one of [<class 'str'>, "
                "<class 'launch.substitution.Substitution'>, <class 'collections.abc.Iterable'>, "
                f"<class 'os.PathLike'>], but got '{param_file}' of type '{type(param_file)}'"
            )
        if not isinstance(allow_substs, bool):
            raise TypeError(
                "'ParameterFile()' expected 'allow_subst' to be one of [<class 'bool'>], "
                f"but got '{allow_substs}' of type '{type(allow_substs)}'"
            )
        self.param_file = substitutions(str(param_file) if isinstance(param_file, Path) else param_file)
        self.allow_substs, self.place = allow_substs, caller()

    def evaluate(self, context: LaunchContext) -> Path:
        """Return the path of the file to pass on."""
        path = Path(perform(context, self.param_file))
        if not self.allow_substs:
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


class Parameters:
    """A dictionary of parameters, checked when it is written and evaluated when its node starts."""

    def __init__(self, values: Mapping[Any, Any]) -> None:
        self.entries = list(_flat(values, []))

    def evaluate(self, context: LaunchContext) -> dict[str, Any]:
        return {(name := perform(context, parts)): _evaluated(context, name, value) for parts, value in self.entries}


def _flat(values: Mapping[Any, Any], above: list[Substitution]) -> Iterator[tuple[list[Substitution], Any]]:
    """Yield the entries of nested dictionaries with the parts of their dotted names."""
    for key, value in values.items():
        name = [*above, *substitutions(key)]
        if isinstance(value, Mapping):
            yield from _flat(value, [*name, TextSubstitution(text=".")])
        else:
            yield name, _checked(value)


def _checked(value: Any) -> Any:
    """Return a value if it can be one of a parameter, a list in a form in which its items have one type."""
    if isinstance(value, ParameterValue | Substitution | str | bytes | bool | int | float):
        return value
    if not isinstance(value, Sequence):
        raise TypeError(f"Unexpected type for parameter value {value!r}")
    for one in value:
        if not isinstance(one, float | int | str | Substitution | Iterable):
            raise TypeError(
                "Expected 'subvalue' to be one of [<class 'float'>, <class 'int'>, <class 'str'>, <class 'bool'>, "
                "<class 'launch.substitution.Substitution'>, <class 'collections.abc.Iterable'>], "
                f"but got '{one}' of type '{type(one)}'"
            )
    if is_substitution(value):
        return Joined(value)
    if {type(one) for one in value} == {int, float}:
        return [float(one) for one in value]
    return [one if isinstance(one, bool | int | float | str) else Joined(one) for one in value]


class Joined(Substitution):
    """The text of several parts."""

    def __init__(self, parts: Any) -> None:
        self.parts = substitutions(parts)

    def perform(self, context: LaunchContext) -> str:
        return perform(context, self.parts)


def _evaluated(context: LaunchContext, name: str, value: Any) -> Any:
    """Return the current value of a parameter; the text of a substitution is read as YAML."""
    if isinstance(value, ParameterValue):
        return value.evaluate(context)
    if isinstance(value, Substitution):
        value = _read(value.perform(context), name)
        if not isinstance(value, str | bytes | bool | int | float | list):
            raise TypeError(
                "Allowed value types are bytes, bool, int, float, str, Sequence[bool], Sequence[int], "
                f'Sequence[float], Sequence[str]. Got {type(value)} for "{name}". {AS_TEXT}'
            )
    elif isinstance(value, list):
        value = [_read(one.perform(context), name) if isinstance(one, Substitution) else one for one in value]
    if isinstance(value, list) and not _uniform(value):
        raise TypeError(
            "Expected a non-empty sequence, with items of uniform type. Allowed sequence item types are bool, int, "
            f'float, str. Got inconsistent input for "{name}"'
        )
    return value


def _read(text: str, name: str) -> Any:
    try:
        return yaml.safe_load(text) if text else ""
    except yaml.YAMLError as error:
        raise TypeError(f"Unable to parse the value of parameter {name} as yaml. {AS_TEXT}") from error


def _uniform(values: list[Any]) -> bool:
    kind = type(values[0]) if values else None
    return kind in (bool, int, float, str) and all(isinstance(one, kind) for one in values)


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
