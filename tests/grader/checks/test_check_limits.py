"""F11: how fast speeds may rise."""

from __future__ import annotations

import pytest
from helpers.judging import trial

from grader.courses.robot_controller.checks import check_limits as checks
from grader.evidence import Command, ParameterAnswer, Trial

TICK = 0.05
LIMIT = lambda _start, _end: 1.0  # noqa: E731 - m/s², at all times


def ramp(acceleration: float, top: float, seconds: float = 2.0) -> list[Command]:
    """Return commands at each tick of a speed that rises from zero."""
    ticks = range(round(seconds / TICK))
    return [Command(n * TICK, min(top, acceleration * n * TICK), 0.0, 0.0) for n in ticks]


@pytest.mark.parametrize("top", [0.5, -0.5])
def test_a_gentle_rise_is_allowed_in_both_directions(top: float):
    commands = [Command(c.t, c.v if top > 0 else -c.v, 0.0, 0.0) for c in ramp(1.0, 0.5)]
    assert checks.steepest(commands, "v", LIMIT, TICK) is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_is_found_in_both_directions(sign: float):
    commands = [Command(n * TICK, sign * (0.375 if n > 10 else 0.0), 0.0, 0.0) for n in range(40)]
    assert checks.steepest(commands, "v", LIMIT, TICK) is not None


def test_a_jump_among_ten_thousand_commands_at_a_time_is_found(monkeypatch: pytest.MonkeyPatch):
    """Every command was compared with every other: a flood of them in two bursts took the checks ten minutes."""
    compared = 0
    base = checks._base

    def counted(*pair: object) -> float:
        nonlocal compared
        compared += 1
        return base(*pair)  # type: ignore[arg-type]

    monkeypatch.setattr(checks, "_base", counted)
    clumps = [Command(t, v, 0.0, 0.0) for t, v in ((0.0, 0.0), (0.3, 0.2), (0.6, 0.2)) for _ in range(10_000)]
    assert checks.steepest(clumps, "v", LIMIT, TICK) is None
    assert checks.steepest([*clumps, Command(0.6, 0.9, 0.0, 0.0)], "v", LIMIT, TICK) is not None
    assert compared < 100


# Two starts of one node with an events executor, which commands -0.1, -0.2, -0.3 at 0.4, 0.5 and 0.6 s, and one jump.
LATE = [(0.0, 0.0), (0.15, 0.0), (0.3, 0.0), (0.35, -0.1), (0.35, -0.2), (0.4, -0.3), (0.6, -0.375)]
LATER = [(0.0, 0.0), (0.2, 0.0), (0.3, 0.1), (0.4, 0.3), (0.5, 0.4), (0.6, 0.5)]


@pytest.mark.parametrize(
    ("speeds", "within"),
    [(LATE, True), (LATER, True), ([(t + 0.1 * (t > 0), v) for t, v in ((0.0, 0.0), (0.1, 0.0), (0.2, 0.5))], False)],
)
def test_a_node_whose_commands_are_out_of_step_may_be_as_much_later(speeds: list[tuple[float, float]], within: bool):
    commands = [Command(t, v, 0.0, 0.0) for t, v in speeds]
    assert (checks.beyond(trial("wall_backward", commands=commands)) is None) is within


def changed(accepted: bool, *speeds: tuple[float, float]) -> Trial:
    """Return a trial whose node was told at 1 s that 0.25 m/s is the limit, and its commands."""
    answer = ParameterAnswer(1.0, "max_linear_speed", 0.25, accepted, 0.25 if accepted else 0.5)
    return trial("changed_limits", parameters=[answer], commands=[Command(t, v, 0.0, 0.0) for t, v in speeds])


@pytest.mark.parametrize(
    ("accepted", "t", "v", "within"),
    [
        (True, 0.9, 0.5, True),
        (True, 1.1, 0.5, True),  # the cycle that had begun
        (True, 1.5, 0.5, False),
        (True, 1.5, -0.3, False),
        (True, 1.5, -0.25, True),
        (False, 1.5, 0.5, True),  # I6 judges whether a node may refuse
    ],
)
def test_a_limit_that_was_lowered_holds_from_the_next_cycle_on(accepted: bool, t: float, v: float, within: bool):
    assert (checks.beyond(changed(accepted, (t, v))) is None) is within
