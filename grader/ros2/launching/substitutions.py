"""The substitutions of `launch.substitutions`. Each finds its text when it is performed, not when it is written."""

from __future__ import annotations

import importlib
import math
import os
import shlex
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

from ..commands import packages  # noqa: TID252 - the folder has no fixed name, so there is no absolute import
from .entities import (
    LaunchContext,
    SomeSubstitutionsType,
    Substitution,
    TextSubstitution,
    describe,
    is_substitution,
    perform,
    substitutions,
    truth,
)
from .errors import LaunchError, SubstitutionFailure


class LaunchConfiguration(Substitution):
    """The value of a launch argument, or of any configuration that has been set."""

    shown = "LaunchConfig({variable_name})"

    def __init__(self, variable_name: SomeSubstitutionsType, *, default: Any = None) -> None:
        self.variable_name = substitutions(variable_name)
        self.default = None if default is None else list(_texts(default))

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.variable_name)
        if name in context.launch_configurations:
            return str(context.launch_configurations[name])
        if self.default is None:
            raise SubstitutionFailure(f"launch configuration '{name}' does not exist")
        return perform(context, self.default)


def _texts(default: Any) -> Iterator[Substitution]:
    """Yield the parts of a default; what is not text becomes text, item by item."""
    for item in default if isinstance(default, Iterable) and not isinstance(default, str) else [default]:
        yield item if isinstance(item, Substitution) else TextSubstitution(text=str(item))


_listed = substitutions  # the keyword of the next class has this name


class PathJoinSubstitution(Substitution):
    """Parts of a path, joined by the separator."""

    def __init__(self, substitutions: Iterable[str | Substitution]) -> None:
        self.parts = _listed(substitutions)

    def perform(self, context: LaunchContext) -> str:
        return os.path.join(*(one.perform(context) for one in self.parts))  # noqa: PTH118 - keeps "./" and "//"

    def describe(self) -> str:
        return f"PathJoin({', '.join(one.describe() for one in self.parts)})"


class EnvironmentVariable(Substitution):
    """The value of an environment variable."""

    def __init__(self, name: SomeSubstitutionsType, *, default_value: SomeSubstitutionsType | None = None) -> None:
        self.name = substitutions(name)
        self.default_value = None if default_value is None else substitutions(default_value)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        if name in context.environment:
            return context.environment[name]
        if self.default_value is None:
            raise SubstitutionFailure(f"environment variable '{name}' does not exist")
        return perform(context, self.default_value)

    def describe(self) -> str:
        default = "" if self.default_value is None else f", default={describe(self.default_value)}"
        return f"EnvVar({describe(self.name)}{default})"


class FindExecutable(Substitution):
    """The path of a program on PATH."""

    shown = "FindExec({name})"

    def __init__(self, *, name: SomeSubstitutionsType) -> None:
        self.name = substitutions(name)

    def perform(self, context: LaunchContext) -> str:
        name = perform(context, self.name)
        if (found := shutil.which(name, path=context.environment.get("PATH"))) is None:
            raise SubstitutionFailure(f"executable '{name}' not found on the PATH")
        return found


class Command(Substitution):
    """The output of a command."""

    shown = "Command({command})"

    def __init__(self, command: SomeSubstitutionsType, *, on_stderr: SomeSubstitutionsType = "fail") -> None:
        self.command, self.on_stderr = substitutions(command), substitutions(on_stderr)

    def perform(self, context: LaunchContext) -> str:
        """Run the command and return its standard output; a failure, or by default stderr, stops the launch."""
        command = perform(context, self.command)
        try:
            done = subprocess.run(shlex.split(command), capture_output=True, text=True, check=False)
        except OSError as error:
            raise SubstitutionFailure(f"command '{command}' cannot be run: {error.strerror}") from error
        if done.returncode != 0:
            raise SubstitutionFailure(
                f"executed command failed. Command: {command}\nCaptured stderr output: {done.stderr}"
            )
        policy = perform(context, self.on_stderr)
        if done.stderr and policy in ("fail", "warn"):
            said = f"executed command showed stderr output. Command: {command}\nCaptured stderr output:\n{done.stderr}"
            if policy == "fail":
                raise SubstitutionFailure(said)
            if context.runner is not None:
                context.runner.output.warn("launch", said)
        return done.stdout


