"""The actions of `launch.actions` that hold entities or change the state: groups, includes, arguments, environment."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from importlib.machinery import SourceFileLoader
from pathlib import Path
from types import ModuleType
from typing import Any

from .entities import (
    Action,
    Entities,
    LaunchContext,
    LaunchDescription,
    SomeSubstitutionsType,
    perform,
    perform_alone,
    substitutions,
)
from .errors import LaunchError, UnsupportedError

OTHER_FORMATS = {".xml": "an XML", ".launch": "an XML", ".yaml": "a YAML", ".yml": "a YAML"}


class LogInfo(Action):
    """Prints a line."""

    def __init__(self, *, msg: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.msg = substitutions(msg)

    def execute(self, context: LaunchContext) -> None:
        context.runner.output.info("launch.user", perform(context, self.msg))


class OpaqueFunction(Action):
    """Calls a function of the launch file, which may return entities to visit."""

    def __init__(
        self, *, function: Callable[..., Any], args: Iterable[Any] | None = None, kwargs: Any = None, **rest: Any
    ) -> None:
        super().__init__(**rest)
        if not callable(function):
            raise TypeError(f"OpaqueFunction expected 'callable' for 'function' but got '{type(function)}'")
        self.function, self.args, self.kwargs = function, list(args or []), dict(kwargs or {})

    def execute(self, context: LaunchContext) -> Entities | None:
        found: Entities | None = self.function(context, *self.args, **self.kwargs)
        return found


class DeclareLaunchArgument(Action):
    """Declares an argument of the launch file; its default is set only if the name has no value yet."""

    def __init__(
        self,
        name: str,
        *,
        default_value: SomeSubstitutionsType | None = None,
        description: str | None = None,
        choices: Iterable[str] | None = None,
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        if not isinstance(name, str):
            raise TypeError(f"the name of a launch argument is a string, got {name!r}")
        self.name = name
        self.default_value = None if default_value is None else substitutions(default_value)
        self.choices = None if choices is None else list(choices)
        if self.choices is None:
            self.description = "no description given" if description is None else description
            return
        if not self.choices:
            raise LaunchError("Provided choices arg is empty. Use None to ignore the choice list.")
        if isinstance(default_value, str) and default_value not in self.choices:
            raise LaunchError(f'Provided default_value "{default_value}" is not in provided choices "{self.choices}".')
        end = "." if description is not None and not description.endswith(".") else ""
        shown = "One of:" if description is None else f"{description}{end} Valid choices are:"
        self.description = f"{shown} {self.choices}"

    def declared_arguments(self, conditional: bool = False) -> Iterator[tuple[Any, bool]]:
        yield self, conditional or self.condition is not None

    def execute(self, context: LaunchContext) -> None:
        """Set the default, and compare the value with the choices."""
        if self.name not in context.launch_configurations:
            if self.default_value is None:
                raise LaunchError(
                    f"Required launch argument '{self.name}' (description: '{self.description}') was not provided."
                )
            context.launch_configurations[self.name] = perform(context, self.default_value)
        value = str(context.launch_configurations[self.name])
        if self.choices is not None and value not in self.choices:
            raise LaunchError(
                f'Argument "{self.name}" provided value "{value}" is not valid. Valid options are: {self.choices}'
            )


class SetLaunchConfiguration(Action):
    """Sets a configuration."""

    def __init__(self, name: SomeSubstitutionsType, value: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.name, self.value = substitutions(name), substitutions(value)

    def execute(self, context: LaunchContext) -> None:
        context.launch_configurations[perform(context, self.name)] = perform(context, self.value)


class SetEnvironmentVariable(SetLaunchConfiguration):
    """Sets an environment variable for the processes started afterwards."""

    def execute(self, context: LaunchContext) -> None:
        context.environment[perform(context, self.name)] = perform(context, self.value)


class GroupAction(Action):
    """Groups actions; configurations and environment are restored after them, unless `scoped=False`."""

    def __init__(self, actions: Iterable[Action], *, scoped: bool = True, **rest: Any) -> None:
        for name in rest.keys() & {"forwarding", "launch_configurations"}:
            raise UnsupportedError(f"{name}= of GroupAction")
        super().__init__(**rest)
        self.actions, self.scoped = list(actions), scoped

    def describe_sub_entities(self) -> Entities:
        return self.actions

    def execute(self, context: LaunchContext) -> Entities:
        """Return the actions, and the step that closes the group."""
        return [*self.actions, _Restore(context)] if self.scoped else self.actions


class _Restore(Action):
    """Restores configurations and environment, as they are now, at the end of a group."""

    def __init__(self, context: LaunchContext) -> None:
        super().__init__()
        self.configurations, self.environment = dict(context.launch_configurations), dict(context.environment)

    def execute(self, context: LaunchContext) -> None:
        context.launch_configurations.clear()
        context.launch_configurations.update(self.configurations)
        for name in context.environment.keys() - self.environment.keys():
            del context.environment[name]
        context.environment.update(self.environment)


# -- other launch files ----------------------------------------------------------------------------------------------
def read(path: Path) -> LaunchDescription:
    """Return the description that a Python launch file generates; one in XML or YAML is refused by its name."""
    if (other := OTHER_FORMATS.get(path.suffix)) is not None:
        raise LaunchError(
            f"{path.name} is {other} launch file, which this kit does not read: write it as a Python launch file "
            "(.launch.py) with generate_launch_description()."
        )
    module = ModuleType("python_launch_file")
    module.__file__ = str(path)
    SourceFileLoader(module.__name__, str(path)).exec_module(module)
    generate = getattr(module, "generate_launch_description", None)
    if generate is None:
        raise LaunchError(
            f"launch file at '{path}' does not contain the required function 'generate_launch_description()'"
        )
    description = generate()
    if not isinstance(description, LaunchDescription):
        raise LaunchError(
            f"generate_launch_description() of '{path}' returns {type(description).__name__}, not a LaunchDescription"
        )
    return description


class LaunchDescriptionSource:
    """The place of a launch file, which in this kit is written in Python. One source serves one include."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        self._place = substitutions(launch_file_path)
        self._description: LaunchDescription | None = None
        self.folder = ""  # of the file, once it has been read

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Return the description if its place is known without a context and the file can be read."""
        with contextlib.suppress(Exception):  # said when the file is needed
            return self.get_launch_description(LaunchContext())
        return None

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Return the description."""
        if self._description is None:
            # An absolute path, but with its links kept: a symlinked install names its folder as the user does.
            path = Path(perform(context, self._place)).absolute()
            self._description, self.folder = read(path), str(path.parent)
        return self._description


