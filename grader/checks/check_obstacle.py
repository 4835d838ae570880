"""F4: what the controller does about an obstacle ahead."""

import math

from grader.checks import motion
from grader.checks.judge import Judge, NotReached
from grader.evidence import Trial

_TRIALS = ("wall_fast", "wall_slow", "wall_backward", "pole_aside", "creeping")
_SUDDEN = "obstacle_vanishes"
_SLACK_S = 0.05  # one tick of the trial: a command is known to be sent no better than that


def test_never_touches_the_obstacle(judge: Judge) -> None:
    """Driven at an obstacle at any allowed speed, the robot stops and never touches it."""
    for trial in _driven(judge):
        if trial.touches:
            touch = trial.touches[0]
            seen = f"touched the {touch.obstacle} at {touch.t:.2f} s, moving at {touch.speed:.2f} m/s"
            judge.expect(False, seen, "which readings look ahead, and what does the callback do when one is near?")
        last = trial.samples[-1]
        seen = f"still on its way {motion.closest_ahead(trial):.2f} m before the obstacle when the trial ended"
        # How long it takes to get there is F2's matter.
        still = motion.first_near(trial) > last.t - 1.5 or motion.stays_still(trial.samples, last.t - 1.0)
        judge.expect(still, seen + _where(trial), "publish zero for as long as there is an obstacle")


def test_stops_within_three_tenths_of_a_second(judge: Judge) -> None:
    """`cmd_vel` is zero within 0.3 s of the first scan whose closest valid reading is below the threshold."""
    for trial in [*_driven(judge), judge.trial(_SUDDEN)]:
        near = motion.first_near(trial)
        if math.isinf(near):
            continue  # it stopped earlier than it had to
        zero = next((c.t for c in trial.commands if c.t >= near - 1e-9 and motion.is_zero(c)), math.inf)
        delay = zero - near
        zero_came = f"a zero came {delay:.2f} s after" if math.isfinite(delay) else "no zero came after"
        seen = f"{zero_came} the first scan below {motion.THRESHOLD_M} m (at {near:.2f} s){_where(trial)}"
        judge.expect(delay <= 0.3 + _SLACK_S, seen, "stop in the cycle that sees the scan: no averaging, no waiting")


def _where(trial: Trial) -> str:
    degrees = trial.choices.get("degrees")
    return f"; it stood {degrees:.0f} degrees to one side, and 60 count as ahead" if degrees is not None else ""


def _driven(judge: Judge) -> list[Trial]:
    """Return the trials in which the robot did come near: a robot that never drove has avoided nothing."""
    trials = []
    for name in _TRIALS:
        trial = judge.trial(name)
        if (judge.call(trial, "set_speed", 0).response or {}).get("success") is False and name == "wall_fast":
            continue  # it refuses the limit itself, which is F2's matter
        nearest = motion.closest_ahead(trial)
        if nearest <= 1.0 or trial.touches:
            trials.append(trial)
        elif trial.choices["speed"] > 0:
            raise NotReached(f"the robot never came near the obstacle: {nearest:.2f} m at best (F2)")
    return trials
