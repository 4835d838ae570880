"""Which command a browser's message is. Nothing in it is believed before it was looked at."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sim.live.feed import Message


def command(content: object) -> Message | None:
    """Return the command in a browser's message, None if there is none that makes sense."""
    if not isinstance(content, Mapping):
        return None
    kind = content.get("kind")
    if kind in ("run", "pause", "step", "reset"):
        return {"kind": kind}
    if kind in ("hello", "bye", "alive") and isinstance(content.get("view"), str):
        return {"kind": kind, "view": content["view"], "hidden": content.get("hidden") is True}
    if kind == "rate":
        value = content.get("value")
        rate = math.inf if value is None else _number(value)
        return {"kind": kind, "value": rate} if rate is not None and rate > 0 else None
    if kind in ("goal", "move"):
        x, y = _number(content.get("x")), _number(content.get("y"))
        if x is None or y is None:
            return None
        if kind == "goal":
            return {"kind": kind, "x": x, "y": y}
        if isinstance(content.get("name"), str):
            return {"kind": kind, "name": content["name"], "x": x, "y": y}
    return None


def _number(value: object) -> float | None:
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e4
    return float(value) if fits else None  # type: ignore[arg-type]  # just asked
