"""Packages as the prefixes of AMENT_PREFIX_PATH have them."""

from __future__ import annotations

import os
from pathlib import Path

from . import hints


def every() -> list[Path]:
    """Return the prefixes in the order in which they are searched."""
    return [Path(part) for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]


def resource(kind: str, name: str) -> Path | None:
    """Return the file of a resource in the first prefix that has it."""
    found = (prefix / "share/ament_index/resource_index" / kind / name for prefix in every())
    return next((path for path in found if path.is_file()), None)


def names(kind: str) -> list[str]:
    """Return the names of all resources of a kind."""
    folders = (prefix / "share/ament_index/resource_index" / kind for prefix in every())
    return sorted({path.name for folder in folders if folder.is_dir() for path in folder.iterdir()})


def prefix(package: str) -> Path | None:
    """Return the prefix that holds a package."""
    found = resource("packages", package)
    return None if found is None else found.parents[4]


def executables(package: str) -> list[Path] | None:
    """Return the executables of a package, or nothing if there is no such package."""
    where = prefix(package)
    if where is None:
        return None
    folder = where / "lib" / package
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.rglob("*") if path.is_file() and os.access(path, os.X_OK))


def advice(package: str) -> str:
    """Return what to do about a package that is not found but seems to be near, else nothing."""
    here = Path.cwd()
    for folder in (here, *here.parents):
        install = folder / "install"
        if (install / package / "share" / package).is_dir() or (install / "share" / package).is_dir():
            return f"\nIt is built in {install}, which is not sourced here: source {install}/setup.bash"
        if (folder / "src" / package / "package.xml").is_file():
            return f"\nIts source is in {folder}/src: cd {folder} && colcon build && source install/setup.bash"
    return hints.near(package, names("packages"))
