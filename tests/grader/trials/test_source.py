"""The trials as a source of evidence: what an earlier grading has seen is not run again."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers import recordings
from helpers.archives import write
from helpers.course import PACKAGE

from grader import KIT, building, evidence
from grader.building import Built
from grader.evidence import Intake, Kind, Reason, Trial
from grader.intake.submission import Submission
from grader.processes import jobs
from grader.processes.kept import Kept
from grader.scoring.rubric import load
from grader.settings import Settings
from grader.source import Subject
from grader.trials.observers import Observers
from grader.trials.plan import TrialPlan
from grader.trials.request import went_well
from grader.trials.source import Trials

TRIAL = recordings.load("reference").trials["wall_fast"]


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the trials that were run; each shows what one of the reference's trials showed."""
    names: list[str] = []

    def run(_: Observers, plan: TrialPlan, _then: Sequence[TrialPlan] = ()) -> Trial:
        names.append(plan.name)
        return replace(TRIAL, name=plan.name)

    monkeypatch.setattr(Observers, "run", run)
    return names


def collect(subject: Subject) -> tuple[dict[str, Trial], dict[str, str]]:
    """Return the trials of the subject as a new process would collect them, and since when each is kept."""
    folder = Path(tempfile.mkdtemp(dir=subject.folder))
    asked = Trials().ask(replace(subject, folder=folder))
    done = jobs.run(asked.jobs, Kept(subject.folder / "kept"))
    trials: Any = asked.collected(done.results).facts["trials"]
    return trials, dict(done.kept)


@pytest.fixture
def subject(tmp_path: Path) -> Subject:
    package = tmp_path / "p"
    write(package, dict.fromkeys(("node.py", "test/test_node.py"), "1\n"))
    for name in ("own", "contract"):
        (tmp_path / name / "install").mkdir(parents=True)
        building.cache.write_checksum(tmp_path / name / "install")
    facts = evidence.Build(ok=True, package=PACKAGE, types_package=PACKAGE)
    own, contract = (Built(facts, tmp_path / name / "install") for name in ("own", "contract"))
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("F4",))
    submission = Submission(Intake("p.zip", "ab", "p", "."), tmp_path, package, None, ())
    return Subject(submission, settings, tmp_path, built=own, contract=contract)


def test_what_has_not_changed_is_not_run_again(subject: Subject, ran: list[str]):
    first, kept = collect(subject)
    assert len(ran) == len(first) > 3
    assert not kept
    second, kept = collect(subject)
    assert len(ran) == len(first)
    assert second == first
    assert set(kept) == {f"trial {name}" for name in ran}


def test_only_what_another_requirement_needs_besides_is_run(subject: Subject, ran: list[str]):
    collect(subject)
    before = set(ran)
    ran.clear()
    both = replace(subject, settings=replace(subject.settings, requirements=("F4", "F8")))
    found, _ = collect(both)
    assert before.isdisjoint(ran)
    assert set(found) == before | set(ran)


def test_an_edit_of_a_node_runs_all_again_and_one_of_a_test_none(subject: Subject, ran: list[str]):
    collect(subject)
    ran.clear()
    (subject.submission.package / "test" / "test_node.py").write_text("2\n")
    collect(subject)
    assert not ran
    (subject.submission.package / "node.py").write_text("2\n")
    collect(subject)
    assert ran


def test_what_was_installed_decides_too(subject: Subject, ran: list[str]):
    collect(subject)
    ran.clear()
    (subject.install / "changed").touch()
    building.cache.write_checksum(subject.install)
    collect(subject)
    assert ran


@pytest.mark.parametrize(
    "wrong",
    [{"ready": False}, {"ended": Reason(Kind.NOT_UP)}, {"script_error": "ours"}, {"stopped": "memory"}, {"dropped": 1}],
)
def test_a_trial_that_went_wrong_is_tried_again(wrong: dict[str, Any]):
    assert went_well(TRIAL)
    assert not went_well(replace(TRIAL, **wrong))
