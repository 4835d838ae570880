"""A hunt is judged by what it has found: all points or none, and a case with which to see it again."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from helpers import judging
from helpers.course import COURSE
from helpers.hunting import driven

from grader import evidence
from grader.checks import checks_run
from grader.checks.check_hunt import test_keeps_its_promises as keeps
from grader.checks.judge import Unjudged
from grader.evidence import BrokenPromise, Build, Evidence, Hunt, Kind, Reason
from grader.scoring.rubric import HUNT
from grader.scoring.scorecard import Outcome

CASE = "breaks: is_slow\nnode: robot_controller\nsteps:\n- {wait: 3.0}\n"
BROKEN = Hunt(3, broken=BrokenPromise("is_slow", "It is slow.", "1 m/s at 0.5 s", CASE), trial="hunt_F4")


def hunted(hunt: Hunt, **facts: object) -> Evidence:
    trial = replace(driven(1.0, **facts), name="hunt_F4")
    return judging.evidence_with(hunts={"F4": hunt, "F1": Hunt(9)}, trials={"hunt_F4": trial})


def judged(found: Evidence, requirement: str = "F4") -> judging.Judged:
    return judging.ask(partial(keeps, requirement=requirement), found)


def test_nothing_found_gets_all_points():
    said = judged(hunted(Hunt(300)))
    assert (said.share, said.seen) == (1.0, "300 cases, no fault found")


def test_a_broken_promise_gets_none_and_is_said_with_the_case():
    said = judged(hunted(BROKEN))
    assert said.share == 0
    assert said.seen == f"1 m/s at 0.5 s\npromised: It is slow.\ncase 3, made as small as it can be:\n{CASE.rstrip()}"
    assert "grader hunt --again case.yaml" in said.try_


@pytest.mark.parametrize(
    ("found", "kind"),
    [
        (hunted(BROKEN, ready=False, ended=Reason(Kind.NOT_UP, "robot_controller", seconds=20.0)), Kind.NOT_UP),
        (hunted(Hunt(0, trial="hunt_F4"), ended=Reason(Kind.WAITED, seconds=300.0)), Kind.WAITED),
        (hunted(Hunt(300, trial="hunt_F4"), ended=Reason(Kind.OBSERVER_CRASHED)), Kind.OBSERVER_CRASHED),
        (judging.evidence_with(build=Build(ok=False, package="p", types_package="p")), Kind.NOT_BUILT),
    ],
    ids=["no node", "waits", "brings observers down", "no build"],
)
def test_what_kept_the_hunt_from_judging_is_said(found: Evidence, kind: Kind):
    said = judged(found)
    assert not said.reached
    assert said.reason is not None
    assert said.reason.kind is kind


def test_a_hunt_that_did_not_take_place_costs_nothing():
    with pytest.raises(Unjudged, match="no hunt for F9"):
        judged(hunted(BROKEN), "F9")


def test_the_check_is_run_for_each_requirement_by_its_id(tmp_path: Path):
    evidence.save(hunted(BROKEN), tmp_path)
    results = checks_run.run(COURSE, tmp_path, [f"{HUNT}[F4]", f"{HUNT}[F1]", f"{HUNT}[F9]"])
    outcomes = {result.id: result.outcome for result in results}
    assert outcomes == {
        f"{HUNT}[F4]": Outcome.FAILED, f"{HUNT}[F1]": Outcome.PASSED, f"{HUNT}[F9]": Outcome.ERROR,
    }  # fmt: skip
    assert results[0].trial == "hunt_F4"
