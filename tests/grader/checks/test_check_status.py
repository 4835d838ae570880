"""F7: the flag of get_status, in the direction of travel."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find, with_trials

from grader.evidence import Kind, Reason

ASSERTION = (
    "python3: _get_robot_status_s.c:141: my_package__srv__get_robot_status__response__convert_from_py: "
    "Assertion `PyFloat_Check(field)' failed.\nFatal Python error: Aborted\nExtension modules: numpy (total: 1)\n"
)
FLAG = find("check_status::test_status_reports_an_obstacle")
PLACES = ("standing", "driving", "before an obstacle", "when it is gone", "beside a pole", "ahead", "behind")


def flagged(**flags: bool) -> Judged:
    """Return what F7 says of the reference with other flags in the answers, each given by its place."""
    evidence = recordings.load("reference")
    status = evidence.trials["status"]
    asked = [call for call in status.calls if call.service == "get_status"]
    others = {call.t: flags[place] for call, place in zip(asked, PLACES, strict=True) if place in flags}
    calls = [
        replace(call, response={**(call.response or {}), "obstacle_detected": others[call.t]})
        if call.service == "get_status" and call.t in others else call for call in status.calls
    ]  # fmt: skip
    return ask(FLAG, with_trials(evidence, replace(status, calls=calls)))


@pytest.mark.parametrize(
    ("flags", "said"),
    [
        ({"ahead": True}, "obstacle_detected = True while driving backwards, away from an obstacle"),
        ({"behind": False}, "obstacle_detected = False after driving backwards, with an obstacle 0.45 m behind"),
    ],
)
def test_driving_backwards_the_flag_is_about_what_lies_behind(flags: dict[str, bool], said: str):
    answer = flagged(**flags)
    assert answer.share == 0.5
    assert answer.seen == said


@pytest.mark.parametrize(
    "check", ["check_status::test_status_gives_the_speed_in_force", "check_navigation::test_stands_still_after_arrival"]
)
def test_a_node_that_dies_of_the_first_question_after_a_goal_loses_points(check: str):
    """`self._speed = 0` at the end of a goal passed F2, F3, F7 to F11; the next get_status ended the node."""
    evidence = recordings.load("reference")
    again = evidence.trials["navigate_again"]
    process = replace(again.process, by="itself", exit_code=-6, output_tail=ASSERTION)
    dead = replace(again, ended=Reason(Kind.DIED, exit_code=-6, seconds=20.0), process=process)
    said = ask(find(check), with_trials(evidence, dead))
    assert said.share == 0.5
    assert "with exit status -6; its last output was: Assertion" in said.seen
    assert "`0.0` for a float64" in said.try_


def test_a_robot_that_does_not_drive_backwards_is_judged_by_f2():
    evidence = recordings.load("reference")
    status = evidence.trials["status"]
    still = [replace(s, odom_x=0.0, odom_y=0.0) if s.t > status.marks["backwards"] - 0.3 else s for s in status.samples]
    wrong = [
        replace(call, response={**(call.response or {}), "obstacle_detected": False})
        if call.t > status.marks["backwards"] else call for call in status.calls
    ]  # fmt: skip
    assert ask(FLAG, with_trials(evidence, replace(status, samples=still, calls=wrong))).share == 1
