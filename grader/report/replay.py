"""The seconds of a trial around a failure, as numbers and shapes that replay.js draws and plays.

Nothing in it is text, so nothing that a submission wrote can be in it.
"""

from __future__ import annotations

import bisect
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

from grader.evidence import Command, Sample, ScanSummary, Trial
from grader.words import say
from sim.inventory import Presence
from sim.obstacles import CirclePart, Obstacle, PolygonPart, SegmentPart
from sim.robot import COURSE
from sim.scene import Scene
from sim.world import World, WorldError

T = TypeVar("T")

BEFORE_S, AFTER_S = 5.0, 3.0
FRAMES = 400  # 20 s of a trial without a moment of failure; longer ones are thinned out
FAR_M = 30.0  # a goal farther away is meant to be refused; drawn, it would shrink the path to a dot
_MARGIN_M = 0.9  # around the path driven, so that obstacles near it are visible
_EXACT_M = 0.002  # two distances between the same things differ less
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
    at = moment(trial, seen)
    begin, end = (-math.inf, math.inf) if at is None else (at - BEFORE_S, at + AFTER_S)
    within = [sample for sample in trial.samples if begin <= sample.t <= end]
    samples = within[:: max(1, math.ceil(len(within) / FRAMES))]
    command: Callable[[float], Command | None] = _latest(trial.commands, [c.t for c in trial.commands])
    scan: Callable[[float], ScanSummary | None] = _latest(trial.scans, [s.t for s in trial.scans])
    goals = [goal for goal in trial.goals if math.hypot(goal.x, goal.y) < FAR_M]  # false for NaN
    there = presences(trial)
    made = {
        "box": _box([(s.x, s.y) for s in samples] + [(goal.x, goal.y) for goal in goals]),
        "radius": COURSE.radius,
        "at": at,
        "t": [_rounded(s.t, 2) for s in samples],
        "x": [_rounded(s.x) for s in samples],
        "y": [_rounded(s.y) for s in samples],
        "yaw": [_rounded(s.yaw) for s in samples],
        "v": [_rounded(s.v, 2) for s in samples],
        "command": [_speed(command(s.t)) for s in samples],
        "ahead": [_rounded(last.ahead, 2) if (last := scan(s.t)) else None for s in samples],
        "goals": [[_rounded(g.x), _rounded(g.y), _rounded(g.tolerance) or 0] for g in goals],
        "touches": [_touch(t, trial.samples) for t in (touch.t for touch in trial.touches[:20])],
        "shapes": [shape for each in there for shape in _shapes(each.obstacle)],
        "since": [_rounded(each.since, 2) for each in there for _ in each.obstacle.parts()],
        "until": [_rounded(each.until, 2) for each in there for _ in each.obstacle.parts()],
    }
    return json.dumps(made, separators=(",", ":"), allow_nan=False)


def presences(trial: Trial) -> list[Presence]:
    """Return the trial's obstacles with the times at which each may have been there.

    The evidence says when an obstacle was taken away, not when it was put down: that was after the last moment at which
    the robot had more room around it than the obstacle would leave.
    """
    try:
        obstacles = World.from_dict(trial.scene).obstacles if trial.scene else ()
    except WorldError:
        return []
    return [Presence(obstacle, *_times(obstacle, trial.samples)) for obstacle in obstacles]


def _times(obstacle: Obstacle, samples: Sequence[Sample]) -> tuple[float, float]:
    until = float(obstacle.vanishes) if isinstance(obstacle.vanishes, int | float) else math.inf
    if obstacle.motion is not None:
        return 0.0, until
    scene, since, absent = Scene([obstacle]), 0.0, False
    for sample in samples:
        if sample.t >= until:
            break
        nearest = scene.nearest(sample.x, sample.y)
        since = sample.t if absent else since
        absent = nearest is not None and sample.clearance > nearest.distance - COURSE.radius + _EXACT_M
    return since, until


def _latest(values: Sequence[T], times: Sequence[float]) -> Callable[[float], T | None]:
    """Return a function that gives the last value that is not after a time, None if there is none."""

    def at(t: float) -> T | None:
        index = bisect.bisect_right(times, t + 1e-9)
        return values[index - 1] if index else None

    return at


def _speed(command: Command | None) -> float | None:
    return None if command is None else _rounded(max(-_SPEED_LIMIT, min(_SPEED_LIMIT, command.v)), 2)


def _touch(t: float, samples: Sequence[Sample]) -> list[float | None]:
    at = min(samples, key=lambda sample: abs(sample.t - t))
    return [_rounded(t, 2), _rounded(at.x), _rounded(at.y)]


def _shapes(obstacle: Obstacle) -> Iterator[list[float | None]]:
    """Yield an obstacle's parts: [x, y, radius] for a circle, the corners' coordinates for a line or a polygon."""
    place = obstacle.pose.point_to_parent
    for part in obstacle.parts():
        match part:
            case CirclePart():
                yield [*_flat([place(part.center)]), _rounded(part.radius)]
            case SegmentPart():
                yield _flat([place(part.start), place(part.end)])
            case PolygonPart():
                yield _flat(map(place, part.corners))


def _flat(points: Iterable[tuple[float, float]]) -> list[float | None]:
    return [_rounded(value) for point in points for value in point]


def _box(places: Sequence[tuple[float, float]]) -> list[Any]:
    """Return the part of the map to show: left, lower edge, width and height in metres."""
    xs, ys = zip(*places, strict=True)
    left, low = min(xs) - _MARGIN_M, min(ys) - _MARGIN_M
    return [_rounded(value) for value in (left, low, max(xs) + _MARGIN_M - left, max(ys) + _MARGIN_M - low)]


def _rounded(value: float, digits: int = 3) -> float | None:
    return round(value, digits) if math.isfinite(value) else None
