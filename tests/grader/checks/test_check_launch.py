"""I5: what is said of a launch file whose nodes do not come up."""

from __future__ import annotations

from helpers.judging import Judged, ask, evidence_with, find, trial

from grader.evidence import Graph, Kind, ProcessEnd, Reason

CHECK = find("check_launch::test_the_launch_files_start_the_nodes")
NOT_UP = Reason(Kind.NOT_UP, "robot_controller", launch="robot_controller_launch.py", nodes=("controller",))


def judged(ended: Reason, output: str, *nodes: str, by: str = "us") -> Judged:
    end = ProcessEnd(by, None if by == "us" else 1, 1.0, output)
    launched = trial(
        "launch_robot_controller", ready=False, ended=ended, graph=Graph(nodes=list(nodes)),
        launch="robot_controller_launch.py", process=end,
    )  # fmt: skip
    return ask(CHECK, evidence_with(trials={launched.name: launched}))


def test_a_node_under_another_name_is_asked_for_its_name():
    said = judged(NOT_UP, "", "controller")
    assert "; is `controller` its name? name= in the launch file, the key in the YAML file and" in said.seen


def test_a_launch_file_that_raises_is_named():
    output = "[ERROR] [launch]: Caught exception in launch: ModuleNotFoundError: No module named 'nav2'\n"
    said = judged(Reason(Kind.DIED_EARLY, launch="robot_controller_launch.py", exit_code=1), output, by="itself")
    assert said.seen == (
        "robot_controller_launch.py ended before a node came up, with exit status 1; `ros2 launch` said: "
        "[ERROR] [launch]: Caught exception in launch: ModuleNotFoundError: No module named 'nav2'"
    )
