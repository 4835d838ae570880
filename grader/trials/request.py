"""What the grader asks a trial host for. Imported on both sides, so it knows neither ROS nor bubblewrap."""

from __future__ import annotations

from dataclasses import dataclass

from grader import evidence
from grader.trials.catalog import TrialPlan

READY = "ready"
"""What a host says first, once it has loaded everything."""

CANNOT = "cannot: "
"""How a host's answer begins when this machine, not the submission, kept it from running the trial; words follow."""

OBSERVER_ENDED = "the process that observes the node crashed on what it was sent, twice in a row"
"""How a trial ended that cannot be seen to its end, because rclpy or DDS on our side does not survive the node."""

LATE_VARIABLE = "ROS2_COURSE_KIT_LATE_S"
"""How long an observer waits before it joins a trial's graph, in wall seconds: discovery delayed, as by a slow host."""


@dataclass(frozen=True)
class Request:
    """One trial to run: of which install tree, with which seed, in which DDS domain, and where its evidence goes."""

    trial: str
    install: str
    seed: int
    domain_id: int
    out: str
    package: str = ""
    """The package's source folder, for a trial that plays a script of it."""


def unjudged(plan: TrialPlan, seed: int, script_error: str, ended: str = "") -> evidence.Trial:
    """Return the facts of a trial that never began."""
    return evidence.Trial(
        name=plan.name, node=plan.node, world=plan.world, seed=seed, ready=False, pace="lockstep",
        ended=ended, script_error=script_error,
    )  # fmt: skip
