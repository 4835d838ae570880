"""The substitutions of `launch_ros.substitutions`: the places of packages and of their executables."""

from __future__ import annotations

import os
from pathlib import Path

from ..commands import packages  # noqa: TID252 - the folder has no fixed name, so there is no absolute import
from .context import LaunchContext
from .entities import SomeSubstitutionsType, Substitution, perform, substitutions
from .errors import PackageNotFoundError, SubstitutionFailure

PARAMETERS = "global_params"  # the configuration that holds the settings for all nodes


def find_prefix(package: str) -> Path:
    """Return the prefix that a package is installed in.

    Raises:
        PackageNotFoundError: no prefix holds it; the message says what to do about that, if it is known.
    """
    if (found := packages.prefix(package)) is not None:
        return found
    advice = packages.advice(package).strip()
    searched = [str(one) for one in packages.prefixes()]
    raise PackageNotFoundError(
        f"\"package '{package}' not found, searching: {searched}\"{f' - {advice}' if advice else ''}"
    )


class FindPackagePrefix(Substitution):
    """The prefix that a package is installed in."""

    shown = "FindPackagePrefix(pkg={package})"

    def __init__(self, package: SomeSubstitutionsType) -> None:
        self.package = substitutions(package)

    def find(self, package_name: str) -> str:
        return str(find_prefix(package_name))

    def perform(self, context: LaunchContext) -> str:
        return self.find(perform(context, self.package))


class FindPackageShare(FindPackagePrefix):
    """The share folder of a package."""

    shown = "FindPackageShare(pkg={package})"

    def find(self, package_name: str) -> str:
        return str(find_prefix(package_name) / "share" / package_name)


class ExecutableInPackage(Substitution):
    """The path of a package's executable."""

    shown = "ExecInPkg(executable={executable}, pkg={package})"

    def __init__(self, executable: SomeSubstitutionsType, package: SomeSubstitutionsType) -> None:
        self.executable, self.package = substitutions(executable), substitutions(package)

    def perform(self, context: LaunchContext) -> str:
        """Return the path; PATH is not searched."""
        name, package = perform(context, self.executable), perform(context, self.package)
        folder = find_prefix(package) / "lib" / package
        path = folder / name
        if not (path.is_file() and os.access(path, os.X_OK)):
            there = sorted(p.name for p in folder.iterdir() if os.access(p, os.X_OK)) if folder.is_dir() else []
            has = f"; it holds {', '.join(there)}" if there else ""
            raise SubstitutionFailure(f"executable '{name}' not found on the libexec directory '{folder}'{has}")
        return str(path)
