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

from grader import KIT
from grader.notebook import checkpoints, run_node
from grader.notebook.workspace import VARIABLE, Workspace

ROOT = KIT
BEGIN = """
import json, os, sys
sys.path.insert(0, "")
from grader.notebook import begin, check, run_node, start_at
def report(**facts): print("FACTS " + json.dumps(facts), flush=True)
def pid(run): return run._process._popen.pid if run._process else None
begin("05")
"""

Facts = dict[str, Any]
pytestmark = pytest.mark.ros


def play(root: Path, script: str) -> Facts:
    """Run a script as a notebook's cells; return the facts it reports, and its other output under "said"."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("ROS_", "AMENT", "COLCON", "PYTEST"))}
    ran = subprocess.run(
        [sys.executable, "-W", "error::RuntimeWarning", "-c", BEGIN + script],
        env=environment | {VARIABLE: str(root), "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, check=False, timeout=240,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    facts: Facts = {"said": [line for line in ran.stdout.splitlines() if not line.startswith("FACTS ")]}
    for line in ran.stdout.splitlines():
        if line.startswith("FACTS "):
            facts |= json.loads(line.removeprefix("FACTS "))
    return facts


def is_gone(pid: int) -> bool:
    """Return whether no process of that number is left, or only a zombie."""
    status = Path(f"/proc/{pid}/stat")
    try:
        return status.read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


# -- without a working node --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Facts:
    """The facts of a run in an empty workspace."""
    return play(
        tmp_path_factory.mktemp("empty") / "ws",
        """
run = run_node()
recording = run.drive(1.0)
went = run.go_to(1.0, 0.0)
status = run.status()
ended = run.interrupt()
report(trouble=run.trouble, shown=repr(run), x=run.simulator.pose.x, t=run.t, samples=len(recording),
     set_speed=[run.set_speed(0.2).success, run.set_speed(0.2).message],
     status=[status.obstacle_detected, status.status, status.pose.position.x], went=[went.status, went.success],
     heard=run.messages("cmd_vel"), parameter=run.set_parameter("speed", 1.0),
     ended=[ended.seconds, ended.exit_code, ended.last_command], output=run.output)
""",
    )


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
    return play(
        root,
        """
import gc, time
PACKAGE = "ros2_robot_controller"
run = run_node("robot_controller", "wall_ahead")
report(trouble=run.trouble, first=pid(run))
run.drive(0.5)
good, bad = run.set_speed(0.375), run.set_speed(7.0)
report(good=[good.success, good.message], bad=[bad.success, bad.message], speed=run.status().speed)
recording = run.drive(8.0)
report(at=recording.x[-1], v=recording.v[-1], contacts=len(recording.contacts), status=run.status().status,
     t=run.t, scans=len(recording.scan_t), columns=len(recording), zero=run.messages("cmd_vel")[0][1].linear.x,
     rate=len(run.messages("cmd_vel")) / run.t)
until = run.t
run.drive(5.0, until=lambda: run.t > until + 0.2)
report(early=run.t - until)
went = run.go_to(0.6, -0.4, tolerance=0.15)
pose = run.simulator.pose
report(went=[went.status, went.success], missed=((pose.x - 0.6) ** 2 + (pose.y + 0.4) ** 2) ** 0.5,
     final=[went.place.position.x, went.place.position.y], feedback=len(went.feedback),
     first_feedback=went.feedback[0][1])
goal = run._active_stage().navigate(-3.0, 0.0)
goal.cancel()
report(answered=goal.facts().cancel_accepted)
run.drive(0.2)
report(canceled=run.go_to(-3.0, 0.0, cancel_after=1.0).status, limit=run.go_to(-3.0, 0.0, limit=0.5).status)
report(refused=run.set_parameter("max_linear_speed", -1.0), taken=run.set_parameter("max_linear_speed", 0.25))
report(clicked=run._click(0.5, 0.5))

# The rest of the kernel works as usual: plain rclpy, the student's modules, the contract's types.
import rclpy
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node("from_a_cell")
heard = []
node.create_subscription(Twist, "cmd_vel", heard.append, 10)
for _ in range(100):
    run.drive(0.1)
    rclpy.spin_once(node, timeout_sec=0.05)
    if heard:
        break
def sees_robot(wanted):
    deadline = time.monotonic() + 60.0
    while wanted != ("simulated_robot" in node.get_node_names()) and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)
    return "simulated_robot" in node.get_node_names()
