"""Build the student's package for a session: the install tree of a node, its command line and its environment."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path

from grader import KIT, building
from grader.errors import SubmissionError
from grader.host import ros_env
from grader.notebook import prerequisites
from grader.notebook.workspace import NOTEBOOK, Workspace, course, discovery_range
from grader.words import say


def install(workspace: Workspace, node: str) -> Path:
    """Build the package if it has changed, and return its install tree, which holds the node.

    Raises:
        SubmissionError: the package lacks something, does not build, or does not install the node.
        GraderError: this host cannot build.
    """
    modules = [course().nodes[node].module] if node in course().nodes else []
    gap = prerequisites.first_missing(workspace.package, (*course().builds, *modules), os.environ.get(NOTEBOOK, ""))
    if gap is not None:
        raise SubmissionError(f"{gap.seen}; {gap.try_}")
    if workspace.is_linked:
        return workspace.install
    built = building.build([workspace.package], building.cache_folder(), course())
    if not built.facts.ok:
        raise SubmissionError(
            say("the package does not build: {first_error}", first_error=prerequisites.first_error(built.facts))
        )
    if node not in built.facts.executables:
        raise SubmissionError(
            say("the package installs no executable {node} in lib/{package}", node=node, package=course().package)
        )
    return built.install


def command(
    installed: Path,
    node: str,
    program: str,
    launch: str,
    parameters: Mapping[str, object],
    remappings: Mapping[str, str],
) -> list[str]:
    """Return the command line of a node, as `ros2 run` would start it, of a Python file, or of a launch file."""
    if launch:
        ros2 = str(KIT / "grader" / "ros2")
        return [sys.executable, ros2, "launch", course().package, *launch.split(), "use_sim_time:=true"]
    start = (
        [sys.executable, str(Path(program).resolve())]
        if program
        else [str(installed / "lib" / course().package / node)]
    )
    words = [*start, "--ros-args", "-p", "use_sim_time:=true"]
    for name, value in parameters.items():
        words += ["-p", f"{name}:={str(value).lower() if isinstance(value, bool) else value}"]
    for name, new in remappings.items():
        words += ["-r", f"{name}:={new}"]
    return words


def environment(installed: Path, workspace: Workspace) -> dict[str, str]:
    """Return the environment of a node: its install tree, and the workspace's DDS domain."""
    return ros_env.environment(installed, home=Path.home()) | {
        "ROS_DOMAIN_ID": str(workspace.domain_id),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": discovery_range(),
        "ROS_LOG_DIR": str(workspace.root / "log" / "ros"),
        "PYTHONFAULTHANDLER": "1",  # a node that hangs can tell where
    }
