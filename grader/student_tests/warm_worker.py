"""Start workers in sandboxes, hand them requests to run test modules, and read what they report.

This is the host's side of `worker.py`. A worker is warm: it has imported pytest and ROS 2 before the first request.
"""

from __future__ import annotations

import base64
import contextlib
import itertools
import json
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TypeVar

from grader import building, sandbox
from grader.errors import GraderError
from grader.host import dds_domain, ros_env, tempdir
from grader.sandbox import untrusted
from grader.student_tests.package_modules import MODULES, PACKAGE, source_folders
from grader.student_tests.worker_report import ModuleRun, read_run
from grader.words import mark, say

WORKERS = 2
_Given = TypeVar("_Given")
_Made = TypeVar("_Made")
_DATA_CAP = 100_000_000  # bytes
_POLL_S, _POLL_SHARE = 0.005, 0.02  # of a run, between two looks whether it has ended
_START_SECONDS = 60.0
# A run's limits leave out waiting for a core; by the clock it may take this many times as long.
_BUSY_FACTOR = 10.0
_LIFE_S = 86400.0  # each run has limits of its own
_WORKERS_AT_MOST = 20  # each takes a second to start; a suite that ends more has lost its points anyway
_HERE = Path(__file__).parent
_ENVIRONMENT = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTHONNOUSERSITE": "1"}
_NOT_COPIED = shutil.ignore_patterns("__pycache__", ".pytest_cache", ".git", "*.pyc")
_AT_MOST = 20_000_000  # bytes; the rest of a larger package (maps, bags) is not restored before each run
_PLAIN = 0o644


@dataclass(frozen=True)
class ModuleRequest:
    """One run of pytest over one test module of the package. Paths in `files` are those in the sandbox.

    With `coverage` it is measured which test reaches which line, which takes time. `select` names the tests to run, in
    this order; without it all run in the module's own order. Limits are seconds of wall time: `limits` for single
    tests, `limit` for each other test and for collecting, `total` for the whole run.
    """

    module: str
    files: Mapping[str, str] = field(default_factory=dict)
    select: Sequence[str] = ()
    first_failure: bool = False
    coverage: bool = False
    limits: Mapping[str, float] = field(default_factory=dict)
    limit: float = 60.0
    total: float = 90.0

    def to_json(self) -> str:
        """Return the request as the worker reads it: all but the files, which are part of the tree under test."""
        return json.dumps({
            "module": self.module, "order": list(self.select),
            "first": self.first_failure, "coverage": self.coverage, "limits": dict(self.limits),
            "limit": self.limit, "total": self.total,
        })  # fmt: skip


class Tree:
    """The files of a package as they were handed in, by their paths in the sandbox, and the byte code made of them.

    Args:
        package: the package's source folder, of which no test has run yet.
        modules: the folder of its installed modules. Of this one only Python files are restored.
        inside: where the two are in the sandbox.
    """

    def __init__(self, package: Path, modules: Path, inside: tuple[Path, Path]) -> None:
        self._files: dict[str, tuple[str, tuple[int, int], int]] = {}
        self._others: list[str] = []
        self._byte_code: dict[str, tuple[str, str] | None] = {}
        room = _AT_MOST
        for folder, root in zip((package, modules), inside, strict=True):
            for path in sorted(folder.rglob("*"), key=lambda path: (path.suffix != ".py", path)):
                name, facts = str(root / path.relative_to(folder)), path.lstat()
                is_wanted = folder == package or path.suffix == ".py"
                data = untrusted.read_bytes(path, room) if is_wanted else None
                if data is None:
                    self._others.append(name)
                    continue
                room -= len(data)
                self._files[name] = _as_text(data), (facts.st_atime_ns, facts.st_mtime_ns), facts.st_mode & 0o7777

    def under_test(self, changed: Mapping[str, str]) -> str:
        """Return the tree with the texts `changed`, as the worker reads it.

        The times of a changed file are those of the original, and byte code of the original is left out.
        """
        files = dict(self._files)
        some_times = next((times for _, times, _ in files.values()), (0, 0))
        for name, text in changed.items():
            _, times, mode = files.get(name, ("", some_times, _PLAIN))
            files[name] = _as_text(text.encode("utf-8", "surrogateescape")), times, mode
        compiled = {source: made for source, made in self._byte_code.items() if source not in changed}
        files |= {made[0]: (made[1], files[source][1], _PLAIN) for source, made in compiled.items() if made}
        return json.dumps({"files": files, "others": self._others, "compiled": list(compiled)})

    def keep_byte_code(self, made: Any, changed: Mapping[str, str]) -> None:
        """Keep what the worker has compiled before a run: {source: [path, bytes]}, None where that cannot be done."""
        for source, code in made.items() if isinstance(made, dict) else ():
            if source in self._files and source not in changed:
                is_code = isinstance(code, list) and len(code) == 2 and all(isinstance(part, str) for part in code)
                self._byte_code[source] = tuple(code) if is_code else None


