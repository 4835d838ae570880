"""Pictures of worlds and runs with matplotlib: units on every axis, equal aspect on maps, one colour per kind.

Every `*_view` returns a figure and touches no global state: it works in a notebook, in a script, without a display.
"""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle as CirclePatch
from matplotlib.patches import Polygon as PolygonPatch

from sim.geometry import Point, Pose
from sim.obstacles import CirclePart, Obstacle, Path, PolygonPart, SegmentPart
from sim.recording import THRESHOLDS_NOTE, Recording
from sim.simulator import Simulator
from sim.transform import moved_to
from sim.world import World

# One colour per kind of thing, everywhere. After Okabe and Ito: colour-blind readers can tell them apart.
COLORS = {
    "obstacle": "#7d8590",
    "mover": "#CC79A7",
    "path": "#0072B2",
    "odometry": "#56B4E9",
    "command": "#333333",
    "scan": "#E69F00",
    "closest": "#E69F00",
    "clearance": "#5D3A9B",
    "goal": "#009E73",
    "contact": "#D55E00",
    "threshold": "#b03060",
    "other": "#882255",
}

# Distances at which a robot of this size should stop driving, and stop at all: the default thresholds in plots, m.
THRESHOLDS = {"obstacle": 0.5, "emergency": 0.2}

_FRAME = "#8a94a0"  # a middle tone, seen on light and dark pages
_TURNS = 0.02  # rad/s, more than the sensors' and the wheels' noise makes of a straight drive


class View(Figure):
    """A Figure that a notebook shows exactly once, with any backend."""

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        note = self.get_supxlabel().replace("\n", " ")
        return png(self), {"alt": f"{self.get_suptitle()}. {note}" if note else self.get_suptitle()}


def png(figure: Figure, dpi: float = 96) -> bytes:
    """Return a framed figure as a PNG."""
    out = io.BytesIO()
    framed(figure).savefig(out, format="png", dpi=dpi)
    return out.getvalue()


def framed(figure: Figure) -> Figure:
    """Give a figure a frame and return it: on a dark page, white without one looks like an oversight."""
    figure.patch.set(edgecolor=_FRAME, linewidth=4.0)
    return figure


def map_view(what: Recording | World | Simulator, at: float | None = None, *, title: str | None = None) -> View:
    """Return the map: obstacles, goals and, for a recording, path, odometry, contacts, and robot and scan at `at`.

    `at` is simulated time in s; the default is the recording's end.
    """
    figure = View(figsize=(7.0, 6.0), layout="constrained")
    axes = figure.add_subplot()
    if isinstance(what, World):
        draw_obstacles(axes, what.obstacles)
        draw_goals(axes, what.goals)
        draw_robot(axes, what.start, 0.171)
        default = f"{what.name}: {what.title}" if what.title else what.name
    elif isinstance(what, Simulator):
        draw_obstacles(axes, [_shifted(o, place) for o, place in what.obstacles])
        draw_goals(axes, what.world.goals)
        scan = what.scan()
        _draw_scan(axes, scan.ranges, scan.angles, what.pose.compose(what.profile.lidar.pose))
        draw_robot(axes, what.pose, what.profile.radius)
        default = f"{what.world.name} at {what.time:.2f} s"
    else:
        draw_run(axes, what, at)
        default = _run_title(what, at)
    figure.suptitle(default if title is None else title)
    if isinstance(what, Recording):
        _add_caveat(figure, what)
    _finish_map(axes)
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    figure.set_size_inches(7.0, min(max(6.3 * (y1 - y0) / (x1 - x0) + 1.1, 2.6), 8.0))
    return figure


def run_view(recording: Recording, thresholds: Mapping[str, float] | None = None, at: float | None = None) -> View:
    """Return the map of a run beside its speeds and distances over simulated time.

    `at` (s) is the moment that the map shows; thresholds (name -> m) are drawn into the distances. A panel in which
    nothing happens is not drawn.
    """
    figure = View(figsize=(13.0, 6.0), layout="constrained")
    plan, speed, turn, distance = _map_and_lines(figure, recording)
    draw_run(plan, recording, at)
    _finish_map(plan)
    draw_speed(speed, recording)
    if turn is not None:
        draw_turn_rate(turn, recording)
    if distance is not None:
        draw_distances(distance, recording, thresholds_of(recording) if thresholds is None else thresholds)
    figure.suptitle(_run_title(recording, at))
    _add_caveat(figure, recording)
    return figure


def thresholds_of(recording: Recording) -> Mapping[str, float]:
    """Return the thresholds that plots of a recording show: those in its notes, or the default ones."""
    found: Mapping[str, float] = recording.notes.get(THRESHOLDS_NOTE, THRESHOLDS)
    return found


