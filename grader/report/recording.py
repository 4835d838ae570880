"""A trial as the simulator's recording, of which pictures are drawn, and as a replay for replay.js."""

from __future__ import annotations

import bisect
import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from grader.evidence import Sample, Trial
from grader.words import say
from sim.geometry import Pose
from sim.inventory import Presence
from sim.obstacles import CirclePart, Obstacle, PolygonPart, SegmentPart
from sim.recording import THRESHOLDS_NOTE, Recording
from sim.robot import COURSE
from sim.scene import Scene
from sim.simulator import Contact
from sim.world import World, WorldError

TOUCHES = 20  # a robot that scrapes along a wall touches it at every tick
_FAR_M = 30.0  # a goal farther away is meant to be refused; drawn, it would shrink the path to a dot
_EXACT_M = 0.002  # two distances between the same things differ less

BEFORE_S, AFTER_S = 5.0, 3.0
FRAMES = 400  # 20 s of a trial without a moment of failure; longer ones are thinned out
_MARGIN_M = 0.9  # around the path driven, so that obstacles near it are visible
_SPEED_LIMIT = 99.0  # m/s, for showing a command


def recording(trial: Trial) -> Recording:
    """Return the trial as the simulator's recording; the goals of its world are those that the node was sent to.

    There are no scans in it, for the evidence has none, only their closest readings: `closest` is that ahead. What was
    not commanded or read yet is NaN.
    """
    columns = {
        name: np.array([getattr(sample, name) for sample in trial.samples], dtype=np.float64)
        for name in ("t", "x", "y", "yaw", "v", "omega", "odom_x", "odom_y", "odom_yaw", "clearance")
    }
    times, said = columns["t"].tolist(), [command.t for command in trial.commands]
    columns["cmd_v"] = _held(said, [command.v for command in trial.commands], times)
    columns["cmd_omega"] = _held(said, [command.omega for command in trial.commands], times)
    columns["closest"] = _held([scan.t for scan in trial.scans], [scan.ahead for scan in trial.scans], times)
    try:
        world = World.from_dict(trial.scene) if trial.scene else World()
    except WorldError:
        world = World()
    near = tuple(Pose(goal.x, goal.y) for goal in trial.goals if math.hypot(goal.x, goal.y) < _FAR_M)  # false for NaN
    beams = COURSE.lidar.beams
    return Recording(
        world=World(world.name, world.obstacles, world.start, near),
        profile=COURSE.name,
        radius=COURSE.radius,
        seed=0,  # the seed is the instructor's
        samples=columns,
        scan_t=np.zeros(0),
        scan_index=np.zeros(0, dtype=np.int64),
        scan_ranges=np.zeros((0, beams.count)),
        scan_angles=beams.angles,
        lidar=COURSE.lidar.pose,
        odom_origin=Pose(),
        contacts=tuple(
            Contact(touch.t, touch.obstacle, _place(trial.samples, touch.t), touch.speed)
            for touch in trial.touches[:TOUCHES]
            if trial.samples
        ),
        presences=tuple(Presence(each, *_times(each, trial.samples)) for each in world.obstacles),
        notes={THRESHOLDS_NOTE: dict(trial.thresholds)},
    )


def _place(samples: Sequence[Sample], t: float) -> tuple[float, float]:
    """Return where the robot was at the sample that is nearest to a time: the evidence has no place of a contact."""
    at = min(samples, key=lambda sample: abs(sample.t - t))
    return at.x, at.y


def _times(obstacle: Obstacle, samples: Sequence[Sample]) -> tuple[float, float]:
    """Return from when to when an obstacle may have been there.

    The evidence says when one was taken away, not when it was put down: that was after the last moment at which the
    robot had more room around it than the obstacle would leave.
    """
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


def _held(times: Sequence[float], values: Sequence[float], at: Sequence[float]) -> np.ndarray:
    """Return at each time the last value that is not after it, NaN where there is none."""
    found = (bisect.bisect_right(times, t + 1e-9) for t in at)
    return np.array([values[index - 1] if index else math.nan for index in found], dtype=np.float64)


# -- the seconds around a failure: numbers and shapes, so that nothing that a submission wrote can be in them ----------
def moment(trial: Trial, seen: str) -> float | None:
    """Return when a check failed: the first time that it names, else the first contact, else None. Simulated s."""
    end = trial.samples[-1].t if trial.samples else 0.0
    # Language by language: "at 7.3 s", "bei 7,3 s".
    moments = re.escape(say("at {t} s")).replace(r"\{t\}", r"(\d+(?:[.,]\d+)?)")
    named = (float(number.replace(",", ".")) for number in re.findall(rf"\b{moments}\b", seen))
    return next((t for t in [*named, *(touch.t for touch in trial.touches)] if 0 <= t <= end), None)


def replay(trial: Trial, seen: str) -> str:
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
