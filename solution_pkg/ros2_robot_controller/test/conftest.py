"""A bench for one node: its clock is set by hand, what it publishes and logs is written down."""

from collections import defaultdict
import itertools
import os
import signal
import time

import pytest
import rclpy
from rclpy.action.server import ServerGoalHandle
from rclpy.executors import SingleThreadedExecutor, TimeoutException
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.time import Time

NAMESPACE = f'/bench{os.getpid()}'  # no other test run answers in ours
TICK_NS = 50_000_000  # how a simulator's clock moves on
DOMAINS = itertools.count(os.getpid())
DEADLINE_S = 10.0  # wall time; only ever reached by a fault


class Bench:
    """
    A node on a bench, in a namespace of its own and in simulated time.

    Messages and requests go straight into the node's callbacks, so nothing has to be waited for.
    """

    def __init__(self, node_class, parameters):
        overrides = [Parameter('use_sim_time', value=True)]
        overrides += [Parameter(name, value=value) for name, value in parameters.items()]
        self.node = node_class(namespace=NAMESPACE, parameter_overrides=overrides,
                               start_parameter_services=False)  # quicker, and nobody asks
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.now_ns = 0

    def advance(self, seconds, each_tick=lambda: None):
        """Let simulated time pass, tick by tick."""
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.set_clock(self.now_ns + TICK_NS)
            each_tick()
            self.settle()

    def set_clock(self, now_ns):
        """Set the node's clock, without running what is due."""
        self.now_ns = now_ns
        self.node.get_clock().set_ros_time_override(Time(nanoseconds=now_ns))

    def settle(self):
        """Run what is due: two timers, a goal, and the messages that these cause."""
        for _ in range(5):
            try:
                task, _, _ = self.executor.wait_for_ready_callbacks(timeout_sec=0.0)
            except TimeoutException:
                return  # nothing is due
            task()
            task.result()  # raises what the callback has raised

    def until(self, future):
        """Return the future's result; simulated time stands still meanwhile."""
        deadline = time.monotonic() + DEADLINE_S
        while not future.done():
            assert time.monotonic() < deadline, 'no answer'
            self.executor.spin_once(timeout_sec=0.01)
        return future.result()

    def subscription(self, topic):
        """Return the node's subscription to a topic."""
        return next(s for s in self.node.subscriptions if s.topic_name == f'{NAMESPACE}/{topic}')

    def service(self, name):
        """Return the node's service of that name."""
        return next(s for s in self.node.services if s.service_name == f'{NAMESPACE}/{name}')

    def publisher(self, topic):
        """Return the node's publisher on a topic."""
        return next(p for p in self.node.publishers if p.topic_name == f'{NAMESPACE}/{topic}')

    def hear(self, topic, message, age=0.0):
        """Give the node a message that was measured `age` seconds ago."""
        subscription = self.subscription(topic)
        assert isinstance(message, subscription.msg_type)
        measured = self.now_ns - round(age * 1e9)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(measured, 10**9)
        subscription.callback(message)

    def ask(self, service, request):
        """Return what a service of the node answers."""
        found = self.service(service)
        return found.callback(request, found.srv_type.Response())

    def set_parameter(self, name, value):
        """Set a parameter at run time; return whether the node took it, and its words."""
        return self.node.set_parameters([Parameter(name, value=value)])[0]

    def close(self):
        """Take the node off the bench."""
        self.executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def published(monkeypatch):
    """Return a dictionary from topic, or 'feedback', to the list of messages published on it."""
    messages = defaultdict(list)
    publish = Publisher.publish
    publish_feedback = ServerGoalHandle.publish_feedback

    def record(publisher, message):
        messages[publisher.topic_name.removeprefix(f'{NAMESPACE}/')].append(message)
        publish(publisher, message)

    def record_feedback(handle, feedback):
        messages['feedback'].append(feedback)
        publish_feedback(handle, feedback)

    monkeypatch.setattr(Publisher, 'publish', record)
    monkeypatch.setattr(ServerGoalHandle, 'publish_feedback', record_feedback)
    return messages


@pytest.fixture
def logged(monkeypatch):
    """Return the list of (severity, words) that the nodes log."""
    lines = []
    monkeypatch.setattr(
        RcutilsLogger, 'log',
        lambda _, message, severity, **__: lines.append((severity.name, message)) or True)
    return lines


@pytest.fixture
def make_bench(published):
    """Return a function from node class and parameters to a bench."""
    # Away from a robot or a simulator that may run on this machine, and from the test before: what
    # an action leaves behind is on the network until Python collects its garbage.
    rclpy.init(domain_id=1 + next(DOMAINS) % 100)
    benches = []

    def make(node_class, **parameters):
        benches.append(Bench(node_class, parameters))
        return benches[-1]

    yield make
    for bench in benches:
        bench.close()
    rclpy.try_shutdown()


@pytest.fixture
def interrupt(monkeypatch):
    """Return a function: raise this signal when an executor has spun three times."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    spin_once = SingleThreadedExecutor.spin_once

    def arrange(number):
        spins = []

        def spin_and_count(executor, timeout_sec=None):
            assert 0.0 < timeout_sec <= 0.5, 'a signal waits for as long as this'
            assert len(spins) < 10, 'spins on after the signal'
            spins.append(executor)
            spin_once(executor, timeout_sec=0.01)
            if len(spins) == 3:
                signal.raise_signal(number)

        monkeypatch.setattr(SingleThreadedExecutor, 'spin_once', spin_and_count)

    yield arrange
    for number, handler in handlers.items():
        signal.signal(number, handler)
