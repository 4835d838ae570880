"""Serve requests in the sandbox: run each test module in a fork of one warm process. Imports nothing of the grader.

The worker imports once what every run needs (pytest, coverage, rclpy, the usual messages), and nothing of the
submission. For each request it restores the package as handed in, changes the files that the request names, forks,
and lets pytest run one module in the fork (`pytest_run`). When the fork has ended, everything it started is killed.

What is written to `out` comes from a process shared with the submission: it is data, and the host checks it.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import inspect
import json
import os
import runpy
import select
import shutil
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PACKAGE = Path("/ws/package")
REQUESTS = Path("/ws/requests")
OUT = Path("/ws/out")
POLL_S = 0.002
LOOK_S = 0.05  # between two looks at a running test; the end of its process is seen at once
_SET_DUMPABLE = 4  # <linux/prctl.h>
RESTORE_CAP = 2_000_000  # bytes; longer files (maps, bags) are not restored before each run

Request = Mapping[str, Any]
"""A ModuleRequest of `warm_worker`, as read from JSON."""
RunModule = Callable[[int, Request, Path], None]
Compile = Callable[[Path, bytes], "tuple[Path, bytes] | None"]
Files = dict[Path, tuple[bytes, tuple[int, int], int]]
"""Files as they were handed in: path -> bytes, times (access, change) in nanoseconds, mode."""


def main() -> None:
    """Serve requests until the sandbox is killed."""
    settings = json.loads((REQUESTS / "settings.json").read_text())
    modules = Path(settings["modules"])
    handed_in = read_files(PACKAGE) | {path: file for path, file in read_files(modules).items() if path.suffix == ".py"}
    # Not imported, so that no test finds the module in sys.modules.
    pytest_run = runpy.run_path(str(Path(__file__).with_name("pytest_run.py")))
    run_module: RunModule = pytest_run["prepare"]()
    bytecode = ByteCode(handed_in, pytest_run["compile_module"], pytest_run["compile_tests"])
    bytecode.add_modules(modules)
    if settings["warm"]:
        runpy.run_path(str(Path(__file__).with_name("warm_imports.py")))["import_modules"]()
        importlib.import_module("unittest.mock")  # which tests import; it takes 50 ms
    # For a log line, a traceback or coverage's start it looks at every module that it does not know yet.
    inspect.getmodule(inspect.currentframe(), os.devnull)
    gc.collect()
    gc.freeze()  # a fork that never touches these pages never copies them
    set_dumpable(False)
    number = 0
    while True:
        request = await_request(number)
        bytecode.add_tests(request["modules"])
        serve(number, request, modules, handed_in, run_module)
        number += 1


def set_dumpable(wanted: bool) -> None:
    """Let this process's memory and descriptors be open to those that it forks, or not. See prctl(2)."""
    ctypes.CDLL(None).prctl(_SET_DUMPABLE, int(wanted), 0, 0, 0)


def read_files(folder: Path) -> Files:
    """Return the files below `folder`, without links and big files."""
    found: Files = {}
    for here, _, names in os.walk(folder):
        for name in names:
            path = Path(here, name)
            facts = path.lstat()
            if path.is_file() and not path.is_symlink() and facts.st_size <= RESTORE_CAP:
                found[path] = (path.read_bytes(), (facts.st_atime_ns, facts.st_mtime_ns), facts.st_mode & 0o7777)
    return found


def await_request(number: int) -> Request:
    """Return request `number`. Waits until the host has deleted its file, so that no test finds it."""
    path = REQUESTS / f"{number}.json"
    while not path.exists():
        time.sleep(POLL_S)
    request: Request = json.loads(path.read_text())
    (OUT / f"{number}.taken").touch()
    while path.exists():
        time.sleep(POLL_S)
    return request


class ByteCode:
    """Compiles the package's modules and tests once, for all runs; their byte code is restored like their texts.

    Python and pytest compare it with the text before they use it, so a changed module is compiled anew.
    """

    def __init__(self, handed_in: Files, compile_module: Compile, compile_tests: Compile) -> None:
        self.handed_in = handed_in
        self.compile_module = compile_module
        self.compile_tests = compile_tests
        self.known: set[Path] = set()

    def add_modules(self, folder: Path) -> None:
        """Compile the installed modules."""
        for path in [path for path in self.handed_in if path.is_relative_to(folder)]:
            self.add(path, self.compile_module)

    def add_tests(self, modules: Sequence[str]) -> None:
        """Compile test modules, and each conftest.py that belongs to them, as pytest does."""
        for name in modules:
            path = PACKAGE / name
            for each in (path, *(folder / "conftest.py" for folder in path.parents)):
                if each in self.handed_in:
                    self.add(each, self.compile_tests)

    def add(self, path: Path, compiled: Compile) -> None:
        """Compile a file unless that has been done."""
        if path in self.known:
            return
        self.known.add(path)
        data, times, _ = self.handed_in[path]
        if (made := compiled(path, data)) is not None:
            self.handed_in[made[0]] = (made[1], times, 0o644)


