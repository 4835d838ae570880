"""Give each check its evidence, and write down its result."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from grader import evidence
from grader.checks.judge import Failed, Judge, NotReached
from grader.scoring.scorecard import Outcome

_JUDGE = pytest.StashKey[Judge]()
_RESULTS = pytest.StashKey[list[dict[str, Any]]]()
_EVIDENCE = pytest.StashKey[evidence.Evidence]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for where to read the folder of the evidence, a file descriptor, and the file of the results."""
    parser.addoption("--evidence-from", type=int, required=True)
    parser.addoption("--results", type=Path, required=True)


def pytest_configure(config: pytest.Config) -> None:
    """Begin with no results."""
    config.stash[_RESULTS] = []


def pytest_collection_finish(session: pytest.Session) -> None:
    """Wait for the evidence, and read it once."""
    with os.fdopen(session.config.getoption("--evidence-from"), encoding="utf-8") as waiting:
        folder = waiting.read()
    if not folder:
        pytest.exit("there is no evidence", returncode=0)
    session.config.stash[_EVIDENCE] = evidence.load(Path(folder))


@pytest.fixture
def judge(request: pytest.FixtureRequest) -> Judge:
    """Return the judge for one check."""
    judge = Judge(request.config.stash[_EVIDENCE])
    request.node.stash[_JUDGE] = judge
    return judge


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    """Note a check's result. Any exception but Failed and NotReached is an error of the grader."""
    yield
    if call.when == "call" or (call.when == "setup" and call.excinfo is not None):
        item.config.stash[_RESULTS].append(_result(item, call))


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the results."""
    results: Path = session.config.getoption("--results")
    results.write_text(json.dumps(session.config.stash[_RESULTS], indent=1))


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
