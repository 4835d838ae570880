"""Run test modules in the sandbox, each in a fork of one warm process. Imports nothing of the grader.

The worker imports once what every run needs (pytest, coverage, rclpy, the usual messages), and nothing of the
submission. For each request it restores the package as handed in, changes the files that the request names, forks,
and lets pytest run one module in the fork. When the fork has ended, everything that it started is killed too.

What is written to `out` comes from a process shared with the submission: it is data, and the host checks it.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import resource
import runpy
import shutil
import signal
import sys
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import coverage
import coverage.sqldata
import pytest
from _pytest.config import PytestPluginManager, default_plugins

PACKAGE = Path("/ws/package")
REQUESTS = Path("/ws/requests")
OUT = Path("/ws/out")
RC = "/ws/coveragerc"
POLL_S = 0.005
RESTORE_CAP = 2_000_000  # bytes; longer files (maps, bags) are not restored before each run
REPORT_CAP = 1_000_000  # bytes
TESTS_AT_MOST = 2000

# Hooks that a conftest.py has good reasons to define. The others can rewrite reports, drop tests or swallow exceptions.
ALLOWED_HOOKS = {
    "pytest_addoption", "pytest_configure", "pytest_unconfigure", "pytest_sessionstart", "pytest_sessionfinish",
    "pytest_generate_tests", "pytest_runtest_setup", "pytest_runtest_teardown", "pytest_make_parametrize_id",
    "pytest_assertrepr_compare", "pytest_report_header", "pytest_fixture_setup", "pytest_fixture_post_finalizer",
}  # fmt: skip
WARM = (
    "numpy", "yaml", "unittest.mock", "rclpy",
    "rclpy.action", "rclpy.node", "rclpy.executors", "rclpy.qos", "rclpy.parameter", "rclpy.duration", "rclpy.time",
    "rclpy.logging", "geometry_msgs.msg", "sensor_msgs.msg", "nav_msgs.msg", "std_msgs.msg", "std_srvs.srv",
    "action_msgs.msg", "rosgraph_msgs.msg", "rcl_interfaces.msg",
)  # fmt: skip
MESSAGES = {
    "geometry_msgs.msg": ("Twist", "Pose"), "nav_msgs.msg": ("Odometry",), "std_msgs.msg": ("Float32",),
    "sensor_msgs.msg": ("LaserScan", "Imu", "BatteryState"),
}  # fmt: skip

Request = Mapping[str, Any]
"""A ModuleRequest of `warm_worker`, as read from JSON."""
Files = dict[Path, tuple[bytes, tuple[int, int], int]]
"""Files as they were handed in: path -> bytes, times (access, change) in nanoseconds, mode."""


def main() -> None:
    """Serve requests until the sandbox is killed."""
    settings = json.loads((REQUESTS / "settings.json").read_text())
    modules = Path(settings["modules"])
    handed_in = read_files(PACKAGE) | {path: file for path, file in read_files(modules).items() if path.suffix == ".py"}
    if settings["warm"]:
        warm_up()
    gc.collect()
    gc.freeze()  # a fork that never touches these pages never copies them
    number = 0
    while True:
        serve(number, await_request(number), modules, handed_in)
        number += 1


def warm_up() -> None:
    """Import what most nodes and their tests need, and the C code of the usual messages: half of a node's start-up."""
    for name in WARM:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    with contextlib.suppress(ImportError, AttributeError):
        check = importlib.import_module("rclpy.type_support").check_for_type_support
        for package, names in MESSAGES.items():
            for name in names:
                check(getattr(importlib.import_module(package), name))


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


def serve(number: int, request: Request, modules: Path, handed_in: Files) -> None:
    """Run one request in a fork and write how it ended."""
    restore(modules, handed_in, request["files"])
    for left in OUT.glob("coverage*"):
        with contextlib.suppress(OSError):
            left.unlink()
    pid = os.fork()
    if pid == 0:
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
            for name in folders + names:
                path = Path(here, name)
                if name == "__pycache__":
                    shutil.rmtree(path, ignore_errors=True)
                elif path.suffix == ".pyc" or (path.suffix == ".py" and path not in handed_in):
                    path.unlink(missing_ok=True)
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
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
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


