"""The actions of `launch.actions` that hold entities or change the state: groups, functions, arguments, environment."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from .context import LaunchContext
from .entities import (
    Action,
    DeclaredArgument,
    Entities,
    SomeSubstitutionsType,
    perform,
    substitutions,
)
from .errors import LaunchError


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

    def _check(self, value: str) -> None:
        if self.choices is not None and value not in self.choices:
            raise LaunchError(
                f'Argument "{self.name}" provided value "{value}" is not valid. Valid options are: {self.choices}'
            )

    def declared_arguments(self, conditional: bool = False) -> Iterator[tuple[DeclaredArgument, bool]]:
        yield self, conditional or self.condition is not None

    def execute(self, context: LaunchContext) -> None:
        """Set the default, and compare the value with the choices."""
        if self.name not in context.launch_configurations:
            if self.default_value is None:
                raise LaunchError(
                    f"Required launch argument '{self.name}' (description: '{self.description}') was not provided."
                )
            context.launch_configurations[self.name] = perform(context, self.default_value)
        self._check(str(context.launch_configurations[self.name]))


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


class AppendEnvironmentVariable(SetLaunchConfiguration):
    """Adds to the end, or the start, of an environment variable that is a list."""

    def __init__(
        self,
        name: SomeSubstitutionsType,
        value: SomeSubstitutionsType,
        prepend: bool = False,
        separator: SomeSubstitutionsType = ":",
        **rest: Any,
    ) -> None:
        super().__init__(name, value, **rest)
        self.prepend, self.separator = prepend, substitutions(separator)

    def execute(self, context: LaunchContext) -> None:
        name, value = perform(context, self.name), perform(context, self.value)
        there = [context.environment[name]] if name in context.environment else []
        parts = [value, *there] if self.prepend else [*there, value]
        context.environment[name] = perform(context, self.separator).join(parts)


class GroupAction(Action):
    """Groups actions; configurations and environment are restored after them, unless `scoped=False`."""

    def __init__(
        self,
        actions: Iterable[Action],
        *,
        scoped: bool = True,
        forwarding: bool = True,
        launch_configurations: Mapping[Any, Any] | None = None,
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        self.actions = list(actions)
        self.scoped, self.forwarding = scoped, forwarding
        self.launch_configurations = dict(launch_configurations or {})

    def describe_sub_entities(self) -> Entities:
        return self.actions

    def execute(self, context: LaunchContext) -> Entities:
        """Return the actions, and the step that closes the group."""
        given = [SetLaunchConfiguration(name, value) for name, value in self.launch_configurations.items()]
        if not self.scoped:
            return [*given, *self.actions]
        restore = _Restore(dict(context.launch_configurations), dict(context.environment))
        if not self.forwarding:
            context.restore(context.launch_configurations, context.first_environment)
            given_alone = {perform(context, one.name): perform(context, one.value) for one in given}
            context.restore(given_alone, context.first_environment)
        return [*(given if self.forwarding else ()), *self.actions, restore]


class _Restore(Action):
    """Restores configurations and environment at the end of a group."""

    def __init__(self, configurations: Mapping[str, Any], environment: Mapping[str, str]) -> None:
        super().__init__()
        self.configurations, self.environment = configurations, environment

    def execute(self, context: LaunchContext) -> None:
        context.restore(self.configurations, self.environment)
