"""`grader flakiness`: flaky requirements are named, and a log is continued only for the same submission."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader import cli
from grader.errors import EXIT_USAGE, GraderError
from grader.selftest import flakiness
from grader.selftest.flakiness import GradingRun


def one(
    number: int, f1: float = 3.0, stress: bool = False, sha256: str = "a", name: str = "F1", kit: str = "k"
) -> GradingRun:
    return GradingRun(number, stress, {name: f1}, {name: "passed" if f1 == 3.0 else "partial"}, sha256, kit)


@pytest.fixture
def graded(monkeypatch: pytest.MonkeyPatch):
    """Return a function that sets the results of the next gradings and returns a list of their (number, stress)."""

    def arrange(*runs: GradingRun) -> list[tuple[int, bool]]:
        waiting, asked = iter(runs), []

        def grade(_submission: Path, number: int, stress: bool, *_: object) -> GradingRun:
            asked.append((number, stress))
            return next(waiting)

        monkeypatch.setattr(flakiness, "_grade", grade)
        return asked

    return arrange


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


def test_every_second_run_is_under_stress_and_a_log_is_continued(graded, tmp_path: Path):
    log = tmp_path / "log.jsonl"
    asked = graded(one(0), one(1), one(2))
    assert len(list(flakiness.grade_repeatedly(tmp_path, log, 1, stress=True))) == 1
    with log.open("a") as stream:
        stream.write('{"number": 1, "str')  # the grader was killed here
    assert [run.number for run in flakiness.grade_repeatedly(tmp_path, log, 3, stress=True)] == [0, 1, 2]
    assert asked == [(0, False), (1, True), (2, False)]
    assert len(flakiness.load(log)) == 3


def test_an_interrupted_series_prints_the_table_of_its_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys):
    def grade(_submission: Path, number: int, *_: object) -> GradingRun:
        if number == 2:
            raise KeyboardInterrupt
        return one(number)

    monkeypatch.setattr(flakiness, "_grade", grade)
    assert cli.main(["flakiness", str(tmp_path), "--runs", "30", "--log", str(tmp_path / "log")]) == 130
    assert "No requirement was flaky in 2 runs, 0 of them under stress." in capsys.readouterr().out
    assert len(flakiness.load(tmp_path / "log")) == 2


def test_a_requirement_that_does_not_exist_is_wrong_usage(tmp_path: Path, capsys):
    """`--only F` graded nothing thirty times, and said that nothing was flaky."""
    assert cli.main(["flakiness", str(tmp_path), "--only", "F"]) == EXIT_USAGE
    assert "there is no requirement 'F'. There are F1, F2" in capsys.readouterr().err


OTHERS = {"submission": one(1, sha256="b"), "requirements": one(1, name="F2"), "kit": one(1, kit="l")}


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_a_log_of_another_submission_is_refused_at_once_and_kept(graded, tmp_path: Path, other: GradingRun):
    """After thirty gradings it would be late, and other requirements would all seem flaky."""
    log = tmp_path / "log.jsonl"
    asked = graded(one(0), other, one(2))
    list(flakiness.grade_repeatedly(tmp_path, log, 1, stress=False))
    with pytest.raises(GraderError, match="Choose another --log, or remove it"):
        list(flakiness.grade_repeatedly(tmp_path, log, 3, stress=False))
    assert len(asked) == 2
    assert flakiness.load(log) == [one(0)]


def test_what_cost_points_in_a_flaky_requirement_is_in_the_table():
    """Points alone do not lead to the race."""
    steady = GradingRun(0, False, {"F9": 2.0}, {"F9": "passed"})
    lost = GradingRun(1, False, {"F9": 1.0}, {"F9": "partial"}, seen={"F9": "no feedback for 0.9 s"})
    assert "run 2: no feedback for 0.9 s" in flakiness.render([steady, lost])
    assert "no feedback" not in flakiness.render([lost])
