"""I8: whose traceback it is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find, with_trials

CHECK = find("check_interrupt::test_ctrl_c_ends_each_node_cleanly")
ALREADY = "rclpy._rclpy_pybind11.RCLError: failed to shutdown: rcl_shutdown already called on the given context\n"
BEGIN = "Traceback (most recent call last):\n  File 'sensor_processor.py', line 97, in main\n"


def judged(output: str, exit_code: int = 0) -> Judged:
    """Return the verdict on the reference's evidence with another output of the sensor processor."""
    evidence = recordings.load("reference")
    trial = evidence.trials["interrupted_sensor_processor"]
    assert trial.process is not None
    changed = replace(trial, process=replace(trial.process, output_tail=output, exit_code=exit_code))
    return ask(CHECK, with_trials(evidence, changed))


def test_a_race_inside_rclpys_try_shutdown_costs_nothing():
    """Seen once, in a correct node with many threads."""
    assert (
        judged(f"{BEGIN}    rclpy.try_shutdown()\n  File 'context.py', line 139, in try_shutdown\n{ALREADY}").share == 1
    )


@pytest.mark.parametrize(
    "output",
    [
        f"{BEGIN}    rclpy.shutdown()\n  File 'utilities.py', line 80, in shutdown\n{ALREADY}",
        f"{BEGIN}    self.x\nAttributeError: no x\n{BEGIN}  File 'context.py', line 139, in try_shutdown\n{ALREADY}",
        f"{BEGIN}    executor.spin()\nKeyboardInterrupt\n",
    ],
    ids=["shutdown", "an error of the node before", "not caught"],
)
def test_a_traceback_of_the_nodes_own_costs_the_point(output: str):
    assert judged(output).share == 0


def test_the_line_that_raised_is_named_though_a_log_line_follows_the_traceback():
    """A goal's thread that answered too late was said to end with rclpy's warning, and to need try_shutdown."""
    late = "rclpy._rclpy_pybind11.RCLError: Failed get goal status array: feedback publisher is invalid"
    place = '  File "/ws/install/lib/ros2_robot_controller/navigator.py", line 52, in execute\n'
    said = judged(f"{BEGIN}{place}    handle.succeed()\n{late}\n[WARN] [17.2] [a.action_server]: the client has gone\n")
    assert f"ending '{late} (ros2_robot_controller/navigator.py:52, in `execute`)'" in said.seen
    assert said.try_.startswith("once rclpy is shut down, nothing can be published or answered")


COLLECTED = """Exception ignored in: <function Executor.__del__ at 0x7f12>
Traceback (most recent call last):
  File "/usr/lib/python3/dist-packages/rclpy/executors.py", line 263, in __del__
    self._sigint_gc.destroy()
rclpy._rclpy_pybind11.InvalidHandle: cannot use Destroyable because destruction was requested
"""


def test_what_garbage_collection_complains_of_is_named_and_costs_nothing():
    """The course's own hint printed it, and lost the point."""
    said = judged(COLLECTED)
    assert said.share == 1
    assert said.seen == (
        "sensor_processor ends well, and no point is lost; Python's garbage collection complains afterwards: Exception "
        "ignored in: <function Executor.__del__ at 0x7f12> ... rclpy._rclpy_pybind11.InvalidHandle: cannot use "
        "Destroyable because destruction was requested"
    )
    assert said.try_ == "call executor.shutdown() before rclpy shuts down"


@pytest.mark.parametrize(("output", "exit_code"), [(COLLECTED, 1), (f"{COLLECTED}{BEGIN}ValueError: no\n", 0)])
def test_it_excuses_no_other_traceback(output: str, exit_code: int):
    assert judged(output, exit_code).share == 0


def test_a_robot_that_never_moves_has_not_been_stopped():
    """The untouched stub of notebook 05 had the point: its last command was zero, like all others."""
    evidence = recordings.load("reference")
    still = {
        name: replace(trial, commands=[replace(command, v=0.0, omega=0.0) for command in trial.commands])
        for name, trial in evidence.trials.items()
    }
    said = ask(CHECK, replace(evidence, trials=still))
    assert (said.share, said.reached) == (0, False)
    assert said.seen.startswith("not tried yet: the robot stood still whenever Ctrl-C came")
