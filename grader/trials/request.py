"""What observers and worker tell each other. Imported by both, so it needs no ROS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grader import evidence
from grader.evidence import Reason
from grader.trials.plan import TrialPlan

READY = "ready"
"""A worker's first line, once it has loaded everything."""

CANNOT = "cannot: "
"""How a worker's answer begins when this machine, not the submission, kept it from running the trial; why follows."""

PATIENCE_S = 20.0
DEAF_S = 10.0
"""How long a node may answer nothing before its trial is over; excludes time spent waiting for a CPU."""
BEHIND_S, ALL_BEHIND_S = 30.0, 300.0
"""How much longer than a robot would take a node's callbacks may wait in one trial, and in all of a submission."""


@dataclass(frozen=True)
class TrialRequest:
    """One trial to run: with which install tree, seed and DDS domain, and where to write the evidence."""

    trial: str
    install: str
    seed: int
    domain_id: int
    out: str
    package: str = ""
    """The package's source folder, for a trial that runs a script of it."""
    ros_name: str = ""
    """The package's name, by which `ros2 run` finds it."""
    best_effort: bool = False
    """Whether the simulated sensors publish best effort."""
    then: Sequence[str] = ()
    """The trials that are to go on with the same node. Their evidence is written beside that of the first."""
    patience_s: float = PATIENCE_S
    """How long to wait for the node to come up, excluding time spent waiting for a CPU."""
    case: Mapping[str, Any] | None = None
    """What is done in it, if it is in no list of the course (case.py)."""


def not_started(plan: TrialPlan, seed: int, script_error: str = "", ended: Reason | None = None) -> evidence.Trial:
    """Return the facts of a trial that has not begun, or never will."""
    return evidence.Trial(
        name=plan.name, node=plan.node, world=plan.world, seed=seed, ready=False, pace="lockstep",
        ended=ended, script_error=script_error,
    )  # fmt: skip


def went_well(trial: evidence.Trial) -> bool:
    """Return whether a trial went to its end, so that another run of the same content is expected to show the same.

    What went wrong may have done so by chance, on a busy machine above all, and is tried again.
    """
    return trial.ready and not (trial.ended or trial.script_error or trial.stopped or trial.foreign or trial.dropped)
