"""From the first signal handler to the last word, with a node that does nothing else."""

import signal

import pytest
import rclpy
from rclpy.node import Node
from ros2_robot_controller.utils.running import run


class Silent(Node):
    """A node that has nothing to say at the end."""

    def __init__(self):
        super().__init__('silent')
        self.destroyed = False

    def destroy_node(self):
        """Note it."""
        self.destroyed = True
        super().destroy_node()


class Polite(Silent):
    """A node that says a last word."""

    def __init__(self):
        super().__init__()
        self.could_still_speak = []

    def stop(self):
        """Note whether a message would get out."""
        self.could_still_speak.append(rclpy.ok() and not self.destroyed)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_node_is_stopped_once_while_it_can_still_speak(interrupt, number):
    nodes = []
    interrupt(number)
    assert run(lambda: nodes.append(Polite()) or nodes[0]) == 0
    assert nodes[0].could_still_speak == [True]
    assert nodes[0].destroyed
    assert not rclpy.ok()


def test_a_node_without_a_last_word_ends_too(interrupt):
    interrupt(signal.SIGINT)
    assert run(Silent) == 0
    assert not rclpy.ok()
