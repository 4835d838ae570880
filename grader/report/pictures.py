"""Draw one trial as PNG: a map with the path driven, and speeds and ranges over time.

Import this only where a picture is drawn: matplotlib takes half a second.
"""

from __future__ import annotations

import base64
import io
import itertools
import math
from collections.abc import Iterable, Sequence
from typing import TypeVar

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from grader.evidence import Trial
from grader.words import mark, say
from sim.geometry import Pose
from sim.robot import COURSE
from sim.views import COLORS, draw_obstacles, draw_robot
from sim.world import World, WorldError

T = TypeVar("T")

MARGIN_M = 0.9  # around the path driven, so that walls near it are visible
STILL_M = 0.02  # a shorter path counts as standing still
FAR_M = 30.0  # a goal farther away is meant to be refused; drawn, it would shrink the path to a dot
TOUCHES = 20  # a robot that scrapes along a wall touches it at every tick
POINTS = 1_500  # samples drawn; more than a curve has columns
SPEED_LIMIT = 3.0  # m/s, for drawing: a command of 1e300 m/s must not flatten everything else
RANGE_LIMIT = 4.0  # m, for drawing: anything farther away does not matter for stopping

PAPER, INK, FAINT = "#fcfcfa", "#2b2f36", "#9aa0a8"


def drawable(trial: Trial) -> bool:
    """Return whether there is something to see in a trial: a robot that moved or was commanded to."""
    commanded = any(command.v != 0 or command.omega != 0 for command in trial.commands)
    return len(trial.samples) > 1 and (commanded or bool(trial.touches) or _way(trial) > STILL_M)


def data_uri(trial: Trial) -> str:
    """Return the picture of a trial as a data URI for an HTML image."""
    return "data:image/png;base64," + base64.b64encode(png(trial)).decode("ascii")


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


def png(trial: Trial) -> bytes:
    """Return the picture of a trial that is `drawable`, as PNG."""
    figure = Figure(figsize=(9.6, 3.7), dpi=120, facecolor=PAPER)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(
        2, 2, width_ratios=(1.0, 1.5), left=0.06, right=0.99, bottom=0.12, top=0.9, wspace=0.12, hspace=0.25
    )
    chart = figure.add_subplot(grid[:, 0])
    speeds = figure.add_subplot(grid[0, 1])
    ranges = figure.add_subplot(grid[1, 1], sharex=speeds)
    for axes in (chart, speeds, ranges):
        _dress(axes)
    _draw_map(chart, trial)
    _draw_speeds(speeds, trial)
    _draw_ranges(ranges, trial)
    for axes in (speeds, ranges):
        _draw_moments(axes, trial)
        axes.margins(x=0.01)
    speeds.tick_params(labelbottom=False)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


def _dress(axes: Axes) -> None:
    axes.set_facecolor(PAPER)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(FAINT)
    axes.tick_params(colors=INK, labelsize=8)
    axes.grid(True, color="#e8e9ea", linewidth=0.6)
    axes.set_axisbelow(True)


def _draw_map(axes: Axes, trial: Trial) -> None:
    samples = _thin(trial.samples)
    world = _world(trial)
    if world is not None:
        passing = [o for o in world.obstacles if o.motion or o.appears is not None or o.vanishes is not None]
        draw_obstacles(axes, [o for o in world.obstacles if o not in passing])
        draw_obstacles(axes, passing, alpha=0.4)
    axes.plot(
        [s.x for s in samples], [s.y for s in samples], color=COLORS["path"], linewidth=1.8, label=say("path driven")
    )
    first, last = samples[0], samples[-1]
    axes.plot(first.x, first.y, "o", color=INK, markersize=5, label=say("start"))
    draw_robot(axes, Pose(last.x, last.y, last.yaw), COURSE.radius)
    goals = [goal for goal in trial.goals if math.hypot(goal.x, goal.y) < FAR_M]  # false for NaN
    for goal in goals:
        axes.plot(goal.x, goal.y, "*", color=COLORS["goal"], markersize=9, label=say("goal"), zorder=7)
        if 0 < goal.tolerance < FAR_M:
            circle = Circle((goal.x, goal.y), goal.tolerance, facecolor="none", edgecolor=COLORS["goal"], zorder=6)
            axes.add_patch(circle)
    for touch in trial.touches[:TOUCHES]:
        at = min(samples, key=lambda sample: abs(sample.t - touch.t))
        axes.plot(
            at.x,
            at.y,
            "X",
            color=COLORS["contact"],
            markersize=10,
            markeredgecolor="white",
            label=say("contact"),
            zorder=7,
        )
    _frame(axes, [(s.x, s.y) for s in samples] + [(goal.x, goal.y) for goal in goals])
    axes.set_xlabel(say("x (m), odom frame"), fontsize=8, color=INK)
    axes.set_ylabel("y (m)", fontsize=8, color=INK)
    _legend(axes, columns=3)


