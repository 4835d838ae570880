"""The functions that the notebooks import: `begin`, `start_at`, `check`, `run_node`, `tries`, `mine`, `bench`, ..."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from grader.course import passed_over
from grader.notebook import cell_hooks, checkpoints, feedback, lanes, last_hint, standing
from grader.notebook.bench import bench, mine
from grader.notebook.feedback import Checked
from grader.notebook.matrix import mutant, mutant_matrix
from grader.notebook.tables import tries
from grader.notebook.workspace import Workspace, course, find, open_workspace
from grader.words import say

if TYPE_CHECKING:
    from grader.notebook.hunting import Hunt
    from grader.notebook.session import Run
    from grader.notebook.standing import Standing
    from sim import World

__path__ += [str(course().folder / "lessons")]
"""A module in the course's folder `lessons` is imported as `grader.notebook.NAME`."""

__all__ = [
    "begin", "bench", "check", "hunt", "mine", "mutant", "mutant_matrix", "progress", "run_node", "start_at", "tries",
]  # fmt: skip


def begin(notebook: str, lane: str = "") -> None:
    """Open the workspace for a notebook ("05") and print what it holds.

    The first time it asks which of the course's lanes to take; `lane` says so, and may be another one at any time. In
    a shorter lane the course writes the files and functions that its notebooks leave out.

    Creates `ws/src/ros2_robot_controller` beside the notebooks if it is missing, changes into it, and sets up the
    environment for `!ros2`, `!colcon build` and `!python3` in cells. From then on, `%%writefile` backs up a file that
    was edited elsewhere before it overwrites it. Can be called again at any time.

    Raises:
        ValueError: the course has no such notebook, or no such lane.
    """
    if note := passed_over():
        print(note)
    key = checkpoints.number(notebook)
    workspace = open_workspace(key)
    cell_hooks.install(workspace)
    _in_lane(workspace, key, lane)
    print(feedback.welcome(key, workspace))


def check(*requirements: str) -> Checked:
    """Check your package against the named requirements ("F4"), as the grader does, and show the findings.

    What has not changed since an earlier check is not run again; the answer says so.

    Raises:
        ValueError: there is no such requirement.
    """
    from grader.notebook import checking  # takes a second to import, and `begin` should answer at once

    answer = checking.check(find(), requirements)
    last_hint.tried(answer.passed)
    return answer


def hunt(*requirements: str, cases: int = 100, seed: int = 0, of: str = "") -> Hunt:
    """Make up `cases` situations in which your package has to keep its promises ("F4"), and show one that it breaks.

    It is made as small as possible, and kept in ws/hunt; `!grader hunt --again FILE` runs it again. The same seed tries
    the same situations. With `of` ("H1") a prepared package is hunted in instead, which is laid out in ws/hunt.

    Raises:
        GraderError: this kit holds no such prepared package.
    """
    from grader.notebook import hunting  # takes a second to import, and `begin` should answer at once

    workspace = find()
    return hunting.hunt(workspace, requirements, cases, seed, hunting.prepared(workspace, of) if of else None)


def progress() -> Standing:
    """Return where you stand: each notebook's requirements as your last checks found them, the minutes, what is next.

    A check or a build is not run for it. The minutes are those between cells, without pauses of more than ten minutes.
    """
    return standing.of(find())


def run_node(
    node: str = "",
    world: str | World = "open_field",
    *,
    program: str = "",
    launch: str = "",
    parameters: Mapping[str, object] | None = None,
) -> Run:
    """Build your package, start one of its nodes beside a simulated robot, and return the run.

    Simulated time passes only in `run.drive(...)`, `run.go_to(...)` or a live view. A second call for the same node
    closes the first run. If the node does not work, the robot stands still, and one line says why.

    Args:
        node: the executable, by default the first of the contract's nodes.
        program: a Python file that makes this node, to be run in place of the executable.
        launch: a launch file of your package that starts this node and others, to be run in place of the executable;
            its arguments may follow it. Parameters are then its own.
        world: a world's name (`sim.world_names()`) or a World.
        parameters: the node's parameters, by name.

    Raises:
        ValueError: a launch file is given, and beside it what only a node by itself can take.
    """
    if launch and (program or parameters):
        raise ValueError(say("a launch file has parameters of its own"))
    from grader.notebook import session  # takes a second to import, and `begin` should answer at once

    return session.start(
        find(),
        node or next(iter(course().nodes)),
        world,
        program=program,
        launch=launch,
        parameters=parameters,
    )


def start_at(notebook: str, lane: str = "") -> None:
    """Lay out the package as the notebooks before `notebook` ("05") leave it; back up its content first.

    Raises:
        ValueError: the course has no such notebook, or no such lane.
    """
    workspace = find()
    print(checkpoints.start_at(workspace, notebook))
    _in_lane(workspace, checkpoints.number(notebook), lane)


def _in_lane(workspace: Workspace, notebook: str, lane: str) -> None:
    """Keep the lane, ask for it if need be, and write and say what it gives in this notebook."""
    for line in (lanes.choose(workspace, notebook, lane), lanes.lay_out(workspace, notebook)):
        if line:
            print(line)
