# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 09 Tests that notice
#
# ![Three tables of faults and tests: the same code, three sets of tests, more and more faults noticed](pictures/09.png)
#
# Your package works today.
# Next week somebody turns a `<` round, by accident, in a hurry; perhaps you.
# A good test suite is the colleague who notices.
# A bad one says "all passed" and looks the other way, and the two look exactly alike until you try.
# Today you try: you put faults into code on purpose and see who notices.
#
# **You will be able to**
#
# - tell a test that notices from one that only runs;
# - write tests for plain functions, and for nodes whose clock you hold in your hand;
# - read a coverage report, and say what it cannot tell;
# - put faults into code and improve the tests until they are noticed;
# - let a linter read your code before a person does.
#
# **Time:** about 60 minutes, and as long again for all the tests of your package.
#
# **Your package so far**, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/  scripts/  config/  launch/
#     ├── ros2_robot_controller/
#     │   ├── driver.py  speed_server.py  navigator.py  robot_controller.py
#     │   ├── sensor_processor.py
#     │   └── utils/  conversions.py  motion.py  running.py  scans.py  settings.py  steering.py
#     └── test/                                    ← today
#         ├── conftest.py                          a bench for nodes, given
#         ├── test_conversions.py  test_scans.py  test_motion.py  test_steering.py  test_settings.py
#         ├── test_robot_controller.py  test_sensor_processor.py
#         └── test_speed_server.py  test_layers.py  test_running.py

# %%
from grader.notebook import begin, check, run_node, start_at

begin("09")
# !mkdir -p test
# %env PYTEST_DISABLE_PLUGIN_AUTOLOAD=1

# %% [markdown]
# The last line keeps pytest from loading every plug-in that lies on this machine: it starts in a tenth of the time, and the grader's runs do the same.
#
# ## Three tests that lie
#
# ### All lines reached, nothing noticed
#
# Here is a piece of robot, small enough to keep in your head.
# It lies in the workspace, not in your package.

# %%
# %%writefile ../../stopping.py
import math


def closest(ranges):
    return min([r for r in ranges if 0.15 <= r <= 12.0], default=math.inf)


def safe_speed(wanted, ranges):
    if closest(ranges) < 0.5:
        return 0.0
    if closest(ranges) < 0.8 and wanted > 0.2:
        return 0.2
    return wanted

# %%
# %%writefile ../../test_stopping.py
from stopping import safe_speed


def test_safe_speed():
    for ranges in ([], [0.3], [0.7], [5.0]):
        assert safe_speed(0.4, ranges) is not None

# %% [markdown]
# `coverage` runs a program and writes down which lines were reached, and of each `if` whether it went both ways.
# The test calls the function in four situations.
#
# **How much of the file will it reach, in percent?**

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !cd ../.. && coverage run --branch --include=stopping.py -m pytest -q test_stopping.py
# !cd ../.. && coverage report --show-missing

# %% [markdown]
# 100 %, and the tick is green.
# Now break the robot: it shall drive on *because* something is nearer than half a metre.
#
# **Will the test notice?**

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !cd ../.. && sed -i 's/< 0.5/>= 0.5/' stopping.py && pytest -q test_stopping.py
# !cd ../.. && sed -i 's/>= 0.5/< 0.5/' stopping.py

# %% [markdown]
# Still green.
# This robot drives into every wall, with a tested, fully covered brake.
# Coverage says what was *reached*.
# It cannot say whether anybody *looked*: `is not None` is true of every number.
#
# ### A test that asks itself
#
# A mock stands in for something that is awkward in a test, such as a robot.
# It answers whatever you tell it to answer.

# %%
from unittest.mock import Mock

robot = Mock()
robot.safe_speed.return_value = 0.0

assert robot.safe_speed(0.4, [0.3]) == 0.0
robot.safe_speed.assert_called_once_with(0.4, [0.3])
print("passed")

# %% [markdown]
# Passed, and no line of `stopping.py` was run.
# The first assert compares a number with itself: you put the 0.0 in three lines above.
# It looks silly here; with five mocks and a long set-up it looks like a thorough test.
# The question to ask of each assert: *which line of my code would make this fail?*
# When there is none, the test is about the mock.
#
# ### A test that waits
#
# A node publishes ten times a second.
# So somebody writes: wait 0.3 s and a little, expect three messages.
# Here is that node; it listens to itself, so that it can be counted what arrives.

# %%
import time

import rclpy
from rclpy.parameter import Parameter
from std_msgs.msg import String


