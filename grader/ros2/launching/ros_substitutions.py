"""The substitutions of `launch_ros.substitutions`."""

from __future__ import annotations

import os

from . import packages
from .context import LaunchContext
from .entities import SomeSubstitutionsType, Substitution, describe, perform, substitutions
from .errors import SubstitutionFailure
from .substitutions import PathJoinSubstitution


class FindPackagePrefix(Substitution):
    """The prefix that a package is installed in."""

    def __init__(self, package: SomeSubstitutionsType) -> None:
        self.package = substitutions(package)

    @property
    def fixed(self) -> bool:  # type: ignore[override]
        """True where the package's name is."""
        return all(one.fixed for one in self.package)

    def find(self, package_name: str) -> str:
        """Return the place for a package."""
        return str(packages.prefix(package_name))

    def perform(self, context: LaunchContext) -> str:
        """Return the place."""
        return self.find(perform(context, self.package))

    def describe(self) -> str:
        """Return how `--show-args` shows it."""
        return f"{type(self).__name__}(pkg={describe(self.package)})"

    def __truediv__(self, other: SomeSubstitutionsType) -> PathJoinSubstitution:
        """Return a path below it."""
        return PathJoinSubstitution([self, other])


class FindPackageShare(FindPackagePrefix):
    """The share folder of a package."""

    def find(self, package_name: str) -> str:
        """Return the place for a package."""
        return str(packages.share(package_name))


class ExecutableInPackage(Substitution):
    """The path of a package's executable."""

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType) -> None:
        self.executable, self.package = substitutions(executable), substitutions(package)

    def perform(self, context: LaunchContext) -> str:
        """Return the path; there is no search on PATH."""
        name, package = perform(context, self.executable), perform(context, self.package)
        folder = packages.prefix(package) / "lib" / package
        path = folder / name
        if not (path.is_file() and os.access(path, os.X_OK)):
            there = sorted(p.name for p in folder.iterdir() if os.access(p, os.X_OK)) if folder.is_dir() else []
            has = f"; it holds {', '.join(there)}" if there else ""
            raise SubstitutionFailure(f"executable '{name}' not found on the libexec directory '{folder}'{has}")
        return str(path)

    def describe(self) -> str:
        """Return how `--show-args` shows it."""
        return f"ExecInPkg(executable={describe(self.executable)}, pkg={describe(self.package)})"
