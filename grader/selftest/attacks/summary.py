"""Show how attacks came out, as a table."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from grader.selftest.attacks.attack_run import Carried

_WIDTH = 78


def row(carried: Carried, names: int) -> str:
    """Return an attack's line and, below it, what it tried and what stopped it."""
    attack = carried.attack
    if attack.no_door:
        verdict, middle = "no such door", ""
    else:
        verdict = "contained" if carried.contained else "NOT CONTAINED"
        middle = (
            "refused"
            if carried.refused
            else f"{_sum(carried.points, attack.needs)} of {_sum(carried.without, attack.needs)}"
        )
    kinds = ", ".join(dict.fromkeys(flag.kind for flag in carried.flags)) or "-"
    head = f"{attack.name:<{names}}  {verdict:<13}  {middle:<14}  flag: {kinds:<20}  {carried.seconds:5.1f} s".rstrip()
    lines = [head, *_wrapped("tried", attack.tries)]
    lines += _wrapped("why", attack.no_door) if attack.no_door else _wrapped("stopped", attack.stopped)
    for fault in carried.faults:
        lines += _wrapped("FAULT", fault)
    return "\n".join(lines)


def summary(carried: Sequence[Carried]) -> str:
    """Return the last line: how many were contained."""
    run = [each for each in carried if not each.attack.no_door]
    bad = [each.attack.name for each in run if not each.contained]
    absent = len(carried) - len(run)
    doors = f"; {absent} found no door here" if absent else ""
    if bad:
        return f"{len(bad)} of {len(run)} attacks were NOT contained: {', '.join(bad)}{doors}."
    return f"All {len(run)} attacks were contained{doors}."


def _sum(points: dict[str, float], needs: Iterable[str]) -> str:
    return f"{sum(points.get(name, 0.0) for name in needs):.4g}"


def _wrapped(word: str, text: str) -> list[str]:
    first, *more = textwrap.wrap(text, _WIDTH) or [""]
    return [f"    {word:<9} {first}", *(f"{'':14}{line}" for line in more)]