AnyLaunchDescriptionSource = PythonLaunchDescriptionSource = LaunchDescriptionSource


class IncludeLaunchDescription(Action):
    """Runs another launch file in the same state: its arguments, and what it sets, leak into what follows."""

    def __init__(
        self,
        launch_description_source: LaunchDescriptionSource | Any,
        *,
        launch_arguments: Iterable[tuple[SomeSubstitutionsType, Any]] | None = None,
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = LaunchDescriptionSource(launch_description_source)
        self.launch_description_source: LaunchDescriptionSource = launch_description_source
        self.launch_arguments = list(launch_arguments or [])

    def describe_sub_entities(self) -> Entities:
        found = self.launch_description_source.try_get_launch_description_without_context()
        return [] if found is None else [found]

    def execute(self, context: LaunchContext) -> Entities:
        """Read the file, and check that its required arguments are given before any of it runs."""
        description = self.launch_description_source.get_launch_description(context)
        # As in the real one, this stays what it is after the file, too.
        context.locals.current_launch_file_directory = self.launch_description_source.folder
        given = {perform(context, name) for name, _ in self.launch_arguments}
        for argument in _required(description.entities, given):  # a configuration of the same name does not count
            raise LaunchError(
                f"Included launch description missing required argument '{argument.name}' "
                f"(description: '{argument.description}'), given: [{', '.join(sorted(given))}]"
            )
        return [*(SetLaunchConfiguration(name, value) for name, value in self.launch_arguments), description]

    def names_given(self) -> set[str]:
        """Return the names of the given arguments that are known beforehand."""
        names = (perform_alone(name) for name, _ in self.launch_arguments)
        return {name for name in names if name is not None}


def _required(entities: Entities, given: set[str]) -> Iterator[DeclareLaunchArgument]:
    """Yield the arguments without a default that are not given, also those of files included from here."""
    for entity in entities:
        if entity.condition is not None:
            continue
        if isinstance(entity, DeclareLaunchArgument) and entity.default_value is None and entity.name not in given:
            yield entity
        inner = given | entity.names_given() if isinstance(entity, IncludeLaunchDescription) else given
        yield from _required(entity.describe_sub_entities(), inner)
