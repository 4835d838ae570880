"""Trials of the package's launch files, which are run and not read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.contract.spec import NODES
from grader.trials.catalog import trial
from grader.trials.plan import OWN_LAUNCH

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def _get_parameters(stage: Stage, nodes: tuple[str, ...]) -> None:
    """Ask each node for use_sim_time and for the parameters that were changed in the package's files."""
    for node in nodes:
        stage.get_parameter("use_sim_time", node)
        for name in stage.choices:
            stage.get_parameter(name, node)


@trial(serves=["I5"], launch="robot_controller_launch.py", awaits=NODES)
def launch_both(stage: Stage) -> None:
    """Run robot_controller_launch.py with changed parameter files."""
    _get_parameters(stage, NODES)


@trial(serves=["I5"], node="sensor_processor", launch="sensor_processor_launch.py", awaits=("sensor_processor",))
def launch_processor(stage: Stage) -> None:
    """Run sensor_processor_launch.py with changed parameter files."""
    _get_parameters(stage, ("sensor_processor",))
    stage.refresh_graph()  # a second node, which should not run, may come up later


@trial(serves=["I5"], launch="robot_controller_launch.py", use_sim_time=False, awaits=NODES)
def launch_by_wall(stage: Stage) -> None:
    """Run robot_controller_launch.py without simulated time, as on a real robot."""
    for node in NODES:
        stage.get_parameter("use_sim_time", node)


@trial(serves=["I5"], launch=OWN_LAUNCH, awaits=NODES)
def launch_remapped(stage: Stage) -> None:
    """Run the grader's own launch file, which remaps topics of both nodes."""
    stage.record_graph_of("sensor_processor")
