"""What the notebooks use: `begin`, `start_at`, `check`, `run_node`. Thin; the work is done in grader.course."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from grader.notebook import cell_hooks, checkpoints, feedback
from grader.notebook.feedback import Checked
from grader.notebook.workspace import find, open_workspace

if TYPE_CHECKING:
    from grader.notebook.session import Run
    from sim import World

__all__ = ["begin", "check", "run_node", "start_at"]


def begin(notebook: str) -> None:
    """Open the workspace for a notebook ("05") and say what is in it.

    Makes `ws/src/ros2_robot_controller` beside the notebooks where it is missing, changes into it, and sets the
    environment so that `!ros2`, `!colcon build` and `!python3` work in cells. A `%%writefile` that meets a file which
    was edited elsewhere then keeps a copy of it first. Can be run again at any time.

    Raises:
        ValueError: the course has no such notebook.
    """
    key = checkpoints.number(notebook)
    workspace = open_workspace(key)
    cell_hooks.watch(workspace)
    print(feedback.welcome(key, workspace))


def check(*requirements: str) -> Checked:
    """Try the named requirements ("F4") on your package, as the grader does, and say what was seen.

    Raises:
        ValueError: there is no requirement of that name.
    """
    from grader.notebook import checking  # takes a second to import; a notebook that only begins should not wait

    return checking.check(find(), requirements)


def run_node(
    node: str = "robot_controller",
    world: str | World = "open_field",
    *,
    seed: int = 0,
    parameters: Mapping[str, object] | None = None,
    remappings: Mapping[str, str] | None = None,
    profile: str = "course",
) -> Run:
    """Build your package, start one of its nodes beside a simulated robot, and return the run.

    Simulated time stands still until `run.drive(...)`, `run.go_to(...)` or a live view lets it pass. A second call for
    the same node ends the first run. Without a node that works the robot stands, and one line says why.

    Args:
        node: the executable, "robot_controller" or "sensor_processor".
        world: a world's name (`sim.world_names()`) or a World.
        seed: of the sensors' noise.
        parameters: the node's parameters, by name.
        remappings: other names for its topics and services.
        profile: the robot, "course" or "tb4".
    """
    from grader.notebook import session  # takes a second to import; a notebook that only begins should not wait

    return session.start(
        find(), node, world, seed=seed, parameters=parameters or {}, remappings=remappings or {}, profile=profile
    )


def start_at(notebook: str) -> None:
    """Lay out the package as the notebooks before `notebook` ("05") leave it; what is there goes into a backup."""
    print(checkpoints.start_at(find(), notebook))
