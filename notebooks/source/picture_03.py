"""The picture at the head of notebook 03: a heading as an arrow, as a number that jumps, and what comes of the jump."""

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim import Circle, Pose, Recording, Simulator, Twist, World, drive, normalize_angle
from sim.views import COLORS, View, draw_obstacles, draw_robot

EVERY = 32  # samples between two arrows: 1.6 s
ARROW_M = 0.5


def draw() -> Figure:
    """Return a robot that drives in circles, its yaw over time, and two robots that turn from -170 to 170 degrees."""
    figure = View(figsize=(12.0, 3.7), layout="constrained")
    plan, line, turns = figure.subplots(1, 3)
    simulator = Simulator(World(start=Pose(0.0, -0.7), obstacles=(Circle(center=(0.0, 0.1), radius=0.2, name="pole"),)))
    spiral = drive(simulator, lambda seen: Twist(0.3 + 0.008 * seen.time, 0.42), 25.6)
    _draw_arrows(plan, spiral)
    _draw_heading(line, spiral, COLORS["path"], "")
    line.set_title("the same heading as a number")
    _draw_heading(turns, _turn(lambda difference: difference), COLORS["contact"], "wanted - yaw")
    _draw_heading(turns, _turn(normalize_angle), COLORS["goal"], "normalized")
    turns.set_title("turning from -170° to 170°")
    turns.legend(loc="center right", fontsize=9)
    return figure


def _turn(difference: Callable[[float], float]) -> Recording:
    robot = Simulator(World(start=Pose(yaw=math.radians(-170))))
    wanted = math.radians(170)
    return drive(robot, lambda seen: Twist(0.0, 1.5 * difference(wanted - seen.odometry.pose.yaw)), 6.0)


def _draw_arrows(axes: Axes, recording: Recording) -> None:
    draw_obstacles(axes, [presence.obstacle for presence in recording.presences])
    axes.plot(recording.x, recording.y, color=COLORS["path"], linewidth=1.2, alpha=0.6)
    for index in range(0, len(recording), EVERY):
        pose = recording.pose_at(index)
        draw_robot(axes, pose, 0.07)
        axes.quiver(
            pose.x, pose.y, ARROW_M * math.cos(pose.yaw), ARROW_M * math.sin(pose.yaw), color=COLORS["scan"],
            angles="xy", scale_units="xy", scale=1, width=0.009, zorder=8,
        )  # fmt: skip
    axes.set(xlabel="x (m)", ylabel="y (m)", title="a heading as an arrow")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.grid(alpha=0.3)


def _draw_heading(axes: Axes, recording: Recording, color: str, label: str) -> None:
    yaw = np.degrees(recording.yaw)
    shown = np.where(np.abs(np.diff(yaw, prepend=yaw[0])) > 180, np.nan, yaw)  # no line where the number jumps
    axes.plot(recording.t, shown, color=color, linewidth=2.0, label=label)
    axes.set(xlabel="simulated time (s)", ylabel="yaw (°)", yticks=range(-180, 181, 90), ylim=(-195, 195))
    axes.grid(alpha=0.3)