# All that follows runs in the fork.


def run_module(number: int, request: Request, modules: Path) -> None:
    """Let pytest run one module, write what it reports, and exit so that no exit handler can add to it."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (int(request["total"]) + 5,) * 2)
    log = os.open(OUT / f"{number}.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    null = os.open(os.devnull, os.O_RDONLY)
    for target, source in ((0, null), (1, log), (2, log)):
        os.dup2(source, target)
    os.chdir(PACKAGE)
    # Only now, so that no sitecustomize of the install tree was loaded. Programs that the tests start need it too.
    os.environ["PYTHONPATH"] = str(modules.parent)
    sys.path.insert(0, str(modules.parent))
    sys.argv = ["pytest"]
    importlib.invalidate_caches()
    # A test that imports __main__ must not find this module.
    sys.modules["__main__"] = ModuleType("__main__")
    measure = None
    write = None
    if request["coverage"]:
        measure = coverage.Coverage(config_file=RC, data_file=str(OUT / "coverage"), data_suffix=f"{number}.main")
        write = reach_writer(OUT / f"{number}.reach", measure)
        measure.start()
    with (OUT / f"{number}.report").open("a") as stream:
        recorder = Recorder(stream, request["order"], measure)
        hook = runpy.run_path(str(Path(__file__).with_name("source_read_hook.py")))
        folders = [str(modules), str(PACKAGE / modules.name)]
        hook["watch"](folders, [str(PACKAGE), str(modules)], source_read_noter(stream.fileno(), recorder))
        recorder.write(ended=run_pytest(recorder, request))
    if write is not None:
        write(recorder.tests)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def run_pytest(recorder: Recorder, request: Request) -> int:
    """Return pytest's exit status. Of the submission's plugins and conftest files only ALLOWED_HOOKS are called."""
    pytests_own = plugins_of_pytest()
    parse = PytestPluginManager.parse_hookimpl_opts

    def only_allowed(manager: PytestPluginManager, plugin: object, name: str) -> Any:
        options = parse(manager, plugin, name)
        if options is None or plugin is recorder or name in ALLOWED_HOOKS:
            return options
        if id(plugin) in pytests_own or id(type(plugin)) in pytests_own:
            return options
        module = plugin if isinstance(plugin, ModuleType) else sys.modules.get(type(plugin).__module__)
        home = getattr(module, "__file__", None) or "a plugin made at run time"
        recorder.write(refused=name, where=home.removeprefix(f"{PACKAGE}/")[:200])
        return None

    PytestPluginManager.parse_hookimpl_opts = only_allowed  # type: ignore[method-assign, assignment] # in this fork only
    arguments = [
        "-c", os.devnull, f"--rootdir={PACKAGE}", "-p", "no:cacheprovider", "-p", "no:junitxml", "-q", "-o", "addopts=",
        "--tb=short", *(["-x"] if request["first"] else []), *request["modules"],
    ]  # fmt: skip
    return int(pytest.main(arguments, plugins=[recorder]))


def plugins_of_pytest() -> set[int]:
    """Return the ids of pytest's own modules and of their classes, taken before any other code is loaded.

    By id, because a module or a class can be given any name and origin.
    """
    for name in default_plugins:
        importlib.import_module(name if name.startswith("_pytest.") else f"_pytest.{name}")
    home = str(Path(pytest.__file__).parents[1])
    modules = [module for module in sys.modules.values() if (getattr(module, "__file__", None) or "").startswith(home)]
    things = [thing for module in modules for thing in list(vars(module).values()) if isinstance(thing, type)]
    classes = [thing for thing in things if thing.__module__.split(".")[0] in ("_pytest", "pytest", "pluggy")]
    return {id(known) for known in (*modules, *classes)}


class Recorder:
    """A pytest plugin that records reports as they come, and tells coverage which test is running."""

    def __init__(self, stream: IO[str], order: Sequence[str], measure: coverage.Coverage | None) -> None:
        self.stream = stream
        self.order = order
        self.measure = measure
        self.tests: list[str] = []
        self.current = ""
        self.context = ""
        """The test to which lines count at the moment, "" for none or for all of them."""

    def write(self, **entry: Any) -> None:
        """Write one line and flush it: whatever ends this process, the host knows what happened until then."""
        if self.stream.tell() < REPORT_CAP:
            self.stream.write(json.dumps(entry) + "\n")
            self.stream.flush()

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Keep the tests that were requested, in that order."""
        if self.order:
            place = {name: number for number, name in enumerate(self.order)}
            items[:] = sorted((item for item in items if item.nodeid in place), key=lambda item: place[item.nodeid])

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """Record the collected tests."""
        self.tests = [item.nodeid for item in session.items]
        self.write(collected=self.tests[:TESTS_AT_MOST])

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Record a module that cannot be collected."""
        if report.failed:
            lines = message_of(report).splitlines()
            words = [line.removeprefix("E ").strip() for line in lines if line.startswith("E ")] or lines[-3:]
            self.write(broken=report.nodeid[:300], message=" ".join(words)[-400:])

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        """Record that a test starts."""
        self.current = nodeid
        self.count_to(nodeid)
        self.write(start=nodeid)

    def pytest_runtest_logfinish(self) -> None:
        """Count the lines that follow to no test."""
        self.count_to("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record how a test's setup, call or teardown went."""
        self.write(
            id=report.nodeid, when=report.when, outcome=report.outcome, seconds=round(report.duration, 4),
            message="" if report.passed else message_of(report)[:400], xfail=hasattr(report, "wasxfail"),
        )  # fmt: skip

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Generator[None, object, object]:
        """Count the lines of a fixture that several tests share to all of them, not to the test that came first."""
        module = sys.modules.get(getattr(fixturedef.func, "__module__", "") or "")
        if fixturedef.scope == "function" or "/_pytest/" in (getattr(module, "__file__", "") or ""):
            return (yield)
        self.write(shared=fixturedef.argname[:100])
        self.count_to("")
        try:
            return (yield)
        finally:
            self.count_to(self.current)

    def count_to(self, name: str) -> None:
        """Count the lines that follow to the test `name`, "" for none."""
        self.context = name
        if self.measure is not None:
            self.measure.switch_context(name)


