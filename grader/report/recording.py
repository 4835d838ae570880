"""A trial as the simulator's recording, which pictures, replays and MCAP files are made of."""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence

import numpy as np

from grader.evidence import Sample, Trial
from sim.geometry import Pose
from sim.inventory import Presence
from sim.obstacles import Obstacle
from sim.recording import THRESHOLDS_NOTE, Recording
from sim.robot import COURSE
from sim.scene import Scene
from sim.simulator import Contact
from sim.world import World, WorldError

TOUCHES = 20  # a robot that scrapes along a wall touches it at every tick
_FAR_M = 30.0  # a goal farther away is meant to be refused; drawn, it would shrink the path to a dot
_EXACT_M = 0.002  # two distances between the same things differ less


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