def _frame(axes: Axes, places: Sequence[tuple[float, float]]) -> None:
    """Show a square of the map with all the places in it, to scale."""
    (left, right), (low, high) = ((min(values), max(values)) for values in zip(*places, strict=True))
    half = max(right - left, high - low) / 2 + MARGIN_M
    axes.set_xlim((left + right) / 2 - half, (left + right) / 2 + half)
    axes.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)
    axes.set_aspect("equal")


def _world(trial: Trial) -> World | None:
    """Return the trial's world with all that was put into it; None if the evidence holds none that can be read."""
    try:
        return World.from_dict(trial.scene) if trial.scene else None
    except WorldError:
        return None


def _draw_speeds(axes: Axes, trial: Trial) -> None:
    commands, samples = _thin(trial.commands), _thin(trial.samples)
    times, speeds = [c.t for c in commands], [_within(c.v, SPEED_LIMIT) for c in commands]
    axes.plot([s.t for s in samples], [s.v for s in samples], color=COLORS["path"], linewidth=1.6, label=say("true v"))
    axes.step(
        times, speeds, where="post", color=COLORS["command"], linestyle="--", linewidth=1.2, label=say("commanded v")
    )
    axes.set_ylabel("v (m/s)", fontsize=8, color=INK)
    _legend(axes, columns=2)


def _draw_ranges(axes: Axes, trial: Trial) -> None:
    scans = _thin(trial.scans)
    # A scan without a valid reading ahead (inf) leaves a gap.
    ahead = [scan.ahead if scan.ahead <= RANGE_LIMIT else math.nan for scan in scans]
    axes.plot(
        [scan.t for scan in scans], ahead, color=COLORS["closest"], linewidth=1.6, label=say("closest reading ahead")
    )
    for threshold in trial.thresholds.values():
        label = say("threshold {d} m", d=threshold)
        axes.axhline(threshold, color=COLORS["threshold"], linewidth=1.0, linestyle=":", label=label)
    if all(map(math.isnan, ahead)):
        said = say("nothing ahead within {d:g} m", d=RANGE_LIMIT) if scans else say("no scan was published")
        axes.text(0.5, 0.5, said, transform=axes.transAxes, ha="center", fontsize=8, color=INK)
    axes.set_ylim(0.0, max([*trial.thresholds.values(), *filter(math.isfinite, ahead)], default=RANGE_LIMIT) * 1.15)
    axes.set_xlabel(say("simulated time (s)"), fontsize=8, color=INK)
    axes.set_ylabel(say("range (m)"), fontsize=8, color=INK)
    _legend(axes, columns=3)


def _draw_moments(axes: Axes, trial: Trial) -> None:
    """Draw what happened at a moment as an upright line."""
    for goal in trial.goals:
        for moment in (goal.t, goal.ended_t):
            if math.isfinite(moment):
                axes.axvline(moment, color=COLORS["goal"], linewidth=0.9, linestyle="--")
    for touch in trial.touches[:1]:
        axes.axvline(touch.t, color=COLORS["contact"], linewidth=1.1)


def _legend(axes: Axes, *, columns: int) -> None:
    """Put the legend above the axes, where it hides nothing; what was drawn several times is named once."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    legend = axes.legend(once.values(), once.keys(), fontsize=7, ncols=columns, frameon=False, loc="lower right")
    legend.set_bbox_to_anchor((1.0, 0.98), transform=axes.transAxes)


def _thin(values: Sequence[T]) -> Sequence[T]:
    """Return at most about POINTS of the values, evenly, the last one among them."""
    stride = max(1, math.ceil(len(values) / POINTS))
    return [*values[::stride], *values[-1:]]


def _within(value: float, limit: float) -> float:
    """Return the value cut to -limit ... limit; NaN, which draws a gap, stays."""
    return math.nan if math.isnan(value) else max(-limit, min(limit, value))


def worth_drawing(trials: Iterable[Trial]) -> Trial | None:
    """Return the drawable trial in which the robot went the longest way, None if there is none."""
    return max((trial for trial in trials if drawable(trial)), key=_way, default=None)


def _way(trial: Trial) -> float:
    places = [(sample.x, sample.y) for sample in _thin(trial.samples)]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(places))
