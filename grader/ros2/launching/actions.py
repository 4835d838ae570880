"""The actions of `launch.actions` that hold or fetch other entities: groups, included files, functions; and LogInfo."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from .entities import Action, Entities, LaunchDescription, SomeSubstitutionsType, perform, substitutions
from .errors import LaunchError
from .state_actions import (
    DeclareLaunchArgument,
    PopEnvironment,
    PopLaunchConfigurations,
    PushEnvironment,
    PushLaunchConfigurations,
    ResetLaunchConfigurations,
    SetLaunchConfiguration,
)

if TYPE_CHECKING:
    from .context import LaunchContext
    from .sources import LaunchDescriptionSource


class LogInfo(Action):
    """Prints a line."""

    def __init__(self, *, msg: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.msg = substitutions(msg)

    def execute(self, context: LaunchContext) -> None:
        """Print it."""
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
        """Call it."""
        found: Entities | None = self.function(context, *self.args, **self.kwargs)
        return found


class _Do(Action):
    """A step of a group."""

    def __init__(self, step: Callable[[LaunchContext], Any]) -> None:
        super().__init__()
        self.step = step

    def execute(self, context: LaunchContext) -> None:
        """Take the step."""
        self.step(context)


class GroupAction(Action):
    """Actions together; configurations and environment are put back after them, unless `scoped=False`."""

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
        """Return the actions."""
        return self.actions

    def execute(self, context: LaunchContext) -> Entities:  # noqa: ARG002 - as every action
        """Return the actions between what opens and what closes the group."""
        given = [SetLaunchConfiguration(name, value) for name, value in self.launch_configurations.items()]
        if not self.scoped:
            return [*given, *self.actions]
        opening: list[Action] = [PushLaunchConfigurations(), PushEnvironment()]
        if self.forwarding:
            opening += given
        else:
            opening += [
                _Do(lambda c: c.reset_environment()),
                ResetLaunchConfigurations(self.launch_configurations),
            ]
        return [*opening, *self.actions, PopEnvironment(), PopLaunchConfigurations()]


class IncludeLaunchDescription(Action):
    """Runs another launch file in the same state: what it sets, and its arguments, leak into what follows."""

    def __init__(
        self,
        launch_description_source: LaunchDescriptionSource | Any,
        *,
        launch_arguments: Iterable[tuple[SomeSubstitutionsType, Any]] | None = None,
        **rest: Any,
    ) -> None:
        super().__init__(**rest)
        from .sources import AnyLaunchDescriptionSource, LaunchDescriptionSource

        if not isinstance(launch_description_source, LaunchDescriptionSource):
            launch_description_source = AnyLaunchDescriptionSource(launch_description_source)
        self.launch_description_source: LaunchDescriptionSource = launch_description_source
        self.launch_arguments = list(launch_arguments or [])

    def describe_sub_entities(self) -> Entities:
        """Return the file's description, where its place is known beforehand."""
        found = self.launch_description_source.try_get_launch_description_without_context()
        return [] if found is None else [found]

    def execute(self, context: LaunchContext) -> Entities:
        """Read the file, and check before anything of it runs that its required arguments are given."""
        description = self.launch_description_source.get_launch_description(context)
        location = self.launch_description_source.location
        names = {"current_launch_file_path": str(location), "current_launch_file_directory": str(location.parent)}
        before = {name: context.get_locals_as_dict().get(name) for name in names}
        context.extend_locals(names)
        given = [SetLaunchConfiguration(name, value) for name, value in self.launch_arguments]
        self._require(context, description)
        return [*given, description, _Do(lambda c: c.extend_locals(before))]

    def _require(self, context: LaunchContext, description: LaunchDescription) -> None:
        """Raise if a required argument is not among those given; a configuration of its name does not do."""
        given = {perform(context, name) for name, _ in self.launch_arguments}
        for argument in _required(description.entities, given):
            raise LaunchError(
                f"Included launch description missing required argument '{argument.name}' "
                f"(description: '{argument.description}'), given: [{', '.join(sorted(given))}]"
            )

    def names_given(self) -> set[str]:
        """Return the names of the arguments given that are known beforehand."""
        names = [substitutions(name) for name, _ in self.launch_arguments]
        return {"".join(one.perform(None) for one in name) for name in names if all(one.fixed for one in name)}  # type: ignore[arg-type]  # fixed


def _required(entities: Entities, given: set[str]) -> Iterator[DeclareLaunchArgument]:
    """Yield the arguments without a default that are not given, those of files included from here too."""
    for entity in entities:
        if getattr(entity, "condition", None) is not None:
            continue
        if isinstance(entity, DeclareLaunchArgument) and entity.default_value is None and entity.name not in given:
            yield entity
        inner = given | entity.names_given() if isinstance(entity, IncludeLaunchDescription) else given
        yield from _required(entity.describe_sub_entities(), inner)
