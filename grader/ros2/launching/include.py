"""Include launch files: Python files, read as the module `python_launch_file`."""

from __future__ import annotations

import contextlib
import importlib.machinery
import importlib.util
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from .actions import DeclareLaunchArgument, SetLaunchConfiguration
from .context import LaunchContext
from .entities import (
    Action,
    Entities,
    LaunchDescription,
    SomeSubstitutionsType,
    perform,
    perform_alone,
    substitutions,
)
from .errors import LaunchError

OTHER_FORMATS = {".xml": "an XML", ".launch": "an XML", ".yaml": "a YAML", ".yml": "a YAML"}
PYTHON_FILE = "Write it as a Python launch file (.launch.py) with generate_launch_description()."


def read(path: Path) -> LaunchDescription:
    """Return the description that a Python launch file generates; one in XML or YAML is refused by its name."""
    if (other := OTHER_FORMATS.get(path.suffix)) is not None:
        raise LaunchError(
            f"{path.name} is {other} launch file, which this kit does not read: write it as a Python launch file "
            "(.launch.py) with generate_launch_description()."
        )
    if not path.is_file():
        raise FileNotFoundError(f"[Errno 2] No such file or directory: '{path}'")
    spec = importlib.util.spec_from_loader(
        "python_launch_file", importlib.machinery.SourceFileLoader("python_launch_file", str(path)), origin=str(path)
    )
    if spec is None or spec.loader is None:
        raise LaunchError(f"{path} cannot be read as Python")
    module = importlib.util.module_from_spec(spec)
    module.__file__ = str(path)
    spec.loader.exec_module(module)
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
    """A description, or the place of a file that generates one. One source serves one include."""

    def __init__(self, launch_description: Any = None, location: SomeSubstitutionsType = "") -> None:
        self._place = substitutions(location)
        self._description: LaunchDescription | None = launch_description
        self._path: Path | None = None

    @property
    def location(self) -> Path:
        """The file's path, once known."""
        return self._path or Path("<script>")

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Return the description if its place is known without a context and the file can be read."""
        if self._description is None and (place := perform_alone(self._place)) is not None:
            with contextlib.suppress(Exception):  # said when the file is needed
                self._load(place)
        return self._description

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Return the description."""
        return self._description or self._load(perform(context, self._place))

    def _load(self, place: str) -> LaunchDescription:
        # An absolute path, but with its links kept: a symlinked install names its folder as the user does.
        self._path = Path(place).absolute()
        self._description = read(self._path)
        return self._description


class AnyLaunchDescriptionSource(LaunchDescriptionSource):
    """A launch file in any format; in this kit that means Python."""

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path)


class PythonLaunchDescriptionSource(AnyLaunchDescriptionSource):
    """A Python launch file."""


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
            launch_description_source = AnyLaunchDescriptionSource(launch_description_source)
        self.launch_description_source: LaunchDescriptionSource = launch_description_source
        self.launch_arguments = list(launch_arguments or [])

    def describe_sub_entities(self) -> Entities:
        found = self.launch_description_source.try_get_launch_description_without_context()
        return [] if found is None else [found]

    def execute(self, context: LaunchContext) -> Entities:
        """Read the file, and check that its required arguments are given before any of it runs."""
        description = self.launch_description_source.get_launch_description(context)
        location = self.launch_description_source.location
        # As in the real one, this stays what it is after the file, too.
        context.locals.current_launch_file_directory = str(location.parent)
        given = [SetLaunchConfiguration(name, value) for name, value in self.launch_arguments]
        self._require(context, description)
        return [*given, description]

    def _require(self, context: LaunchContext, description: LaunchDescription) -> None:
        """Raise if a required argument is not among those given; a configuration of the same name does not count."""
        given = {perform(context, name) for name, _ in self.launch_arguments}
        for argument in _required(description.entities, given):
            raise LaunchError(
                f"Included launch description missing required argument '{argument.name}' "
                f"(description: '{argument.description}'), given: [{', '.join(sorted(given))}]"
            )

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