def message_of(report: pytest.CollectReport | pytest.TestReport) -> str:
    """Return the message of a failure."""
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message if crash else report.longrepr).strip()


def source_read_noter(report: int, recorder: Recorder) -> Callable[[], None]:
    """Return a function that records, once for each test, that the test reads the package's source."""
    noted: set[str] = set()
    write, dumps = os.write, json.dumps

    def note() -> None:
        if recorder.context not in noted and len(noted) < TESTS_AT_MOST:
            noted.add(recorder.context)
            write(report, (dumps({"reads": recorder.context}) + "\n").encode())

    return note


def reach_writer(path: Path, measure: coverage.Coverage) -> Callable[[Sequence[str]], None]:
    """Return a function that stops measuring and writes which tests reached which line: {file: {line: [test numbers]}}.

    The number -1 stands for "in no test": on import, or in a program that a test has started. The function is made
    before any test runs, and binds all that it calls, so that no test can replace it.
    """
    dumps, write_text = json.dumps, Path.write_text
    stop, save, get_data, fold = measure.stop, measure.save, measure.get_data, fold_in

    def write(tests: Sequence[str]) -> None:
        stop()
        data = get_data()
        fold(data)
        save()
        numbers = {name: number for number, name in enumerate(tests)} | {"": -1}
        reach = {
            file: {
                line: sorted({numbers[name] for name in contexts if name in numbers})
                for line, contexts in sorted(data.contexts_by_lineno(file).items())
            }
            for file in sorted(data.measured_files())
        }
        write_text(path, dumps({"tests": tests, "reach": reach}, separators=(",", ":")))

    return write


def fold_in(data: coverage.CoverageData) -> None:
    """Add what was measured in programs that the tests started, so that the probes check it like the rest.

    The host takes only one file of each run, that of this process.
    """
    for path in sorted(OUT.glob("coverage.*")):
        if str(path) != data.data_filename():
            with contextlib.suppress(Exception):
                other = coverage.CoverageData(str(path))
                other.read()
                data.update(other)


if __name__ == "__main__":
    main()
