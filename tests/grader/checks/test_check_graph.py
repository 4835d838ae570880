"""I4 and I5: names that a namespace does not reach."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers import recordings
from helpers.judging import Judged, ask, find, with_trials

from grader.evidence import Evidence, Finding, Kind, Reason

CONTROLLER = find("check_graph::test_controller_shows_the_contracts_interfaces")
PROCESSOR = find("check_graph::test_processor_shows_the_contracts_interfaces")
REMAPPED = find("check_launch::test_a_remapping_in_a_launch_file_works")


def with_absolute(*names: str) -> Evidence:
    """Return the reference's evidence as if these names had a slash in front, so that a namespace changes nothing."""
    evidence = recordings.load("reference")
    trial = evidence.trials["launch_remapped"]
    graphs = {}
    for which in ("graph", "other_graph"):
        graph = getattr(trial, which)
        ends = [end for end in graph.endpoints if not end.topic.endswith(tuple(names))]
        there = [replace(end, topic=name) for name in names for end in graph.endpoints if end.topic.endswith(name)]
        services = {n.removeprefix("robot7/") if n.endswith(names) else n: kind for n, kind in graph.services.items()}
        graphs[which] = replace(graph, endpoints=ends + there, services=services)
    return with_trials(evidence, replace(trial, **graphs))


def test_the_reference_moves_with_its_namespace() -> None:
    evidence = recordings.load("reference")
    assert ask(CONTROLLER, evidence) == ask(PROCESSOR, evidence) == ask(REMAPPED, evidence) == Judged(1.0, "")


@pytest.mark.parametrize(
    ("check", "names", "share"),
    [
        (CONTROLLER, ("cmd_vel", "scan"), 4 / 6),
        (CONTROLLER, ("odom", "set_speed"), 4 / 6),
        (PROCESSOR, ("imu/data",), 4 / 5),
    ],
)
def test_each_absolute_name_costs_its_share_of_i4(check, names: tuple[str, ...], share: float) -> None:
    """`/cmd_vel` cost nothing: in the root namespace it is the same topic as `cmd_vel`."""
    said = ask(check, with_absolute(*names))
    assert said.share == pytest.approx(share)
    for name in names:
        assert f"in the namespace /robot7 there is still /{name}: it is an absolute name" in said.seen


OUTPUT = """Traceback (most recent call last):
  File "/ws/install/lib/python3.11/site-packages/ros2_robot_controller/utils/running.py", line 20, in run
    rclpy.spin(make_node())
  File "/opt/site-packages/rclpy/executors.py", line 111, in await_or_execute
    return callback(*args)
TypeError: 'NoneType' object is not callable
"""


def test_a_node_that_ended_at_once_is_said_to_have_ended_and_by_which_line() -> None:
    """`create_timer(period, self._fuse())`: five lessons on names, and the line of a given file."""
    evidence = recordings.load("reference")
    trial = evidence.trials["idle_sensor_processor"]
    died = replace(
        trial, ended=Reason(Kind.DIED, seconds=0.05, exit_code=1), graph=replace(trial.graph, endpoints=[]),
        process=replace(trial.process, by="itself", output_tail=OUTPUT),
    )  # fmt: skip
    text = "`create_timer` gets what `self._fuse()` returns, None: write `self._fuse`"
    habits = [Finding("ros2_robot_controller/sensor_processor.py", 105, "called-at-once", text)]
    evidence = replace(evidence, quality=replace(evidence.quality, habits=habits))
    said = ask(PROCESSOR, with_trials(evidence, died))
    assert not said.reached
    assert said.seen == (
        f"the node ended at 0.05 s with exit status 1: ros2_robot_controller/sensor_processor.py:105 {text}"
    )


def test_an_absolute_name_is_not_remapped_in_a_namespace() -> None:
    said = ask(REMAPPED, with_absolute("cmd_vel"))
    assert said.share == 0
    assert said.seen == "in the namespace /robot7, with cmd_vel remapped to base/cmd_vel, the node still has /cmd_vel"