@dataclass(frozen=True)
class WarmWorker:
    """A worker that waits for requests. Made by `start_workers`."""

    process: sandbox.Process
    tree: Tree
    requests: Path
    out: Path
    count: list[int]
    domain_id: int = 0

    def run(self, request: ModuleRequest) -> ModuleRun:
        """Run one request and return what was reported.

        Raises:
            GraderError: the worker did not start.
        """
        number = self.count[0]
        self.count[0] += 1
        self._hand_in(number, request)
        began = time.monotonic()
        done = self.out / f"{number}.done"
        # The worker itself enforces the time limits.
        deadline = began + _BUSY_FACTOR * request.total + _START_SECONDS
        while not done.exists() and self.alive:
            time.sleep(_POLL_S + _POLL_SHARE * (time.monotonic() - began))
            if time.monotonic() > deadline:
                self.process.kill()
        ran = read_run(self.out, number, time.monotonic() - began)
        ran = replace(ran, worker_lost=not self.alive)
        # Coverage writes some of its data as it goes, and a run that is cut off leaves them without its reach.
        if request.coverage and (self.out / f"{number}.reach").exists():
            ran = replace(ran, coverage_data=self._keep_coverage(number))
        for leftover in (*self.out.glob(f"{number}.*"), *self.out.glob("coverage*")):
            with contextlib.suppress(OSError):
                leftover.unlink()
        return ran

    def _keep_coverage(self, number: int) -> Path | None:
        """Copy the data that the worker measured for a request, and no other file; return the copy."""
        kept = self.out.parent / "data" / f"coverage.{number}.main"
        # A copy: a test that has linked the file could still change the original.
        data = untrusted.read_bytes(self.out / kept.name, _DATA_CAP)
        if data is None:
            return None
        kept.write_bytes(data)
        return kept

    @property
    def alive(self) -> bool:
        """Return whether the worker still runs. It ends when a test fills the disk, and reports nothing more."""
        return self.process.exit_code() is None

    def _hand_in(self, number: int, request: ModuleRequest) -> None:
        path = self.requests / f"{number}.json"
        tree = path.with_suffix(".tree")
        tree.write_text(self.tree.under_test(request.files))
        path.with_suffix(".part").write_text(request.to_json())
        path.with_suffix(".part").rename(path)
        taken = self.out / f"{number}.taken"
        deadline = time.monotonic() + _START_SECONDS
        while not taken.exists() and self.alive and time.monotonic() < deadline:
            time.sleep(_POLL_S)
        if not taken.exists():
            if number == 0:
                output = self.process.output
                words = mark("The process that runs the package's own tests did not start:\n{output}")
                raise GraderError(say(words, output=output))
            self.process.kill()
        self.tree.keep_byte_code(untrusted.read_json(taken, _DATA_CAP), request.files)
        for file in (taken, tree, path):  # with the last one the tests begin
            file.unlink(missing_ok=True)


