"""`grader certify`: what flickers is named, and a log is gone on with only where it is of the same thing."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.errors import GraderError
from grader.selftest import flakiness
from grader.selftest.flakiness import Run


def one(number: int, f1: float = 3.0, stress: bool = False, sha256: str = "a", name: str = "F1") -> Run:
    return Run(number, stress, {name: f1}, {name: "passed" if f1 == 3.0 else "partial"}, sha256)


@pytest.fixture
def graded(monkeypatch: pytest.MonkeyPatch):
    """Return a function that says what the next gradings give; the list that it returns holds (number, stress)."""

    def arrange(*runs: Run) -> list[tuple[int, bool]]:
        waiting, asked = iter(runs), []

        def grade(_submission: Path, number: int, stress: bool, *_: object) -> Run:
            asked.append((number, stress))
            return next(waiting)

        monkeypatch.setattr(flakiness, "_grade", grade)
        return asked

    return arrange


def test_a_requirement_that_came_out_otherwise_once_flickers():
    steady, unsteady = [one(0), one(1)], [one(0), one(1, 1.5, stress=True)]
    assert flakiness.flickering(steady) == []
    assert flakiness.flickering(unsteady) == ["F1"]
    assert "No requirement flickered in 2 runs" in flakiness.render(steady)
    table = flakiness.render(unsteady)
    assert "FLICKERS" in table
    assert "1/1" in table
    assert "0/1" in table


def test_every_second_run_is_under_stress_and_a_log_is_gone_on_with(graded, tmp_path: Path):
    log = tmp_path / "log.jsonl"
    asked = graded(one(0), one(1), one(2))
    assert len(list(flakiness.run(tmp_path, log, 1, stress=True))) == 1
    with log.open("a") as stream:
        stream.write('{"number": 1, "str')  # we were killed here
    assert [run.number for run in flakiness.run(tmp_path, log, 3, stress=True)] == [0, 1, 2]
    assert asked == [(0, False), (1, True), (2, False)]
    assert len(flakiness.load(log)) == 3


@pytest.mark.parametrize("other", [one(1, sha256="b"), one(1, name="F2")], ids=["submission", "requirements"])
def test_a_log_of_something_else_is_refused_at_once_and_kept(graded, tmp_path: Path, other: Run):
    """After thirty gradings would be late, and other requirements would all seem to flicker."""
    log = tmp_path / "log.jsonl"
    asked = graded(one(0), other, one(2))
    list(flakiness.run(tmp_path, log, 1, stress=False))
    with pytest.raises(GraderError, match="Name another --log, or remove it"):
        list(flakiness.run(tmp_path, log, 3, stress=False))
    assert len(asked) == 2
    assert flakiness.load(log) == [one(0)]
