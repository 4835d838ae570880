"""What this host ran out of or forbids, in words. Such a fault is ours: no submission loses points by it."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Iterator
from pathlib import Path

from grader.errors import GraderError

LITTLE_ROOM = 16 * 1024 * 1024
"""A disk with less free than these bytes is full: what a compiler could not write has been taken away again."""
_FEW_FILES = 100
_NEEDED = 1_000_000_000  # of address space, which is more than memory: an observer of a trial maps 700 MB

_SAFE = "No points are lost by it, and earlier results are as they were"
NO_MEMORY = (
    f"There is no memory left for the grader. {_SAFE}. Close other programs, or raise the limit that `ulimit -v` "
    "shows, and grade again."
)
KILLED = (
    "A process of the grader's was killed from outside, as the kernel does when memory runs out (`dmesg` shows it). "
    f"{_SAFE}. Close other programs and grade again."
)
_FILES = f"The grader may open no more files. {_SAFE}. Raise the limit that `ulimit -n` shows and grade again."
# What the standard library and the loader say, in errors that bear no number.
_MEMORY_WORDS = ("can't start new thread", "failed to map segment", "cannot allocate memory", "memoryerror")
_NOT_A_FOLDER = (errno.ENOTDIR, errno.EEXIST, errno.EISDIR)
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)


def require_memory() -> None:
    """Check that the grader may use the memory that it needs.

    Raises:
        GraderError: somebody has set a lower limit. Some libraries would end the process instead of saying so.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if 0 <= limit < _NEEDED:
        raise GraderError(
            f"The grader may use no more than {limit // 1_000_000} MB of address space, and needs "
            f"{_NEEDED // 1_000_000}. Say `ulimit -v unlimited` in this shell, or ask who has set the limit, and grade "
            "again."
        )


def explain(error: BaseException) -> str:
    """Return what happened, to what, and what to do next, if the host's state has caused `error`; "" if not."""
    return next((said for each in _chain(error) if (said := _said(each))), "")


def in_text(text: str) -> str:
    """Return the same for what a process of ours has said at its end."""
    low = text.lower()
    if "no space left on device" in low or "disk quota exceeded" in low:
        return _full("")
    return NO_MEMORY if any(word in low for word in _MEMORY_WORDS) else ""


def full(folder: Path) -> str:
    """Return the same if the disk that holds `folder` is full."""
    try:
        facts = os.statvfs(folder)
    except OSError:
        return ""
    few_files = facts.f_files > 0 and facts.f_favail < _FEW_FILES
    little_room = facts.f_blocks > 0 and facts.f_bavail * facts.f_frsize < LITTLE_ROOM  # some file systems tell nothing
    return _full(str(folder)) if little_room or few_files else ""


def _said(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return NO_MEMORY
    number = error.errno if isinstance(error, OSError) else None
    what = str(error.filename or "") if isinstance(error, OSError) else ""
    if number in (errno.ENOSPC, errno.EDQUOT):
        return _full(what)
    if number == errno.ENOMEM or any(word in str(error).lower() for word in _MEMORY_WORDS):
        return NO_MEMORY
    if number in (errno.EMFILE, errno.ENFILE):
        return _FILES
    if number in _FORBIDDEN and what:
        return f"The grader may not use {what}: {os.strerror(number)}. {_SAFE}. Change its permissions or its place."
    if number in _NOT_A_FOLDER and what:
        return f"{what} is in the way: {os.strerror(number)}. {_SAFE}. Take it away or choose another place."
    if number == errno.ENOENT and what and "/" not in what:
        return f"The program {what} is not on the PATH. {_SAFE}. Run `grader doctor`; it says how to mend it."
    return ""


def _full(what: str) -> str:
    where = f"The disk at {_mount_point(what)} is full" if what else "A disk is full (`df -h` shows which)"
    return f"{where}. {_SAFE}. Free some space there and grade again."


def _mount_point(path: str) -> str:
    """Return where the disk is mounted that holds `path`, or would hold it."""
    place = Path(path).absolute()
    while not os.path.ismount(place):
        place = place.parent
    return str(place)


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yield the error and what led to it, the last first."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
