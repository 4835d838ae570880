"""The picture at the top of notebook 07: a robot that visits three goals, and the distance that it would report."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from sim import COURSE, Circle, Pose, Simulator, Twist, World, drive, normalize_angle
from sim.drive import Seen
from sim.views import COLORS, draw_obstacles, draw_robot

GOALS = (Pose(1.8, 0.6), Pose(0.4, 1.5), Pose(-0.8, 0.0))
WORLD = World(
    "three goals", (Circle((0.7, 0.9), 0.15, name="pillar"), Circle((-0.6, 1.2), 0.2, name="tub")), goals=GOALS
)


class Visitor:
    """Turns to a goal, drives there, slower at last; then to the next one."""

    def __init__(self) -> None:
        self.left = list(GOALS)
        self.told: list[tuple[float, float]] = []

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for the goal in hand."""
        if not self.left:
            return Twist()
        here, goal = seen.odometry.pose, self.left[0]
        distance = here.distance_to(goal)
        self.told.append((seen.time, distance))
        if distance < 0.05:
            self.left.pop(0)
            return Twist()
        error = normalize_angle(math.atan2(goal.y - here.y, goal.x - here.x) - here.yaw)
        omega = max(-1.0, min(1.0, 1.5 * error))
        return Twist(0.0 if abs(error) > 0.3 else min(0.5, distance), omega)


def draw() -> Figure:
    """Return the figure: the way on the map at the left, the reported distance over time at the right."""
    visitor = Visitor()
    run = drive(Simulator(WORLD, noise=False), visitor, 40.0, until=lambda: not visitor.left)
    figure = Figure(figsize=(10.5, 4.4), layout="constrained")
    plan, told = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    draw_obstacles(plan, WORLD.obstacles)
    plan.plot(run.x, run.y, color=COLORS["path"], linewidth=2.0)
    for index in np.linspace(0, len(run) - 1, 9).astype(int):
        draw_robot(plan, run.pose_at(int(index)), COURSE.radius)
    for number, goal in enumerate(GOALS, start=1):
        plan.plot(goal.x, goal.y, "*", color=COLORS["goal"], markersize=15, zorder=8)
        beside = 24 if goal.y > 1.0 else -36  # of the robots, which would be drawn over it
        plan.annotate(f"goal {number}", (goal.x, goal.y), (0, beside), textcoords="offset points", color=COLORS["goal"],
                      ha="center", zorder=9)  # fmt: skip
    plan.set(xlim=(-1.2, 2.2), ylim=(-0.5, 1.9), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    times, distances = np.array(visitor.told).T
    told.plot(times, distances, ".", color=COLORS["goal"], markersize=5, label="feedback: distance_remaining")
    told.axhline(0.1, color=COLORS["threshold"], linestyle=":", label="tolerance 0.1 m")
    told.set(xlabel="simulated time (s)", ylabel="distance (m)", ylim=(0.0, 2.4))
    told.grid(alpha=0.3)
    told.legend(loc="upper right")
    return figure
