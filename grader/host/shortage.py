"""Explain what this host has run out of or forbids. Such an error is the grader's: it costs a submission no points."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Callable, Iterator
from pathlib import Path

from grader.errors import GraderError
from grader.words import mark, say

MIN_FREE_BYTES = 16 * 1024 * 1024
"""A disk with less free space counts as full: a compiler that meets a full disk removes what it has written."""
_MIN_FREE_FILES = 100
_NEEDED_BYTES = 1_000_000_000  # of address space, which is more than memory: an observer of a trial maps 700 MB

FEW_PROCESSES = 128
"""One trial and its build have 90 processes and threads at once; a whole grading has more."""

NO_MEMORY = mark(
    "The grader has run out of memory. No points are lost, and earlier results are unchanged. Close other programs, or "
    "raise the limit that `ulimit -v` shows, and grade again."
)
KILLED = mark(
    "A process of the grader was killed from outside, as the kernel does when memory runs out (`dmesg` shows it). "
    "No points are lost, and earlier results are unchanged. Close other programs and grade again."
)
_FILES = mark(
    "The grader has reached its limit on open files. No points are lost, and earlier results are unchanged. Raise the "
    "limit that `ulimit -n` shows and grade again."
)
_FORBIDS = mark(
    "The grader may not use {what}: {why}. No points are lost, and earlier results are unchanged. Change its "
    "permissions, remove what is in the way, or choose another place."
)
_LACKS = mark(
    "The program {what} is not on the PATH. No points are lost, and earlier results are unchanged. Run "
    "`grader doctor`; it prints the fix."
)
# Messages of the standard library and the loader in errors without an errno.
_MEMORY_WORDS = ("can't start new thread", "failed to map segment", "cannot allocate memory", "memoryerror")
_FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EEXIST, errno.EISDIR)


def require_memory() -> None:
    """Check that the grader may use the memory that it needs.

    Raises:
        GraderError: a lower limit is set. Some libraries would end the process without a message.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if 0 <= limit < _NEEDED_BYTES:
        raise GraderError(
            say(
                "The grader may use only {limit} MB of address space and needs {needed}. "
                "Run `ulimit -v unlimited` in this shell, or ask your administrator to raise the limit, and grade "
                "again.",
                limit=limit // 1_000_000,
                needed=_NEEDED_BYTES // 1_000_000,
            )
        )


def process_limit(read: Callable[[str], str | None]) -> int:
    """Return how many processes a container's cgroup allows as `read` reads its files, a huge number if any."""
    found = [read(path) or "" for path in ("/sys/fs/cgroup/pids/pids.max", "/sys/fs/cgroup/pids.max")]
    return min((int(text) for text in found if text.strip().isdigit()), default=1 << 30)


def free_memory(read: Callable[[str], str | None] = lambda path: Path(path).read_text()) -> int:
    """Return the bytes of memory that new processes can use, swap left out, as /proc/meminfo estimates them."""
    lines = (read("/proc/meminfo") or "").splitlines()
    return next((int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")), 0)


def explain(error: BaseException) -> str:
    """Return what happened, to what, and what to do next, if the host's state caused `error`; "" if not."""
    return next((sentence for each in _chain(error) if (sentence := _explain_one(each))), "")


def explain_output(output: str) -> str:
    """Return the same for the output of a process of the grader that failed."""
    low = output.lower()
    if "no space left on device" in low or "disk quota exceeded" in low:
        return _disk_full("")
    return say(NO_MEMORY) if any(word in low for word in _MEMORY_WORDS) else ""


def explain_disk(folder: Path) -> str:
    """Return the same if the disk that holds `folder` is full; "" if not."""
    try:
        facts = os.statvfs(folder)
    except OSError:
        return ""
    few_files = facts.f_files > 0 and facts.f_favail < _MIN_FREE_FILES
    little_space = facts.f_blocks > 0 and facts.f_bavail * facts.f_frsize < MIN_FREE_BYTES  # some file systems report 0
    return _disk_full(str(folder)) if little_space or few_files else ""


def _explain_one(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return say(NO_MEMORY)
    number = error.errno if isinstance(error, OSError) else None
    what = str(error.filename or "") if isinstance(error, OSError) else ""
    if number in (errno.ENOSPC, errno.EDQUOT):
        return _disk_full(what)
    if number == errno.ENOMEM or any(word in str(error).lower() for word in _MEMORY_WORDS):
        return say(NO_MEMORY)
    if number in (errno.EMFILE, errno.ENFILE):
        return say(_FILES)
    if number in _FORBIDDEN and what:
        return say(_FORBIDS, what=what, why=os.strerror(number))
    if number == errno.ENOENT and what and "/" not in what:
        return say(_LACKS, what=what)
    return ""


def _disk_full(path: str) -> str:
    if path:
        where = say("The disk at {place} is full.", place=_mount_point(path))
    else:
        where = say("A disk is full (`df -h` shows which).")
    rest = say("No points are lost, and earlier results are unchanged. Free some space there and grade again.")
    return f"{where} {rest}"


def _mount_point(path: str) -> str:
    """Return where the disk that holds `path`, or would hold it, is mounted."""
    place = Path(path).absolute()
    while not os.path.ismount(place):
        place = place.parent
    return str(place)


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yield the error and its causes, the last first."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__
