"""What a submission can import: the packages that the kit installs, and those of a course's extra-requirements.txt."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from grader import KIT
from grader.course.model import Course
from grader.errors import GraderError

EXTRA = "extra-requirements.txt"
"""In a course's folder: a line `name==version` for each package that it adds, and for each that these need."""

_MORE_OF_ROS = ("rcl_interfaces", "ament_index_python", "launch", "launch_ros")
_HASH = re.compile(r"\s--hash=\S+")


@dataclass(frozen=True)
class Package:
    """A package as pip knows it, with the one version that is offered, and the modules that Python imports of it."""

    name: str
    version: str

    @property
    def modules(self) -> tuple[str, ...]:
        """Return the modules; for a package that is not installed, what its name suggests."""
        name = canonicalize_name(self.name)
        of_name = name.replace("-", "_")
        found = [module for module, names in _modules().items() if name in map(canonicalize_name, names)]
        public = tuple(sorted(module for module in found if re.fullmatch(r"[A-Za-z]\w*", module)))
        return (of_name,) if of_name in public or not public else public


@cache
def extra(course: Course) -> tuple[Package, ...]:
    """Return the packages that a course adds.

    Raises:
        GraderError: a line does not name one version.
    """
    path = course.folder / EXTRA
    lines = path.read_text(encoding="utf-8").replace("\\\n", " \n").splitlines() if path.is_file() else []
    found = [_package(path, number, text) for number, line in enumerate(lines, 1) if (text := _bare(line))]
    return tuple(package for package in found if package is not None)


def offered(course: Course) -> tuple[Package, ...]:
    """Return the packages of Python that a submission can import, sorted: the kit's, and those that a course adds."""
    kits = {canonicalize_name(name) for name in (*_project()["dependencies"], "pytest")}
    found: dict[str, list[str]] = {}
    for name, version in re.findall(
        r"(?m)^([\w.-]+)==([^\s;]+)", (KIT / "requirements.txt").read_text(encoding="utf-8")
    ):
        if canonicalize_name(name) in kits:
            found.setdefault(name, []).append(version)  # one for each of several versions of Python
    own = {package.name: package for package in extra(course)}
    return tuple(
        package for _, package in sorted(({n: Package(n, " or ".join(v)) for n, v in found.items()} | own).items())
    )


def of_ros() -> tuple[str, ...]:
    """Return the packages of ROS that nodes and launch files can import."""
    names = [re.fullmatch(r"ros-jazzy-([\w-]+).*", name) for name in _project()["optional-dependencies"]["ros"]]
    return (*(name[1].replace("-", "_") for name in names if name), *_MORE_OF_ROS)


def names(course: Course) -> str:
    """Return in words what a submission can import of Python's packages, as Python names them."""
    return ", ".join(module for package in offered(course) for module in package.modules)


def keys(course: Course, module: str) -> list[str]:
    """Return the packages that a course adds in which a module is; package.xml may name it by them."""
    return [package.name for package in extra(course) if module in package.modules]


def missing(course: Course) -> list[str]:
    """Return which packages that a course adds are not here, or here in another version, and what they lack."""
    return [words for package in extra(course) if (words := _missing(package))]


def install_line(course: Course) -> str:
    """Return the command that installs what a course adds."""
    return f".venv/bin/python -m pip install --no-deps -r {course.folder / EXTRA}"


def require(course: Course) -> None:
    """Check that what a course adds is installed.

    Raises:
        GraderError: something is not.
    """
    if lacking := missing(course):
        raise GraderError(f"{course.folder / EXTRA}: {'; '.join(lacking)}.", f"Run: {install_line(course)}")


def _bare(line: str) -> str:
    return _HASH.sub("", f" {line.partition('#')[0]}").strip()


def _package(path: Path, number: int, text: str) -> Package | None:
    try:
        found = Requirement(text)
    except InvalidRequirement:
        found = None
    version = re.fullmatch(r"==([^*,]+)", str(found.specifier)) if found else None
    if found is None or version is None:
        raise GraderError(f"{path}, line {number}: {text} names no single version; write it as name==1.2.3.")
    return None if found.marker and not found.marker.evaluate() else Package(found.name, version[1])


def _missing(package: Package) -> str:
    try:
        here = metadata.distribution(package.name)
    except metadata.PackageNotFoundError:
        return f"{package.name} {package.version} is not installed"
    if here.version != package.version:
        return f"{package.name} is {here.version}, not {package.version}"
    for needed in map(Requirement, here.requires or ()):
        if needed.marker is None or needed.marker.evaluate({"extra": ""}):
            try:
                if needed.specifier.contains(metadata.version(needed.name), prereleases=True):
                    continue
            except metadata.PackageNotFoundError:
                pass
            return f"{package.name} needs {needed.name}{needed.specifier}, which is not here; add a line for it"
    return ""


@cache
def _modules() -> dict[str, list[str]]:
    return dict(metadata.packages_distributions())


@cache
def _project() -> dict[str, Any]:
    found: dict[str, Any] = tomllib.loads((KIT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return found
