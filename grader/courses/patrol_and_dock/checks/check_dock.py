"""D1 and D2: the robot comes back when the battery is low, and stands in its dock."""

from grader.checks.judge import Judge, NotReached
from grader.evidence import Trial

from .patrol_facts import from_dock, visits

_BACK_M, _DOCK_M, _DOCK_DEG = 0.5, 0.1, 10.0


def test_comes_back(judge: Judge) -> None:
    """When the battery is below `battery_low`, the robot leaves its patrol and comes back to the dock."""
    trial = _sent_back(judge)
    off, _ = from_dock(trial)
    seen = f"the battery was low at {trial.marks['low']:.0f} s, and the robot {off:.2f} m from the dock in the end"
    judge.expect(off <= _BACK_M, seen, "")


def test_stands_at_the_dock(judge: Judge) -> None:
    """The robot stands still within 0.1 m of the dock."""
    trial = _back(judge)
    off, end = from_dock(trial)[0], trial.samples[-1]
    judge.expect(end.v == 0.0 and end.omega == 0.0, f"still moved at {end.t:.0f} s, {off:.2f} m from the dock", "")
    judge.expect(off <= _DOCK_M, f"stood {off:.2f} m from the dock", "")


def test_faces_as_the_dock_does(judge: Judge) -> None:
    """The robot stands within 10 degrees of the dock's heading."""
    turned = from_dock(_back(judge))[1]
    judge.expect(turned <= _DOCK_DEG, f"stood {turned:.0f} degrees off the dock's heading", "")


def _sent_back(judge: Judge) -> Trial:
    trial = judge.trial("low_battery", complete=False)
    if "low" not in trial.marks or len(visits(trial)) < int(trial.choices["visits"]):
        raise NotReached("the robot was not on patrol when the battery ran low", "P1")
    return trial


def _back(judge: Judge) -> Trial:
    trial = _sent_back(judge)
    if not from_dock(trial)[0] <= _BACK_M:
        raise NotReached("the robot did not come back", "D1")
    return trial