class PythonExpression(Substitution):
    """The value of a Python expression, as text; the expression may use the names of `math`."""

    shown = "PythonExpr({expression})"

    def __init__(self, expression: SomeSubstitutionsType, python_modules: Iterable[str] = ("math",)) -> None:
        self.expression, self.python_modules = substitutions(expression), list(python_modules)

    def perform(self, context: LaunchContext) -> str:
        known: dict[str, Any] = {"__builtins__": __builtins__}
        for name in self.python_modules:
            known[name] = importlib.import_module(perform(context, name))
        if "math" in known:
            known.update({name: value for name, value in vars(math).items() if not name.startswith("_")})
        expression = perform(context, self.expression)
        try:
            return str(eval(expression, known))
        except Exception as error:
            raise SubstitutionFailure(
                f"Python expression '{expression}' fails: {type(error).__name__}: {error}"
            ) from error


class ThisLaunchFileDir(Substitution):
    """The folder of the launch file that was read last."""

    def perform(self, context: LaunchContext) -> str:
        found = getattr(context.locals, "current_launch_file_directory", None)  # set by the include that reads the file
        if found is None:
            raise SubstitutionFailure("ThisLaunchFileDir used outside of a launch file (in a script)")
        return str(found)


class EqualsSubstitution(Substitution):
    """Whether two texts are equal: as truth values, as numbers, or letter by letter."""

    def __init__(self, left: Any, right: Any) -> None:
        texts = (one if is_substitution(one) else "" if one is None else str(one) for one in (left, right))
        self.sides = [substitutions(one) for one in texts]

    def perform(self, context: LaunchContext) -> str:
        return str(self.equal(context)).lower()

    def equal(self, context: LaunchContext) -> bool:
        """Return whether the two are equal."""
        left, right = (perform(context, side) for side in self.sides)
        truths = {"true": True, "1": True, "false": False, "0": False}
        if left.lower() in truths and right.lower() in truths:
            return truths[left.lower()] == truths[right.lower()]
        try:
            return math.isclose(float(left), float(right))
        except ValueError:
            return left == right


class NotEqualsSubstitution(EqualsSubstitution):
    """Whether two texts differ."""

    def perform(self, context: LaunchContext) -> str:
        return str(not self.equal(context)).lower()


class OrSubstitution(Substitution):
    """Whether one of two is true."""

    combine: Callable[[Iterable[bool]], bool] = staticmethod(any)

    def __init__(self, left: SomeSubstitutionsType, right: SomeSubstitutionsType) -> None:
        self.args = [substitutions(left), substitutions(right)]

    def perform(self, context: LaunchContext) -> str:
        return str(self.combine(truth(context, value) for value in self.args)).lower()


class AndSubstitution(OrSubstitution):
    """Whether both are true."""

    combine = staticmethod(all)


class NotSubstitution(Substitution):
    """The opposite of a truth value."""

    def __init__(self, value: SomeSubstitutionsType) -> None:
        self.value = substitutions(value)

    def perform(self, context: LaunchContext) -> str:
        return str(not truth(context, self.value)).lower()


# -- of launch_ros: the places of packages and of their executables ----------------------------------------------------
def find_prefix(package: str) -> Path:
    """Return the prefix that a package is installed in.

    Raises:
        LaunchError: no prefix holds it; the message says what to do about that, if it is known.
    """
    if (found := packages.prefix(package)) is not None:
        return found
    advice = packages.advice(package).strip()
    searched = [str(one) for one in packages.prefixes()]
    raise LaunchError(f"\"package '{package}' not found, searching: {searched}\"{f' - {advice}' if advice else ''}")


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