def serve(number: int, request: Request, modules: Path, handed_in: Files, run_module: RunModule) -> None:
    """Run one request in a fork and write how it ended."""
    restore(modules, handed_in, request["files"])
    for left in OUT.glob("coverage*"):
        with contextlib.suppress(OSError):
            left.unlink()
    pid = os.fork()
    if pid == 0:
        set_dumpable(True)
        with contextlib.suppress(BaseException):
            run_module(number, request, modules)
        os._exit(99)
    end = watch(pid, OUT / f"{number}.report", request)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.kill(-1, signal.SIGKILL)  # everything but this process and the sandbox's init
    facts = {"status": end.status, "late": end.timed_out, "queued": round(end.queued_s, 3)}
    done = OUT / f"{number}.done"
    done.with_suffix(".part").write_text(json.dumps(facts))
    done.with_suffix(".part").rename(done)


def restore(modules: Path, handed_in: Files, changed: Mapping[str, str]) -> None:
    """Restore the package as handed in except for the files `changed`, and delete what the last run left behind."""
    for folder in (Path("/tmp"), Path(os.environ["HOME"]), Path("/dev/shm")):
        empty(folder)
    for root in (PACKAGE, modules):
        for here, folders, names in os.walk(root):
            for name in names:
                if name.endswith((".py", ".pyc")) and (path := Path(here, name)) not in handed_in:
                    path.unlink(missing_ok=True)
            if "__pycache__" in folders and (path := Path(here, "__pycache__")).is_symlink():
                path.unlink()
    for path, (data, times, mode) in handed_in.items():
        put(path, data, times, mode)
    some_times = next(iter(handed_in.values()))[1] if handed_in else (0, 0)
    for name, text in changed.items():
        path = Path(name)
        _, times, mode = handed_in.get(path, (b"", some_times, 0o644))
        # Same times as before: neither a test nor a stale bytecode file can tell a changed module from the original.
        put(path, text.encode("utf-8", "surrogateescape"), times, mode)


def put(path: Path, data: bytes, times: tuple[int, int], mode: int) -> None:
    """Write `data` to `path` unless the file is already as it should be."""
    with contextlib.suppress(OSError):
        facts = path.lstat()
        if path.is_symlink() or not path.is_file() or path.read_bytes() != data:
            path.unlink()
        elif facts.st_mtime_ns == times[1] and facts.st_mode & 0o7777 == mode:
            return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    path.chmod(mode)
    os.utime(path, ns=times)


def empty(folder: Path) -> None:
    """Delete everything below `folder`, except a Python installation."""
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            if any(Path(prefix).is_relative_to(path) for prefix in (sys.prefix, sys.base_prefix)):
                # It is mounted read-only; but trying to delete its 800 MB takes seconds, at every run.
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


@dataclass(frozen=True)
class End:
    """How a fork ended: its status, the test that ran out of time ("" if none), and how long it waited for a core."""

    status: int
    timed_out: str
    queued_s: float


def watch(pid: int, report: Path, request: Request) -> End:
    """Wait for the fork, and kill it when a test takes too long.

    Time spent waiting for a core does not count: a grade must not depend on what else the machine does.
    """
    began = seen = time.monotonic()
    size, current = 0, ""
    queued = 0.0
    end = os.pidfd_open(pid)
    while True:
        select.select([end], [], [], LOOK_S)
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            os.close(end)
            return End(os.waitstatus_to_exitcode(status), "", queued)
        queued = max(queued, waited_for_core(pid))
        now = time.monotonic() - queued
        with contextlib.suppress(OSError):
            if report.stat().st_size != size:
                size, seen = report.stat().st_size, now
                current = latest(report)
        limit = request["limits"].get(current, request["limit"])
        if now - began > request["total"] or now - seen > limit or is_stopped(pid):
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return End(-signal.SIGKILL, current or "collection", queued)
        time.sleep(POLL_S)


def is_stopped(pid: int) -> bool:
    """Return whether a process has been stopped by a signal: it will never end by itself."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"
    return False


def waited_for_core(pid: int) -> float:
    """Return how many seconds a process waited for a core, by its worst thread; 0 if unknown."""
    longest = 0
    with contextlib.suppress(OSError, ValueError, IndexError):
        for thread in Path(f"/proc/{pid}/task").iterdir():
            longest = max(longest, int((thread / "schedstat").read_text().split()[1]))
    return longest * 1e-9


def latest(report: Path) -> str:
    """Return the test that is running, according to the last lines of the report."""
    with report.open("rb") as stream:
        stream.seek(max(0, report.stat().st_size - 4096))
        lines = stream.read().decode("utf-8", "replace").splitlines()
    for line in reversed(lines):
        with contextlib.suppress(ValueError, TypeError, AttributeError, RecursionError):
            entry = json.loads(line)
            return str(entry.get("start") or entry.get("id") or "")
    return ""


if __name__ == "__main__":
    main()
