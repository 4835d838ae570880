"""A goal ends in the tick in which the node ends it, however slowly node and observer get on with it."""

from __future__ import annotations

import pytest
from helpers.short_nodes import ODOMETRY, Run

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

ROLLS_ON = """
from rclpy.action import CancelResponse
from rclpy.task import Future

send = ActionServer._send_result_response
def send_late(*arguments):
    time.sleep(0.1)
    send(*arguments)
ActionServer._send_result_response = send_late

commands = node.create_publisher(Twist, "cmd_vel", 10)
goals = []
async def drive(handle):
    canceled = Future()
    goals.append((handle, canceled))
    await canceled
    handle.canceled()
    return NavigateToPosition.Result()

def control():
    twist = Twist()
    twist.linear.x = 0.1  # never zero, after which the observer gives the node more rounds
    for handle, canceled in goals:
        if handle.is_cancel_requested and not canceled.done():
            canceled.set_result(True)
            twist.angular.z = 0.1
    commands.publish(twist)

node.create_subscription(LaserScan, "scan", lambda m: None, 10)
node.create_timer(0.1, control)
ActionServer(node, NavigateToPosition, "navigate_to_position", drive, cancel_callback=lambda _: CancelResponse.ACCEPT)
"""


@pytest.mark.slow  # one more trial
def test_a_result_that_the_node_is_long_in_sending_counts_for_the_tick_of_its_timer(run: Run):
    """The node sleeps between the round of its executor that ends the goal and the message that tells us."""
    found = run("cancel_early", ODOMETRY + ROLLS_ON)
    (goal,) = found.goals
    (ending,) = [command.t for command in found.commands if command.omega]
    assert (goal.status, goal.ended_t) == ("canceled", ending)
    assert goal.cancel_t < ending