def compare_view(a: Recording, b: Recording, labels: tuple[str, str] = ("first", "second")) -> View:
    """Return two runs in one picture: both paths on the map, speeds and closest ranges over the same time."""
    figure = View(figsize=(13.0, 6.0), layout="constrained")
    plan, speed, turn, distance = _map_and_lines(figure, a, b)
    _draw_obstacles_at(plan, a, a.t[-1])
    draw_goals(plan, a.world.goals)
    for run, label, color, style in ((a, labels[0], COLORS["path"], "-"), (b, labels[1], COLORS["other"], "--")):
        line: dict[str, Any] = {"color": color, "linestyle": style, "label": label, "linewidth": 1.6}
        plan.plot(run.x, run.y, zorder=3, **line)
        plan.plot(run.x[-1:], run.y[-1:], "o", color=color, zorder=4)
        draw_contacts(plan, run)
        speed.plot(run.t, run.v, **line)
        if turn is not None:
            turn.plot(run.t, run.omega, **line)
        if distance is not None:
            distance.plot(run.t, _gaps(run.closest), **line)
    apart = _first_difference(a, b)
    _finish_map(plan)
    _label(speed, "v (m/s)")
    _legend(speed)
    _widen(speed, 0.5)
    if turn is not None:
        _label(turn, "omega (rad/s)")
        _widen_both_ways(turn)
    if distance is not None:
        _label(distance, "closest reading (m)")
        distance.set_ylim(bottom=0.0)
    difference = "the same path" if apart is None else f"apart by more than 1 cm from {apart:.2f} s on"
    figure.suptitle(f"{a.world.name}: {labels[0]} and {labels[1]}, {difference}")
    _add_caveat(figure, a if a.unrepeatable else b)
    return figure


# ------------------------------------------------------------------- parts for your own pictures


def draw_obstacles(axes: Axes, obstacles: Iterable[Obstacle], alpha: float = 1.0, ways: bool = True) -> None:
    """Draw obstacles at their own poses, and (if `ways`) the paths of moving ones as dotted lines."""
    for obstacle in obstacles:
        color = COLORS["mover" if obstacle.motion is not None else "obstacle"]
        lines: list[tuple[Point, Point]] = []
        place = obstacle.pose.point_to_parent
        for part in obstacle.parts():
            match part:
                case SegmentPart():
                    lines.append((place(part.start), place(part.end)))
                case CirclePart():
                    axes.add_patch(
                        CirclePatch(place(part.center), part.radius, color=color, lw=0, alpha=alpha, zorder=2)
                    )
                case PolygonPart():
                    corners = [place(c) for c in part.corners]
                    axes.add_patch(PolygonPatch(corners, color=color, lw=0.6, alpha=alpha, zorder=2))
        if lines:
            axes.add_collection(LineCollection(lines, colors=color, linewidths=2.5, alpha=alpha, zorder=2))
        if ways and isinstance(obstacle.motion, Path):
            route = [(obstacle.pose.x, obstacle.pose.y), *obstacle.motion.waypoints]
            axes.plot(*zip(*route, strict=True), ":", color=color, linewidth=1.2, zorder=1)


def draw_goals(axes: Axes, goals: Iterable[Pose]) -> None:
    """Draw goals, numbered in order, above a robot that stands on one."""
    for number, goal in enumerate(goals, start=1):
        label = "goal" if number == 1 else None
        axes.plot(goal.x, goal.y, "*", color=COLORS["goal"], markersize=14, zorder=8, label=label)
        axes.annotate(str(number), (goal.x, goal.y), (7, 5), textcoords="offset points", color=COLORS["goal"], zorder=8)


def draw_robot(axes: Axes, pose: Pose, radius: float) -> None:
    """Draw the hull and its heading."""
    axes.add_patch(CirclePatch((pose.x, pose.y), radius, facecolor="white", edgecolor=COLORS["path"], lw=1.6, zorder=5))
    nose = pose.point_to_parent((radius, 0.0))
    axes.plot([pose.x, nose[0]], [pose.y, nose[1]], color=COLORS["path"], linewidth=1.6, zorder=6)


