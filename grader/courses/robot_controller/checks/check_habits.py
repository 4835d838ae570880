"""Q4: numbers that are parameters, and which of them the robot does not go by."""

from __future__ import annotations

import itertools

from grader.checks.check_habits import expect_parameters
from grader.checks.judge import Judge
from grader.evidence import Trial
from grader.words import mark, say

from . import motion
from .check_limits import LATE_S, steepest


def test_contract_numbers_are_parameters(judge: Judge) -> None:
    """The numbers that the contract names as parameters are declared as parameters and read from them."""
    trial = judge.evidence.trials.get("other_settings")  # which the package's text alone is judged without
    tried = trial is not None and trial.ready and not trial.script_error
    found = without_effect(trial).items() if trial is not None and tried else ()
    expect_parameters(judge, [(name, f"robot_controller: {seen}") for name, seen in found])


_DEFAULTS = motion.DEFAULTS


def without_effect(trial: Trial) -> dict[str, str]:
    """Return by name the parameters whose other value changed nothing, with what was seen.

    A number in the code shows in that the robot does what the default asks for; a robot that does neither is judged by
    other requirements. A trial that did not come so far shows nothing.
    """
    seen = {
        "laser_processing_rate": _rate(trial),
        "linear_acceleration": _rise(trial, "v", "linear_acceleration"),
        # An action loop that sleeps by wall time keeps the acceleration of its turns only by that.
        "angular_acceleration": _rise(trial, "omega", "angular_acceleration") if trial.pace == "lockstep" else "",
        "max_angular_speed": _turning(trial),
        "emergency_stop_distance": _emergency(trial),
        "safety_margin": _margin(trial),
    }
    words = mark("with {name} = {value:g}, {seen}")
    return {name: say(words, name=name, value=trial.choices[name], seen=shown) for name, shown in seen.items() if shown}


def _rate(trial: Trial) -> str:
    if "start" not in trial.marks:
        return ""
    hertz = motion.rate(trial.commands, trial.marks["idle"], trial.marks["start"])
    usual = _DEFAULTS["laser_processing_rate"]
    return say("cmd_vel still came at {hertz:.1f} Hz", hertz=hertz) if abs(hertz - usual) <= 0.2 * usual else ""


def _rise(trial: Trial, letter: str, name: str) -> str:
    late, limit, usual = LATE_S[trial.pace], trial.choices[name], _DEFAULTS[name]
    jump = steepest(trial.commands, letter, lambda _a, _b: limit, late)
    # One step shows a jump, which over a longer time the limit of the speed itself may hide.
    steps = itertools.pairwise(abs(getattr(command, letter)) for command in trial.commands)
    period = 1.0 / max(trial.choices["laser_processing_rate"], 1.0)
    jumps = any(b - a > usual * (1.1 * period + late) for a, b in steps)
    if jump is None or jumps or steepest(trial.commands, letter, lambda _a, _b: usual, late) is not None:
        return ""
    words = mark("{letter} still rose as fast as with {usual:g}, at {t:.2f} s")
    return say(words, letter=letter, usual=usual, t=jump[0].t)


def _turning(trial: Trial) -> str:
    fastest, name = max((abs(command.omega) for command in trial.commands), default=0.0), "max_angular_speed"
    beyond = trial.choices[name] + 1e-3 < fastest <= _DEFAULTS[name] + 1e-3
    return say("the robot still turned at {fastest:.2f} rad/s", fastest=fastest) if beyond else ""


def _emergency(trial: Trial) -> str:
    if "gone" not in trial.marks or _speed_before(trial, "beside") < 0.1:
        return ""
    commands = motion.between(trial.commands, trial.marks["beside"], trial.marks["gone"])
    stopped = any(command.is_zero for command in commands)
    return "" if stopped else say("the robot drove on with an obstacle 0.3 m away, to one side")


def _margin(trial: Trial) -> str:
    before = _speed_before(trial, "ahead")
    if "slowed" not in trial.marks or before < 0.3:  # how much slower is left open; a slow robot may be slow enough
        return ""
    slowest = min((c.v for c in motion.between(trial.commands, trial.marks["ahead"], trial.marks["slowed"])), default=0)
    if slowest < 0.98 * before:
        return ""
    return say("the robot drove on at {slowest:.2f} m/s with an obstacle 1 m ahead", slowest=slowest)


def _speed_before(trial: Trial, mark: str) -> float:
    """Return the last commanded speed before a mark, in m/s; 0 if there is none."""
    before = [command.v for command in trial.commands if command.t <= trial.marks.get(mark, 0.0)]
    return before[-1] if before else 0.0
