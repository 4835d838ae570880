"""`run_node`: one of the student's nodes beside a simulated robot, in the kernel.

Each script runs in a separate process, as a kernel does: interface types, once loaded, stay in a process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from helpers import beside

from grader import KIT
from grader.host import procfs
from grader.notebook import checkpoints, run_node
from grader.notebook.workspace import VARIABLE, Workspace

TEXTS = beside(__file__)

Facts = dict[str, Any]
pytestmark = pytest.mark.ros


def play(root: Path, script: str) -> Facts:
    """Run a script as a notebook's cells; return the facts it reports, and its other output under "said"."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "AMENT", "COLCON", "PYTEST"))}
    ran = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", "-c", TEXTS["BEGIN"] + script],
        env=environment | {VARIABLE: str(root), "PYTHONPATH": str(KIT)},
        capture_output=True, text=True, check=False, timeout=240,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    facts: Facts = {"said": [line for line in ran.stdout.splitlines() if not line.startswith("FACTS ")]}
    for line in ran.stdout.splitlines():
        if line.startswith("FACTS "):
            facts |= json.loads(line.removeprefix("FACTS "))
    return facts


# -- without a working node --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Facts:
    """The facts of a run in an empty workspace."""
    return play(tmp_path_factory.mktemp("empty") / "ws", TEXTS["empty"])


def test_without_a_package_the_robot_stands_still_and_one_line_says_why(empty: Facts) -> None:
    assert next(line for line in empty["said"] if "not yet" in line) == (
        "not yet: your package is empty; "
        'notebook 01 writes it; `start_at("05")` lays out what the earlier notebooks leave'
    )
    assert empty["x"] == 0.0
    assert empty["t"] == 1.0
    assert empty["samples"] == 21
    assert empty["shown"] == "Run(robot_controller in 'open_field': not yet: your package is empty; " + (
        'notebook 01 writes it; `start_at("05")` lays out what the earlier notebooks leave)'
    )


def test_without_a_node_every_call_still_returns_an_answer(empty: Facts) -> None:
    assert empty["set_speed"] == [False, "no node offers set_speed"]
    assert empty["status"] == [False, "no node offers get_status", 0.0]
    assert empty["went"] == ["no server", False]
    assert empty["heard"] == []
    assert empty["parameter"] == [False, "there is no node"]
    assert empty["ended"] == [0.0, None, None]
    assert empty["output"] == ""


# -- the reference ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Facts:
    """The finished package's controller before a wall, with refusals, goals and Ctrl-C; and its sensor processor."""
    root = tmp_path_factory.mktemp("driven") / "ws"
    checkpoints.start_at(Workspace(root), "10")
    return play(root, TEXTS["driven"])


SLOW = pytest.mark.slow  # a package is built and driven for all of these


@SLOW
def test_a_node_drives_and_stops_before_the_wall_and_all_of_it_is_recorded(driven: Facts) -> None:
    assert driven["trouble"] == ""
    assert driven["good"][0] is True
    assert 1.3 < driven["at"] < 1.6
    assert driven["v"] == pytest.approx(0.0, abs=0.01)
    assert driven["contacts"] == 0
    assert driven["status"] == "OBSTACLE_DETECTED"
    assert driven["rate"] == pytest.approx(10.0, rel=0.2)
    assert driven["t"] == pytest.approx(8.5)
    assert (driven["columns"], driven["scans"]) == (171, 85)
    assert driven["early"] == pytest.approx(0.25), "a drive ends when its condition holds"


@SLOW
def test_a_refusal_comes_with_the_nodes_own_message(driven: Facts) -> None:
    assert driven["bad"][0] is False
    assert "0.5 m/s" in driven["bad"][1]
    assert driven["speed"] == 0.375
    assert driven["refused"][0] is False
    assert "max_linear_speed" in driven["refused"][1]
    assert driven["taken"] == [True, ""]


@SLOW
def test_a_goal_is_reached_canceled_or_left_unfinished(driven: Facts) -> None:
    """A cancel is answered before time goes on: whether it came before the next tick was chance."""
    assert driven["went"] == ["succeeded", True]
    assert driven["missed"] < 0.15
    assert driven["final"] == pytest.approx([0.6, -0.4], abs=0.2)
    assert driven["feedback"] > 10
    assert driven["first_feedback"] == pytest.approx(0.98, abs=0.15)
    assert driven["answered"] is True
    assert (driven["canceled"], driven["limit"]) == ("canceled", "unfinished")
    assert driven["clicked"] == "goal sent: (0.50, 0.50) m"


@SLOW
def test_the_kernel_hears_the_node_and_knows_the_students_modules_and_the_contracts_types(driven: Facts) -> None:
    assert driven["heard"] >= 1
    assert driven["clamped"] == 1.0
    assert "/ws/src/" in driven["own"]
    assert driven["request"] == 0.5
    assert driven["live"] == pytest.approx(0.5)
    assert driven["view"] == "Live view of 'wall_ahead'"


@SLOW
def test_the_sensor_processor_runs_with_parameters(driven: Facts) -> None:
    t, frame, count = driven["fused"]
    assert frame == "base_link"
    assert t == pytest.approx(2.0, abs=0.2)
    assert count == driven["distances"] == pytest.approx(20, abs=3)


