"""Give each check its evidence, and write down its result."""

from __future__ import annotations

import json
import resource
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from grader import evidence
from grader.checks.judge import SILENT, Failed, Judge, NotReached, Unjudged
from grader.course import named
from grader.evidence import Kind
from grader.scoring.scorecard import CheckResult, Outcome
from grader.words import say

_JUDGE = pytest.StashKey[Judge]()
_EVIDENCE = pytest.StashKey[evidence.Evidence]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options: the evidence's and the course's folder, the results' file, and the limits."""
    parser.addoption("--evidence", type=Path, required=True)
    parser.addoption("--course", type=Path, required=True)
    parser.addoption("--results", type=Path, required=True)
    parser.addoption("--cpu-seconds", type=float, required=True)
    parser.addoption("--memory", type=int, required=True)


class TookTooLong(Exception):
    """A check has used up its CPU time."""


def pytest_configure(config: pytest.Config) -> None:
    """Limit the memory; what exceeds it ends with MemoryError."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    wanted: int = config.getoption("--memory")
    resource.setrlimit(resource.RLIMIT_AS, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Limit a check's CPU time. A search for a regular expression looks for signals, too."""
    seconds: float = item.config.getoption("--cpu-seconds")

    def stop(*_: object) -> None:
        raise TookTooLong(f"the check took more than {seconds:g} s of CPU time")

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    yield
    signal.setitimer(signal.ITIMER_PROF, 0.0)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a check with an argument `requirement` each that is wanted: "check_hunt::test_keeps_its_promises[F4]"."""
    if "requirement" in metafunc.fixturenames:
        ids = (arg.partition(f"::{metafunc.function.__name__}[")[2] for arg in metafunc.config.args)
        metafunc.parametrize("requirement", [id_.removesuffix("]") for id_ in ids if id_])


def pytest_collection_finish(session: pytest.Session) -> None:
    """Read the evidence once."""
    session.config.stash[_EVIDENCE] = evidence.load(session.config.getoption("--evidence"))
    session.config.getoption("--results").touch()  # from here on, what goes wrong is about a check


@pytest.fixture
def judge(request: pytest.FixtureRequest) -> Judge:
    """Return the judge for one check."""
    judge = Judge(request.config.stash[_EVIDENCE], named(str(request.config.getoption("--course"))))
    request.node.stash[_JUDGE] = judge
    return judge


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Write down a check's result. Any exception but Failed and NotReached is an error of the grader."""
    yield
    if call.when == "call" or (call.when == "setup" and call.excinfo is not None):
        results: Path = item.config.getoption("--results")
        with results.open("a") as stream:  # at once: a check after this one may end the process
            stream.write(f"{json.dumps(evidence.to_data(_result(item, call)))}\n")


def _result(item: pytest.Item, call: pytest.CallInfo[None]) -> CheckResult:
    judge = item.stash.get(_JUDGE, None)
    sentence = " ".join((getattr(item, "function", None).__doc__ or "").split())
    trial = judge.trials[-1] if judge and judge.trials else ""
    id_, error = f"{item.path.stem}::{item.name}", call.excinfo and call.excinfo.value
    sentence = say(sentence)
    result = CheckResult(id_, Outcome.ERROR, 0.0, sentence, expected=sentence, trial=trial)
    if judge is None or (error is not None and not isinstance(error, Failed | NotReached)):
        return replace(result, seen=f"{type(error).__name__}: {error}{_line(item, call)}")
    return concluded(judge, result, error)


def concluded(judge: Judge, result: CheckResult, error: Failed | NotReached | None) -> CheckResult:
    """Return a check's result with what it has said, and before that with the cause that its trials show."""
    seen, try_ = (error.seen, error.try_) if isinstance(error, Failed) else (judge.seen, judge.try_)
    result = replace(result, seen=say(seen), try_=say(try_), figures=judge.figures)
    if error is None and judge.fraction >= 1:
        return replace(result, outcome=Outcome.PASSED, fraction=judge.fraction)
    own, told = error.reason if error is not None else None, str(error or seen)
    known = own and (own.kind in (Kind.UNHEARD, Kind.SPINS) or (own.fault is not None and own.kind not in SILENT))
    cause = None if known else judge.cause(told)
    reason = cause or own
    if isinstance(error, NotReached):
        cure = reason.cure if reason is not None else ""
        because = "; ".join(dict.fromkeys(str(part) for part in (cause, told) if part))
        return replace(result, outcome=Outcome.NOT_REACHED, because=because, try_=cure, reason=reason)
    if cause is not None:
        result = replace(result, seen=f"{cause}\n{result.seen}", try_=cause.cure or result.try_)
    outcome = Outcome.PARTIAL if error is None and judge.fraction > 0 else Outcome.FAILED
    return replace(result, outcome=outcome, fraction=0.0 if error else judge.fraction, reason=reason)


def _line(item: pytest.Item, call: pytest.CallInfo[None]) -> str:
    """Return the line of a check's file in which an exception was raised that is not of the judge; "" if in none."""
    if call.excinfo is None or isinstance(call.excinfo.value, Unjudged):
        return ""
    lines = [frame.lineno + 1 for frame in call.excinfo.traceback if frame.path == item.path]
    return say(" ({file}, line {line})", file=item.path.name, line=lines[-1]) if lines else ""
