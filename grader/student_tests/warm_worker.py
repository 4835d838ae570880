"""A bench for a package's own tests: a warm worker behind a wall that runs one module at a time, as asked.

The host's side of `worker.py`: it hands in requests and reads back what came, capped and checked, because a process
of the submission could have written every byte of it.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from grader import build, sandbox
from grader.contract import spec
from grader.errors import GraderError
from grader.host import ros_env, tempdir
from grader.sandbox import untrusted

PACKAGE = Path("/ws/package")
MODULES = build.INSTALL / ros_env.SITE_IN_PREFIX / spec.PACKAGE
GENERATED = ("msg", "srv", "action")
_REACH_CAP = 30_000_000  # a thousand tests that each reach a thousand lines
_DATA_CAP = 100_000_000
_TAIL = 2000
_POLL_S = 0.01
_START_SECONDS = 60.0
_BUSY_FACTOR = 10.0  # how much longer than its limits, which leave waiting for a core out, a run may take by the clock
_STOPPED_SECONDS = 1.0  # after which a worker that has been stopped counts as dead
_HERE = Path(__file__).parent
_ENVIRONMENT = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONNOUSERSITE": "1", "ROS_DOMAIN_ID": "7"}


@dataclass(frozen=True)
class Request:
    """One run of pytest over one module. Paths in `files` are those inside the wall; `beside` are further modules.

    `select` names the tests to run, in this order; without it all are run in the module's own order. Limits are wall
    seconds: `limits` for single tests, `limit` for each other test and for collecting, `total` for the whole run.
    """

    module: str
    files: Mapping[str, str] = field(default_factory=dict)
    beside: Sequence[str] = ()
    select: Sequence[str] = ()
    first_failure: bool = False
    coverage: bool = False
    limits: Mapping[str, float] = field(default_factory=dict)
    limit: float = 60.0
    total: float = 90.0


@dataclass(frozen=True)
class Test:
    """What pytest reported of one test: "passed", "failed", "error" or "skipped"; `expected` for a marked failure."""

    id: str
    outcome: str
    message: str = ""
    seconds: float = 0.0
    expected: bool = False


@dataclass(frozen=True)
class Ran:
    """How one request went. `late` names the test that was stopped for its time, "collection" or ""."""

    tests: tuple[Test, ...]
    collected: tuple[str, ...]
    broken: str
    ended: bool
    status: int
    late: str
    seconds: float
    quiet_seconds: float
    """Without the time in which other processes had the cores: what it would have taken on a quiet machine."""
    shared: bool
    refused: tuple[tuple[str, str], ...]
    output_tail: str
    reach: Mapping[str, Mapping[int, frozenset[str]]]
    readers: frozenset[str] = frozenset()
    """The tests that have read the package's source as a text."""
    data: Path | None = None
    """What coverage has written for this run, as it was when the run ended: no later test can get at it."""

    @property
    def noticed(self) -> str:
        """Return the test that did not pass or was not there to pass, "" if all is well."""
        for test in self.tests:
            if test.outcome in ("failed", "error"):
                return test.id
        if self.late:
            return self.late
        if self.broken or not self.ended:
            return "collection" if not self.tests else "the end of the run"
        return ""


@dataclass(frozen=True)
class Bench:
    """A worker that waits for requests. Made by `benches`."""

    process: sandbox.Process
    requests: Path
    out: Path
    count: list[int]
    worker: list[int] = field(default_factory=list)
    """The worker's threads, as the host numbers them."""

    def run(self, request: Request) -> Ran:
        """Run one request and return what it reported.

        Raises:
            GraderError: the worker did not come up.
        """
        number = self.count[0]
        self.count[0] += 1
        self._hand_in(number, request)
        began = time.monotonic()
        done = self.out / f"{number}.done"
        # The worker keeps the time itself; this is for a worker that the submission has stopped or killed.
        ran_last = began
        while not done.exists() and self.alive:
            now = time.monotonic()
            ran_last = ran_last if self._is_stopped() else now
            if now - began > _BUSY_FACTOR * request.total + _START_SECONDS or now - ran_last > _STOPPED_SECONDS:
                self.process.kill()
            time.sleep(_POLL_S)
        ran = _read_run(self.out, number, time.monotonic() - began)
        ran = replace(ran, data=self._keep(number) if request.coverage else None)
        for leftover in (*self.out.glob(f"{number}.*"), *self.out.glob("coverage*")):
            with contextlib.suppress(OSError):
                leftover.unlink()
        return ran

    def _keep(self, number: int) -> Path | None:
        """Copy what the worker measured for a request, and nothing that lies beside it; return the copy."""
        kept = self.out.parent / "data" / f"coverage.{number}.main"
        try:
            # A copy, for a test that has linked the file would keep a hand on it.
            with untrusted.open_file(self.out / kept.name) as stream:
                if os.fstat(stream.fileno()).st_size > _DATA_CAP:
                    return None
                kept.write_bytes(stream.read(_DATA_CAP))
        except OSError:
            return None
        return kept

    @property
    def alive(self) -> bool:
        """Return whether the worker still runs. A submission can kill it, and then has nothing more to report."""
        return self.process.exit_code() is None

    def _is_stopped(self) -> bool:
        """Return whether the worker itself has been stopped by a signal or a debugger; only a test does that."""
        return any(_state(pid) in ("T", "t") for pid in self.worker)

    def _hand_in(self, number: int, request: Request) -> None:
        text = json.dumps({
            "modules": [request.module, *request.beside], "files": dict(request.files), "order": list(request.select),
            "first": request.first_failure, "coverage": request.coverage, "limits": dict(request.limits),
            "limit": request.limit, "total": request.total,
        })  # fmt: skip
        path = self.requests / f"{number}.json"
        path.with_suffix(".part").write_text(text)
        path.with_suffix(".part").rename(path)
        taken = self.out / f"{number}.taken"
        deadline = time.monotonic() + _START_SECONDS
        while not taken.exists() and self.alive and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        if not taken.exists():
            if number == 0:
                output = self.process.output
                raise GraderError(f"The process that runs the package's own tests did not start:\n{output}")
            self.process.kill()
        elif not self.worker:
            # No test has run yet, so whatever there is behind the wall is the worker.
            self.worker.extend(self.process.thread_times())
        path.unlink()


