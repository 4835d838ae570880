"""What a run shows, what every node promises, and what a course can hunt for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.hunting import NODE, SLOW, WAITS, driven, waiting
from hypothesis import given
from hypothesis import strategies as st

from grader.errors import UsageError
from grader.evidence import Call, Kind, ProcessEnd, Reason, Trial
from grader.trials.case import Case, Step
from grader.trials.promises import LIVES, Broken, Hunts, Making, Promise, Run, first_broken, hunts

TRACEBACK = 'Traceback (most recent call last):\n  File "a.py", line 3, in f\nValueError: no scan\n'


def process(output: str, by: str = "us") -> ProcessEnd:
    return ProcessEnd(by, 0, 1.0, output)


def test_a_run_says_when_a_step_was_done_and_with_what():
    case = Case(NODE, (Step("wait", 0.5), Step("remove", "a"), Step("wait", 1.0)))
    run = Run(case, driven(0.0, marks={"0 wait": 0.0, "1 remove": 0.5}))
    assert run.times("wait") == [(0.0, 0.5)]  # the second was not reached
    assert run.times("remove") == [(0.5, "a")]
    assert run.end == 1.0
    assert run.sample(0.52).t == 0.5
    assert [len(run.commands(start, end)) for start, end in ((0.0, 0.5), (0.5, 1.0))] == [1, 0]


@pytest.mark.parametrize(
    ("trial", "said"),
    [
        (driven(0.0, ended=Reason(Kind.DIED, exit_code=1, seconds=0.7)), "the node ended at 0.70 s with exit status 1"),
        (driven(0.0, ended=Reason(Kind.HANGS, seconds=10.0)), "the node did not answer for 10 s: a callback hangs"),
        (driven(0.0, process=process(TRACEBACK)), "a traceback: ValueError: no scan"),
        (driven(0.0, calls=[Call(0.4, "get_status", {}, None, problem=Reason(Kind.NO_ANSWER, seconds=2.0))]), "no answer within 2 s"),
        (driven(0.0, stopped="memory", ended=Reason(Kind.DIED, exit_code=-9, seconds=0.3)), "exceeded its limit of memory"),
        (driven(0.0, dropped=5), "the node sent more messages than could be kept"),
        (driven(0.0, foreign=["/clock by evil"]), "it publishes /clock by evil, which only the simulator does"),
    ],
)  # fmt: skip
def test_a_node_that_does_not_live_on_is_named(trial: Trial, said: str):
    broken = LIVES.judge(Run(waiting(1), trial))
    assert broken is not None
    assert said in broken.seen


@pytest.mark.parametrize(
    "trial",
    [
        driven(0.0, process=process("")),
        driven(0.0, process=process(TRACEBACK, by="interrupt")),  # ends_on_ctrl_c judges that
        driven(0.0, ended=Reason(Kind.OBSERVER_CRASHED)),
    ],
)
def test_what_is_not_the_nodes_doing_breaks_no_promise(trial: Trial):
    assert LIVES.judge(Run(waiting(1), trial)) is None


def test_the_promise_that_was_broken_first_is_shown():
    later = replace(SLOW, name="later", judge=lambda _: Broken(0.9, "later"))
    run = Run(waiting(1), driven(1.0))
    assert first_broken([later, SLOW], run) == (SLOW, Broken(0.5, "1 m/s at 0.5 s"))
    assert first_broken([SLOW], Run(waiting(1), driven(0.1))) is None
    assert first_broken([later], Run(waiting(1), driven(1.0, script_error="KeyError"))) is None


def test_a_hunt_is_for_what_its_requirements_need():
    other = Making(("F2", "F3"), st.just(waiting(50)))
    all_ = Hunts((WAITS, other), (SLOW, Promise("it", "It is.", lambda _: None, ("F3",))))
    assert [promise.name for promise in all_.of(["F1"])[1]] == ["is_slow", "lives"]
    assert [promise.name for promise in all_.of(["F3"])[1]] == ["it", "lives"]
    assert all_.of([])[0].serves == all_.requirements == ("F1", "F2", "F3")
    assert all_.of(["F3"])[0].cases is other.cases

    @given(all_.of(["F1", "F2"])[0].cases)
    def each(case: Case) -> None:
        made.add(len(case.steps) == 1 and case.steps[0].to == 5.0)

    made: set[bool] = set()
    each()
    assert made == {True, False}


def test_what_cannot_be_hunted_for_is_refused():
    with pytest.raises(UsageError, match=r"No hunt is for 'Q1'. There are F1, "):
        hunts(COURSE).of(["Q1"])
    with pytest.raises(UsageError, match="This course has no hunts: no module of its folder hunts/ makes up cases"):
        Hunts().of([])


def test_the_courses_hunts_are_found_in_its_folder(tmp_path: Path):
    found = hunts(COURSE)
    assert {"F1", "F4", "F8", "F12", "I8"} <= {*found.requirements}
    assert {name for promise in found.promises for name in promise.serves} == {*found.requirements}
    assert all(promise.sentence.endswith(".") for promise in found.promises)
    assert hunts(replace(COURSE, folder=tmp_path)) == Hunts()
