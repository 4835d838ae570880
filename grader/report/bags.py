"""Write a trial as an MCAP file, for Foxglove and `ros2 bag`: what the robot did, was told and had ahead of it."""

from __future__ import annotations

import bisect
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from grader.evidence import Trial
from grader.report.replay import presences
from sim.bag import BagMessage, write_bag
from sim.geometry import Pose
from sim.recording import Recording
from sim.robot import COURSE
from sim.world import World


def write(trial: Trial, path: Path) -> None:
    """Write the trial to `path`, whole or not at all. Scans are not in the evidence, only their closest readings."""
    name = "std_msgs/msg/Float64"
    readings = [
        BagMessage(topic, name, scan.t, {"data": value})
        for scan in trial.scans
        for topic, value in (("/scan/closest_ahead", scan.ahead), ("/scan/closest", scan.anywhere))
    ]
    touches = [
        BagMessage(
            "/ground_truth/contacts",
            "std_msgs/msg/String",
            touch.t,
            {"data": f"touched {touch.obstacle}, moving at {touch.speed:.2f} m/s"},
        )
        for touch in trial.touches
    ]
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".bag-") as scratch:
        folder = Path(scratch) / path.stem
        write_bag(recording(trial), folder, messages=[*readings, *touches])
        next(folder.glob("*.mcap")).rename(path)


def recording(trial: Trial) -> Recording:
    """Return the trial as the simulator's recording, without scans."""
    columns = {
        name: np.array([getattr(sample, name) for sample in trial.samples], dtype=np.float64)
        for name in ("t", "x", "y", "yaw", "v", "omega", "odom_x", "odom_y", "odom_yaw", "clearance")
    }
    times = columns["t"].tolist()
    columns["cmd_v"] = _held([c.t for c in trial.commands], [c.v for c in trial.commands], times, 0.0)
    columns["cmd_omega"] = _held([c.t for c in trial.commands], [c.omega for c in trial.commands], times, 0.0)
    columns["closest"] = _held([s.t for s in trial.scans], [s.anywhere for s in trial.scans], times, math.inf)
    beams, world = COURSE.lidar.beams, World.from_dict(trial.scene)
    return Recording(
        world=world,
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
        presences=tuple(presences(trial)),
    )


def _held(times: Sequence[float], values: Sequence[float], at: Sequence[float], before: float) -> np.ndarray:
    """Return at each time the last value that is not after it, `before` where there is none."""
    found = (bisect.bisect_right(times, t + 1e-9) for t in at)
    return np.array([values[index - 1] if index else before for index in found], dtype=np.float64)
