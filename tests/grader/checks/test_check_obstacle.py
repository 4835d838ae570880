"""F4: each of two poles, one on each side, has to stop the robot."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find

from grader.evidence import Trial

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
    return ask(find(f"check_obstacle::{check}"), replace(REFERENCE, trials=REFERENCE.trials | {NAME: trial}))


@pytest.mark.parametrize("check", ["test_never_touches_the_obstacle", "test_stops_within_three_tenths_of_a_second"])
def test_a_robot_that_watches_one_side_fails_whichever_side_comes_first(check: str):
    """A node that was blind on one side kept all of F4 with every second seed."""
    assert judged(check, with_two_poles((1, 2))).share == 1.0
    for stops_for in ((1,), (2,)):
        said = judged(check, with_two_poles(stops_for))
        assert said.share == 0.0
        assert "degrees to one side" in said.seen
