"""The actions of `launch.actions` that start no process."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from . import events
from .entities import Action, Entities, LaunchDescription, SomeSubstitutionsType, perform, substitutions
from .errors import LaunchError
from .handlers import EventHandler, OnShutdown

if TYPE_CHECKING:
    from .context import LaunchContext
    from .sources import LaunchDescriptionSource


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


class _Do(Action):
    """A step of a group."""

    def __init__(self, step: Callable[[LaunchContext], Any]) -> None:
        super().__init__()
        self.step = step

    def execute(self, context: LaunchContext) -> None:
        """Take the step."""
        self.step(context)


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


class TimerAction(Action):
    """Does its actions after a period in seconds, in the state that holds then."""

    def __init__(self, *, period: Any, actions: Iterable[Action], cancel_on_shutdown: Any = True, **rest: Any) -> None:
        super().__init__(**rest)
        self.period, self.actions, self.cancel_on_shutdown = period, list(actions), cancel_on_shutdown
        self._done: asyncio.Future[None] | None = None
        self._handle: asyncio.TimerHandle | None = None

    def describe_conditional_sub_entities(self) -> list[tuple[str, Entities]]:
        """Return the actions."""
        return [("after some time", self.actions)]

    def get_asyncio_future(self) -> asyncio.Future[None] | None:
        """Return what is done when the timer has fired or was cancelled."""
        return self._done

    def cancel(self) -> None:
        """Stop the timer before it fires."""
        if self._handle is not None:
            self._handle.cancel()
        if self._done is not None and not self._done.done():
            self._done.set_result(None)

    def execute(self, context: LaunchContext) -> None:
        """Start the timer."""
        if context.is_shutdown:
            return
        loop = context.asyncio_loop
        assert loop is not None
        plain = isinstance(self.period, int | float)
        period_s = float(self.period if plain else perform(context, self.period))
        self._done = done = loop.create_future()
        fired = EventHandler(
            matcher=lambda e: isinstance(e, events.TimerEvent) and e.timer_action is self,
            entities=self.actions,
            handle_once=True,
        )
        context.register_event_handler(fired)
        stop = self.cancel_on_shutdown
        if stop if isinstance(stop, bool) else perform(context, stop).lower() == "true":
            context.register_event_handler(OnShutdown(on_shutdown=lambda *_: self.cancel(), handle_once=True))

        def fire() -> None:
            context.emit_event_sync(events.TimerEvent(timer_action=self))
            if not done.done():
                done.set_result(None)

        self._handle = loop.call_later(period_s, fire)


class RegisterEventHandler(Action):
    """Has an event handler asked from now on."""

    def __init__(self, event_handler: EventHandler, **rest: Any) -> None:
        super().__init__(**rest)
        self.event_handler = event_handler

    def describe_conditional_sub_entities(self) -> list[tuple[str, Entities]]:
        """Return what the handler would do."""
        return [("on an event", self.event_handler.described())]

    def execute(self, context: LaunchContext) -> None:
        """Register it."""
        context.register_event_handler(self.event_handler)


class UnregisterEventHandler(Action):
    """Has an event handler asked no more."""

    def __init__(self, event_handler: EventHandler, **rest: Any) -> None:
        super().__init__(**rest)
        self.event_handler = event_handler

    def execute(self, context: LaunchContext) -> None:
        """Take it away."""
        context.unregister_event_handler(self.event_handler)


class EmitEvent(Action):
    """Makes an event happen."""

    def __init__(self, *, event: events.Event, **rest: Any) -> None:
        super().__init__(**rest)
        self.event = event

    def execute(self, context: LaunchContext) -> None:
        """Queue it."""
        context.emit_event_sync(self.event)


class Shutdown(EmitEvent):
    """Ends the launch."""

    def __init__(self, *, reason: str = "reason not given", **rest: Any) -> None:
        super().__init__(event=events.Shutdown(reason=reason), **rest)

    def execute(self, context: LaunchContext) -> None:
        """End it, and say so where a process's end is the occasion."""
        event = context.get_locals_as_dict().get("event")
        if isinstance(event, events.ProcessExited):
            said = f"process[{event.process_name}] was required: shutting down launched system"
            context.runner.output.info("launch", said)
        super().execute(context)
