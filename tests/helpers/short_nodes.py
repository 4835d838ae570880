"""Nodes of a few lines, and a run of a trial with one of them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from grader import building
from grader.evidence import Trial
from grader.processes import jobs
from grader.trials import catalog, observers
from grader.trials.observers import Observers
from grader.trials.plan import TrialPlan
from helpers import beside
from helpers.course import COURSE, PACKAGE

TEXTS = beside(__file__)

COMMANDS = """
commands = node.create_publisher(Twist, "cmd_vel", 10)
node.create_subscription(LaserScan, "scan", lambda m: None, 10)
node.create_timer(0.1, lambda: commands.publish(Twist()))
"""
ODOMETRY = 'node.create_subscription(Odometry, "odom", lambda m: None, 10)\n'

Run = Callable[..., Trial]


def run_trials(plans: Sequence[TrialPlan], *, folder: Path, **how: Any) -> dict[str, Trial]:
    """Return the facts of trials of the kit's course by name; `how` has the other arguments of Observers."""
    folder.mkdir(exist_ok=True)
    with Observers(COURSE, folder=folder, **how) as running:
        listed = observers.jobs(running, plans)
        results = jobs.run([job for _, job in listed]).results
        return {plan.name: results[job.name] for plan, job in listed}


def install_node(contract: building.Built, folder: Path, node: str, body: str, *, services: bool = True) -> Path:
    """Return an install tree with the contract's types, a node whose code is given, and nothing else."""
    install = folder / "install"
    shutil.copytree(contract.install, install, symlinks=True)
    executable = install / "lib" / PACKAGE / node
    executable.parent.mkdir(parents=True, exist_ok=True)
    text = TEXTS["NODE"].format(python="/usr/bin/env python3", node=node, services=services, body=body)
    executable.write_text(text)
    executable.chmod(0o755)
    return install


@pytest.fixture
def run(contract: building.Built, tmp_path: Path) -> Run:
    """Run a trial with a node whose code is given; its install tree has the contract's types and nothing else."""

    def run(trial: str, body: str, *, services: bool = True, package: Path | None = None) -> Trial:
        plan = catalog.trials(COURSE)[trial]
        install = install_node(contract, tmp_path, plan.node, body, services=services)
        found = run_trials(
            [plan], install=install, contract=contract.install, folder=tmp_path / "trials", seed=1, package=package
        )[trial]
        assert found.script_error == ""
        assert found.ready, f"{found.ended}{found.process.output_tail if found.process else ''}"
        return found

    return run
