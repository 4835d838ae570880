"""I4: what the running graph shows of each node."""

from grader.checks.check_graph import expect_interfaces
from grader.checks.judge import Judge


def test_controller_shows_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows `robot_controller` with the contract's topics, types, services and action."""
    expect_interfaces(judge, [judge.course.nodes["robot_controller"]])


def test_processor_shows_the_contracts_interfaces(judge: Judge) -> None:
    """The running graph shows `sensor_processor` with the contract's topics and types."""
    expect_interfaces(judge, [judge.course.nodes["sensor_processor"]])
