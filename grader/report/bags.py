"""Write a trial as an MCAP file, for Foxglove and `ros2 bag`: what the robot did, was told and had ahead of it."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from grader.evidence import Trial
from grader.report.recording import recording
from sim.bag import BagMessage, write_bag


def write(trial: Trial, path: Path) -> None:
    """Write the trial to `path`, whole or not at all. Scans are not in the evidence, only their closest readings."""
    readings = [
        BagMessage(topic, "std_msgs/msg/Float64", scan.t, {"data": value})
        for scan in trial.scans
        for topic, value in (("/scan/closest_ahead", scan.ahead), ("/scan/closest", scan.anywhere))
    ]
    run = recording(trial)
    commands = {name: np.nan_to_num(run.samples[name], nan=0.0) for name in ("cmd_v", "cmd_omega")}
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".bag-") as scratch:
        folder = Path(scratch) / path.stem
        write_bag(replace(run, samples=run.samples | commands), folder, messages=readings)
        next(folder.glob("*.mcap")).rename(path)