def make_ticker(sim_time):
    """Return a node that publishes ten times a second, and collects in `heard` what arrives."""
    use_sim_time = Parameter("use_sim_time", value=sim_time)
    node = rclpy.create_node("ticker", enable_rosout=False, parameter_overrides=[use_sim_time])
    publisher, node.heard = node.create_publisher(String, "tick", 10), []
    node.create_subscription(String, "tick", node.heard.append, 10)
    node.create_timer(0.1, lambda: publisher.publish(String()))
    return node

# %%
def wait(node):
    """Let 0.31 s of wall time pass."""
    end = time.monotonic() + 0.31
    while (left := end - time.monotonic()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left)

# %%
def tries(let_time_pass, sim_time):
    """Return how many messages arrive, in eight tries."""
    found = []
    for _ in range(8):
        node = make_ticker(sim_time)
        let_time_pass(node)
        found.append(len(node.heard))
        node.destroy_node()
    return found

# %% [markdown]
# **How often in eight tries will there be exactly three?**
# And how often, when the machine has something else to do at the same time?

# %% tags=["nbval-ignore-output"]
# Not compared: what comes out is chance, and that is the point.
import threading


def work():
    while busy:
        sum(range(1000))


if not rclpy.ok():
    rclpy.init()
print("quiet machine:", tries(wait, sim_time=False))
busy = True
for _ in range(3):
    threading.Thread(target=work).start()
print("busy machine: ", tries(wait, sim_time=False))

# %% [markdown]
# The same node, the same test, and it passes or fails with the weather: it **flickers**.
# A flickering test is worse than none, for after the fifth false alarm nobody looks any more.
# "Then wait a second, to be safe" makes it slow *and* flickering on a busier machine.
#
# There is another way: let the node live in simulated time, and turn its clock by hand.
# The machine is still as busy.

# %%
from rclpy.time import Time


def turn_the_clock(node):
    """Let 0.3 s of simulated time pass, and after each tenth wait for the message itself."""
    for step in (1, 2, 3):
        node.get_clock().set_ros_time_override(Time(nanoseconds=step * 100_000_000))
        for _ in range(20):
            if len(node.heard) < step:
                rclpy.spin_once(node, timeout_sec=0.05)


print("clock by hand:", tries(turn_the_clock, sim_time=True))
busy = False

# %% [markdown]
# Never sleep in a test; hold the clock.
#
# ## Faults and the tests that notice them
#
# So how good is a set of tests?
# There is one honest way to find out: put a fault in, see whether a test fails, take it out again; and then the next fault.
# T3 does this to your package.
# The faults are small mistakes as people make them, and you can have the list.

# %%
from pathlib import Path

from grader.mutation.operators import mutants
from grader.mutation.source_text import parse

source = parse("stopping.py", Path("../../stopping.py").read_text())
all_faults = mutants(source)
print(len(all_faults), "faults, for example:")
for fault in all_faults[::4]:
    print(f"  line {fault.line}: {fault.words.replace('`', '')}")

# %% [markdown]
# To try one: put the fault into the text, run the text, call the test.
# Nothing more is behind it.
# Here a test is a function that is given the code.

# %%
from types import SimpleNamespace


def notices(test, fault):
    """Return whether the test fails when this fault is in the code."""
    broken = {}
    exec(source.apply(fault), broken)
    try:
        test(SimpleNamespace(**broken))
    except Exception:
        return True
    return False

# %%
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap


def draw_matrix(tests):
    """Draw which test notices which fault."""
    seen = np.array([[notices(test, fault) for test in tests] for fault in all_faults])
    figure, axes = plt.subplots(figsize=(9, 5.6), layout="constrained")
    axes.pcolormesh(seen[::-1], cmap=ListedColormap(["0.9", "#3a9d6a"]), vmin=0, vmax=1, edgecolors="w", lw=2)
    rows = [f"{fault.line}: {fault.words.replace('`', '')}" for fault in all_faults]
    axes.set_yticks(np.arange(len(rows)) + 0.5, rows[::-1], fontsize=8)
    axes.set_xticks(np.arange(len(tests)) + 0.5, [test.__name__.replace("_", "\n") for test in tests])
    axes.set_title(f"{seen.any(axis=1).sum()} of {len(seen)} faults noticed (green)")

# %% [markdown]
# First the test of before, that reached everything.
# And one that asks the obvious.
#
# **Guess:** how many of the faults will each notice?

