"""Reasons are data: what is done about one depends on its fields, and never on the words that people read."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.course import COURSE
from helpers.judging import ask, evidence_with, find, judged
from helpers.report_examples import grading

from grader.evidence import (
    Build,
    Call,
    Evidence,
    Finding,
    Goal,
    Graph,
    Kind,
    Manifest,
    ProcessEnd,
    Quality,
    Reason,
    Trial,
    from_json,
    to_json,
)
from grader.notebook.prerequisites import advice
from grader.report import cause
from grader.scoring.rubric import RUBRIC, load
from grader.scoring.scorecard import Outcome, score
from grader.trials import catalog

F2, F8 = "check_set_speed::test_drives_at_the_set_speed", "check_navigation::test_reaches_a_target_ahead"
PLACE = '  File "/ws/install/lib/python3.12/site-packages/ros2_robot_controller/driver.py", line 7, in go\n'
RAISED = f"Traceback (most recent call last):\n{PLACE}KeyError: 1\n"
IDLE = "idle_robot_controller"
ITSELF, US = ProcessEnd("itself", 1, 0.4, RAISED), ProcessEnd("us", None, 9.0, "")
LOOPS = Finding("ros2_robot_controller/driver.py", 88, "loop-in-callback", "`while` in the callback `on_scan`")


def everywhere(ended: Reason | None = None, *, ready: bool = True, **facts: object) -> Evidence:
    """Return the evidence of a package all of whose trials went alike."""
    facts = {"process": US, "graph": Graph(nodes=["driver"]), **facts}
    trials = {
        name: Trial(name, plan.node, plan.world, 0, ready, "lockstep", ended, launch=plan.launch, **facts)  # type: ignore[arg-type]
        for name, plan in catalog.trials(COURSE).items()
    }
    return evidence_with(trials=trials, quality=Quality(Manifest(found=True), habits=[LOOPS]))


def unanswered(kind: Kind) -> Evidence:
    goal = Goal(0.5, 1.0, 0.0, 0.1, False, "unfinished", None, 0.0, 0.0, 0.0, problem=Reason(kind, "x", seconds=2.0))
    services = [name for node in COURSE.nodes.values() for name in node.services]
    return everywhere(calls=[Call(0.5, name, {}, None, problem=goal.problem) for name in services], goals=[goal])


UNBUILT = Build(ok=False, cached=False, wall_seconds=1.0, exit_code=1, timed_out=False, log_tail="")
EVIDENCE = {
    "not built": evidence_with(build=UNBUILT),
    "no program": everywhere(Reason(Kind.NO_PROGRAM, "robot_controller", "p"), ready=False),
    "no file": everywhere(Reason(Kind.NO_FILE, "config/robot_params.yaml", "p"), ready=False),
    "died early": everywhere(Reason(Kind.DIED_EARLY, exit_code=1), ready=False, process=ITSELF),
    "not up": everywhere(Reason(Kind.NOT_UP, "robot_controller", seconds=20.0, nodes=("driver",)), ready=False),
    "died": everywhere(Reason(Kind.DIED, exit_code=1, seconds=1.0), process=ITSELF),
    "hangs": everywhere(Reason(Kind.HANGS, seconds=10.0, place="driver.py:7, in `go`")),
    "slow": everywhere(Reason(Kind.SLOW, seconds=120.0)),
    "no service": unanswered(Kind.NO_SERVICE),
    "no answer": unanswered(Kind.NO_ANSWER),
    "unheard": everywhere(deaf_to=["scan"]),
    "the robot stands": everywhere(calls=[Call(0.5, "set_speed", {"speed": 0.1}, {"success": True, "message": ""})]),
}


def consequences(evidence: Evidence) -> tuple[dict[str, str], set[str]]:
    """Return the advice for each check that was not reached, and the checks that the first cause explains."""
    results, rubric = judged(evidence), load(RUBRIC)
    first = cause.find(grading(rubric, results, evidence, scorecard=score(rubric, results)))
    tries = {result.id: advice(result.reason) for result in results if result.outcome is Outcome.NOT_REACHED}
    return tries, {loss.result.id for loss in first.losses} if first else set()


@pytest.mark.parametrize("name", EVIDENCE)
def test_other_words_lose_no_advice_and_no_first_cause(name: str, monkeypatch: pytest.MonkeyPatch):
    """Rewording two sentences once kept every test green and lost the advice."""
    before = consequences(EVIDENCE[name])
    assert before[0], "some check is not reached"
    for kind in Kind:
        monkeypatch.setattr(kind, "words", f"blah {kind.value}")
    assert any("blah" in result.because for result in judged(EVIDENCE[name]))
    assert consequences(EVIDENCE[name]) == before


def test_each_kind_of_reason_has_advice_of_its_own_where_there_is_any():
    tries = {name: consequences(evidence)[0].get(F2, "") for name, evidence in EVIDENCE.items()}
    assert tries["no program"].startswith("install it with install(PROGRAMS")
    assert tries["no service"].startswith("complete the exercise")
    assert tries["died"] == tries["died early"] == "the node ended by itself; its last output says where"
    assert tries["hangs"] == tries["slow"] == tries["no answer"]
    assert tries["hangs"].startswith("return at once and let a timer")


def test_a_requirement_that_the_students_own_exception_names_is_not_to_be_fixed_first():
    """`raise NotImplementedError("goals come later (F8)")` made the advice say "fix F8 first"."""
    output = f"Traceback (most recent call last):\n{PLACE}NotImplementedError: goals come later (F8)\n"
    evidence = everywhere(Reason(Kind.DIED, exit_code=1, seconds=1.0), process=replace(ITSELF, output_tail=output))
    said = ask(find(F2), evidence)
    assert said.seen.endswith("goals come later (F8) (ros2_robot_controller/driver.py:7, in `go`)")
    assert advice(said.reason) == "the node ended by itself; its last output says where"
    results = judged(evidence)
    waits = [replace(r, because="NotImplementedError: goals come later (F8)") for r in results]
    rubric = load(RUBRIC)
    first = cause.find(grading(rubric, waits, evidence, scorecard=score(rubric, waits)))
    assert first is None or not first.sentence.startswith("F8 ")


def test_every_kind_of_reason_has_words():
    assert all(str(Reason(kind, "x", seconds=1.0, said="y", requirements=("F2",))) for kind in Kind)


def test_a_trial_recorded_with_sentences_is_refused():
    """What an earlier kit wrote beside them has another meaning now."""
    trial = to_json(replace(EVIDENCE["hangs"].trials[IDLE], ended=None)).replace('"ended": null', '"ended": ""')
    with pytest.raises(ValueError, match="not a Trial"):
        from_json(trial, Trial)
