"""F11: how fast speeds may rise."""

from __future__ import annotations

import pytest

from grader.checks import check_limits as checks
from grader.evidence import Command

TICK = 0.05


def ramp(acceleration: float, top: float, seconds: float = 2.0) -> list[Command]:
    """Return commands at each tick of a speed that rises from zero."""
    ticks = range(round(seconds / TICK))
    return [Command(n * TICK, min(top, acceleration * n * TICK), 0.0, 0.0) for n in ticks]


@pytest.mark.parametrize("top", [0.5, -0.5])
def test_a_gentle_rise_is_allowed_in_both_directions(top: float):
    commands = [Command(c.t, c.v if top > 0 else -c.v, 0.0, 0.0) for c in ramp(1.0, 0.5)]
    assert checks._steepest(commands, "v", 1.0, TICK) is None


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_is_found_in_both_directions(sign: float):
    commands = [Command(n * TICK, sign * (0.375 if n > 10 else 0.0), 0.0, 0.0) for n in range(40)]
    assert checks._steepest(commands, "v", 1.0, TICK) is not None


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
    assert checks._steepest(clumps, "v", 1.0, TICK) is None
    assert checks._steepest([*clumps, Command(0.6, 0.9, 0.0, 0.0)], "v", 1.0, TICK) is not None
    assert compared < 100