@SLOW
def test_ctrl_c_ends_the_node_with_a_zero_command(driven: Facts) -> None:
    seconds, code, last = driven["ended"]
    assert code == 0
    assert 0.0 < seconds < 5.0
    assert last == 0.0
    assert driven["over"] == "Run(robot_controller in 'wall_ahead': closed)"
    assert "turtlebot4 is ready" in driven["output"]
    assert driven["after"] == "no node offers set_speed"


@SLOW
def test_what_is_over_leaves_no_robot_and_no_process(driven: Facts) -> None:
    """Three performances of a demonstration were three ghosts, and a warning that they share a name."""
    assert driven["beside"]
    assert not driven["left"]
    assert driven["replaced"] == "Run(robot_controller in 'open_field': closed)", "by a second run of the node"
    assert driven["abandoned"] == -9, "without references"
    assert not any(procfs.runs(driven[name]) for name in ("first", "second", "third")), "no node outlives the kernel"


# -- failures ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Facts:
    """One thing after another that goes wrong in the finished package's runs, in one kernel."""
    root = tmp_path_factory.mktemp("failing") / "ws"
    checkpoints.start_at(Workspace(root), "10")
    return play(root, TEXTS["failing"])


@SLOW
def test_a_reset_of_the_live_view_starts_the_node_anew(failing: Facts) -> None:
    assert failing["t"] == failing["speed"] == 0.0
    assert failing["second"] not in (failing["first"], None)
    assert failing["alive"], "although the thread that started it has ended"
    assert failing["after"] == pytest.approx(1.0)
    assert failing["samples"] == 21
    assert not any(procfs.runs(failing[name]) for name in ("first", "second"))


@SLOW
def test_a_run_says_once_that_its_node_is_older_than_the_package(failing: Facts) -> None:
    """A file was mended, and the run under way went on with the old one without a word."""
    assert [line for line in failing["said"] if "has changed" in line] == [
        "your package has changed since this run began, and the node is still the old one; call run_node again"
    ]


@SLOW
def test_a_node_that_ends_in_the_middle_is_reported_and_the_robot_stops(failing: Facts) -> None:
    assert failing["killed"] == pytest.approx(4.0)
    assert failing["v"] == pytest.approx(0.0, abs=1e-6)
    assert failing["ended"].startswith("the node ended at 2.00 s with exit status -9")
    assert failing["deaf"] == "no node offers set_speed"


@SLOW
def test_a_node_that_dies_of_a_question_is_reported_and_no_traceback(failing: Facts) -> None:
    """`run.status()` ended in TrialOver, and the words were "Extension modules: numpy..."."""
    assert "A value in get_robot_status (response) is not of the field's type, float" in failing["trouble"]
    assert failing["status"] == failing["trouble"]
    assert failing["went"] == "no server"


@SLOW
def test_an_action_that_sleeps_is_told_its_line_within_seconds(failing: Facts) -> None:
    """`go_to` was silent for four minutes, and then gave general advice."""
    assert failing["sleeping"] == "unfinished"
    assert "did not answer for 10 s: a callback hangs at ros2_robot_controller/navigator.py:" in failing["hangs"]
    assert "`time.sleep` in the callback `_navigate`" in failing["hangs"]


@SLOW
def test_a_launch_file_that_starts_nothing_is_reported(failing: Facts) -> None:
    assert failing["launched"].startswith("robot_controller_launch.py ended before a node came up")
    assert failing["moved"] == 0.0


@SLOW
def test_a_reliable_subscription_hears_nothing_of_the_courses_sensors(failing: Facts) -> None:
    """It did in the course, against its own lesson; on a robot it does not."""
    assert failing["fused"] == 0
    said = next(line for line in failing["said"] if "subscribed reliably" in line)
    assert said.startswith("battery/state, imu/data, raw_scan: subscribed reliably, and the sensors here publish")


@pytest.mark.parametrize("option", [{"program": "a.py"}, {"parameters": {"a": 1}}])
def test_a_launch_file_takes_nothing_that_is_a_single_nodes(option: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="of its own"):
        run_node(launch="robot_controller_launch.py", **option)


@pytest.mark.slow  # a build, a kernel and a node
def test_a_node_dies_with_a_kernel_that_is_killed(tmp_path: Path) -> None:
    root = tmp_path / "ws"
    checkpoints.start_at(Workspace(root), "10")
    script = "import signal\nreport(node=pid(run_node()))\nos.kill(os.getpid(), signal.SIGKILL)\n"
    environment = dict(os.environ) | {VARIABLE: str(root), "PYTHONPATH": str(KIT)}
    with subprocess.Popen(
        [sys.executable, "-c", TEXTS["BEGIN"] + script], env=environment, stdout=subprocess.PIPE, text=True
    ) as kernel:
        out, _ = kernel.communicate(timeout=240)
    node = json.loads(next(line for line in out.splitlines() if line.startswith("FACTS "))[6:])["node"]
    assert node
    assert not procfs.runs(node)
