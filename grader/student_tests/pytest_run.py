"""Run one test module with pytest, in a fork of the worker, and write down what happens.

Runs in the sandbox and imports nothing of the grader.
"""

from __future__ import annotations

import ast
import contextlib
import importlib
import json
import os
import resource
import sys
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import partial
from importlib import _bootstrap_external as importing
from importlib.util import cache_from_source, source_hash
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import _pytest.config
import coverage
import coverage.sqldata
import pytest
from _pytest.assertion import rewrite
from _pytest.config import Config

PACKAGE = Path("/ws/package")
OUT = Path("/ws/out")
RC = "/ws/coveragerc"
CACHE = "/tmp/pytest-cache"  # emptied before each run; pytest writes there only if a test asks it to
REPORT_CAP = 1_000_000  # bytes
TESTS_AT_MOST = 2000
NOTED_AT_MOST = 1000
IMPORT = "import"
"""Coverage's context while a module of the package is imported; a test's has "::" in it."""

Request = Mapping[str, Any]
"""A ModuleRequest of `warm_worker`, as read from JSON."""


def prepare() -> Callable[[int, Request, Path], None]:
    """Do once what takes time at each start of pytest and coverage; return `run_module`, to be called in a fork."""
    config = _pytest.config.get_config()
    with contextlib.suppress(ImportError):
        importlib.import_module("readline")  # as pytest does at each start
    environment = dict(os.environ)
    warm = coverage.Coverage(config_file=RC, data_file=None)
    warm.start()  # takes 30 ms the first time
    warm.stop()
    os.environ.clear()
    os.environ.update(environment)  # without the variable by which programs that the tests start are measured
    return partial(run_module, config)


def run_module(config: Config, number: int, request: Request, modules: Path) -> None:
    """Run one module with pytest, write the reports of this run to OUT, and end the process without exit handlers."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (int(request["total"]) + 5,) * 2)
    log = os.open(OUT / f"{number}.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    null = os.open(os.devnull, os.O_RDONLY)
    for target, source in ((0, null), (1, log), (2, log)):
        os.dup2(source, target)
    os.chdir(PACKAGE)
    # Only now, so that no sitecustomize of the install tree was loaded. Programs that the tests start need it too.
    os.environ["PYTHONPATH"] = str(modules)
    sys.path.insert(0, str(modules))
    sys.argv = ["pytest"]
    importlib.invalidate_caches()
    # A test that imports __main__ must not find this module.
    sys.modules["__main__"] = ModuleType("__main__")
    measure = write = None
    if request["coverage"]:
        measure = coverage.Coverage(config_file=RC, data_file=str(OUT / "coverage"), data_suffix=f"{number}.main")
        # Saves a look at each imported module; none of them is the package's.
        measure._warn_preimported_source = False
        write = reach_writer(OUT / f"{number}.reach", measure)
        measure.start()
    with (OUT / f"{number}.report").open("a") as stream:
        recorder = Recorder(stream, request["order"], measure)
        sources = [path.parent for path in PACKAGE.glob("*/__init__.py") if not path.parent.name.startswith("test")]
        count_imports(recorder, (str(modules), *map(str, sources)))
        sys.addaudithook(noter(stream.fileno()))
        recorder.write(ended=run_pytest(config, recorder, request))
    if write is not None:
        write(recorder.tests)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def run_pytest(config: Config, recorder: Recorder, request: Request) -> int:
    """Return pytest's exit status."""
    arguments = [
        "-c", os.devnull, f"--rootdir={PACKAGE}", "-o", f"cache_dir={CACHE}", "-q", "-o", "addopts=",
        # What is reported of a failure is its message; to quote the source at each takes longer than most tests.
        *(["-x"] if request["first"] else []), "--tb=no", request["module"],
    ]  # fmt: skip
    config.invocation_params = Config.InvocationParams(args=arguments, plugins=[recorder], dir=PACKAGE)
    _pytest.config.get_config = lambda *_arguments, **_options: config  # in this fork only
    return int(pytest.main(arguments, plugins=[recorder]))


