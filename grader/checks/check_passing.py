"""F5: an obstacle that goes away, and one that is not in the way."""

from grader.checks import motion
from grader.checks.judge import Judge, NotReached


def test_drives_on_when_the_obstacle_goes_away(judge: Judge) -> None:
    """When the obstacle goes away the robot drives on at the set speed."""
    trial = judge.trial("obstacle_vanishes")
    judge.call(trial, "set_speed", 0)
    marks, wanted = trial.marks, trial.choices["speed"]
    if motion.odometry_speed(trial.samples, marks["blocked"] - 0.5, marks["blocked"]) < 0.05:
        raise NotReached("the robot did not drive before the obstacle came (F2)")
    stood = motion.odometry_speed(trial.samples, marks["blocked"] + 1.0, marks["free"])
    if abs(stood) > 0.05:
        raise NotReached(f"the robot did not stop for the obstacle: {stood:.2f} m/s before it (F4)")
    speed = motion.odometry_speed(trial.samples, marks["cruise"], marks["cruise_end"])
    before = motion.odometry_speed(trial.samples, marks["blocked"] - 0.5, marks["blocked"])
    seen = (
        f"{before:.3f} m/s before the obstacle came, {speed:.3f} m/s from 1 s after it was gone, set_speed {wanted:g}"
    )
    # Whether it drove at the set speed before is F2's matter.
    holds = abs(speed - before) <= 0.05 * max(abs(before), 0.1)
    judge.expect(holds, seen, "who clears the obstacle flag, and who keeps the set speed?")
    again = motion.odometry_speed(trial.samples, marks["again"], marks["again_end"])
    if abs(again - before) > 0.05 * max(abs(before), 0.1):
        seen = (
            f"{before:.3f} m/s before an obstacle came, {again:.3f} m/s from 1 s after one was gone for which the "
            f"robot had slowed down and stopped, set_speed {wanted:g}"
        )
        judge.share(0.5, seen, "keep the set speed apart from the speed that is commanded for now")


def test_drives_forward_with_an_obstacle_behind(judge: Judge) -> None:
    """An obstacle behind the robot does not stop it from driving forward."""
    trial = judge.trial("obstacle_behind")
    judge.call(trial, "set_speed", 0)
    way = abs(motion.odometry_speed(trial.samples, trial.marks["start"], trial.marks["end"])) * 2.0
    seen = f"drove {way:.2f} m in 2 s at set_speed 0.25 with something {trial.choices['distance']:g} m behind"
    judge.expect(way >= 0.3, seen, "use the beams within 60 degrees of the direction of travel only")