def draw_run(axes: Axes, recording: Recording, at: float | None = None) -> None:
    """Draw a recorded run on a map, with robot, scan and moving obstacles at time `at` (s), by default at the end."""
    draw_moment(axes, recording, recording.t[-1] if at is None else at)
    draw_goals(axes, recording.world.goals)
    origin = recording.odom_origin
    odometry = [origin.point_to_parent(p) for p in zip(recording.odom_x, recording.odom_y, strict=True)]
    axes.plot(recording.x, recording.y, color=COLORS["path"], linewidth=1.8, zorder=3, label="path")
    if np.abs(np.array(odometry) - np.stack([recording.x, recording.y], axis=1)).max() > 1e-3:
        axes.plot(*zip(*odometry, strict=True), "--", color=COLORS["odometry"], lw=1.2, zorder=3, label="odometry")
    axes.plot(recording.x[:1], recording.y[:1], "o", color=COLORS["path"], markersize=4, zorder=4)
    draw_contacts(axes, recording)


def draw_moment(axes: Axes, recording: Recording, time: float) -> None:
    """Draw robot, obstacles and the latest scan of a recorded run at `time` (s) on a map."""
    index = recording.index_at(time)
    _draw_obstacles_at(axes, recording, time)
    kept = np.flatnonzero(recording.scan_index <= index)
    if kept.size:
        last = int(kept[-1])
        taken = recording.pose_at(int(recording.scan_index[last])).compose(recording.lidar)
        _draw_scan(axes, recording.scan_ranges[last], recording.scan_angles, taken)
    draw_robot(axes, recording.pose_at(index), recording.radius)


def draw_speed(axes: Axes, recording: Recording) -> None:
    """Draw the commanded and the true speed over time."""
    _draw_commanded_and_driven(axes, recording, "v")
    _label(axes, "v (m/s)")
    _legend(axes)
    _widen(axes, 0.5)


def draw_turn_rate(axes: Axes, recording: Recording) -> None:
    """Draw the commanded and the true turn rate over time."""
    _draw_commanded_and_driven(axes, recording, "omega")
    _label(axes, "omega (rad/s)")
    _widen_both_ways(axes)


def _draw_commanded_and_driven(axes: Axes, recording: Recording, name: str) -> None:
    command = recording.samples[f"cmd_{name}"]
    axes.step(recording.t, command, where="pre", color=COLORS["command"], lw=1.0, ls="--", label="commanded")
    axes.plot(recording.t, recording.samples[name], color=COLORS["path"], linewidth=1.6, label="driven")


def draw_distances(axes: Axes, recording: Recording, thresholds: Mapping[str, float]) -> None:
    """Draw closest reading and clearance over time, with thresholds and contacts marked."""
    axes.plot(recording.t, _gaps(recording.closest), color=COLORS["closest"], lw=1.6, label="closest reading")
    axes.plot(recording.t, _gaps(recording.clearance), color=COLORS["clearance"], lw=1.6, label="clearance of the hull")
    side = _emptier_side(recording, max(thresholds.values(), default=0.0))
    place = recording.t[0 if side == "left" else -1]
    for name, value in thresholds.items():
        axes.axhline(value, color=COLORS["threshold"], linewidth=1.0, linestyle=":")
        axes.annotate(
            f"{name} {value:g} m", (place, value), (0, 2), textcoords="offset points", ha=side, fontsize=8,
            color=COLORS["threshold"], zorder=1.5,  # below the lines, so that it hides none
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.5},
        )  # fmt: skip
    for i, contact in enumerate(recording.contacts):
        axes.axvline(contact.time, color=COLORS["contact"], linewidth=1.2, label="contact" if i == 0 else None)
    finite = recording.closest[np.isfinite(recording.closest)]
    axes.set_ylim(0.0, max(1.0, 1.15 * float(finite.max(initial=0.0))))
    _label(axes, "distance (m)")
    _legend(axes)


