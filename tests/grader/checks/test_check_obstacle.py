"""F4: each of two poles, one on each side, has to stop the robot."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find, with_trials

from grader.evidence import Kind, Reason, Trial

REFERENCE = recordings.load("reference")
NAME = "pole_aside"
SEEN = REFERENCE.trials[NAME]
END = SEEN.samples[-1].t


def with_two_poles(stops_for: tuple[int, ...]) -> Trial:
    """Return the trial twice over, for a pole at either side; the robot stops for the first (1) and the second (2)."""
    samples, commands, scans = [], [], []
    for number, later in ((1, 0.0), (2, END + 0.1)):
        stops = number in stops_for
        samples += [replace(s, t=s.t + later, x=s.x if stops else 0.25 * s.t) for s in SEEN.samples]
        commands += [replace(c, t=c.t + later, v=c.v if stops else 0.25) for c in SEEN.commands]
        scans += [replace(s, t=s.t + later) for s in SEEN.scans]
    marks = SEEN.marks | {"free": END, "other side": END + 0.1}
    return replace(SEEN, samples=samples, commands=commands, scans=scans, marks=marks)


def judged(check: str, trial: Trial) -> Judged:
    return ask(find(f"check_obstacle::{check}"), with_trials(REFERENCE, trial))


@pytest.mark.parametrize("check", ["test_never_touches_the_obstacle", "test_stops_within_three_tenths_of_a_second"])
def test_a_robot_that_watches_one_side_fails_whichever_side_comes_first(check: str):
    """A node that was blind on one side kept all of F4 with every second seed."""
    assert judged(check, with_two_poles((1, 2))).share == 1.0
    for stops_for in ((1,), (2,)):
        said = judged(check, with_two_poles(stops_for))
        assert said.share == 0.0
        assert "degrees to one side" in said.seen


def until(t: float, trial: Trial) -> Trial:
    """Return a trial of which nothing was seen after a time."""
    scans = [scan for scan in trial.scans if scan.t <= t]
    commands = [command for command in trial.commands if command.t <= t]
    marks = {name: mark for name, mark in trial.marks.items() if mark <= t}
    return replace(trial, scans=scans, commands=commands, marks=marks)


def test_a_robot_that_never_turned_is_judged_by_how_it_drives():
    """Without an action, or with a node that dies of a goal, which F8 judges: one mistake is charged once."""
    check, whole = "test_commands_zero_in_an_emergency", REFERENCE.trials["emergency"]
    driven = until(whole.marks["beside, gone"], whole)
    for ended in (None, Reason(Kind.DIED, exit_code=1, seconds=2.5)):
        said = judged(check, replace(driven, ended=ended))
        assert (said.share, said.seen) == (1.0, "it turned towards no goal, so only driving was looked at")
    drove_on = [replace(c, v=0.06) if c.t > 1.0 else c for c in driven.commands]
    said = judged(check, replace(driven, commands=drove_on))
    assert (said.share, said.seen.partition(", ")[2]) == (0.0, "with something beside the robot")
    stood = [replace(c, v=0.0) for c in driven.commands]
    assert not judged(check, replace(driven, commands=stood)).reached, "it never moved"
