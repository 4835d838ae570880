"""F11: the limits of speed and acceleration, in every trial that drives."""

import itertools

from grader.checks import motion
from grader.checks.judge import Failed, Judge, NotReached
from grader.contract.spec import PARAMETERS
from grader.evidence import Command

_LIMITS = PARAMETERS["robot_controller"]
_TRIALS = (*motion.ROUTES, "drive_forward", "wall_fast", "wall_backward", "obstacle_vanishes", "blocked_goal")
_WINDOW_S = (0.2, 1.0)  # over which a rise is measured: one late command must not look like a jump
# How late a command may be: a tick, or in real time and on a busy machine several.
_LATE_S = {"lockstep": 0.05, "real time": 0.3}


def test_limits_hold_throughout(judge: Judge) -> None:
    """abs(v) and abs(w) stay within their maxima, and commanded speeds rise no faster than the accelerations + 10 %."""
    for name in _TRIALS:
        trial = judge.trial(name)
        if not any(not motion.is_zero(command) for command in trial.commands):
            if name in ("wall_backward", "wall_fast"):
                continue  # it may drive only forwards, or only below the limit; F2 judges that
            raise NotReached(f"the robot never moved in the trial {name} (F2, F8)")
        for command in trial.commands:
            seen = f"v = {command.v:.3f} m/s, omega = {command.omega:.3f} rad/s at {command.t:.2f} s"
            judge.expect(_is_within(command), seen, "clamp both to max_linear_speed and max_angular_speed")
        for letter, unit, limit in (
            ("v", "m/s", _LIMITS["linear_acceleration"]), ("omega", "rad/s", _LIMITS["angular_acceleration"]),
        ):  # fmt: skip
            jump = _steepest(trial.commands, letter, limit, _LATE_S[trial.pace])
            if jump is not None:
                a, b = jump
                rise = abs(getattr(b, letter)) - _base(a, b, letter)
                times = f"from {a.t:.2f} to {b.t:.2f} s"
                seen = f"{letter} rose by {rise:.2f} {unit} {times}; the limit is {limit:g} {unit}²"
                raise Failed(seen, "approach the wanted speed by at most acceleration * dt in each cycle")


def _is_within(command: Command) -> bool:
    v, omega = _LIMITS["max_linear_speed"], _LIMITS["max_angular_speed"]
    return abs(command.v) <= v + 1e-3 and abs(command.omega) <= omega + 1e-3


def _steepest(commands: list[Command], letter: str, limit: float, late: float) -> tuple[Command, Command] | None:
    """Return two commands between which a speed rose faster than `limit` + 10 %, None if there are none.

    Each of the two may be up to `late` seconds late.
    """
    commands = _extremes(commands, letter)
    for i, a in enumerate(commands):
        for b in commands[i + 1 :]:
            dt = b.t - a.t
            if dt > _WINDOW_S[1]:
                break
            if dt < _WINDOW_S[0] - 1e-9:
                continue
            if abs(getattr(b, letter)) - _base(a, b, letter) > limit * (1.1 * dt + late) + 1e-6:
                return a, b
    return None


def _extremes(commands: list[Command], letter: str) -> list[Command]:
    """Return the slowest and the fastest of the commands of each moment: a thousand of them show no more."""
    kept = []
    for _, together in itertools.groupby(commands, key=lambda command: command.t):
        ordered = sorted(together, key=lambda command: abs(getattr(command, letter)))
        kept += [ordered[0], ordered[-1]][: len(ordered)]
    return kept


def _base(a: Command, b: Command, letter: str) -> float:
    """Return the speed from which the rise to b counts: that of a, or 0 if the direction changed in between."""
    first, second = getattr(a, letter), getattr(b, letter)
    return abs(first) if first * second > 0 else 0.0