def _emptier_side(recording: Recording, height: float) -> str:
    """Return the side, "left" or "right", whose third has fewer distances up to a little above `height` (m)."""
    third = max(1, len(recording.t) // 3)
    lines = np.array([recording.closest, recording.clearance])
    low = np.isfinite(lines) & (lines < height + 0.2)
    return "left" if low[:, :third].sum() < low[:, -third:].sum() else "right"


def _draw_obstacles_at(axes: Axes, recording: Recording, time: float) -> None:
    """Draw obstacles at their positions at `time` (s), those that were absent then faintly."""
    index = recording.index_at(time)
    dragged = {e.subject for e in recording.events if e.kind == "moved" and e.time < time}
    for presence in recording.presences:
        obstacle, track = presence.obstacle, recording.track(presence)
        if track is not None:
            obstacle = _shifted(obstacle, (float(track[index, 0]), float(track[index, 1])))
        there = presence.since <= time < presence.until
        way = obstacle.name not in dragged  # a dragged obstacle has left this path
        draw_obstacles(axes, [obstacle], alpha=1.0 if there else 0.25, ways=way)


def draw_contacts(axes: Axes, recording: Recording) -> None:
    """Mark where a recorded robot touched something."""
    if recording.contacts:
        places = np.array([c.point for c in recording.contacts])
        label = None if any(t.get_label() == "contact" for t in axes.get_lines()) else "contact"
        axes.plot(
            *places.T, "X", color=COLORS["contact"], markersize=11, markeredgecolor="white", zorder=7, label=label
        )


def _draw_scan(axes: Axes, ranges: Any, angles: Any, sensor: Pose) -> None:
    """Draw a scan's valid readings as points; `sensor` is the lidar's pose in the map frame."""
    valid = np.isfinite(ranges)
    bearing = angles[valid] + sensor.yaw
    x, y = sensor.x + ranges[valid] * np.cos(bearing), sensor.y + ranges[valid] * np.sin(bearing)
    axes.plot(x, y, ".", color=COLORS["scan"], markersize=3, zorder=4, label="scan")


def _shifted(obstacle: Obstacle, place: Point) -> Obstacle:
    """Return the obstacle with its centre at `place`, but with its original path."""
    if place == (obstacle.pose.x, obstacle.pose.y):
        return obstacle
    return replace(moved_to(obstacle, place), motion=obstacle.motion)


def _gaps(values: Any) -> Any:
    """Return the values with NaN, a gap in the line, where nothing is in range."""
    return np.where(np.isfinite(values), values, np.nan)


def _first_difference(a: Recording, b: Recording) -> float | None:
    n = min(len(a), len(b))
    apart = np.hypot(a.x[:n] - b.x[:n], a.y[:n] - b.y[:n]) > 0.01
    return float(a.t[int(np.argmax(apart))]) if apart.any() else None


def _run_title(recording: Recording, at: float | None) -> str:
    moment = f", at {at:.2f} s" if at is not None else ""
    return f"{recording.world.name}: {recording.duration:.1f} s simulated, {recording.distance:.2f} m driven{moment}"


def _add_caveat(figure: Figure, recording: Recording) -> None:
    """Print below a run why another one may differ."""
    if recording.unrepeatable:
        columns = round(14 * figure.get_figwidth())  # in small type
        figure.supxlabel(textwrap.fill(recording.unrepeatable, columns), fontsize=8, color="#555555")


def _label(axes: Axes, label: str) -> None:
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)


def _legend(axes: Axes) -> None:
    """Put the legend above the axes, where it hides no data."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, fontsize=8, frameon=False, borderaxespad=0.2)


def _widen(axes: Axes, least: float) -> None:
    """Show at least the range from 0 to `least` or to -`least`, so that a little noise does not fill the axes."""
    low, high = axes.dataLim.y0, axes.dataLim.y1
    low, high = min(low, 0.0), max(high, 0.0)
    if high - low < least:
        low, high = (low, low + least) if high > -low else (high - least, high)
    axes.set_ylim(low - 0.07 * (high - low), high + 0.07 * (high - low))


def _widen_both_ways(axes: Axes) -> None:
    """Show as much below 0 as above, and at least 0.5 on each side."""
    most = 1.07 * max(0.5, abs(axes.dataLim.y0), abs(axes.dataLim.y1))
    axes.set_ylim(-most, most)


def _map_and_lines(figure: Figure, *runs: Recording) -> tuple[Axes, Axes, Axes | None, Axes | None]:
    """Return axes for a map on the left, and on the right for speed, turn rate and distance over time.

    A panel in which nothing happens is None: of the turn rate where nothing turns, of the distance where nothing is in
    range.
    """
    turns = any(np.abs(run.samples[name]).max(initial=0.0) > _TURNS for run in runs for name in ("omega", "cmd_omega"))
    sees = any(np.isfinite(run.closest).any() for run in runs)
    heights = [1.0, *([1.0] if turns else []), *([1.3] if sees else [])]
    grid = figure.add_gridspec(len(heights), 2, width_ratios=[1, 1.05], height_ratios=heights)
    plan = figure.add_subplot(grid[:, 0])
    speed = figure.add_subplot(grid[0, 1])
    turn = figure.add_subplot(grid[1, 1], sharex=speed) if turns else None
    distance = figure.add_subplot(grid[-1, 1], sharex=speed) if sees else None
    *upper, lowest = [axes for axes in (speed, turn, distance) if axes is not None]
    for axes in upper:
        axes.tick_params(labelbottom=False)
    lowest.set_xlabel("simulated time (s)")
    return plan, speed, turn, distance


def _finish_map(axes: Axes) -> None:
    axes.set_aspect("equal", adjustable="box")
    axes.autoscale_view()
    axes.margins(0.05)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=5, fontsize=8, frameon=False)
