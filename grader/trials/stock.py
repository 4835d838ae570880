"""The trials that a course gets for its contract alone: `idle_NODE` for each node, `launch_FILE` for each launch file.

A trial of the course's own that has such a name takes its place. What they show is judged by checks in grader/checks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from grader.course import Course, launch_stem
from grader.trials.plan import TrialPlan

if TYPE_CHECKING:
    from grader.trials.stage import Stage


def plans(course: Course) -> Iterator[TrialPlan]:
    """Yield the trials that every course with this contract gets."""
    for node in course.nodes.values():
        yield _plan(idle, node.name)
        yield _plan(standing_clock, node.name, mostly_waits=True)
        yield _plan(interrupted, node.name, mostly_waits=True, follows=f"{idle.__name__}_{node.name}")
        if node.config:
            yield _plan(file, node.name, params_file=PurePosixPath(node.config).name)
        if node.refused:
            yield _plan(senseless_settings, node.name)
            yield _plan(senseless_start, node.name, parameters=node.refused_at_start)
    for number, (path, nodes) in enumerate(course.launch.items()):
        options: dict[str, Any] = {"launch": PurePosixPath(path).name, "awaits": nodes, "about": launch_stem(path)}
        yield _plan(launch, nodes[0], mostly_waits=len(nodes) < len(course.nodes), **options)
        yield _plan(launch_plain, nodes[0], use_sim_time=None, **options)
        if not number:  # the others differ in what they start
            yield _plan(launch_by_wall, nodes[0], use_sim_time=False, **options)


def _plan(script: Callable[[Stage], None], node: str, *, about: str = "", **options: Any) -> TrialPlan:
    kind = script.__name__
    return TrialPlan(f"{kind}_{about or node}", script.__doc__ or "", script, node, kind=kind, **options)


def idle(stage: Stage) -> None:
    """Run the node while nothing is asked of it."""
    stage.run(1.0)
    stage.record_graph(*stage.contract.subscribes, *stage.contract.publishes)


def standing_clock(stage: Stage) -> None:
    """Stop the clock for a while as the node runs."""
    stage.run(2.0)
    stage.measured["held"] = stage.freeze_clock(1.0)
    stage.run(1.0)


def interrupted(stage: Stage) -> None:
    """Press Ctrl-C while nothing is asked of the node."""
    stage.run(0.5)
    stage.interrupt()


def file(stage: Stage) -> None:
    """Start the node with its parameter file, in which some values were changed."""
    for name in stage.contract.parameters:
        stage.get_parameter(name)


def senseless_settings(stage: Stage) -> None:
    """Set parameters of the running node to invalid values, then one to a valid value."""
    stage.run(0.3)
    for name, value in stage.contract.refused:
        stage.set_parameter(name, value)
    name, value = next(iter(stage.contract.telltales.items()))
    stage.set_parameter(name, value)
    stage.run(1.0)


def senseless_start(stage: Stage) -> None:
    """Start the node with an invalid value."""
    for name in stage.plan.parameters:
        stage.get_parameter(name)


def launch(stage: Stage) -> None:
    """Run a launch file with changed parameter files."""
    for node in stage.plan.awaits:
        stage.get_parameter("use_sim_time", node)
        for name in stage.recorded.in_files:
            stage.get_parameter(name, node)
    stage.list_launch_arguments()
    if len(stage.plan.awaits) < len(stage.course.nodes):
        stage.refresh_graph()  # a node that should not run may come up later


def launch_by_wall(stage: Stage) -> None:
    """Run a launch file without simulated time, as on a real robot."""
    for node in stage.plan.awaits:
        stage.get_parameter("use_sim_time", node)


def launch_plain(_stage: Stage) -> None:
    """Run a launch file without any argument."""