def byte_code(path: Path, data: bytes, is_module: bool) -> tuple[Path, bytes] | None:
    """Return where Python looks for a module's byte code, or pytest for that of tests, and that.

    None if compiling fails or gives a warning, which the run itself is to show. It is used only while the source has
    exactly this text. Tests have their assertions rewritten as pytest does.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            tree = ast.parse(data, str(path))
            if not is_module:
                rewrite.rewrite_asserts(tree, data, str(path))
            code = compile(tree, str(path), "exec", dont_inherit=True)
        except Exception:
            return None
    for_tests = rewrite.get_cache_dir(path) / f"{path.stem}{rewrite.PYC_TAIL}"
    place = Path(cache_from_source(str(path))) if is_module else for_tests
    return place, bytes(importing._code_to_hash_pyc(code, source_hash(data), True))  # type: ignore[attr-defined]


class Recorder:
    """A pytest plugin that writes each report as it comes, and sets coverage's context to the test that runs."""

    def __init__(self, stream: IO[str], order: Sequence[str], measure: coverage.Coverage | None) -> None:
        self.stream = stream
        self.order = order
        self.measure = measure
        self.tests: list[str] = []
        self.current = ""
        self.context = ""
        """The test to which the lines that run now are attributed, "" for none or all of them, or IMPORT."""

    def write(self, **entry: Any) -> None:
        """Write one line and flush it: whatever ends this process, the host knows what happened until then."""
        if self.stream.tell() < REPORT_CAP:
            self.stream.write(json.dumps(entry) + "\n")
            self.stream.flush()

    @pytest.hookimpl(tryfirst=True)
    def pytest_ignore_collect(self) -> bool:
        """Ignore every file that was not requested; pytest asks about no other."""
        return True

    @pytest.hookimpl(trylast=True)
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
        """Attribute the lines that run from here on to no test."""
        self.count_to("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record how a test's setup, call or teardown went."""
        self.write(
            id=report.nodeid, when=report.when, outcome=report.outcome, seconds=round(report.duration, 4),
            message="" if report.passed else message_of(report)[:400], xfail=hasattr(report, "wasxfail"),
        )  # fmt: skip

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: pytest.FixtureDef[Any]) -> Generator[None, object, object]:
        """Attribute the lines of a fixture that several tests share to all of them, not to the first that uses it."""
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
        """Attribute the lines that run from here on to the test `name`, "" for none."""
        self.context = name
        if self.measure is not None:
            with contextlib.suppress(coverage.CoverageException):  # a test has stopped it
                self.measure.switch_context(name)


def message_of(report: pytest.CollectReport | pytest.TestReport) -> str:
    """Return the message of a failure."""
    crash = getattr(report.longrepr, "reprcrash", None)
    return str(crash.message if crash else report.longrepr).strip()


def count_imports(recorder: Recorder, folders: tuple[str, ...]) -> None:
    """Attribute the lines that run while a module below `folders` is imported to IMPORT, not to a test."""
    execute = importing.SourceFileLoader.exec_module

    def exec_module(self: importing.SourceFileLoader, module: ModuleType) -> None:
        before = recorder.context
        if self.path.startswith(folders):
            recorder.count_to(IMPORT)
        try:
            execute(self, module)
        finally:
            recorder.count_to(before)

    importing.SourceFileLoader.exec_module = exec_module  # type: ignore[method-assign, assignment] # in this fork only


def noter(report: int) -> Callable[[str, tuple[Any, ...]], None]:
    """Return an audit hook that records the command lines of started programs.

    A node that a test starts and then kills leaves no coverage; its command line shows that it was reached.
    """
    noted: set[str] = set()
    write, dumps, decode = os.write, json.dumps, os.fsdecode

    def note(event: str, arguments: tuple[Any, ...]) -> None:
        if event not in ("os.system", "subprocess.Popen") or len(noted) >= NOTED_AT_MOST:
            return
        with contextlib.suppress(Exception):  # must never make a test fail
            command = arguments[-1] if event == "os.system" else arguments[1]
            words = [command] if isinstance(command, str | bytes) else list(command)
            entry = dumps({"starts": " ".join(decode(word) for word in words)[:1000]})
            if entry not in noted:
                noted.add(entry)
                write(report, (entry + "\n").encode())

    return note


def reach_writer(path: Path, measure: coverage.Coverage) -> Callable[[Sequence[str]], None]:
    """Return a function that stops measuring and writes which tests reached which line: {file: {line: [test numbers]}}.

    -1 means no test: on import, or in a program that a test has started. Lines that ran only while the package was
    imported are also listed as `imported`. The function has its own references to all that it calls, made before any
    test runs, so that no test can replace them.
    """
    dumps, write_text = json.dumps, Path.write_text
    stop, save, get_data, fold = measure.stop, measure.save, measure.get_data, fold_in

    def write(tests: Sequence[str]) -> None:
        stop()
        data = get_data()
        fold(data)
        save()
        numbers = {name: number for number, name in enumerate(tests)} | {"": -1, IMPORT: -1}
        contexts = {file: data.contexts_by_lineno(file) for file in sorted(data.measured_files())}
        reach = {
            file: {line: sorted({numbers[name] for name in names if name in numbers}) for line, names in lines.items()}
            for file, lines in contexts.items()
        }
        imported = {
            file: [line for line, names in lines.items() if IMPORT in names and "" not in names]
            for file, lines in contexts.items()
        }
        write_text(path, dumps({"tests": tests, "reach": reach, "imported": imported}, separators=(",", ":")))

    return write


def fold_in(data: coverage.CoverageData) -> None:
    """Add what was measured in programs that the tests have started to the data of this process.

    The host reads only this process's file of each run, and checks all that is in it.
    """
    for path in sorted(OUT.glob("coverage.*")):
        if str(path) != data.data_filename():
            with contextlib.suppress(Exception):
                other = coverage.CoverageData(str(path))
                other.read()
                data.update(other)
