"""The parameters of a node: their values, the types of these, and the file that carries them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from . import typed
from .context import LaunchContext
from .entities import SomeSubstitutionsType, Substitution, TextSubstitution, perform, substitutions
from .errors import UnsupportedError, caller
from .substitutions import (
    EnvironmentVariable,
    FindPackagePrefix,
    FindPackageShare,
    LaunchConfiguration,
    ThisLaunchFileDir,
)

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