# %%
def reaches_all(code):
    for ranges in ([], [0.3], [0.7], [5.0]):
        assert code.safe_speed(0.4, ranges) is not None


def stops_at_a_wall(code):
    assert code.safe_speed(0.4, [0.3]) == 0.0


draw_matrix([reaches_all, stops_at_a_wall])

# %% [markdown]
# The left column has no green at all: 100 % coverage, and not one fault noticed.
# One line with a number in it notices several.
#
# Each row without green is a question: *in which situation would that fault hurt?*
# Take "`0.5` became `1.0`": the robot stops too early.
# It shows at 0.6 m, where it should still drive, slowly.
# That situation is the next test.

# %%
def slows_down_near_a_wall(code):
    assert code.safe_speed(0.4, [0.6]) == 0.2


def drives_when_free(code):
    assert code.safe_speed(0.4, [1.5]) == 0.4
    assert code.safe_speed(0.4, []) == 0.4


draw_matrix([stops_at_a_wall, slows_down_near_a_wall, drives_when_free])

# %% [markdown]
# What is still grey sits at edges: is 0.5 m near or not?
# What about the nearest reading a lidar can give, and one that is too far to be true?
# And the nearest of several?

# %%
def looks_at_the_nearest(code):
    assert code.safe_speed(0.4, [5.0, 0.3, 2.0]) == 0.0


def knows_its_edges(code):
    assert code.safe_speed(0.4, [0.5]) == 0.2
    assert code.safe_speed(0.4, [0.8]) == 0.4
    assert code.safe_speed(0.1, [0.6]) == 0.1
    assert code.safe_speed(0.4, [0.15]) == 0.0


draw_matrix([stops_at_a_wall, slows_down_near_a_wall, drives_when_free, looks_at_the_nearest, knows_its_edges])

# %% [markdown]
# **Change one thing:** one row is grey still.
# Which situation would show that fault?
# Write a test for it, add it to the list, and see the row turn green.
# Mind that a test may also call `code.closest`: a fault that one function hides, another shows.
#
# Some faults cannot be noticed at all, because they change nothing that anybody could see.
# That is why T3 gives full marks at 75 %, and not at 100.
#
# ## A first test for each node
#
# Now your package.
# T1 wants tests for both nodes that assert something and pass.
# Begin with what is easy: functions that need no node.
# You wrote your decisions as such functions from notebook 03 on, and this is where it pays.

# %% tags=["exercise"]
# %%writefile test/test_conversions.py
"""Angles and quaternions, at their edges."""

from ros2_robot_controller.utils.conversions import normalize_angle


def test_no_angle_stays_none():
    assert normalize_angle(0.0) == 0.0


# TODO 1: both ends of the half-open circle, and beyond: pi, -pi, 3 pi, pi + 0.1. pytest.approx.
# TODO 2: NaN and infinity.
# TODO 3: yaw to quaternion and back; a quarter turn as in the textbook; a length of 3.
# TODO 4: clamp inside, at both ends, beyond them, and NaN.

# %% tags=["exercise"]
# %%writefile test/test_scans.py
"""What counts as a reading, and where it lies."""

from ros2_robot_controller.utils.scans import closest_reading
from sensor_msgs.msg import LaserScan


def test_an_empty_scan_is_free():
    assert closest_reading(LaserScan()) > 1.0


# TODO 1: each kind of invalid reading beside a real one: the real one is seen.
# TODO 2: the ends of the range belong to it.
# TODO 3: a beam at 59, 61, 119, 121 and 180 degrees, and at minus that: ahead, behind, neither?

# %% tags=["exercise"]
# %%writefile test/test_motion.py
"""The decisions, without a robot."""

from ros2_robot_controller.utils.motion import ramp


def test_a_ramp_that_is_there_stays_there():
    assert ramp(0.3, 0.3, 0.1) == 0.3


# TODO 1: speeding up, slowing down and turning round, forwards and backwards.
# TODO 2: an obstacle ahead, behind, too close anywhere: what is stopped, what goes on?
# TODO 3: at 0.49 m, 0.5 m, 0.65 m and 0.8 m: how fast?

