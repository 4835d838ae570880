"""Serve requests in the sandbox: run each test module in a fork of one process.

The worker imports once what every run needs (pytest, coverage, rclpy, the usual messages), and nothing of the
submission. For each request it forks twice. The first fork writes the tree under test, which the host hands in, to the
sandbox's folders and ends; the second runs one module with pytest (`pytest_run`). When that has ended, the worker kills
everything that it has started. No test can stop or kill the worker: it is the first process of its sandbox. It never
reads the tree itself: a fork has a copy of its memory, in which tests must not find the text that was mutated.

The files in `out` may have been written by the submission, so the host treats them as data and checks them.
"""

from __future__ import annotations

import base64
import contextlib
import ctypes
import inspect
import json
import os
import runpy
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from grader.sandbox.first_process import (
    empty,
    empty_own_folders,
    forget_the_kit,
    freeze,
    import_ros,
    kill_others,
    remove,
    shield,
    unshield,
)

PACKAGE = Path("/ws/package")
REQUESTS = Path("/ws/requests")
OUT = Path("/ws/out")
POLL_S = 0.002
LOOK_S = 0.05  # between two looks at a running test; the end of its process is seen at once
_SET_CHILD_SUBREAPER = 36  # <linux/prctl.h>

Request = Mapping[str, Any]
"""A ModuleRequest of `warm_worker`, as read from JSON."""
RunModule = Callable[[int, Request, Path], None]
Compile = Callable[[Path, bytes, bool], "tuple[Path, bytes] | None"]


def main() -> None:
    """Serve requests until the sandbox is killed."""
    forget_the_kit()
    settings = json.loads((REQUESTS / "settings.json").read_text())
    modules = Path(settings["modules"])
    # Not imported, so that no test finds the module in sys.modules.
    pytest_run = runpy.run_path(str(Path(__file__).with_name("pytest_run.py")))
    run_module: RunModule = pytest_run["prepare"]()
    if settings["warm"]:
        import_ros()
    # For a log line, a traceback or coverage's start it looks at every module that it does not know yet.
    inspect.getmodule(inspect.currentframe(), os.devnull)
    freeze()
    shield()
    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    number = 0
    while True:
        serve(number, await_request(number, modules, pytest_run["byte_code"]), modules, run_module)
        number += 1


def await_request(number: int, modules: Path, byte_code: Compile) -> Request:
    """Return request `number` after its tree was laid out and the host has deleted both, so that no test finds them."""
    path = REQUESTS / f"{number}.json"
    while not path.exists():
        time.sleep(POLL_S)
    request: Request = json.loads(path.read_text())
    _, status = os.waitpid(fork(partial(lay_out, number, request, modules, byte_code)), 0)
    if status:
        sys.exit("the tree under test could not be laid out")
    while path.exists():
        time.sleep(POLL_S)
    return request


def fork(work: Callable[[], None]) -> int:
    """Call `work`, which ends the process, in a fork; return its pid. It exits with 99 if `work` returns or raises."""
    pid = os.fork()
    if pid == 0:
        try:
            work()
        except BaseException:
            traceback.print_exc()
        os._exit(99)
    return pid


def lay_out(number: int, request: Request, modules: Path, byte_code: Compile) -> None:
    """Write the tree under test to the sandbox's folders, compile its modules and tests, and report their byte code.

    Python and pytest compare byte code with the text before they use it.
    """
    tree = json.loads((REQUESTS / f"{number}.tree").read_text())
    empty_own_folders()
    empty(OUT)
    known = {*tree["files"], *tree["others"], *(str(up) for name in tree["files"] for up in Path(name).parents)}
    for root in (PACKAGE, modules):
        for here, folders, names in os.walk(root):
            for path in (Path(here, name) for name in (*names, *folders)):
                if str(path) not in known or (path.is_symlink() and str(path) not in tree["others"]):
                    remove(path)
    made: dict[str, tuple[str, str] | None] = {}
    module = PACKAGE / request["module"]
    tests = [module, *(folder / "conftest.py" for folder in module.parents)]
    for name, (text, times, mode) in tree["files"].items():
        path, data = Path(name), base64.b64decode(text)
        put(path, data, times, mode)
        is_module = path.suffix == ".py" and path.is_relative_to(modules)
        if (is_module or path in tests) and name not in tree["compiled"]:
            made[name] = None
            if code := byte_code(path, data, is_module):
                put(*code, times, 0o644)
                made[name] = str(code[0]), base64.b64encode(code[1]).decode()
    written(OUT / f"{number}.taken", made)
    os._exit(0)


def serve(number: int, request: Request, modules: Path, run_module: RunModule) -> None:
    """Run one request in a fork and write how it ended."""

    def run() -> None:
        unshield()
        run_module(number, request, modules)

    pid = fork(run)
    facts = watch(pid, OUT / f"{number}.report", request)
    kill_others()
    written(OUT / f"{number}.done", facts)


def written(path: Path, data: object) -> None:
    """Write data as JSON to a file that is there as soon as it is whole."""
    path.with_suffix(".part").write_text(json.dumps(data))
    path.with_suffix(".part").rename(path)


def put(path: Path, data: bytes, times: Sequence[int], mode: int) -> None:
    """Make `path` a file with this content, times and mode. Nothing of it shows whether it had to be written."""
    if path.is_symlink() or not path.is_file() or path.stat().st_nlink > 1:
        remove(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    if path.read_bytes() != data:
        path.chmod(0o600)
        path.write_bytes(data)
    path.chmod(mode)
    os.utime(path, ns=(times[0], times[1]))


def watch(pid: int, report: Path, request: Request) -> dict[str, object]:
    """Wait for the fork, and kill it when a test takes too long.

    Return its status, the test that ran `late` ("" if none), and how many seconds it was `queued` for a core. These do
    not count: a grade must not depend on what else the machine does.
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
            return {"status": os.waitstatus_to_exitcode(status), "late": "", "queued": round(queued, 3)}
        queued = max(queued, waited_for_core(pid))
        now = time.monotonic() - queued
        with contextlib.suppress(OSError):
            if report.stat().st_size != size:
                size, seen = report.stat().st_size, now
                current = latest(report)
        limit = request["limits"].get(current, request["limit"])
        if now - began > request["total"] or now - seen > limit:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            os.close(end)
            return {"status": -signal.SIGKILL, "late": current or "collection", "queued": round(queued, 3)}
        time.sleep(POLL_S)


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
