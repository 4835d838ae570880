"""The actions of `launch.actions` that change the state: configurations, the arguments among them, and environment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from .entities import Action, SomeSubstitutionsType, perform, substitutions
from .errors import LaunchError

if TYPE_CHECKING:
    from .context import LaunchContext


class DeclareLaunchArgument(Action):
    """Declares an argument of the launch file; its default is set only where the name has no value yet."""

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
        self.description = description or "no description given"
        if self.choices is not None:
            self.description += ("" if self.description.endswith(".") else ".") + f" Valid choices are: {self.choices}"
        self.conditional = False
        fixed = self.default_value is not None and all(one.fixed for one in self.default_value)
        if self.choices is not None and fixed:
            self._check("".join(one.perform(None) for one in self.default_value or ()))  # type: ignore[arg-type]  # fixed

    def _check(self, value: str) -> None:
        if self.choices is not None and value not in self.choices:
            raise LaunchError(
                f'Argument "{self.name}" provided value "{value}" is not valid. Valid options are: {self.choices}'
            )

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
        """Set it."""
        context.launch_configurations[perform(context, self.name)] = perform(context, self.value)


class UnsetLaunchConfiguration(Action):
    """Forgets a configuration."""

    def __init__(self, name: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.name = substitutions(name)

    def execute(self, context: LaunchContext) -> None:
        """Forget it."""
        context.launch_configurations.pop(perform(context, self.name), None)


class PushLaunchConfigurations(Action):
    """Remembers the configurations."""

    def execute(self, context: LaunchContext) -> None:
        """Remember them."""
        context.push_configurations()


class PopLaunchConfigurations(Action):
    """Goes back to the configurations last remembered."""

    def execute(self, context: LaunchContext) -> None:
        """Go back."""
        context.pop_configurations()


class ResetLaunchConfigurations(Action):
    """Forgets all configurations but those given."""

    def __init__(self, launch_configurations: Mapping[Any, Any] | None = None, **rest: Any) -> None:
        super().__init__(**rest)
        self.launch_configurations = dict(launch_configurations or {})

    def execute(self, context: LaunchContext) -> None:
        """Evaluate the given ones, then forget the rest."""
        kept = {perform(context, name): perform(context, value) for name, value in self.launch_configurations.items()}
        context.launch_configurations.clear()
        context.launch_configurations.update(kept)


class PushEnvironment(Action):
    """Remembers the environment."""

    def execute(self, context: LaunchContext) -> None:
        """Remember it."""
        context.push_environment()


class PopEnvironment(Action):
    """Goes back to the environment last remembered."""

    def execute(self, context: LaunchContext) -> None:
        """Go back."""
        context.pop_environment()


class SetEnvironmentVariable(Action):
    """Sets an environment variable for what is started afterwards."""

    def __init__(self, name: SomeSubstitutionsType, value: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.name, self.value = substitutions(name), substitutions(value)

    def execute(self, context: LaunchContext) -> None:
        """Set it."""
        context.environment[perform(context, self.name)] = perform(context, self.value)


class UnsetEnvironmentVariable(Action):
    """Takes an environment variable away."""

    def __init__(self, name: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.name = substitutions(name)

    def execute(self, context: LaunchContext) -> None:
        """Take it away."""
        context.environment.pop(perform(context, self.name), None)


class AppendEnvironmentVariable(Action):
    """Adds to the end, or the start, of an environment variable that is a list."""

    def __init__(
        self,
        name: SomeSubstitutionsType,
        value: SomeSubstitutionsType,
        prepend: Any = False,
        separator: SomeSubstitutionsType = ":",
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        self.name, self.value, self.prepend, self.separator = substitutions(name), value, prepend, separator

    def execute(self, context: LaunchContext) -> None:
        """Add to it."""
        name, value = perform(context, self.name), perform(context, self.value)
        first = self.prepend if isinstance(self.prepend, bool) else perform(context, self.prepend).lower() == "true"
        parts = [value, context.environment[name]] if name in context.environment else [value]
        context.environment[name] = perform(context, self.separator).join(parts if first else reversed(parts))
