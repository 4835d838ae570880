"""S1 to S3: how the robot drives: without contact, with clearance, without delay."""

from grader.checks.judge import Judge, NotReached

from .patrol_facts import TRIALS, driven, drove, visits

_CLEARANCE_M, _ROUND_S = 0.1, 60.0


def test_touches_nothing(judge: Judge) -> None:
    """The robot never touches anything."""
    for trial in [drove(judge, name) for name in TRIALS]:
        if trial.touches:
            touch = trial.touches[0]
            judge.expect(False, f"touched {touch.obstacle} at {touch.t:.1f} s, at {touch.speed:.2f} m/s", "")


def test_keeps_its_distance(judge: Judge) -> None:
    """The robot's hull keeps a distance of 0.1 m from everything."""
    trials = [drove(judge, name) for name in TRIALS]
    nearest = min((sample for trial in trials for sample in trial.samples), key=lambda sample: sample.clearance)
    judge.figure("clearance", nearest.clearance)
    judge.expect(nearest.clearance >= _CLEARANCE_M, f"{nearest.clearance:.2f} m at {nearest.t:.0f} s", "")


def test_is_quick(judge: Judge) -> None:
    """The first round takes 60 s at most."""
    trial = judge.trial("first_round", complete=False)
    places, times = len(trial.scene["goals"]), visits(trial)
    if len(times) < places:
        raise NotReached("the first round was not finished", "P1")
    end = times[places - 1]
    judge.figure("time", end)
    judge.figure("distance", driven(trial.samples, end))
    judge.expect(end <= _ROUND_S, f"the round took {end:.0f} s", "")