report(beside=sees_robot(True))
gc.disable()  # what a closed run leaves is gone at once, not when the garbage is collected
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.srv import SetSpeed
report(heard=len(heard), clamped=clamp(5.0, 0.0, 1.0), own=sys.modules[f"{PACKAGE}.utils"].__file__,
     request=SetSpeed.Request(speed=0.5).speed)

ended = run.interrupt()
report(ended=[ended.seconds, ended.exit_code, ended.last_command.linear.x], over=repr(run), output=run.output,
     after=run.set_speed(0.1).message)
run.close()
with run_node():
    pass
report(left=sees_robot(False))
gc.enable()
node.destroy_node()
rclpy.shutdown()

with run_node("sensor_processor", parameters={"fusion_frequency": 10.0}) as sensors:
    sensors.drive(2.0)
    t, fused = sensors.messages("sensor_fusion_data")[-1]
    report(fused=[t, fused.header.frame_id, len(sensors.messages("sensor_fusion_data"))], second=pid(sensors),
         distances=len(sensors.messages("obstacle_distance")))
run = run_node()
other = run_node(world="wall_ahead")
report(replaced=repr(run), third=pid(other))
live = other.live(rate=float("inf"))
live.run(0.5)
report(live=other.t, view=repr(live))
live.stop()
abandoned = other._process
del other, live, run
gc.collect()
report(abandoned=abandoned.exit_code())
""",
    )


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
    assert all(is_gone(driven[name]) for name in ("first", "second", "third")), "no node outlives the kernel"


# -- failures ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def failing(tmp_path_factory: pytest.TempPathFactory) -> Facts:
    """One thing after another that goes wrong in the finished package's runs, in one kernel."""
    root = tmp_path_factory.mktemp("failing") / "ws"
    checkpoints.start_at(Workspace(root), "10")
    return play(
        root,
        """
import signal
from pathlib import Path
def change(module, *changes):
    path = Path("ros2_robot_controller", module)
    text = path.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)

run = run_node()
live = run.live(rate=float("inf"))
run.set_speed(0.25)
live.run(1.0)
first = pid(run)
live.reset()
report(first=first, t=run.t, second=pid(run), speed=run.status().speed)
live.stop()
run.set_speed(0.2)
run.drive(1.0)
report(alive=run.trouble == "", after=run.t, samples=len(run.recording))
change("driver.py", ("import math\\n", "import math  # changed\\n"))
run.drive(0.1)
run.drive(0.9)
os.kill(pid(run), signal.SIGKILL)
run._process._popen.wait()
run.drive(2.0)
report(killed=run.t, v=run.simulator.twist.v, ended=run.trouble, deaf=run.set_speed(0.1).message)

change("navigator.py", ("self._speed = 0.0", "self._speed = 0"))
run = run_node()
run.go_to(0.1, 0.0)
report(status=run.status().status, trouble=run.trouble, went=run.go_to(1.0, 0.0).status)

loop = "while not goal.ending.done():\\n            time.sleep(0.1); self._control()\\n        ending = None"
change("navigator.py", ("import Enum\\n", "import Enum\\nimport time\\n"), ("ending = await goal.ending", loop))
run = run_node()
report(sleeping=run.go_to(1.0, 0.0).status, hangs=run.trouble)

Path("launch/robot_controller_launch.py").write_text(
    "from launch import LaunchDescription\\n"
    "def generate_launch_description():\\n    return LaunchDescription([])\\n"
)
run = run_node(launch="robot_controller_launch.py")
report(launched=run.trouble, moved=run.drive(1.0).x[-1])

change("sensor_processor.py", ("qos_profile_sensor_data)", "10)"))
run = run_node("sensor_processor")
run.drive(1.0)
report(fused=len(run.messages("sensor_fusion_data")))
""",
    )


@SLOW
def test_a_reset_of_the_live_view_starts_the_node_anew(failing: Facts) -> None:
    assert failing["t"] == failing["speed"] == 0.0
    assert failing["second"] not in (failing["first"], None)
    assert failing["alive"], "although the thread that started it has ended"
    assert failing["after"] == pytest.approx(1.0)
    assert failing["samples"] == 21
    assert is_gone(failing["first"])
    assert is_gone(failing["second"])


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
    environment = dict(os.environ) | {VARIABLE: str(root), "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", BEGIN + script], env=environment, stdout=subprocess.PIPE, text=True
    ) as kernel:
        out, _ = kernel.communicate(timeout=240)
    node = json.loads(next(line for line in out.splitlines() if line.startswith("FACTS "))[6:])["node"]
    assert node
    assert is_gone(node)