class WorkerPool:
    """A fixed number of warm workers, each started when it is first needed. `folder` has the coverage settings.

    One that a test has brought down is replaced, so that later tests lose nothing. Safe to use from several threads.
    """

    def __init__(self, start: Callable[[int, int], WarmWorker], folder: Path, size: int) -> None:
        self.folder, self.size = folder, size
        self._start, self._numbers = start, itertools.count()
        self._idle: SimpleQueue[WarmWorker | None] = SimpleQueue()
        for _ in range(size):
            self._idle.put(None)

    def run(self, request: ModuleRequest) -> ModuleRun:
        """Run one request as soon as a worker is idle, and return what was reported.

        Raises:
            GraderError: no worker started.
        """
        worker = self._idle.get()
        try:
            if worker is None:
                worker = self._start(next(self._numbers), 0)
            elif not worker.alive and (number := next(self._numbers)) < _WORKERS_AT_MOST * self.size:
                worker = self._start(number, worker.domain_id)
            return worker.run(request)
        finally:
            self._idle.put(worker)

    def map(self, work: Callable[[_Given], _Made], given: Sequence[_Given]) -> list[_Made]:
        """Return what `work`, which may run requests, makes of each item: as many at a time as there are workers."""
        with ThreadPoolExecutor(self.size) as threads:
            return list(threads.map(work, given))


@contextlib.contextmanager
def start_workers(package: Path, install: Path) -> Iterator[WorkerPool]:
    """Yield workers for a package (its source folder and its install tree), each in a sandbox of its own."""
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempdir.folder("own-tests"))
        # A sandbox ends with the thread that has started it, and those of `WorkerPool.map` end before the workers.
        starter = stack.enter_context(ThreadPoolExecutor(1))
        sources = "\n    ".join(source_folders(package, install))
        settings = (_HERE / "coverage.ini").read_text().replace("@MODULES@", str(MODULES)).replace("@SOURCES@", sources)
        (folder / "coveragerc").write_text(settings)

        def begin(number: int, domain_id: int) -> WarmWorker:
            # Workers that are not in network namespaces of their own must not hear each other.
            domain_id = domain_id or stack.enter_context(dds_domain.free())
            return stack.enter_context(_start(package, install, folder / str(number), domain_id))

        yield WorkerPool(lambda *which: starter.submit(begin, *which).result(), folder, WORKERS)


@contextlib.contextmanager
def _start(package: Path, install: Path, folder: Path, domain_id: int) -> Iterator[WarmWorker]:
    folder.mkdir()
    for name in ("requests", "out", "data"):
        (folder / name).mkdir()
    shutil.copytree(package, folder / "package", symlinks=True, ignore=_NOT_COPIED)
    modules = install / MODULES.relative_to(building.INSTALL)
    if modules.is_dir():
        shutil.copytree(modules, folder / "modules", symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        (folder / "modules").mkdir()
    tree = Tree(folder / "package", folder / "modules", (PACKAGE, MODULES))
    # Importing ROS takes the worker a second; a package that does not use it need not wait for that.
    warm = any("rclpy" in (untrusted.read_text(path) or "") for path in (folder / "package").rglob("*.py"))
    (folder / "requests" / "settings.json").write_text(json.dumps({"modules": str(MODULES), "warm": warm}))
    domain = {"ROS_DOMAIN_ID": str(domain_id)}
    environment = ros_env.environment(building.INSTALL, home=sandbox.HOME) | _ENVIRONMENT | domain
    # The worker starts without the install tree on its path: a sitecustomize in it must not be imported first.
    environment["PYTHONPATH"] = ros_env.environment(home=sandbox.HOME)["PYTHONPATH"]
    box = sandbox.Sandbox(
        read_only={
            install: str(building.INSTALL), folder.parent / "coveragerc": "/ws/coveragerc",
            folder / "requests": "/ws/requests",
            **{_HERE / name: f"/ws/worker/{name}" for name in ("worker.py", "pytest_run.py")},
            **sandbox.beside_script("/ws/worker"),
        },
        writable={folder / "package": str(PACKAGE), folder / "out": "/ws/out"}
        | ({folder / "modules": str(MODULES)} if modules.is_dir() else {}),
        environment=environment,
        cwd="/ws/package",
        fed=(folder / "requests",),
        as_init=True,
    )  # fmt: skip
    command = ["python3", "-s", "/ws/worker/worker.py"]
    with sandbox.Process(command, box, sandbox.Limits(wall_seconds=_LIFE_S)) as process:
        yield WarmWorker(process, tree, folder / "requests", folder / "out", [0], domain_id)


def _as_text(data: bytes) -> str:
    return base64.b64encode(data).decode()
