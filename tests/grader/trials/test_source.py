"""The trials as a source of evidence: what an earlier grading has seen is not run again."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers import recordings
from helpers.course import PACKAGE

from grader import KIT, building, evidence
from grader.building import Built
from grader.course import Course
from grader.evidence import Intake, Kind, Reason, Trial
from grader.evidence.kept import Kept
from grader.intake.submission import Submission
from grader.scoring.rubric import load
from grader.settings import Settings
from grader.source import Subject
from grader.trials import source
from grader.trials.plan import TrialPlan
from grader.trials.source import Trials, may_be_kept

TRIAL = recordings.load("reference").trials["wall_fast"]


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the trials that were run; each shows what one of the reference's trials showed."""
    names: list[str] = []

    def run(plans: Iterable[TrialPlan], _course: Course, **_: Any) -> dict[str, Trial]:
        found = {plan.name: replace(TRIAL, name=plan.name) for plan in plans}
        names.extend(found)
        return found

    monkeypatch.setattr(source.scheduler, "run", run)
    return names


@pytest.fixture
def subject(tmp_path: Path) -> Subject:
    package = tmp_path / "p"
    for name in ("node.py", "test/test_node.py"):
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1\n")
    for name in ("own", "contract"):
        (tmp_path / name / "install").mkdir(parents=True)
        building.cache.write_checksum(tmp_path / name / "install", tmp_path / name / "install")
    own, contract = (
        Built(replace(evidence.Build.not_tried(PACKAGE), ok=True), tmp_path / name / "install")
        for name in ("own", "contract")
    )
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("F4",))
    submission = Submission(Intake("p.zip", "ab", "p", "."), tmp_path, package, None, ())
    return Subject(submission, settings, tmp_path, Kept(tmp_path / "kept"), own, contract)


def again(subject: Subject) -> Subject:
    """Return the same subject as a new process would read it."""
    return replace(subject)


def test_what_has_not_changed_is_not_run_again(subject: Subject, ran: list[str]):
    first = Trials().collect(subject)
    trials: Any = first.facts["trials"]
    assert len(ran) == len(trials) > 3
    assert not first.kept
    second = Trials().collect(again(subject))
    assert len(ran) == len(second.kept) == len(trials)
    assert second.facts == first.facts
    assert set(second.kept) == {f"trial {name}" for name in ran}


def test_only_what_another_requirement_needs_besides_is_run(subject: Subject, ran: list[str]):
    Trials().collect(subject)
    before = set(ran)
    ran.clear()
    both = replace(subject, settings=replace(subject.settings, requirements=("F4", "F8")))
    found = Trials().collect(both)
    assert before.isdisjoint(ran)
    trials: Any = found.facts["trials"]
    assert set(trials) == before | set(ran)


def test_an_edit_of_a_node_runs_all_again_and_one_of_a_test_none(subject: Subject, ran: list[str]):
    Trials().collect(subject)
    ran.clear()
    (subject.submission.package / "test" / "test_node.py").write_text("2\n")
    Trials().collect(again(subject))
    assert not ran
    (subject.submission.package / "node.py").write_text("2\n")
    Trials().collect(again(subject))
    assert ran


def test_what_was_installed_decides_too(subject: Subject, ran: list[str]):
    Trials().collect(subject)
    ran.clear()
    (subject.install / "changed").touch()
    building.cache.write_checksum(subject.install, subject.install)
    Trials().collect(again(subject))
    assert ran


@pytest.mark.parametrize(
    "wrong",
    [{"ready": False}, {"ended": Reason(Kind.NOT_UP)}, {"script_error": "ours"}, {"stopped": "memory"}, {"dropped": 1}],
)
def test_a_trial_that_went_wrong_is_tried_again(wrong: dict[str, Any]):
    assert may_be_kept(TRIAL)
    assert not may_be_kept(replace(TRIAL, **wrong))
