"""Hunts in a grading: as many cases as the rubric says, by the grading's seed, and what they have shown as evidence."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest
from helpers.course import COURSE
from helpers.hunting import NODE, FakeObservers, driven, moves, stands

from grader import KIT
from grader.building import Built
from grader.evidence import Build, Hunt, Intake, Kind, Reason, Trial, from_json, to_json
from grader.hunt import search
from grader.hunt.search import Runner
from grader.hunt.source import Hunts
from grader.intake.submission import Submission
from grader.processes import jobs
from grader.scoring.rubric import Rubric, load
from grader.settings import Settings
from grader.source import Collected, Subject
from grader.trials import case as cases
from grader.trials.case import Case

Collects = Callable[..., tuple[Collected, list[Case]]]


def hunting(**hunted: int) -> Rubric:
    """Return the kit's rubric with hunts of so many cases."""
    whole = load(KIT / "rubric.yaml")
    with_hunts = [
        replace(c, requirements=tuple(replace(r, hunt=hunted.get(r.id, 0)) for r in c.requirements))
        for c in whole.criteria
    ]
    return replace(whole, criteria=tuple(with_hunts))


@pytest.fixture
def collects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Collects:
    """Return a function that hunts in a package whose trials `make` makes; it returns evidence, and the cases run."""
    (tmp_path / "install").mkdir()
    built = Built(Build(ok=True, package=COURSE.package, types_package=COURSE.package), tmp_path / "install")
    submission = Submission(Intake("team07.zip", "ab", "p", "."), tmp_path, tmp_path, None, ())

    def collect(make: Callable[[Case], Trial], seed: int = 0, **hunted: int) -> tuple[Collected, list[Case]]:
        observers = FakeObservers(make)
        settings = Settings(hunting(**hunted), tmp_path, COURSE, seed=seed)
        with ThreadPoolExecutor(1) as pool:
            monkeypatch.setattr(search, "of_build", lambda _: Runner(cast(Any, observers), pool))
            asked = Hunts().ask(Subject(submission, settings, tmp_path, built=built, contract=built))
            return asked.collected(jobs.run(asked.jobs).results), observers.ran

    return collect


def test_a_package_that_keeps_its_promises_is_tried_in_as_many_cases_as_the_rubric_says(collects: Collects):
    found, ran = collects(stands, F1=7)
    assert found.facts == {"hunts": {"F1": Hunt(7)}, "trials": {}}
    assert len(ran) == 7


def test_a_broken_promise_is_kept_with_its_trial_and_a_case_that_can_be_run_again(collects: Collects, tmp_path: Path):
    found, ran = collects(moves, F1=7)
    hunt = cast(Any, found.facts["hunts"])["F1"]
    assert hunt.broken.name == "stands_without_a_command"
    assert "nothing was asked" in hunt.broken.seen
    assert cast(Any, found.facts["trials"]).keys() == {hunt.trial} == {"hunt_F1"}
    (tmp_path / "case.yaml").write_text(hunt.broken.case)
    assert cases.read(tmp_path / "case.yaml", COURSE) in ran
    result = (hunt, [moves(ran[0])])  # as it is kept for the next grading
    assert from_json(to_json(result), cast(Any, tuple[Hunt, list[Trial]])) == result


def test_the_same_seed_comes_to_the_same_and_another_one_tries_other_cases(collects: Collects):
    first, again, other = (collects(moves, seed, F4=20) for seed in (4711, 4711, 0))
    assert first == again
    assert first[1] != other[1]


def test_requirements_with_the_same_cases_share_their_trials(collects: Collects):
    found, ran = collects(stands, F8=5, F9=5, F6=5)
    assert {name: hunt.cases for name, hunt in cast(Any, found.facts["hunts"]).items()} == {"F8": 5, "F9": 5, "F6": 5}
    assert len(ran) == 10


def test_a_node_that_cheats_breaks_a_promise_and_is_a_flag(collects: Collects):
    found, _ = collects(lambda _: driven(0.0, foreign=["clock by robot_controller"]), F1=5)
    assert "clock by robot_controller" in cast(Any, found.facts["hunts"])["F1"].broken.seen
    assert [(flag.kind, flag.trial) for flag in found.flags] == [("foreign publisher", "hunt_F1")]


def test_a_node_that_never_comes_up_is_not_started_sixty_times(collects: Collects):
    absent = Reason(Kind.NOT_UP, NODE, seconds=20.0)
    found, ran = collects(lambda _: driven(0.0, ready=False, ended=absent), F1=50)
    assert cast(Any, found.facts["hunts"])["F1"].broken.name == "lives"
    assert len(ran) <= 20


def test_a_package_that_keeps_the_hunt_waiting_has_a_reason_for_it(collects: Collects):
    found, _ = collects(lambda _: driven(0.0, ended=Reason(Kind.WAITED, seconds=300.0)), F1=5)
    assert found.facts["hunts"] == {"F1": Hunt(0, trial="hunt_F1")}
    assert cast(Any, found.facts["trials"])["hunt_F1"].ended.kind is Kind.WAITED


@pytest.mark.parametrize("fate", [{"ended": Reason(Kind.OBSERVER_CRASHED)}, {"script_error": "ValueError: no"}])
def test_a_case_that_could_not_be_judged_is_no_promise_kept(collects: Collects, fate: dict[str, Any]):
    found, ran = collects(lambda case: driven(0.0, **(fate if len(case.steps) > 4 else {})), F1=20)
    assert len(ran) == 20
    assert found.facts["hunts"] == {"F1": Hunt(20, trial="hunt_F1")}
    assert cast(Any, found.facts["trials"])["hunt_F1"] == replace(driven(0.0, **fate), name="hunt_F1")