@contextlib.contextmanager
def benches(package: Path, install: Path, count: int, *, seconds: float) -> Iterator[list[Bench]]:
    """Give `count` benches for a package (its source folder and its install tree), each behind a wall of its own."""
    with tempdir.folder("own-tests") as rooms, contextlib.ExitStack() as stack:
        yield [stack.enter_context(_bench(package, install, rooms / str(i), seconds)) for i in range(count)]


@contextlib.contextmanager
def _bench(package: Path, install: Path, room: Path, seconds: float) -> Iterator[Bench]:
    room.mkdir()
    for name in ("requests", "out", "data"):
        (room / name).mkdir()
    shutil.copytree(package, room / "package", symlinks=True, ignore=_not_source)
    modules = install / MODULES.relative_to(build.INSTALL)
    if modules.is_dir():
        shutil.copytree(modules, room / "modules", symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        (room / "modules").mkdir()
    rc = room / "coveragerc"
    rc.write_text((_HERE / "coverage.ini").read_text().replace("@VERSION@", _version()))
    # Importing ROS takes the worker a second, which a package that does without it need not wait for.
    warm = any("rclpy" in (untrusted.read_text(path) or "") for path in (room / "package").rglob("*.py"))
    (room / "requests" / "settings.json").write_text(json.dumps({"modules": str(MODULES), "warm": warm}))
    environment = ros_env.environment(build.INSTALL, home=sandbox.HOME) | _ENVIRONMENT
    # The worker starts without the install tree on its path: a sitecustomize in there must not come first.
    environment.pop("PYTHONPATH")
    box = sandbox.Sandbox(
        read_only={
            install: str(build.INSTALL), rc: "/ws/coveragerc", _HERE / "worker.py": "/ws/worker.py",
            _HERE / "source_read_hook.py": "/ws/source_read_hook.py",
            room / "requests": "/ws/requests",
        },
        writable={room / "package": str(PACKAGE), room / "out": "/ws/out"}
        | ({room / "modules": str(MODULES)} if modules.is_dir() else {}),
        environment=environment,
        cwd="/ws/package",
    )  # fmt: skip
    command = ["python3", "-s", "-P", "/ws/worker.py"]
    with sandbox.Process(command, box, sandbox.Limits(wall_seconds=seconds)) as process:
        yield Bench(process, room / "requests", room / "out", [0])


def sources(package: Path, install: Path) -> dict[str, str | None]:
    """Return the package's own Python modules, as path relative to the package -> text. Generated ones are no source.

    What is installed counts; a package whose modules are not installed has those of its source folder. The text is None
    where `untrusted.read_python` can make nothing of it.
    """
    for root in (install / ros_env.SITE_IN_PREFIX / spec.PACKAGE, package / spec.PACKAGE):
        found: dict[str, str | None] = {}
        for path in sorted(root.rglob("*.py")):
            inside = path.relative_to(root)
            if inside.parts[0] in GENERATED or path.is_symlink() or not path.is_file():
                continue
            found[str(Path(spec.PACKAGE) / inside)] = untrusted.read_python(path)
        if found:
            return found
    return {}


def places(package: Path, install: Path, name: str, text: str) -> list[str]:
    """Return where inside the wall the module `name` lies with this text: installed, in the source folder, or both."""
    found = []
    for host, inside in ((install / ros_env.SITE_IN_PREFIX, MODULES.parent), (package, PACKAGE)):
        if untrusted.read_python(host / name) == text:
            found.append(str(inside / name))
    return found


def _state(thread: int) -> str:
    """Return in one letter what a thread does, "" if it is gone."""
    status = (untrusted.read_text(Path(f"/proc/{thread}/stat")) or "").rpartition(")")[2].split()
    return status[0] if status else ""


def _version() -> str:
    return f"{sys.version_info.major}.{sys.version_info.minor}"


def _not_source(_folder: str, names: list[str]) -> list[str]:
    return [name for name in names if name in ("__pycache__", ".pytest_cache", ".git") or name.endswith(".pyc")]


def _read_run(out: Path, number: int, seconds: float) -> Ran:
    ended = _entry(untrusted.read_text(out / f"{number}.done") or "")
    entries = [_entry(line) for line in (untrusted.read_text(out / f"{number}.report") or "").splitlines()]
    collected = tuple(_texts(next((e["collected"] for e in entries if "collected" in e), [])))
    return Ran(
        tests=tuple(_tests(entries)),
        collected=collected,
        broken="; ".join(_text(entry.get("message"), 400) for entry in entries if "broken" in entry)[:800],
        ended=any("ended" in entry for entry in entries) and ended.get("status") == 0,
        status=_int(ended.get("status"), -1),
        late=_text(ended.get("late")),
        seconds=seconds,
        quiet_seconds=max(seconds - _number(ended.get("queued")), 0.0),
        shared=any("shared" in entry for entry in entries),
        refused=tuple(
            sorted({(_text(e["refused"], 80), _text(e.get("where"), 200)) for e in entries if "refused" in e})
        )[:20],
        output_tail=(untrusted.read_text(out / f"{number}.log") or "")[-_TAIL:].encode("utf-8", "replace").decode(),
        reach=_reach(untrusted.read_text(out / f"{number}.reach", _REACH_CAP)),
        readers=_readers(entries, collected),
    )


def _tests(entries: Sequence[dict[str, Any]]) -> Iterator[Test]:
    """Yield one result for each test that has ended or begun to fail, in order."""
    found: dict[str, Test] = {}
    for entry in entries:
        if not isinstance(name := entry.get("id"), str):
            continue
        name = name[:300]
        outcome, when = entry.get("outcome"), entry.get("when")
        seconds = _number(entry.get("seconds")) + (found[name].seconds if name in found else 0.0)
        before = found.get(name)
        if outcome == "failed" and (before is None or before.outcome not in ("failed", "error")):
            kind = "failed" if when == "call" else "error"
            found[name] = Test(name, kind, _text(entry.get("message"), 400), seconds)
        elif outcome == "skipped" and before is None:
            found[name] = Test(name, "skipped", _text(entry.get("message"), 400), seconds, bool(entry.get("xfail")))
        elif outcome == "passed" and when == "call" and before is None:
            found[name] = Test(name, "passed", seconds=seconds, expected=bool(entry.get("xfail")))
        elif before is not None:
            found[name] = Test(name, before.outcome, before.message, seconds, before.expected)
    return iter(found.values())


def _readers(entries: Sequence[dict[str, Any]], collected: Sequence[str]) -> frozenset[str]:
    """Return who reads the source: "" and all tests if it is read while importing, or in a fixture that they share."""
    names = {_text(entry["reads"]) for entry in entries if "reads" in entry}
    return frozenset({*names, *collected} if "" in names else names)


def _reach(text: str | None) -> dict[str, dict[int, frozenset[str]]]:
    data = _entry(text or "")
    tests = _texts(data.get("tests"))
    files = data.get("reach")
    found: dict[str, dict[int, frozenset[str]]] = {}
    for name, lines in files.items() if isinstance(files, dict) else ():
        root = next((r for r in (MODULES.parent, PACKAGE) if Path(name).is_relative_to(r)), None)
        if root is None or not isinstance(lines, dict):
            continue
        by_line = found.setdefault(str(Path(name).relative_to(root)), {})
        for line, numbers in lines.items():
            # `isdigit` holds for "²" too, and more than 4300 digits are no number to Python.
            if re.fullmatch("[0-9]{1,7}", line) and isinstance(numbers, list):
                names = {tests[n] if n >= 0 else "" for n in numbers if isinstance(n, int) and -1 <= n < len(tests)}
                by_line[int(line)] = by_line.get(int(line), frozenset()) | frozenset(names)
    return found


def _entry(text: str) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError, MemoryError):
        return {}
    return data if isinstance(data, dict) else {}


def _text(value: Any, cap: int = 300) -> str:
    return value[:cap].encode("utf-8", "replace").decode() if isinstance(value, str) else ""


def _texts(value: Any) -> list[str]:
    return [_text(item) for item in value if isinstance(item, str)] if isinstance(value, list) else []


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) and 0 <= value < 1e6 else 0.0


def _int(value: Any, otherwise: int) -> int:
    return value if isinstance(value, int) and abs(value) < 1e6 else otherwise
