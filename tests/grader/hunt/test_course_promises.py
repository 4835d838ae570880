"""The promises of the kit's own course, on recorded trials: the reference keeps all, each edit breaks its own."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from helpers import recordings
from helpers.course import COURSE
from helpers.hunting import NODE, driven

from grader.evidence import Goal, Trial
from grader.trials.case import Case, Step
from grader.trials.promises import Broken, Run, hunts, judged

PROMISES = {promise.name: promise for promise in hunts(COURSE).promises}
WITH_OBSTACLES = (
    "blocked_goal", "creeping", "emergency", "obstacle_among_bad_readings", "obstacle_behind", "obstacle_vanishes",
    "pole_aside", "status", "wall_backward", "wall_fast", "wall_slow",
)  # fmt: skip
SPOILT = ("bad_readings", "obstacle_among_bad_readings")
THRESHOLDS = {"battery_runs_down": {"battery_low_threshold": 30.0, "battery_critical_threshold": 15.0}}
TRIALS = (
    *WITH_OBSTACLES, *SPOILT, *THRESHOLDS, "cancel_early", "cancel_late", "drive_backward", "drive_forward",
    "fusion", "idle_robot_controller", "interrupted_driving", "navigate_ahead", "navigate_again", "navigate_behind",
    "navigate_beside", "nothing_to_fuse", "refuse_speed",
)  # fmt: skip


def as_run(trial: Trial) -> Run:
    """Return a recorded trial with the case that would have done what was done in it."""
    did: list[tuple[float, Step]] = [(0.0, Step("listen", m)) for m in sorted({m.topic for m in trial.messages})]
    did += [(0.0, Step("obstacle", {}))] if trial.name in WITH_OBSTACLES else []
    did += [(0.3, Step("readings", {"kind": "nan"}))] if trial.name in SPOILT else []
    did += [(call.t, Step("call", {"service": call.service, **call.request})) for call in trial.calls]
    did += [(goal.t, Step("goal", {})) for goal in trial.goals]
    did += [(goal.cancel_t, Step("cancel", None)) for goal in trial.goals if math.isfinite(goal.cancel_t)]
    did += [(mark, Step("wait", 0.0)) for mark in trial.marks.values()]
    did.sort(key=lambda each: each[0])
    marks = {f"{number} {step.do}": t for number, (t, step) in enumerate(did)}
    case = Case(trial.node, tuple(step for _, step in did), parameters=THRESHOLDS.get(trial.name, {}))
    # Which of two calls at the same time came first is not recorded.
    set_ = {call.t for call in trial.calls if call.service == "set_speed"}
    calls = [call for call in trial.calls if call.service != "get_status" or call.t not in set_]
    return Run(case, replace(trial, calls=calls, marks={**trial.marks, **marks}))


def broken(submission: str, promise: str) -> list[tuple[str, Broken]]:
    """Return where a submission's recorded trials break a promise, with the trials' names."""
    trials = recordings.load(submission).trials
    runs = [as_run(trials[name]) for name in TRIALS if name in trials]
    return [(run.trial.name, found) for run in runs if (found := judged(PROMISES[promise], run)) is not None]


@pytest.mark.parametrize("promise", PROMISES)
def test_the_reference_keeps_every_promise(promise: str):
    assert broken("reference", promise) == []


@pytest.mark.parametrize(
    ("promise", "edit", "said"),
    [
        ("never_touches", "drives_into_the_wall", "touched"),
        ("stops_in_time", "stops_late", "in the way"),
        ("stands_in_an_emergency", "turns_on_in_an_emergency", "rad/s at"),
        ("stands_without_a_command", "silent_when_idle", "commands a second"),
        ("stands_without_a_command", "half_the_rate", "commands a second until"),
        ("drives_at_the_set_speed", "drives_too_slowly", "with nothing in the way"),
        ("drives_at_the_set_speed", "never_backwards", "with nothing in the way"),
        ("drives_on", "never_forgets_an_obstacle", "with nothing in the way"),
        ("drives_on", "looks_all_around", "with nothing in the way"),
        ("takes_no_bad_reading_for_an_obstacle", "believes_every_reading", "with nothing in the way"),
        ("refuses_what_is_too_fast", "accepts_nan_as_a_speed", "speed nan was answered success = True"),
        ("refuses_what_is_too_fast", "refuses_without_the_limit", "was refused"),
        ("status_is_true", "status_is_ok", "obstacle_detected = "),
        ("status_is_true", "speed_without_a_sign", "after set_speed"),
        ("status_is_true", "never_reports_the_pose", "from that of odom"),
        ("arrives_where_it_says", "stops_short", "m off; the tolerance is"),
        ("arrives_where_it_says", "forgets_to_say_success", "with success = False"),
        ("arrives_where_it_says", "rolls_on_after_arrival", "after the goal has succeeded"),
        ("does_not_give_up", "gives_up_when_blocked", "the goal was aborted"),
        ("feedback_is_true", "feedback_along_x", "distance_remaining"),
        ("feedback_is_true", "feedback_too_rarely", "no feedback for"),
        ("cancels", "a_cancel_counts_as_success", "with success = True"),
        ("keeps_the_limits", "jumps_to_the_speed", "rose by"),
        ("ends_on_ctrl_c", "drives_on_after_ctrl_c", "the last command is"),
        ("fuses_whatever_is_read", "publishes_nothing_when_nothing_is_near", "no fused data from"),
        ("fuses_the_latest_imu", "keeps_the_first_imu_message", "had been measured"),
        ("fuses_the_battery_in_percent", "battery_as_a_ratio", "battery_level"),
        ("says_once_that_the_battery_is_low", "logs_the_alarm_at_every_message", "times a battery warning"),
        ("publishes_in_time", "publishes_before_the_first_scan", "before the first scan"),
        ("publishes_in_time", "fuses_at_half_the_rate", "at 10.0 Hz"),
    ],
)
def test_a_known_bad_edit_breaks_the_promise_that_it_is_for(promise: str, edit: str, said: str):
    found = broken(edit, promise)
    assert found
    assert any(said in each.seen for _, each in found), found


@pytest.mark.parametrize(("ended", "said"), [(math.nan, "the goal of 0.30 s had not ended at 0.90 s"), (0.8, "")])
def test_a_goal_with_nothing_in_the_way_ends(ended: float, said: str):
    goal = Goal(0.3, 1.0, 0.0, 0.1, True, "succeeded", True, 1.0, 0.0, ended)
    case = Case(NODE, (Step("goal", {}), Step("arrive", 0.5)))
    trial = driven(0.0, goals=[goal], marks={"0 goal": 0.3, "1 arrive": 0.4})
    found = PROMISES["arrives_in_the_end"].judge(Run(case, trial))
    assert (found.seen if found else "") == said


@pytest.mark.parametrize(("next_", "said"), [(5.0, "the goal was aborted at 2.00 s"), (1.9, "")])
def test_a_goal_may_make_room_for_another_one(next_: float, said: str):
    """Found by a hunt in the reference, which ends a goal when the next one comes."""
    goals = [
        Goal(t, 1.0, 0.0, 0.1, True, status, False, 0.0, 0.0, end)
        for t, status, end in ((0.3, "aborted", 2.0), (next_, "succeeded", 9.0))
    ]
    found = PROMISES["does_not_give_up"].judge(Run(Case(NODE, ()), driven(0.0, goals=goals)))
    assert (found.seen if found else "") == said


@pytest.mark.parametrize(
    ("promise", "accepted", "said"),
    [
        ("arrives_where_it_says", False, "the goal at 0.10 s was rejected"),
        ("feedback_is_true", True, "no feedback for 0.9 s from 0.10 s on"),
    ],
)
@pytest.mark.parametrize("first_ends", [0.05, math.nan])
def test_what_becomes_of_a_goal_that_comes_while_another_runs_is_left_open(
    promise: str, accepted: bool, said: str, first_ends: float
):
    """Found by a hunt in the variant `events`, which then forgets both; goals are served one after another."""
    goals = [
        Goal(0.0, 1.0, 0.0, 0.1, True, "aborted", False, 0.0, 0.0, first_ends),
        Goal(0.1, 1.0, 0.0, 0.1, accepted, "unfinished", None, 0.0, 0.0, math.nan),
    ]
    found = PROMISES[promise].judge(Run(Case(NODE, ()), driven(0.0, goals=goals)))
    assert said in found.seen if first_ends == 0.05 else found is None


@pytest.mark.parametrize("promise", ["fuses_whatever_is_read", "publishes_in_time"])
def test_how_often_data_come_is_not_judged_of_a_node_that_goes_by_the_wall_clock(promise: str):
    """Found by a hunt in the variant `wall_time`: until its pace is seen, the simulated clock runs ahead of it."""
    name = {"fuses_whatever_is_read": "publishes_nothing_when_nothing_is_near"}.get(promise, "fuses_at_half_the_rate")
    trials = [t for n, t in recordings.load(name).trials.items() if n in ("fusion", "nothing_to_fuse")]
    by_pace = [
        [PROMISES[promise].judge(as_run(replace(trial, pace=pace))) is not None for trial in trials]
        for pace in ("lockstep", "real time")
    ]
    assert (any(by_pace[0]), any(by_pace[1])) == (True, False)
