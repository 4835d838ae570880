"""F11: the limits of speed and acceleration, in every trial that drives."""

import itertools
from collections.abc import Callable
from functools import partial

from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import Command, Trial
from grader.words import mark, say

from . import motion

_LIMITS = motion.DEFAULTS
MAXIMA = ("max_linear_speed", "max_angular_speed")
ACCELERATIONS = (("v", "m/s", "linear_acceleration"), ("omega", "rad/s", "angular_acceleration"))
_TRIALS = (*motion.ROUTES, "drive_forward", "wall_fast", "wall_backward", "obstacle_vanishes", "blocked_goal")
_WINDOW_S = (0.2, 1.0)  # over which a rise is measured: one late command must not look like a jump
_CYCLE_S = 0.1  # between two commands, by the contract
_CYCLES_S = 2 * _CYCLE_S  # of control: until then a command may follow a limit that has just been changed
# How late a command may be: a tick, or in real time and on a busy machine several.
LATE_S = {"lockstep": 0.05, "real time": 0.3}


def test_limits_hold_throughout(judge: Judge) -> None:
    """abs(v) and abs(w) stay within their maxima, and commanded speeds rise no faster than the accelerations + 10 %."""
    for name in _TRIALS:
        trial = judge.trial(name)
        if not any(not command.is_zero for command in trial.commands):
            if name in ("wall_backward", "wall_fast"):
                continue  # it may drive only forwards, or only below the limit; F2 judges that
            raise NotReached(say("the robot never moved in the trial {name}", name=name), "F2", "F8")
        if excess := beyond(trial):
            raise Failed(*excess)
    changed = judge.trial("changed_limits", complete=False)
    if excess := beyond(changed):
        seen = say("after a change of the parameters: {seen}", seen=excess[0])
        judge.share(0.5, seen, say("{advice}; read the parameters in each cycle", advice=excess[1]))


def values_of(trial: Trial, name: str, start: float, end: float) -> list[float]:
    """Return the values that a parameter had in [start, end]: its default, or what the node accepted since."""
    changes = [(p.t, float(p.wanted)) for p in trial.parameters if p.name == name and p.accepted is True]
    before = [_LIMITS[name], *(value for t, value in changes if t <= start)]
    return [before[-1], *(value for t, value in changes if start < t <= end)]


def steepest(
    commands: list[Command], letter: str, limit: Callable[[float, float], float], late: float
) -> tuple[Command, Command] | None:
    """Return two commands between which a speed rose faster than the limit + 10 %, None if there are none.

    Each of the two may be up to `late` seconds late. `limit` takes their times.
    """
    commands = _extremes(commands, letter)
    for i, a in enumerate(commands):
        for b in commands[i + 1 :]:
            dt = b.t - a.t
            if dt > _WINDOW_S[1]:
                break
            if dt < _WINDOW_S[0] - 1e-9:
                continue
            if abs(getattr(b, letter)) - _base(a, b, letter) > limit(a.t, b.t) * (1.1 * dt + late) + 1e-6:
                return a, b
    return None


def beyond(trial: Trial) -> tuple[str, str] | None:
    """Return (seen, try) of the first command beyond a limit, None if all are within."""
    late = LATE_S[trial.pace] + _out_of_step(trial.commands)
    for command in trial.commands:
        # A command may still be that of the cycle before a change.
        v, omega = (max(values_of(trial, n, command.t - _CYCLES_S - late, command.t)) for n in MAXIMA)
        if not (abs(command.v) <= v + 1e-3 and abs(command.omega) <= omega + 1e-3):
            words = mark("v = {c.v:.3f} m/s, omega = {c.omega:.3f} rad/s at {c.t:.2f} s; the limits: {v:g}, {omega:g}")
            try_ = say("clamp both to max_linear_speed and max_angular_speed")
            return say(words, c=command, v=v, omega=omega), try_
    for letter, unit, name in ACCELERATIONS:
        jump = steepest(trial.commands, letter, partial(_limit_of_rise, trial, name), late)
        if jump is not None:
            a, b = jump
            rise, limit = abs(getattr(b, letter)) - _base(a, b, letter), _limit_of_rise(trial, name, a.t, b.t)
            words = mark("{v} rose by {rise:.2f} {unit} from {a.t:.2f} to {b.t:.2f} s; the limit is {limit:g} {unit}²")
            seen = say(words, v=letter, rise=rise, unit=unit, a=a, b=b, limit=limit)
            return seen, say("approach the wanted speed by at most acceleration * dt in each cycle")
    return None


def _out_of_step(commands: list[Command]) -> float:
    """Return by how much the longest pause between two commands is longer than a cycle, at most by one.

    So much later may be a command of a node whose executor serves timers and messages by events of their own.
    """
    pauses = [b.t - a.t for a, b in itertools.pairwise(commands)]
    return min(max([0.0, *(pause - _CYCLE_S for pause in pauses)]), _CYCLE_S)


def _limit_of_rise(trial: Trial, name: str, start: float, end: float) -> float:
    return max(values_of(trial, name, start - _CYCLES_S, end))


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
