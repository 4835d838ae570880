"""Where launch descriptions come from: Python files, read as the module `python_launch_file`."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from .context import LaunchContext
from .entities import LaunchDescription, SomeSubstitutionsType, perform, substitutions
from .errors import LaunchError, UnsupportedError, caller

OTHER_FORMATS = {".xml": "XML", ".yaml": "YAML", ".yml": "YAML"}


def read_python(path: Path) -> LaunchDescription:
    """Return the description that a Python launch file generates."""
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


def read_any(path: Path) -> LaunchDescription:
    """Return the description in a launch file; XML and YAML are told apart from Python by the name."""
    if (other := OTHER_FORMATS.get(path.suffix)) is not None:
        raise UnsupportedError(
            f"the {other} launch file {path.name}",
            "Write it as a Python launch file (.launch.py) with generate_launch_description().",
            caller(),
        )
    return read_python(path)


class LaunchDescriptionSource:
    """A description, or the place of a file that has one. One source serves one include."""

    method = "unspecified mechanism from a script"

    def __init__(self, launch_description: Any = None, location: SomeSubstitutionsType = "", method: str = "") -> None:
        self._place = substitutions(location)
        self._description: LaunchDescription | None = launch_description
        self._path: Path | None = None
        self.method = method or self.method

    @property
    def location(self) -> Path:
        """The file's path, once known."""
        return self._path or Path("<script>")

    def _read(self, path: Path) -> LaunchDescription:
        return read_any(path)

    def try_get_launch_description_without_context(self) -> LaunchDescription | None:
        """Return the description if its place depends on no configuration and the file can be read."""
        if self._description is None and all(one.fixed for one in self._place):
            self._load(LaunchContext())
        return self._description

    def get_launch_description(self, context: LaunchContext) -> LaunchDescription:
        """Return the description."""
        if self._description is None:
            self._load(context)
        assert self._description is not None
        return self._description

    def _load(self, context: LaunchContext) -> None:
        place = perform(context, self._place)
        # An absolute path, but with its links kept: a symlinked install names its folder as the user does.
        self._path = Path(place).absolute()
        self._description = self._read(self._path)


class PythonLaunchDescriptionSource(LaunchDescriptionSource):
    """A Python launch file."""

    method = "interpreted python launch file"

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path)

    def _read(self, path: Path) -> LaunchDescription:
        return read_python(path)


class AnyLaunchDescriptionSource(LaunchDescriptionSource):
    """A launch file in any format; here, in Python."""

    method = "interpreted frontend launch file"

    def __init__(self, launch_file_path: SomeSubstitutionsType) -> None:
        super().__init__(None, launch_file_path)
