"""Show one trial: as PNG with the simulator's drawings, and as a replay for replay.js.

A picture is a map with the path driven, and speeds and ranges over time. Import this only where one is drawn:
matplotlib takes half a second.
"""

from __future__ import annotations

import base64
import bisect
import io
import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from grader.evidence import Sample, Trial
from grader.words import localized, mark, say
from sim.geometry import Pose
from sim.inventory import Presence
from sim.obstacles import CirclePart, Obstacle, PolygonPart, SegmentPart
from sim.recording import THRESHOLDS_NOTE, Recording
from sim.robot import COURSE
from sim.scene import Scene
from sim.simulator import Contact
from sim.views import draw_distances, draw_run, draw_speed, draw_turn_rate
from sim.world import World, WorldError

MARGIN_M = 0.9  # around the path driven, so that walls near it are visible
STILL_M = 0.02  # a shorter path counts as standing still
SPEED_LIMIT = 3.0  # m/s, for drawing: a command of 1e300 m/s must not flatten everything else
RANGE_LIMIT = 4.0  # m, for drawing: anything farther away does not matter for stopping
# What the drawings are labelled with, to be said in the language of the course.
_LABELS = (
    mark("path"), mark("odometry"), mark("goal"), mark("contact"), mark("commanded"), mark("driven"),
    mark("closest reading"), mark("clearance of the hull"), mark("distance (m)"), mark("simulated time (s)"),
    mark("promise broken"),
)  # fmt: skip

TOUCHES = 20  # a robot that scrapes along a wall touches it at every tick
_FAR_M = 30.0  # a goal farther away is meant to be refused; drawn, it would shrink the path to a dot
_EXACT_M = 0.002  # two distances between the same things differ less

BEFORE_S, AFTER_S = 5.0, 3.0
FRAMES = 400  # 20 s of a trial without a moment of failure; longer ones are thinned out
SHOWN_LIMIT = 99.0  # m/s, for showing a command


def drawable(trial: Trial) -> bool:
    """Return whether there is something to see in a trial: a robot that moved or was commanded to."""
    commanded = any(command.v != 0 or command.omega != 0 for command in trial.commands)
    return len(trial.samples) > 1 and (commanded or bool(trial.touches) or _way(trial) > STILL_M)


def data_uri(trial: Trial, at: float | None = None) -> str:
    """Return the picture of a trial as a data URI for an HTML image."""
    return "data:image/png;base64," + base64.b64encode(png(trial, at)).decode("ascii")


def describe(trial: Trial) -> str:
    """Return a description of the picture in a sentence or two, for readers who cannot see it."""
    first, last = trial.samples[0], trial.samples[-1]
    way = mark(
        "The robot went from ({first.x:.2f}, {first.y:.2f}) to ({last.x:.2f}, {last.y:.2f}) m in {last.t:.1f} s of "
        "simulated time."
    )
    said = [say(way, first=first, last=last)]
    sent = mark("It was sent to ({goal.x:.2f}, {goal.y:.2f}) m; the goal {status}.")
    said += [say(sent, goal=goal, status=say(goal.status)) for goal in trial.goals[:1]]
    if trial.touches:
        touch = trial.touches[0]
        words = mark("It touched {touch.obstacle} at {touch.t:.1f} s, moving at {speed:.2f} m/s.")
        said.append(say(words, touch=touch, speed=abs(touch.speed)))
    nearest = min((scan.ahead for scan in trial.scans), default=math.inf)
    if math.isfinite(nearest):
        said.append(say("The closest reading ahead was {d:.2f} m.", d=nearest))
    return " ".join(said)


def png(trial: Trial, at: float | None = None) -> bytes:
    """Return the picture of a trial that is `drawable`, as PNG, with a line where a promise was broken, `at` s.

    Of a robot that only turns it shows how fast that was.
    """
    run = recording(trial)
    drawn = {name: np.clip(run.samples[name], -SPEED_LIMIT, SPEED_LIMIT) for name in ("v", "cmd_v")}
    drawn |= {name: np.where(run.samples[name] <= RANGE_LIMIT, run.samples[name], np.nan) for name in _RANGES}
    run = replace(run, samples=run.samples | drawn)
    with mpl.rc_context({"font.size": 8.0}):
        figure = Figure(figsize=(9.6, 3.9), dpi=120, facecolor="#fcfcfa")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(
            2, 2, width_ratios=(1.0, 1.5), left=0.06, right=0.98, bottom=0.12, top=0.9, wspace=0.14, hspace=0.3
        )
        chart, speeds = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
        ranges = figure.add_subplot(grid[1, 1], sharex=speeds)
        draw_run(chart, run)
        places = [run.x.tolist(), run.y.tolist()]
        for values, goals in zip(places, ([g.x for g in run.world.goals], [g.y for g in run.world.goals]), strict=True):
            values += goals
        half = max(max(values) - min(values) for values in places) / 2 + MARGIN_M
        x, y = ((max(values) + min(values)) / 2 for values in places)
        chart.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal", xlabel="x (m)", ylabel="y (m)")
        chart.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
        turns = not np.any(run.samples["cmd_v"][np.isfinite(run.samples["cmd_v"])]) and _way(trial) <= STILL_M
        (draw_turn_rate if turns else draw_speed)(speeds, run)
        draw_distances(ranges, run, trial.thresholds)
        for axes, t in itertools.product((speeds, ranges), () if at is None else (at,)):
            axes.axvline(t, color="black", linewidth=1.2, linestyle=":", label="promise broken")
        speeds.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, frameon=False, borderaxespad=0.2)
        speeds.tick_params(labelbottom=False)
        ranges.set_xlabel("simulated time (s)")
        for text in figure.findobj(Text):
            text.set_text(say(text.get_text()) if text.get_text() in _LABELS else localized(text.get_text()))
        stream = io.BytesIO()
        figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


_RANGES = ("closest", "clearance")


def worth_drawing(trials: Iterable[Trial]) -> Trial | None:
    """Return the drawable trial in which the robot went the longest way, None if there is none."""
    return max((trial for trial in trials if drawable(trial)), key=_way, default=None)


def _way(trial: Trial) -> float:
    return sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(trial.samples))


# -- the trial as the simulator's recording
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
    left, low = (min(values) - MARGIN_M for values in (x + [g.x for g in goals], y + [g.y for g in goals]))
    right, high = (max(values) + MARGIN_M for values in (x + [g.x for g in goals], y + [g.y for g in goals]))
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
        "command": _rounded(np.clip(run.cmd_v[keep], -SHOWN_LIMIT, SHOWN_LIMIT), 2),
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
