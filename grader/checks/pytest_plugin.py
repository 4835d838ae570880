"""Give each check its evidence, and write down its result."""

from __future__ import annotations

import json
import os
import resource
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from grader import evidence
from grader.checks.judge import Failed, Judge, NotReached
from grader.course import load
from grader.scoring.scorecard import Outcome

_JUDGE = pytest.StashKey[Judge]()
_EVIDENCE = pytest.StashKey[evidence.Evidence]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options: a descriptor to read the evidence's folder from, the course's folder, the results' file."""
    parser.addoption("--evidence-from", type=int, required=True)
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


def pytest_collection_finish(session: pytest.Session) -> None:
    """Wait for the evidence, and read it once."""
    with os.fdopen(session.config.getoption("--evidence-from"), encoding="utf-8") as waiting:
        folder = waiting.read()
    if not folder:
        pytest.exit("there is no evidence", returncode=0)
    session.config.stash[_EVIDENCE] = evidence.load(Path(folder))
    session.config.getoption("--results").touch()  # from here on, what goes wrong is about a check


@pytest.fixture
def judge(request: pytest.FixtureRequest) -> Judge:
    """Return the judge for one check."""
    judge = Judge(request.config.stash[_EVIDENCE], load(request.config.getoption("--course")))
    request.node.stash[_JUDGE] = judge
    return judge


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Write down a check's result. Any exception but Failed and NotReached is an error of the grader."""
    yield
    if call.when == "call" or (call.when == "setup" and call.excinfo is not None):
        results: Path = item.config.getoption("--results")
        with results.open("a") as stream:  # at once: a check after this one may end the process
            stream.write(f"{json.dumps(_result(item, call))}\n")


def _result(item: pytest.Item, call: pytest.CallInfo[None]) -> dict[str, Any]:
    judge = item.stash.get(_JUDGE, None)
    sentence = " ".join((getattr(item, "function", None).__doc__ or "").split())
    result: dict[str, Any] = {
        "id": f"{item.path.stem}::{item.name}",
        "outcome": Outcome.PASSED.value,
        "fraction": judge.fraction if judge else 0.0,
        "sentence": sentence,
        "seen": judge.seen if judge else "",
        "expected": sentence,
        "try_": judge.try_ if judge else "",
        "trial": judge.trials[-1] if judge and judge.trials else "",
    }
    if call.excinfo is None:
        if result["fraction"] < 1:
            result["outcome"] = (Outcome.PARTIAL if result["fraction"] > 0 else Outcome.FAILED).value
        return result
    error = call.excinfo.value
    result["fraction"] = 0.0
    deaf_to = judge.deaf_to if judge and "best-effort" not in str(error) else ""
    if isinstance(error, Failed):
        result |= {
            "outcome": Outcome.FAILED.value,
            "seen": _joined(error.seen, deaf_to, judge.no_floats if judge else ""),
            "try_": error.try_,
        }
    elif isinstance(error, NotReached):
        result |= {"outcome": Outcome.NOT_REACHED.value, "because": _joined(deaf_to, str(error))}
    else:
        result |= {"outcome": Outcome.ERROR.value, "seen": f"{type(error).__name__}: {error}"}
    return result


def _joined(*words: str) -> str:
    return "; ".join(dict.fromkeys(filter(None, words)))
