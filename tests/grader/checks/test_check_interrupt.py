"""I8: whose traceback it is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find

CHECK = find("check_interrupt::test_ctrl_c_ends_each_node_cleanly")
ALREADY = "rclpy._rclpy_pybind11.RCLError: failed to shutdown: rcl_shutdown already called on the given context\n"
BEGIN = "Traceback (most recent call last):\n  File 'sensor_processor.py', line 97, in main\n"


def judged(output: str) -> Judged:
    """Return the verdict on the reference's evidence with another output of the sensor processor."""
    evidence = recordings.load("reference")
    trial = evidence.trials["interrupted_processor"]
    assert trial.process is not None
    changed = replace(trial, process=replace(trial.process, output_tail=output))
    return ask(CHECK, replace(evidence, trials={**evidence.trials, trial.name: changed}))


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
