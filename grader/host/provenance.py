"""The versions and hashes that decide a grade, recorded so that an appeal can repeat the grading."""

from __future__ import annotations

import datetime as dt
import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata
from pathlib import Path

from grader import KIT
from grader.host import ros_env

_DISTRIBUTIONS = ("ros2-course-kit", "ros-jazzy-rclpy", "pymunk", "numpy", "pytest", "coverage")
# What of the grader only calls a grading, and the courses.
_ABOVE_GRADING = frozenset({"authoring", "classroom", "courses", "notebook", "selftest", "cli.py", "hunting.py"})


def environment() -> dict[str, str]:
    """Return the versions of the software that graded, by name, with the system and its number of cores."""
    versions = {name: _version(name) for name in _DISTRIBUTIONS}
    return versions | {
        "ros": ros_env.name(),
        "python": platform.python_version(),
        "system": platform.platform(),
        "cores": str(os.cpu_count()),
    }


def kit_hash(course: Sequence[Path]) -> str:
    """Return a hash of the code that decides a grade by the folders of a course, 16 hexadecimal digits."""
    found = [path for folder in (KIT / "grader", KIT / "sim") for path in folder.rglob("*.py")]
    engine = (path for path in found if path.relative_to(KIT).parts[1] not in _ABOVE_GRADING)
    kinds = ("checks", "contract", "extra-requirements.txt", "functions", "held_back", "hunts", "trials", "worlds")
    return _hash({KIT: engine} | {folder: _files(folder, *kinds) for folder in course})


def checks_hash(course: Sequence[Path]) -> str:
    """Return a hash of the code that judges evidence by the folders of a course, 16 hexadecimal digits."""
    found = [path for room in ("checks", "scoring") for path in (KIT / "grader" / room).rglob("*.py")]
    kinds = ("checks", "contract", "functions", "held_back/checks")
    return _hash({KIT: found} | {folder: _files(folder, *kinds) for folder in course})


def _files(course: Path, *folders: str) -> Iterable[Path]:
    found = (path for folder in folders for path in (course / folder, *(course / folder).rglob("*")))
    return (path for path in found if path.is_file() and path.suffix != ".pyc")


def _hash(paths: Mapping[Path, Iterable[Path]]) -> str:
    """Return a hash of files, by the folders to which their names are relative."""
    digest = hashlib.sha256()
    for folder, files in paths.items():
        for path in sorted(files):
            digest.update(f"{path.relative_to(folder)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def commit() -> str:
    """Return the git commit of the kit, with "+changes" if files differ from it; "" for a kit without a repository."""
    if not (KIT / ".git").exists():
        return ""
    try:
        head, changes = _git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return ""
    return head + ("+changes" if changes else "")


def commit_time() -> int:
    """Return when the kit's git commit was made, in seconds since 1970; 0 for a kit without a repository."""
    if not (KIT / ".git").exists():  # git would look for a repository above, and obey its settings
        return 0
    try:
        return int(_git("log", "-1", "--format=%ct"))
    except (OSError, subprocess.SubprocessError, ValueError):
        return 0


def now() -> str:
    """Return the local time with its zone, to the second."""
    return dt.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")


def _git(*words: str) -> str:
    command = ["git", "-C", str(KIT), *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
