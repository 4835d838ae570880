"""Run a node from the first signal handler to the last message. Knows no particular node."""

from collections.abc import Callable
import signal
from threading import Event
from typing import Optional

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

WAKE_UP_S = 0.1  # wall time: a signal is seen no later than this


def run(make_node: Callable[[], Node], args: Optional[list[str]] = None) -> int:
    """
    Spin the node that `make_node` makes until Ctrl-C or SIGTERM; return the exit code.

    rclpy's own signal handler shuts the context down before anybody can publish a last message,
    so it is left out. A node with a method `stop` has it called while publishing still works.
    """
    asked_to_stop = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: asked_to_stop.set())
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = make_node()
        spin_until(asked_to_stop, node)
        node.destroy_node()
    except ParameterException as error:
        rclpy.logging.get_logger('startup').fatal(str(error))
        return 1
    finally:
        rclpy.try_shutdown()
    return 0


def spin_until(asked_to_stop: Event, node: Node) -> None:
    """Serve the node's callbacks until the event is set, then call the node's `stop`."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not asked_to_stop.is_set():
        executor.spin_once(timeout_sec=WAKE_UP_S)
    if hasattr(node, 'stop'):
        node.stop()
    executor.shutdown()