# %% [markdown]
# `@pytest.mark.parametrize` makes one test of many situations: a table of inputs and what should come out.
# Each line of the table counts as a test and fails by itself:
#
# ```python
# @pytest.mark.parametrize(('value', 'expected'), [
#     (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (7.0, 2.0),
# ])
# def test_clamp_keeps_to_both_ends(value, expected):
#     assert clamp(value, -1.0, 2.0) == expected
# ```
#
# Write the expected numbers by hand.
# `assert clamp(v, a, b) == max(a, min(v, b))` computes them with the same thought as the code, and shares its mistakes.

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took. Without --tb=no it also says at length what went wrong.
pure = "test/test_conversions.py test/test_scans.py test/test_motion.py"
# !python3 -m pytest -q --tb=no {pure}

# %% [markdown]
# ### A bench for nodes
#
# A node is awkward: it has a clock, a network and callbacks.
# `test/conftest.py` is given; pytest reads it by itself, and what is marked `@pytest.fixture` in it can be asked for by name in any test.

# %% tags=["given"]
# %%writefile test/conftest.py
"""A bench for one node: its clock is set by hand, what it publishes and logs is written down."""

from collections import defaultdict
import itertools
import os
import signal
import time

import pytest
import rclpy
from rclpy.action.server import ServerGoalHandle
from rclpy.executors import SingleThreadedExecutor
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
            self.executor.spin_once(timeout_sec=0.0)

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

    def hear(self, topic, message):
        """Give the node a message."""
        subscription = self.subscription(topic)
        assert isinstance(message, subscription.msg_type)
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

# %% [markdown]
# Read it once from top to bottom.
# The three ideas:
#
# - **Time is set by hand** (`set_clock`, `advance`), as you did above. A test of ten seconds of driving takes a tenth of one.
# - **Messages go straight into the callbacks** (`hear`, `ask`). No network, so nothing gets lost and nothing must be waited for. `hear` finds the callback through the node's real subscription, so a wrong topic name or type fails.
# - **What comes out is written down** (`published`, `logged`), at the place where it leaves the node.
#
# | in a test | gives |
# |---|---|
# | `bench = make_bench(RobotController, max_linear_speed=0.3)` | a node with these parameters |
# | `bench.hear('scan', message)` | a message to its subscription |
# | `bench.ask('set_speed', SetSpeed.Request(speed=0.25))` | the service's response |
# | `bench.advance(2.0)` | two seconds pass |
# | `published['cmd_vel']` | all messages that came out |
# | `logged` | `[('WARN', 'Battery low: 19 %'), ...]` |
# | `bench.set_parameter('safety_margin', 0.2)` | whether it was taken, and the reason |
# | `interrupt(signal.SIGINT)`, then `main()` | Ctrl-C after three rounds |
#
# So the first sentence of the contract, F1, is a test of three lines:
#
# ```python
# def test_without_a_command_it_says_zero_ten_times_a_second(make_bench, published):
#     make_bench(RobotController).advance(2.0)
#     assert [(c.linear.x, c.angular.z) for c in published['cmd_vel']] == [(0.0, 0.0)] * 20
# ```
#
# Go through the contract's requirements, F1 to F13, I6 and I8, and write a test for each, in its words.

# %% tags=["exercise"]
# %%writefile test/test_robot_controller.py
"""The node that drives the robot, on a bench."""

from ros2_robot_controller.robot_controller import RobotController


def test_it_has_its_name(make_bench):
    assert make_bench(RobotController).node.get_name() == 'robot_controller'


# TODO 1: F1, zero ten times a second.
# TODO 2: F2 and F3, with a scan every tick: the set speed, backwards, too fast, NaN.
# TODO 3: F4 and F5: a wall at 0.49 m, on the very scan; free again; a wall behind.
# TODO 4: F7, the status with and without an obstacle.
# TODO 5: F8 to F11, with an ActionClient on bench.node and bench.until(future).
# TODO 6: I6, senseless values at start (pytest.raises) and at run time; a rate changed.
# TODO 7: I8, the last zero.

# %% tags=["exercise"]
# %%writefile test/test_sensor_processor.py
"""The node that fuses the sensors, on a bench."""


def test_nothing_is_published_without_a_node(published):
    assert not published['sensor_fusion_data']


