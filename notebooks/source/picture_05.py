"""The picture at the top of notebook 05: a robot that slows down and stops before a wall, and the stop close up."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from sim import COURSE, Pose, Recording, Simulator, Twist, Wall, World, drive
from sim.drive import Seen
from sim.views import COLORS, draw_obstacles, draw_robot

THRESHOLD_M, MARGIN_M, SPEED_MPS, RAMP_MPS = 0.5, 0.3, 0.5, 0.1
WALL = Wall((2.5, -0.6), (2.5, 0.6), name="wall", thickness=0.06)


class Careful:
    """Speeds up gently, slows down in the margin, stops below the threshold."""

    v = 0.0

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for what is seen."""
        ahead = seen.scan.ranges[np.abs(seen.scan.angles) <= math.radians(60)].min()
        share = min(1.0, max(0.2, (ahead - THRESHOLD_M) / MARGIN_M)) if ahead >= THRESHOLD_M else 0.0
        self.v = min(self.v + RAMP_MPS, share * SPEED_MPS)
        return Twist(self.v, 0.0)


def draw() -> Figure:
    """Return the figure: the drive on the map, speed and distance over time, and what the three distances mean."""
    run = drive(Simulator(World("wall", (WALL,)), noise=False), Careful(), 6.5)
    figure = Figure(figsize=(10.0, 5.6), layout="constrained")
    plan, speed, gap = figure.subplots(3, 1, height_ratios=[1.1, 1.0, 1.2])
    _draw_map(plan, run)
    speed.step(run.t, run.cmd_v, where="pre", color=COLORS["command"], linestyle="--", linewidth=1.2, label="commanded")
    speed.plot(run.t, run.v, color=COLORS["path"], linewidth=2.0, label="driven")
    speed.set_ylabel("v (m/s)")
    gap.plot(run.t, run.closest, color=COLORS["closest"], linewidth=2.0, label="closest reading")
    gap.plot(run.t, run.clearance, color=COLORS["clearance"], linewidth=2.0, label="clearance of the hull")
    for name, height in (("slow down below", THRESHOLD_M + MARGIN_M), ("stop below", THRESHOLD_M)):
        gap.axhline(height, color=COLORS["threshold"], linestyle=":")
        gap.annotate(f"{name} {height:.1f} m", (0.05, height + 0.04), color=COLORS["threshold"])
    gap.set(xlabel="simulated time (s)", ylabel="distance (m)", ylim=(0.0, 1.6))
    stopped = float(run.t[(run.closest < THRESHOLD_M).argmax()])
    for axes in (speed, gap):
        axes.axvspan(stopped, stopped + 0.3, color=COLORS["contact"], alpha=0.25, label="0.3 s to stop")
        axes.set_xlim(0.0, run.t[-1])
        axes.grid(alpha=0.3)
        axes.legend(loc="upper right", fontsize=9, ncols=3)
    speed.set_ylim(0.0, 0.75)
    return figure


def _draw_map(axes: object, run: Recording) -> None:
    draw_obstacles(axes, (WALL,))  # type: ignore[arg-type]
    for index in np.linspace(0, len(run) - 1, 6).astype(int):
        draw_robot(axes, run.pose_at(int(index)), COURSE.radius)  # type: ignore[arg-type]
    end = run.pose_at(len(run) - 1)
    for angle in np.radians(np.linspace(-60, 60, 41)):
        reach = (WALL.start[0] - 0.03 - end.x) / math.cos(angle)
        tip = Pose(end.x, end.y, float(angle)).point_to_parent((min(reach, 0.9), 0.0))
        axes.plot([end.x, tip[0]], [end.y, tip[1]], color=COLORS["scan"], linewidth=0.7, alpha=0.7)  # type: ignore[attr-defined]
    axes.set(xlim=(-0.4, 2.8), ylim=(-0.45, 0.45), aspect="equal", xlabel="x (m)", ylabel="y (m)")  # type: ignore[attr-defined]
