"""The cache of builds: keyed by all that decides a result, checksummed against damage, locked against races."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import stat
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from grader import evidence
from grader.building.install_tree import regular_files
from grader.host import ros_env, tempdir
from grader.intake.names import build_tree

LOCK = ".lock"
"""The suffix of the file beside an entry that is held by whoever makes it."""

_IGNORED = ("__pycache__", ".git", ".pytest_cache")


def cache_folder() -> Path:
    """Return the folder for builds: $ROS2_COURSE_KIT_CACHE, or a folder in the user's cache."""
    chosen = os.environ.get("ROS2_COURSE_KIT_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(chosen or Path(base) / "ros2-course-kit").expanduser()


def build_key(packages: Sequence[Path], *contract: str) -> str:
    """Return a hash of everything that decides a build's result; `contract` is what decides what is read of it."""
    own_sources = (ros_env.CMAKE_HOOK, *sorted(Path(__file__).parent.glob("*.py")))
    parts = (toolchain_id(), *(path.read_text() for path in own_sources), *contract)
    return content_key(packages, *parts, leaving_out=_IGNORED)[:40]


def content_key(packages: Sequence[Path], *parts: str, leaving_out: Sequence[str] = ()) -> str:
    """Return a hash of `parts` and the packages' files, except in build trees and folders named in `leaving_out`."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part.encode() + b"\0")
    for package in packages:
        for path in sorted(regular_files(package)):
            relative = path.relative_to(package)
            made = any(build_tree(package / folder) for folder in relative.parents[:-1])
            if not made and not any(part in leaving_out for part in relative.parts):
                mode = "x" if path.stat().st_mode & 0o100 else "-"
                digest.update(f"{package.name}/{relative}\0{mode}\0".encode("utf-8", "surrogateescape"))
                digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def not_source(folder: str, names: list[str]) -> list[str]:
    """Return which of `names` in a folder are not copied into a build. An `ignore` function for shutil.copytree."""
    paths = [Path(folder, name) for name in names]
    return [path.name for path in paths if path.name in _IGNORED or path.is_symlink() or build_tree(path)]


@cache
def toolchain_id() -> str:
    """Return the versions and places of what builds and runs packages."""
    # By the names of folders: to read the metadata of three hundred distributions takes 0.1 s of CPU time.
    installed = {path.name for folder in sys.path for path in Path(folder).glob("*.dist-info")}
    versions = sorted(name for name in installed if name.startswith(("ros_jazzy", "colcon", "cmake")))
    return "\n".join([str(ros_env.PREFIX), str(ros_env.BASE_PREFIX), *versions])


def checksum(folder: Path) -> str:
    """Return the checksum that was written of a folder in the cache, "" if there is none."""
    try:
        return folder.with_suffix(".sha256").read_text()
    except OSError:
        return ""


def load(folder: Path) -> evidence.Build | None:
    """Return the facts of a finished build; None if there is none or it is damaged, and so must be built again."""
    try:
        facts = evidence.from_json((folder / "build.json").read_text(), evidence.Build)
    except (OSError, ValueError):
        return None
    return facts if is_intact(folder / "install") else None


def write_checksum(folder: Path) -> None:
    """Write the checksum of a folder beside it."""
    folder.with_suffix(".sha256").write_text(_checksum(folder))


def is_intact(folder: Path) -> bool:
    """Return whether a folder is what `write_checksum` saw: a failing disk or a clean-up may have damaged it."""
    return checksum(folder) == _checksum(folder)


def _checksum(root: Path) -> str:
    """Return a hash of the names, kinds and bytes of everything below `root`; Python's own caches do not count."""
    digest = hashlib.sha256()
    for here, folders, names in os.walk(root):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        for name in sorted([*names, *folders]):
            path = Path(here, name)
            digest.update(f"{path.relative_to(root)}\0".encode("utf-8", "surrogateescape"))
            if path.is_symlink():
                digest.update(b"link" + os.fsencode(path.readlink()))
            elif path.is_file():
                executable = path.stat().st_mode & stat.S_IXUSR
                digest.update(b"x" if executable else b"-")
                digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


@contextmanager
def locked(path: Path, *, wait: bool = True) -> Iterator[None]:
    """Hold a lock on `path`, so that two gradings never build the same content at once.

    Raises:
        BlockingIOError: somebody holds it, and `wait` is false.
    """
    with path.open("a") as held:
        fcntl.flock(held, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield


def remove_abandoned(cache: Path) -> None:
    """Remove what gradings that were killed while they built have left."""
    for left in (cache / "builds").glob("*.work"):
        lock = left.with_name(left.name.partition(".")[0] + LOCK)
        with contextlib.suppress(BlockingIOError), locked(lock, wait=False):  # else it is being built now
            tempdir.remove(left)