# TODO 1: F13, silence before the first scan, then twenty a second, with stamp and frame.
# TODO 2: F12, the latest of each sensor; the battery in percent, before and after a message.
# TODO 3: F6, a scan of nothing.
# TODO 4: F12, each alarm once on the way down.
# TODO 5: I6 as for the other node, and the parameter file reaches both.

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# Each requirement of the handout is a sentence with numbers in it. Turn the sentence into the test's name, and the numbers into its assert.
# For T3, look at each `if` in your code, and at each number: which test would fail if it were otherwise?
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# A scan of four beams is enough: `LaserScan(ranges=[behind, inf, ahead, inf], angle_min=-pi, angle_increment=pi / 2, range_min=0.15, range_max=12.0)`.
# A scan must be heard every tick, or the robot stands after 0.5 s: `bench.advance(1.0, lambda: bench.hear('scan', scan))`.
# Goals need the network, inside one process: `ActionClient(bench.node, ...)`, and `bench.until(client.send_goal_async(goal))`.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def test_an_obstacle_stops_it_at_once_and_lets_it_go_on(make_bench, published):
#     bench = make_bench(RobotController)
#     bench.ask('set_speed', SetSpeed.Request(speed=0.5))
#     bench.advance(1.05, lambda: bench.hear('scan', scan_of(ahead=3.0)))
#     assert published['cmd_vel'][-1].linear.x == 0.5
#     bench.hear('scan', scan_of(ahead=0.49))
#     ...                       # at once: no time has passed since
# ```
# </details>
#
# ## Which lines were reached
#
# Coverage cannot say that tests are good.
# It can say where there are none, and that is worth knowing: a line that no test reaches is a line where no fault is noticed.
# T2 counts lines and branches of the whole package, full marks at 90 %.

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took, and one's own numbers are one's own.
# !coverage run --branch --source=ros2_robot_controller --data-file=../../.coverage -m pytest -q --tb=no {pure}
# !coverage report --data-file=../../.coverage --show-missing

# %% [markdown]
# Read the last column as a list of questions, not as a list of lines to tick off.
# `12->exit` means: this `if` was never false.
# A test written *for* a line tends to be one that reaches it and asserts nothing; write it for the situation in which the line matters.
#
# Five more files, for what is left of the package.
# They are small.

# %% tags=["exercise"]
# %%writefile test/test_steering.py
"""The way to a goal, without a robot."""

from ros2_robot_controller.utils.steering import distance_to, Place


def test_where_you_are_is_no_distance_away():
    assert distance_to(Place(1.0, 2.0, 0.0), 1.0, 2.0) == 0.0


# TODO 1: a goal straight ahead, beside, behind; near and far. Turning or driving?
# TODO 2: arrived, just not arrived, blocked within the tolerance, NaN.
# TODO 3: goals that nobody can reach: what is refused, and in which words?

# %% tags=["exercise"]
# %%writefile test/test_settings.py
"""Values that make no sense, and those at the edge of it."""
import math, os
from ros2_robot_controller.utils import settings


def test_a_setting_has_its_default():
    assert settings.at_least_zero(3.0).default == 3.0
# TODO 1: of each kind, good values and bad ones: the edge itself, NaN, infinity.
# TODO 2: a refusal names the parameter, the rule and the value; others' parameters pass by here too, use_sim_time first of all.

# %% tags=["exercise"]
# %%writefile test/test_speed_server.py
"""The speeds that are refused, without a robot."""

from ros2_robot_controller.speed_server import speed_refusal


def test_standing_still_is_allowed():
    assert speed_refusal(0.0, 0.5) == ''


# TODO: at the limit, beyond it, backwards, NaN, infinity; the words state the limit.

# %% tags=["exercise"]
# %%writefile test/test_layers.py
"""Each layer of robot_controller is a node that works without those above it."""

from ros2_robot_controller.driver import Driver


def test_a_driver_has_the_name_of_the_node(make_bench):
    assert make_bench(Driver).node.get_name() == 'robot_controller'


# TODO: Driver, SpeedServer and Navigator each say zero ten times a second, and stop when told.

# %% tags=["exercise"]
# %%writefile test/test_running.py
"""From the first signal handler to the last word."""

from ros2_robot_controller.utils.running import run


def test_there_is_something_to_run():
    assert callable(run)


# TODO: a small node with a `stop`: is it called once after SIGINT, and may it still publish then?

# %% [markdown]
# Now let the grader read, run and break your package: T1 and T2, and for T3 a taste of the faults that the full grading tries.
# It takes a while: the tests run several times.

