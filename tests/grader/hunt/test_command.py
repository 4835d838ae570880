"""`grader hunt` over made-up trials: what it says, keeps, and returns."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.hunting import NODE, driven, moves, replacing, stands

from grader import cli, hunting
from grader.errors import EXIT_INTERRUPTED
from grader.evidence import Kind, Reason, Trial
from grader.trials.case import Case, Step

Hunt = Callable[..., int]


@pytest.fixture
def hunt(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Hunt:
    """Return a function that hunts in a package whose trials `make` makes."""

    def run(make: Callable[[Case], Trial], *arguments: str) -> int:
        monkeypatch.setattr(hunting, "runner", replacing(make))
        return cli.main(["hunt", "--out", str(tmp_path / "hunt"), *arguments])

    return run


def test_a_hunt_without_a_finding_says_how_many_cases_were_tried(hunt: Hunt, capsys: pytest.CaptureFixture[str]):
    assert hunt(stands, "F1", "--cases", "7", "--seed", "17") == 0
    assert capsys.readouterr().out == "7 cases, no fault found, seed 17.\n"


def test_a_finding_is_said_kept_and_fails_again(hunt: Hunt, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert hunt(moves, "F1", "--cases", "5") == 1
    said = capsys.readouterr().out
    file = tmp_path / "hunt" / "F1-stands_without_a_command.yaml"
    assert said.startswith("Found in case 1, seed 0:\n")
    assert "commands 0.25 m/s at 0.50 s, and nothing was asked" in said
    assert f"The replay: {file.with_suffix('.html')}. Again: grader hunt --again {file}" in said
    assert hunt(moves, "--again", str(file)) == 1
    assert "nothing was asked" in capsys.readouterr().out
    assert hunt(stands, "--again", str(file)) == 0
    assert capsys.readouterr().out == "No fault: every promise was kept in this case.\n"


def test_a_case_that_breaks_another_promise_now_still_fails(hunt: Hunt, tmp_path: Path):
    file = tmp_path / "case.yaml"
    file.write_text("breaks: never_touches\n" + Case(NODE, (Step("wait", 1.0),)).text)
    assert hunt(moves, "--again", str(file)) == 1
    file.write_text("breaks: lives\n" + Case(NODE, (Step("wait", 1.0),)).text)
    assert hunt(lambda _: driven(0.0, foreign=["/scan by x"]), "--again", str(file)) == 1


def test_cases_that_fail_only_once_are_counted(hunt: Hunt, capsys: pytest.CaptureFixture[str]):
    seen: set[Case] = set()

    def moves_at_first(case: Case) -> Trial:
        first = not seen
        seen.add(case)
        return moves(case) if first else stands(case)

    assert hunt(moves_at_first, "F1", "--cases", "5") == 0
    assert "1 case failed once and not again; it is not shown." in capsys.readouterr().out


def test_what_was_found_is_kept_when_it_is_interrupted_while_it_is_made_smaller(hunt: Hunt, tmp_path: Path):
    def interrupted(case: Case) -> Trial:
        if (tmp_path / "hunt").is_dir():
            raise KeyboardInterrupt
        return moves(case)

    assert hunt(interrupted, "F1") == EXIT_INTERRUPTED
    assert {path.suffix for path in (tmp_path / "hunt").iterdir()} == {".yaml", ".html", ".py"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["Q1"], "No hunt is for 'Q1'. There are F1, "),
        (["--cases", "0"], "--cases must be at least 1."),
    ],
)
def test_a_wrong_use_is_refused(hunt: Hunt, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]):
    assert hunt(stands, *arguments) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("node: robot_controller\nsteps:\n- wiat: 1.0\n", "line 3: wiat is not allowed here. Did you mean wait?"),
        ("", "line 1: 'node' is missing; a case needs node, steps"),
    ],
)
def test_a_file_with_a_mistake_is_named(
    hunt: Hunt, tmp_path: Path, text: str, said: str, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "case.yaml").write_text(text)
    assert hunt(stands, "--again", str(tmp_path / "case.yaml")) == 3
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"script_error": "KeyError: 'x'"}, "The case cannot be run: KeyError: 'x'"),
        ({"ended": Reason(Kind.SLOW, seconds=120.0)}, "The case cannot be judged: "),
    ],
)
def test_a_case_that_shows_nothing_is_not_taken_for_a_good_one(
    hunt: Hunt, tmp_path: Path, facts: dict[str, Any], said: str, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "case.yaml").write_text(Case(NODE, (Step("wait", 1.0),)).text)
    assert hunt(lambda _: driven(0.0, **facts), "--again", str(tmp_path / "case.yaml")) == 3
    assert said in capsys.readouterr().err
    assert hunt(lambda _: driven(0.0, **facts), "F1", "--cases", "3") == 0
    assert "3 of the cases could not be judged; of the first: " in capsys.readouterr().out
