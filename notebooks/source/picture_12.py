"""The picture at the top of notebook 12: four frames in a room, and their tree."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim import TB4, Box, Pose, Simulator, World, room
from sim.views import COLORS, draw_obstacles, draw_robot

WORLD = World("a room", (*room((0.0, 0.0), (6.0, 4.0)), Box((4.9, 1.0), (0.8, 0.6))), start=Pose(3.2, 2.3, 0.5))
ODOM = Pose(1.3, 1.0, 0.2)
LINKS = (
    ("map", "odom", "the localisation"), ("odom", "base_link", "the odometry"), ("base_link", "laser", "the mount"),
)  # fmt: skip


def draw() -> Figure:
    """Return the room with the axes of four frames, and beside it who says where each one is."""
    figure, (plan, tree) = plt.subplots(1, 2, figsize=(9.0, 3.9), width_ratios=(1.7, 1.0), layout="constrained")
    simulator = Simulator(WORLD, TB4, seed=1)
    laser = WORLD.start.compose(Pose(-0.04, 0.0, math.pi / 2))
    scan = simulator.scan()
    seen = [(r, a) for r, a in zip(scan.ranges, scan.angles, strict=True) if math.isfinite(r)]
    places = [laser.point_to_parent((r * math.cos(a), r * math.sin(a))) for r, a in seen]
    plan.plot(*zip(*places, strict=True), ".", color=COLORS["scan"], markersize=3, zorder=3)
    draw_obstacles(plan, WORLD.obstacles)
    draw_robot(plan, WORLD.start, TB4.radius)
    _draw_axes(plan, "map", Pose(), (0.1, -0.32))
    _draw_axes(plan, "odom", ODOM, (0.1, -0.32))
    _draw_axes(plan, "base_link", WORLD.start, (0.62, 0.12))
    _draw_axes(plan, "laser", laser, (-1.05, -0.1), size=0.35)
    plan.set(xlim=(-0.4, 6.3), ylim=(-0.5, 4.2), aspect="equal", xticks=(), yticks=())
    plan.axis("off")
    tree.axis("off")
    tree.set(xlim=(0.0, 3.0), ylim=(-3.4, 0.4))
    for depth, name in enumerate(("map", *(child for _, child, _ in LINKS))):
        tree.text(0.25 * depth, -depth, name, family="monospace", weight="bold", va="center", color="0.15")
    for depth, (_, _, who) in enumerate(LINKS):
        x, y = 0.25 * depth + 0.12, -depth
        arrow = {"arrowstyle": "->", "color": "0.4", "connectionstyle": "angle,angleA=-90,angleB=0"}
        tree.annotate("", (x + 0.14, y - 1.0), (x, y - 0.16), arrowprops=arrow)
        tree.text(x + 0.45, y - 0.5, f"known from {who}", va="center", fontsize=9, color="#8A4B00")
    return figure


def _draw_axes(axes: Axes, name: str, frame: Pose, label: tuple[float, float], size: float = 0.7) -> None:
    """Draw the x axis in red, the y axis in green, as RViz does, and the name at an offset."""
    for tip, color in (((size, 0.0), "#C0392B"), ((0.0, size), "#27864A")):
        x, y = frame.point_to_parent(tip)
        arrow = {"arrowstyle": "-|>", "color": color, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (x, y), (frame.x, frame.y), arrowprops=arrow, zorder=8)
    axes.text(frame.x + label[0], frame.y + label[1], name, family="monospace", fontsize=10, zorder=9, weight="bold")