# %% tags=["check"]
check("T1", "T2", "T3")

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# T3 lists faults that nobody noticed, each with its file, its line and the tests that ran over it and passed.
# The first of those tests is the place for another assert.
# </details>
#
# <details><summary>Hint 2: what often helps</summary>
#
# Compare whole lists of commands instead of the last one; use numbers that are all different, so that none can stand in for another; test both sides of every edge.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# For a fault "`the parameter safety_margin is ignored, 0.3 stands in its place`":
#
# ```python
# def test_the_margin_is_a_parameter(make_bench, published):
#     bench = make_bench(RobotController, safety_margin=1.0)     # not its default
#     bench.ask('set_speed', SetSpeed.Request(speed=0.5))
#     bench.advance(1.0, lambda: bench.hear('scan', scan_of(ahead=1.0)))
#     ...                       # half of the margin, so half of the speed
# ```
# </details>
#
# ## Let a linter read it first
#
# A linter reads code without running it: names that are not used, lines that are too long, brackets out of place.
# It takes the small things away from your reviewer, who can then think about the large ones.
# ROS has its own rules for it, `ament_flake8`: up to 99 characters a line, among others.
#
# **How many findings** has this file?

# %%
# %%writefile ../../careless.py
import os
import math

class Careless( object ):
    def on_scan(self, scan, seen=[]):
        l = [r for r in scan.ranges if r != None]
        if l == []: return
        seen.append(min(l))
        return math.hypot(*seen)

# %% tags=["nbval-ignore-output"]
# Not compared: findings and their count go into two streams, and their order may change.
# !cd ../.. && ament_flake8 careless.py | grep careless.py:

# %% [markdown]
# It finds the unused `os`, blanks and blank lines, the name `l` that looks like a 1, and two habits: `!= None` and `if` in one line.
# It does not find the worst thing in it, `seen=[]`, one list that all calls share.
# Nor does it know that a scan can hold NaN.
# A linter knows the language, not the robot.
#
# Your own package has findings too: one of today's files came with some.
# Q1 wants none.

# %% tags=["nbval-ignore-output"]
# As above: the order of the lines may change.
# !ament_flake8 . | grep -E "^\./|errors|No problems"

# %% tags=["check"]
check("Q1")

# %% [markdown]
# `# noqa` behind a line makes the linter look away.
# The grader counts as if it were not there; a reader asks what is being hidden.
#
# `ament_pep257`, from notebook 03, reads the docstrings in the same way.
# In a package made by `ros2 pkg create` both are run by two small tests; they are welcome, but they say nothing of what your code does, and T1 does not count them.
#
# > **On a real TurtleBot 4**
# >
# > - On a machine with ROS from apt, `colcon test --packages-select ros2_robot_controller` and then `colcon test-result --verbose` run the same tests: your `CMakeLists.txt` says so in its fifth part.
# > - There, `ament_flake8` has more plug-ins and asks for more: single quotes, imports in alphabetical order. The reference package keeps those rules too.
# > - A bench finds most faults and never all. It has no wheels that slip, no battery that sinks, no lidar that is mounted turned by 90°. The first drive on a real robot is slow, and a hand is at the switch.
# > - A recording is a test input: `ros2 bag record /scan /odom` on the day something went wrong, and the next version of your node has to cope with it at your desk.
#
# ## Go further
#
# Not needed for the next notebook.
#
# - The grader also puts in *decoys*: a line written another way that does the same. What would fail on those? (A test that compares the source's text, or its line numbers. It notices everything and nothing.)
# - `draw_matrix` for a file of your own: `parse("scans.py", Path("ros2_robot_controller/utils/scans.py").read_text())`, and tests that are given the code.
# - Let a machine make the situations: `hypothesis` looks for numbers that break "the safe speed is never above the wanted one".
#
# ## Recall
#
# <details><summary>What does 100 % coverage tell you?</summary>
#
# That every line and branch was reached by some test.
# Whether anything was asserted about what they did, it does not tell.
# </details>
#
# <details><summary>A test passes on your machine, and one time in ten it fails on the server. What do you look for first?</summary>
#
# For wall time: a sleep, a time-out, a count of messages "within a second".
# Set the clock by hand, or wait for the event itself with a deadline that is only ever reached by a fault.
# </details>
#
# <details><summary>How can you see that a test is about its mock?</summary>
#
# Put a fault into the code: it passes all the same.
# No line of your own code can make it fail.
# </details>
#
# <details><summary>Why does <code>bench.hear</code> look for the subscription by its topic, and not call the callback by its name?</summary>
#
# So that the test fails when the topic's name or type is wrong, and does not care how the callback is called.
# A test should know what the contract promises, and nothing of how it is done.
# </details>
#
# **Next:** [10 Show and hand in](10_show_and_hand_in.ipynb). Your package works, and you can prove it. Now somebody else has to be able to use it.
