"""The seconds of a trial around a failure, as numbers and shapes that replay.js draws and plays.

Nothing in it is text, so nothing that a submission wrote can be in it.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from grader.evidence import Trial
from grader.report.recording import recording
from grader.words import say
from sim.obstacles import CirclePart, Obstacle, PolygonPart, SegmentPart

BEFORE_S, AFTER_S = 5.0, 3.0
FRAMES = 400  # 20 s of a trial without a moment of failure; longer ones are thinned out
_MARGIN_M = 0.9  # around the path driven, so that obstacles near it are visible
_SPEED_LIMIT = 99.0  # m/s, for showing a command


def moment(trial: Trial, seen: str) -> float | None:
    """Return when a check failed: the first time that it names, else the first contact, else None. Simulated s."""
    end = trial.samples[-1].t if trial.samples else 0.0
    # Language by language: "at 7.3 s", "bei 7,3 s".
    moments = re.escape(say("at {t} s")).replace(r"\{t\}", r"(\d+(?:[.,]\d+)?)")
    named = (float(number.replace(",", ".")) for number in re.findall(rf"\b{moments}\b", seen))
    return next((t for t in [*named, *(touch.t for touch in trial.touches)] if 0 <= t <= end), None)


def data(trial: Trial, seen: str) -> str:
    """Return the trial around the moment at which a check has `seen` its failure, as JSON; all of it without one."""
    run, at = recording(trial), moment(trial, seen)
    begin, end = (-math.inf, math.inf) if at is None else (at - BEFORE_S, at + AFTER_S)
    within = np.flatnonzero((begin <= run.t) & (run.t <= end))
    keep = within[:: max(1, math.ceil(within.size / FRAMES))]
    x, y = run.x[keep].tolist(), run.y[keep].tolist()
    goals = [goal for goal in trial.goals if any((goal.x, goal.y) == (each.x, each.y) for each in run.world.goals)]
    left, low = (min(values) - _MARGIN_M for values in (x + [g.x for g in goals], y + [g.y for g in goals]))
    right, high = (max(values) + _MARGIN_M for values in (x + [g.x for g in goals], y + [g.y for g in goals]))
    parts = [(each, shape) for each in run.presences for shape in _shapes(each.obstacle)]
    made: dict[str, Any] = {
        "box": _rounded([left, low, right - left, high - low]),
        "radius": run.radius,
        "at": at,
        "t": _rounded(run.t[keep], 2),
        "x": _rounded(x),
        "y": _rounded(y),
        "yaw": _rounded(run.yaw[keep]),
        "v": _rounded(run.v[keep], 2),
        "command": _rounded(np.clip(run.cmd_v[keep], -_SPEED_LIMIT, _SPEED_LIMIT), 2),
        "ahead": _rounded(run.closest[keep], 2),
        "goals": [[*_rounded([g.x, g.y]), *(each or 0 for each in _rounded([g.tolerance]))] for g in goals],
        "touches": [[*_rounded([each.time], 2), *_rounded(each.point)] for each in run.contacts],
        "shapes": [shape for _, shape in parts],
        "since": _rounded((each.since for each, _ in parts), 2),
        "until": _rounded((each.until for each, _ in parts), 2),
    }
    return json.dumps(made, separators=(",", ":"), allow_nan=False)


def _shapes(obstacle: Obstacle) -> Iterator[list[float | None]]:
    """Yield an obstacle's parts: [x, y, radius] for a circle, the corners' coordinates for a line or a polygon."""
    place = obstacle.pose.point_to_parent
    for part in obstacle.parts():
        match part:
            case CirclePart():
                yield _rounded([*place(part.center), part.radius])
            case SegmentPart():
                yield _rounded([*place(part.start), *place(part.end)])
            case PolygonPart():
                yield _rounded(value for corner in part.corners for value in place(corner))


def _rounded(values: Iterable[float], digits: int = 3) -> list[float | None]:
    return [round(float(value), digits) if math.isfinite(value) else None for value in values]
