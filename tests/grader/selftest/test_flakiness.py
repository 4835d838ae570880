"""`grader flakiness`: flaky requirements are named."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader import cli
from grader.errors import EXIT_USAGE
from grader.selftest import flakiness
from grader.selftest.flakiness import GradingRun


def one(number: int, f1: float = 3.0, stress: bool = False) -> GradingRun:
    return GradingRun(number, stress, {"F1": f1}, {"F1": "passed" if f1 == 3.0 else "partial"})


def test_a_requirement_that_differs_once_is_flaky():
    steady, unsteady = [one(0), one(1)], [one(0), one(1, 1.5, stress=True)]
    assert flakiness.flaky(steady) == []
    assert flakiness.flaky(unsteady) == ["F1"]
    assert "No requirement was flaky in 2 runs" in flakiness.render(steady)
    table = flakiness.render(unsteady)
    assert "FLAKY" in table
    assert "1/1" in table
    assert "0/1" in table
    assert "total                      1.5 to 3\n1 requirement was flaky in 2 runs: F1." in table


def test_every_second_run_is_under_stress(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.setattr(flakiness, "_grade", lambda _submission, number, stress, *_: one(number, stress=stress))
    runs = flakiness.grade_repeatedly(tmp_path, 3, stress=True)
    assert [(run.number, run.stress) for run in runs] == [(0, False), (1, True), (2, False)]


def test_an_interrupted_series_prints_the_table_of_its_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys):
    def grade(_submission: Path, number: int, *_: object) -> GradingRun:
        if number == 2:
            raise KeyboardInterrupt
        return one(number)

    monkeypatch.setattr(flakiness, "_grade", grade)
    assert cli.main(["flakiness", str(tmp_path), "--runs", "30"]) == 130
    assert "No requirement was flaky in 2 runs, 0 of them under stress." in capsys.readouterr().out


def test_a_requirement_that_does_not_exist_is_wrong_usage(tmp_path: Path, capsys):
    """`--only F` graded nothing thirty times, and said that nothing was flaky."""
    assert cli.main(["flakiness", str(tmp_path), "--only", "F"]) == EXIT_USAGE
    assert "there is no requirement 'F'. There are F1, F2" in capsys.readouterr().err


def test_what_cost_points_in_a_flaky_requirement_is_in_the_table():
    """Points alone do not lead to the race."""
    steady = GradingRun(0, False, {"F9": 2.0}, {"F9": "passed"})
    lost = GradingRun(1, False, {"F9": 1.0}, {"F9": "partial"}, seen={"F9": "no feedback for 0.9 s"})
    assert "run 2: no feedback for 0.9 s" in flakiness.render([steady, lost])
    assert "no feedback" not in flakiness.render([lost])
