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
# ![Three tables of mutants and tests: the same code, three sets of tests, more and more mutants noticed](pictures/09.png)
#
# If you type `>` instead of `<` by accident, good tests notice it; bad ones say "all passed".
# Today you put small mistakes into code on purpose, and see which tests notice.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - tell a test that notices from one that only runs;
# - write tables of cases for plain functions, and tests for nodes whose clock you set yourself;
# - read a coverage report, and say what it cannot tell;
# - make mutants of your code, and improve the tests until they are noticed.
#
# **Time:** part 1, tests that notice: 40 to 75 minutes.
# Part 2, the controller on a bench: 50 to 80 minutes.
# Part 3, the other node, coverage, mutants and the linter: 45 to 80 minutes.
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
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
#         ├── test_motion.py                       part 1
#         ├── conftest.py                          part 2, a bench for nodes, given
#         ├── test_robot_controller.py             part 2
#         ├── test_sensor_processor.py             part 3
#         └── test_scans.py                        part 3

# %%
from grader.notebook import begin, check, mutant_matrix, start_at

begin("09")
# !mkdir -p test
# %env PYTEST_DISABLE_PLUGIN_AUTOLOAD=1

# %% [markdown]
# The last line keeps pytest from loading all the plug-ins that are installed, which takes time.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 05: why are <code>ramp</code> and <code>make_safe</code> plain functions in a file of their own?</summary>
#
# A table of cases tests them in a millisecond, without a robot, a network or a clock.
# </details>
# <details><summary>Notebook 08: a parameter's callback refuses NaN at run time. Does it also refuse NaN in a parameter file?</summary>
#
# Only if it was registered before the parameter was declared.
# </details>
# <details><summary>Notebook 00: why do two nodes on one machine need a while until a message arrives, and what follows for a test?</summary>
#
# They have to discover each other. A test that waits for a fixed time fails on a slow day.
# </details>

# %% [markdown]
# ## Three tests that lie
#
# ### All lines reached, nothing noticed
#
# This file is in the workspace, not in your package.

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
# `coverage` records which lines ran, and for each `if` whether both ways were taken.
#
# **Predict:** how much of the file will the test reach, in percent?

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !cd ../.. && coverage run --branch --include=stopping.py -m pytest -q test_stopping.py
# !cd ../.. && coverage report --show-missing

# %% [markdown]
# It reaches 100 %.
# Now `sed` changes a `<` to `>=`, so the robot drives on *because* something is near.
#
# **Predict:** will the test notice?

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !cd ../.. && sed -i 's/< 0.5/>= 0.5/' stopping.py && pytest -q test_stopping.py
# !cd ../.. && sed -i 's/>= 0.5/< 0.5/' stopping.py

# %% [markdown]
# It still passes, although this robot drives into every wall.
# Coverage says what *ran*, not whether a test *checked* it: `is not None` is true for every number.

# %% [markdown] tags=["whole"]
# ### A test that asks itself
#
# A mock replaces something that is hard to use in a test, and gives the answers that you choose.

# %% tags=["whole"]
from unittest.mock import Mock

robot = Mock()
robot.safe_speed.return_value = 0.0

assert robot.safe_speed(0.4, [0.3]) == 0.0
robot.safe_speed.assert_called_once_with(0.4, [0.3])
print("passed")

# %% [markdown] tags=["whole"]
# The test passes, but no line of `stopping.py` ran: the first assert compares a number with itself.
# Ask of each assert: *which line of my code could make this fail?*
#
# ### A test that waits
#
# A node publishes ten times a second, and listens to itself.
# The obvious test waits 0.31 s, and expects three messages.

# %% tags=["whole"]
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

# %% tags=["whole"]
def wait(node):
    """Let 0.31 s of wall time pass."""
    end = time.monotonic() + 0.31
    while (left := end - time.monotonic()) > 0.0:
        rclpy.spin_once(node, timeout_sec=left)

# %% tags=["whole"]
def eight_times(let_time_pass, sim_time):
    """Return how many messages arrive, in eight tries."""
    found = []
    for _ in range(8):
        node = make_ticker(sim_time)
        let_time_pass(node)
        found.append(len(node.heard))
        node.destroy_node()
    return found

# %% [markdown] tags=["whole"]
# **Predict:** in how many of eight tries do exactly three arrive, on a quiet machine and on a busy one?

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: what comes out is chance, and that is the point.
import threading


def work():
    while busy:
        sum(range(1000))


if not rclpy.ok():
    rclpy.init()
print("quiet machine:", eight_times(wait, sim_time=False))
busy = True
for _ in range(3):
    threading.Thread(target=work).start()
print("busy machine: ", eight_times(wait, sim_time=False))

# %% [markdown] tags=["whole"]
# The same test passes or fails by chance: it is **flaky**.
#
# Give the node simulated time instead, and set its clock by hand.

# %% tags=["whole"]
from rclpy.time import Time


def turn_the_clock(node):
    """Let 0.3 s of simulated time pass, and after each tenth wait for the message itself."""
    for step in (1, 2, 3):
        node.get_clock().set_ros_time_override(Time(nanoseconds=step * 100_000_000))
        for _ in range(20):
            if len(node.heard) < step:
                rclpy.spin_once(node, timeout_sec=0.05)


print("clock by hand:", eight_times(turn_the_clock, sim_time=True))
busy = False

# %% [markdown] tags=["whole"]
# Never sleep in a test; set the clock.

# %% [markdown]
# ## Mutants and the tests that notice them
#
# A copy of the code with one small mistake, such as a reversed comparison or a doubled number, is called a **mutant**.
# Requirement T3 makes mutants of your package and counts how many your tests notice.
#
# `mutant_matrix` does the same here, for one file and the file of its tests.
# Each row is a mutant, each column a test. Green means that the test fails on the mutant, so it *notices* it.
#
# The test reached every line.
# **Predict:** how many mutants will it notice?

# %%
mutant_matrix("../../stopping.py", "../../test_stopping.py")

# %% [markdown]
# Nothing is green: with 100 % coverage the test notices no mutant.
#
# Now add one test that checks a number. (`-a` adds to the file.)
# **Predict** again.

# %%
# %%writefile -a ../../test_stopping.py


def test_it_stops_at_a_wall():
    assert safe_speed(0.4, [0.3]) == 0.0

# %%
mutant_matrix("../../stopping.py", "../../test_stopping.py")

# %% [markdown]
# Each row without green is a question: *in which situation would that mistake hurt?*
# "0.5 became 1.0" matters at 0.6 m, where the robot should still drive, slowly.

# %%
# %%writefile -a ../../test_stopping.py


def test_it_slows_down_near_a_wall():
    assert safe_speed(0.4, [0.6]) == 0.2


def test_it_drives_when_free():
    assert safe_speed(0.4, [1.5]) == 0.4
    assert safe_speed(0.4, []) == 0.4

# %% tags=["whole"]
mutant_matrix("../../stopping.py", "../../test_stopping.py")

# %% [markdown]
# The rows that are still grey are about edges, and about several readings at once.

# %%
# %%writefile -a ../../test_stopping.py


def test_it_looks_at_the_nearest():
    assert safe_speed(0.4, [5.0, 0.3, 2.0]) == 0.0


def test_it_knows_its_edges():
    assert safe_speed(0.4, [0.5]) == 0.2
    assert safe_speed(0.4, [0.8]) == 0.4
    assert safe_speed(0.1, [0.6]) == 0.1
    assert safe_speed(0.4, [0.15]) == 0.0

# %%
mutant_matrix("../../stopping.py", "../../test_stopping.py")

# %% [markdown]
# **Change one thing:** one row is still grey, "12.0 became 24.0".
# Which reading would show it?
# Write a test for it into the cell below and draw the matrix again; it may call `closest` itself.

# %%
# %%writefile -a ../../test_stopping.py


def test_yours():
    """Replace this by a situation in which the last mistake hurts."""

# %%
mutant_matrix("../../stopping.py", "../../test_stopping.py")

# %% [markdown]
# <details><summary>One answer</summary>
#
# `from stopping import closest` at the top of the cell, and in the test `assert closest([20.0]) == float("inf")`: what comes from beyond the lidar's range is not a reading.
# </details>

# %% [markdown] tags=["whole"]
# Some mutants change nothing that can be seen: `x < 3` and `x <= 2`, for whole numbers.
# Such a mutant is called **equivalent**; that is why T3 gives full marks at 75 %.
#
# ### A table for your own functions
#
# `@pytest.mark.parametrize` makes one test of many situations; each line of the table counts as a test and fails by itself:
#
# ```python
# @pytest.mark.parametrize(('value', 'expected'), [
#     (-3.0, -1.0), (-1.0, -1.0), (0.5, 0.5), (2.0, 2.0), (7.0, 2.0),
# ])
# def test_clamp_keeps_to_both_ends(value, expected):
#     assert clamp(value, -1.0, 2.0) == expected
# ```
#
# Write the expected numbers by hand; a formula would share the code's mistakes.
#
# Here are four tests for `utils/motion.py`; three of them become tables that you fill.
# `pytest.approx` allows a small difference, which floats need: `0.1 + 0.2 == 0.3` is False.

# %% tags=["skeleton", "whole"]
# %%writefile test/test_motion.py
"""What is safe, without a robot."""

import math

import pytest
from ros2_robot_controller.utils.motion import (
    Command, Limits, make_safe, ramp, speed_cap, STOP)
from ros2_robot_controller.utils.scans import Proximity

LIMITS = Limits(
    max_linear_speed=0.5, max_angular_speed=1.0, linear_acceleration=1.0,
    angular_acceleration=2.0, obstacle_detection_threshold=0.5, emergency_stop_distance=0.2,
    safety_margin=0.3)
FREE = Proximity()
FORWARD, BACKWARD, TURN = Command(v=0.4), Command(v=-0.4), Command(omega=0.8)


def wall_ahead(distance):
    return Proximity(ahead=distance, anywhere=distance)


def wall_behind(distance):
    return Proximity(behind=distance, anywhere=distance)


def test_a_ramp_limits_speeding_up_only():
    assert ramp(0.3, 0.3, 0.1) == pytest.approx(0.3)


def test_the_speed_falls_within_the_margin_but_never_to_nothing():
    assert speed_cap(math.inf, LIMITS) == pytest.approx(0.5)


def test_an_obstacle_stops_driving_and_a_too_close_one_everything():
    assert make_safe(FORWARD, wall_ahead(0.49), LIMITS) == STOP
    assert make_safe(BACKWARD, FREE, LIMITS) == BACKWARD
    assert make_safe(TURN, wall_behind(9.0), LIMITS) == TURN


@pytest.mark.parametrize(('wanted', 'expected'), [
    (Command(2.0, 3.0), Command(0.5, 1.0)), (Command(-2.0, -3.0), Command(-0.5, -1.0)),
])
def test_the_limits_hold(wanted, expected):
    assert make_safe(wanted, FREE, LIMITS) == expected

# %% [markdown] tags=["whole"]
# First `ramp(previous, wanted, largest_rise)`, with a largest rise of 0.1.
# Its rules from notebook 05: speeding up is limited, braking is not, and a change of direction passes through exactly zero.

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "ramp")

# %% [markdown] tags=["whole"]
# #### Table 1: ramp
#
# Add: speeding up *backwards*; arriving, when less than 0.1 is missing; braking and turning round, both ways.

# %% tags=["piece", "whole"]
# %%into test/test_motion.py
@pytest.mark.parametrize(('previous', 'wanted', 'expected'), [
    (0.0, 0.5, 0.1), (0.3, 0.3, 0.3),
    # TODO: seven rows or more
])
def test_a_ramp_limits_speeding_up_only(previous, wanted, expected):
    assert ramp(previous, wanted, 0.1) == pytest.approx(expected)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# A row is (what it drives now, what is wanted, what comes out): `(0.5, 0.2, 0.2)` is braking, and free.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     (0.0, 0.5, 0.1), (0.2, 0.5, 0.3), (0.0, -0.5, -0.1), (-0.2, -0.5, -0.3),  # speeding up
#     (0.45, 0.5, 0.5), (-0.45, -0.5, -0.5), (0.3, 0.3, 0.3),  # there
#     (0.5, 0.2, 0.2), (-0.5, -0.2, -0.2), (0.5, 0.0, 0.0),  # braking is free
#     ...                                                      # turning round, both ways
# ```
# </details>

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "ramp")

# %% [markdown] tags=["whole"]
# #### Table 2: the speed near an obstacle
#
# `speed_cap(distance, LIMITS)` allows the full 0.5 m/s from 0.8 m on.
# Within the margin the speed falls in proportion, but never below a fifth of the limit, 0.1 m/s.
#
# Which distances? Both ends of the margin, two places within it, one beyond, one below.

# %% tags=["piece", "whole"]
# %%into test/test_motion.py
@pytest.mark.parametrize(('distance', 'expected'), [
    (math.inf, 0.5),
    # TODO: five rows or more
])
def test_the_speed_falls_within_the_margin_but_never_to_nothing(distance, expected):
    assert speed_cap(distance, LIMITS) == pytest.approx(expected)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# At 0.7 m two thirds of the margin are left: `1 / 3`. At 0.53 m a tenth: that would be 0.05, and a fifth of the limit is more.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     (math.inf, 0.5), (0.8, 0.5), (0.65, 0.25), (0.7, 1 / 3), (0.53, 0.1),
#     ...                                                      # at the threshold, and below it
# ```
# </details>

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "speed_cap")

# %% [markdown] tags=["whole"]
# One row stays grey, "room > 0.0 became always true".
# It hurts only with a margin of 0, and `LIMITS` has 0.3.
#
# #### What a grey row does to a robot
#
# `clearance` decides which way the robot looks while it drives.
# Which of its mutants do your tests notice so far?

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "clearance")

# %% [markdown] tags=["whole"]
# Each grey row is a wrong robot that passes all your tests.
# `Shuttle` drives back and forth between two boxes, backwards first.
# Here it uses your own file.

# %% tags=["whole"]
from grader.notebook import mine, mutant
from sim import Box, Simulator, Twist, World, room
from sim.bridge import to_message
from sim.live import Live

scans = mine("utils.scans")


class Shuttle:
    """Drives backwards until make_safe says stop, then forwards, and so on."""

    def __init__(self, motion):
        self.motion, self.wanted = motion, -0.4

    def __call__(self, seen):
        near = scans.measure_proximity(to_message(seen.scan))
        limits = self.motion.Limits(0.5, 1.0, 1.0, 2.0, 0.5, 0.2, 0.3)
        safe = self.motion.make_safe(self.motion.Command(self.wanted), near, limits)
        if safe == self.motion.STOP:
            self.wanted = -self.wanted
        return Twist(safe.v, safe.omega)

# %% tags=["whole"]
def watch(motion):
    """Return a live view of a Shuttle with this motion.py."""
    boxes = Box((-1.5, 0.0), (0.3, 0.6), name="rear"), Box((1.5, 0.0), (0.3, 0.6), name="front")
    world = World("between two boxes", obstacles=(*room((-2.0, -0.9), (2.0, 0.9)), *boxes))
    return Live(Simulator(world), driver=Shuttle(motion))


watch(mine("utils.motion"))

# %% [markdown] tags=["whole"]
# `mutant` returns your file with the mistake of the third row.
#
# **Predict:** where does this robot turn round, behind and in front?

# %% tags=["whole"]
watch(mutant("ros2_robot_controller/utils/motion.py", 3, "clearance"))

# %% [markdown] tags=["whole"]
# It looks ahead while it drives backwards, so it does not see the box.
# Nearer than 0.2 m the emergency stop acts, but too late, and the robot never drives again.
#
# #### Table 3: stop, or stop everything
#
# In `make_safe(wanted, near, LIMITS)` an obstacle in the way (below 0.5 m) stops *driving*, one that is too close (below 0.2 m, in *any* direction) stops *everything*.

# %% tags=["piece", "whole"]
# %%into test/test_motion.py
@pytest.mark.parametrize(('wanted', 'near', 'expected'), [
    (FORWARD, wall_ahead(0.49), STOP), (BACKWARD, wall_ahead(0.49), BACKWARD),
    # TODO: the same two with the wall behind; turning in place before a wall at 0.49 and at 0.19;
    #       driving on an arc, Command(0.4, 0.4), at a wall; driving away from one at 0.19
])
def test_an_obstacle_stops_driving_and_a_too_close_one_everything(wanted, near, expected):
    assert make_safe(wanted, near, LIMITS) == expected

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# A robot that turns in place does not come nearer, so a wall at 0.49 m does not stop it. A wall at 0.19 m does, and also keeps it from driving away.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     (FORWARD, wall_ahead(0.49), STOP), (BACKWARD, wall_ahead(0.49), BACKWARD),
#     (FORWARD, wall_behind(0.49), FORWARD), (BACKWARD, wall_behind(0.49), STOP),
#     (Command(0.4, 0.4), wall_ahead(0.49), STOP),
#     (TURN, wall_ahead(0.49), TURN),
#     ...                               # the close ones: turning twice, and driving away
# ```
# </details>

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "make_safe")

# %% [markdown] tags=["whole"]
# The row of the robot that did not look behind should now be green.

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/motion.py", "test/test_motion.py", "clearance")

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short -x test/test_motion.py | cat

# %% [markdown] tags=["whole"]
# If a row fails, look at the contract, and correct whichever is wrong, the table or your `motion.py`.
#
# **This is the end of part 1.**

# %% [markdown]
# ## A first test for each node
#
# T1 wants tests for both nodes that assert something and pass.
# They use the types of your interfaces, so the package must be built.

# %% tags=["nbval-ignore-output"]
# Not compared: colcon says how long it took.
# !cd ../.. && colcon build --packages-select ros2_robot_controller 2>&1 | cat

# %% [markdown]
# For a test you put a node on a **bench**, `test/conftest.py`, where you control its clock, its inputs and its outputs:
#
# - **You set the time by hand** (`set_clock`, `advance`).
# - **Messages go straight into the callbacks** (`hear`, `ask`), without a network. `hear` finds the callback through the node's real subscription, so a wrong topic name or type fails.
# - **The bench records the output** (`published`, `logged`), where it leaves the node.
#
# A **fixture** is a function marked `@pytest.fixture`; a test that has its name as an argument gets what it returns, made anew for each test.

# %% [markdown] tags=["whole"]
# JupyterLab shows the next cell folded: run it.

# %% tags=["given", "whole"]
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

# %% [markdown] tags=["whole"]
# | in a test | gives |
# |---|---|
# | `bench = make_bench(RobotController, max_linear_speed=0.3)` | a node with these parameters |
# | `bench.hear('scan', message)` | a message to its subscription |
# | `bench.ask('set_speed', SetSpeed.Request(speed=0.25))` | the service's response |
# | `bench.advance(2.0)` | two seconds pass |
# | `published['cmd_vel']` | all messages that came out |
# | `logged` | `[('WARN', 'Battery low: 19 %'), ...]` |
# | `bench.set_parameter('safety_margin', 0.2)` | whether it was taken (`.successful`), and the `.reason` |
# | `interrupt(signal.SIGINT)`, then `main()` | Ctrl-C after three rounds |

# %% [markdown]
# So F1 is a test of two lines:
#
# ```python
# def test_without_a_command_it_says_zero_ten_times_a_second(make_bench, published):
#     make_bench(RobotController).advance(2.0)
#     assert [(c.linear.x, c.angular.z) for c in published['cmd_vel']] == [(0.0, 0.0)] * 20
# ```

# %% [markdown]
# ### A robot around it
#
# The helper `Robot`, at the top of `test_robot_controller.py`, gives the node a scan every tick, and odometry that follows its commands:
#
# | of the helper | what it does |
# |---|---|
# | `robot.drive(1.0)` | a second passes, with sensors; returns the commands of that second as `[(v, omega), ...]` |
# | `robot.scan = scan_of(ahead=0.4)` | from now on a wall is 0.4 m ahead (also `behind=`) |
# | `robot.set_speed(0.25)`, `robot.status()` | ask the services |
# | `goal = robot.send(1.0, 0.5)`, `robot.outcome(goal)` | send a goal; later: (status, success, (x, y)) |
# | `robot.finish(goal)` | drives until the goal is over, ten seconds at most, and half a second on; returns the commands |
# | `make_robot(max_linear_speed=0.3)` | a robot with other parameters than the defaults |

# %% [markdown] tags=["whole"]
# The next file has this helper, seven finished tests, and eleven that have only a name.
# It is folded, too. Open it and read one: `test_an_obstacle_stops_it_at_once_and_lets_it_go_on` calls `bench.hear` *between* two ticks, so the stop must come from the scan's own callback.

# %% tags=["skeleton"]
# %%writefile test/test_robot_controller.py
"""The node that drives the robot, on a bench."""

import math
import signal
from types import SimpleNamespace

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
import pytest
import rclpy
from rclpy.action import ActionClient
from rclpy.exceptions import InvalidParameterValueException
from rclpy.qos import ReliabilityPolicy
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.robot_controller import main, RobotController
from ros2_robot_controller.srv import GetRobotStatus, SetSpeed
from ros2_robot_controller.utils.conversions import quaternion_from_yaw
from sensor_msgs.msg import LaserScan

SENSELESS = [
    ('robot_name', ''), ('max_linear_speed', -1.0), ('max_angular_speed', -0.1),
    ('linear_acceleration', 0.0), ('angular_acceleration', 0.0), ('laser_processing_rate', 0.0),
    ('fusion_rate', 0.0), ('obstacle_detection_threshold', -0.1),
    ('emergency_stop_distance', math.nan), ('safety_margin', -0.3),
]


def scan_of(ahead=math.inf, behind=math.inf):
    """Return a scan of four beams, the first one backwards."""
    return LaserScan(ranges=[behind, math.inf, ahead, math.inf], angle_min=-math.pi,
                     angle_increment=math.pi / 2, range_min=0.15, range_max=12.0)


def odometry(x, y, yaw=0.0):
    """Return odometry of a robot that is there."""
    odom = Odometry()
    odom.pose.pose.position.x = x
    odom.pose.pose.position.y = y
    odom.pose.pose.orientation = quaternion_from_yaw(yaw)
    return odom


class Robot:
    """The node with a robot around it that does at once what cmd_vel says."""

    def __init__(self, bench, published):
        self.bench = bench
        self.commands = published['cmd_vel']
        self.feedback = published['feedback']
        self.x = self.y = self.yaw = 0.0
        self.scan = scan_of()
        self.has_odometry = True

    def drive(self, seconds):
        """Let simulated time pass, with sensors; return the commands of that time."""
        before = len(self.commands)
        self.bench.advance(seconds, self.sense)
        return [(round(c.linear.x, 6), round(c.angular.z, 6)) for c in self.commands[before:]]

    def finish(self, goal):
        """Drive until a goal is over, at most 10 s, and 0.5 s on; return the commands."""
        commands = []
        for _ in range(100):
            if goal.result.done():
                break
            commands += self.drive(0.1)
        return commands + self.drive(0.5)

    def sense(self):
        """Move for a tick of 0.05 s, then give the node its sensors."""
        command = self.commands[-1] if self.commands else Twist()
        self.yaw += command.angular.z * 0.05
        self.x += command.linear.x * math.cos(self.yaw) * 0.05
        self.y += command.linear.x * math.sin(self.yaw) * 0.05
        if self.scan is not None:
            self.bench.hear('scan', self.scan)
        if self.has_odometry:
            self.bench.hear('odom', odometry(self.x, self.y, self.yaw))

    def set_speed(self, speed):
        return self.bench.ask('set_speed', SetSpeed.Request(speed=speed))

    def status(self):
        return self.bench.ask('get_status', GetRobotStatus.Request())

    def send(self, x, y, tolerance=0.1):
        """Send a goal; return its handle, and its result to come."""
        client = ActionClient(self.bench.node, NavigateToPosition, 'navigate_to_position')
        assert client.wait_for_server(timeout_sec=10.0)
        target = Pose()
        target.position.x, target.position.y = x, y
        handle = self.bench.until(client.send_goal_async(
            NavigateToPosition.Goal(target_pose=target, tolerance=tolerance)))
        result = handle.get_result_async() if handle.accepted else None
        self.bench.settle()
        return SimpleNamespace(handle=handle, result=result, client=client)

    def outcome(self, goal):
        """Return (status, success, x and y of the final pose) of a goal."""
        answer = self.bench.until(goal.result)
        final = answer.result.final_pose.position
        return answer.status, answer.result.success, (final.x, final.y)


@pytest.fixture
def make_robot(make_bench, published):
    """Return a function from parameters to a robot."""
    return lambda **parameters: Robot(make_bench(RobotController, **parameters), published)


@pytest.fixture
def robot(make_robot):
    """Return a robot with the default parameters."""
    return make_robot()


# Written already

def test_names_and_types_are_relative_and_as_agreed(robot):
    bench = robot.bench
    assert bench.node.get_name() == 'robot_controller'
    assert bench.service('set_speed').srv_type is SetSpeed
    assert bench.service('get_status').srv_type is GetRobotStatus
    assert bench.subscription('scan').msg_type is LaserScan
    assert bench.subscription('odom').msg_type is Odometry
    assert bench.publisher('cmd_vel').msg_type is Twist


def test_sensors_may_be_best_effort_and_commands_are_reliable(robot):
    for topic in ('scan', 'odom'):
        qos = robot.bench.subscription(topic).qos_profile
        assert qos.reliability == ReliabilityPolicy.BEST_EFFORT
    qos = robot.bench.publisher('cmd_vel').qos_profile
    assert (qos.reliability, qos.depth) == (ReliabilityPolicy.RELIABLE, 10)


def test_without_a_command_it_says_zero_ten_times_a_second(robot):
    assert robot.drive(2.0) == [(0.0, 0.0)] * 20


def test_an_obstacle_stops_it_at_once_and_lets_it_go_on(robot):
    robot.set_speed(0.5)
    robot.drive(1.05)  # ends between two control steps
    robot.bench.hear('scan', scan_of(ahead=0.49))
    assert robot.commands[-1] == Twist()
    sent = len(robot.commands)
    robot.bench.hear('scan', scan_of(ahead=0.48))
    assert len(robot.commands) == sent, 'one stop is enough'
    robot.scan = scan_of(ahead=0.45)
    assert set(robot.drive(0.5)) == {(0.0, 0.0)}
    status = robot.status()
    assert (status.obstacle_detected, status.status) == (True, 'OBSTACLE_DETECTED')
    assert status.speed == 0.5
    robot.scan = scan_of()
    assert robot.drive(1.0)[-1] == (0.5, 0.0)
    status = robot.status()
    assert (status.obstacle_detected, status.status) == (False, 'ACTIVE')


@pytest.mark.parametrize('target', [(1.0, 0.0), (0.0, 0.8), (-0.7, 0.3), (-0.5, -0.5)])
def test_it_drives_to_a_goal_and_stands_still_there(robot, target):
    robot.drive(0.2)
    goal = robot.send(*target)
    commands = robot.finish(goal)
    status, success, final = robot.outcome(goal)
    assert (status, success) == (GoalStatus.STATUS_SUCCEEDED, True)
    assert math.dist((robot.x, robot.y), target) < 0.1
    assert math.dist(final, (robot.x, robot.y)) < 0.02
    assert commands[-5:] == [(0.0, 0.0)] * 5
    assert max(v for v, _ in commands) <= 0.5
    assert max(abs(omega) for _, omega in commands) <= 1.0
    for (v, omega), (v_next, omega_next) in zip(commands, commands[1:]):
        assert v_next - v <= 0.1 + 1e-5
        assert abs(omega_next) - abs(omega) <= 0.2 + 1e-5


@pytest.mark.parametrize(('name', 'value'), SENSELESS)
def test_a_senseless_value_is_refused_at_start(make_robot, name, value):
    with pytest.raises(InvalidParameterValueException, match=name):
        make_robot(**{name: value})


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_a_last_zero(published, interrupt, number):
    interrupt(number)
    assert main() == 0
    assert not rclpy.ok()
    assert published['/cmd_vel'][-1] == Twist()


# Yours

def test_it_drives_at_the_set_speed(robot):
    pytest.fail('not written yet: F2')


def test_it_drives_backwards(robot):
    pytest.fail('not written yet: F2')


def test_a_speed_beyond_the_limit_changes_nothing(robot):
    pytest.fail('not written yet: F3')


def test_an_obstacle_behind_does_not_stop_it(robot):
    pytest.fail('not written yet: F5')


def test_driving_backwards_it_looks_backwards(robot):
    pytest.fail('not written yet: F4')


def test_it_slows_down_near_an_obstacle(robot):
    pytest.fail('not written yet: F4')


def test_the_status_tells_the_pose_from_odometry(robot):
    pytest.fail('not written yet: F7')


def test_feedback_tells_the_distance_twenty_times_a_second(robot):
    pytest.fail('not written yet: F9')


def test_a_canceled_goal_stops_the_robot(robot):
    pytest.fail('not written yet: F10')


def test_a_lower_limit_slows_the_robot_down(robot):
    pytest.fail('not written yet: I6')


def test_another_threshold_is_in_force_at_once(robot):
    pytest.fail('not written yet: I6')

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=no test/test_robot_controller.py | cat

# %% [markdown] tags=["whole"]
# Twenty passed: seven tests, three of which are tables.
# The eleven that failed are your list for today.

# %% [markdown] tags=["whole"]
# #### F2: drive at the set speed
#
# The first test: let 0.2 s pass, set 0.25 m/s, and look at the next half second.
# With 1 m/s² and ten commands a second the speed goes 0.1, 0.2, 0.25, 0.25, 0.25.
# Compare the *whole list*: it notices a missing ramp and a wrong rate, too.
# Also check that the answer says success and names the speed, and that the status reports it.

# %% tags=["piece", "whole"]
# %%into test/test_robot_controller.py
def test_it_drives_at_the_set_speed(robot):
    robot.drive(0.2)
    answer = robot.set_speed(0.25)
    pytest.fail('not written yet: F2')  # TODO: the answer, the commands of 0.5 s, the status


def test_it_drives_backwards(robot):
    pytest.fail('not written yet: F2')  # TODO: the last command after 0.6 s at -0.5

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `answer.success`, `'0.25 m/s' in answer.message` (use the words of your own node), `robot.status().speed`; `robot.drive(0.6)[-1]` is the last command.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def test_it_drives_at_the_set_speed(robot):
#     robot.drive(0.2)
#     answer = robot.set_speed(0.25)
#     assert answer.success
#     assert '0.25 m/s' in answer.message
#     assert robot.drive(0.5) == [(0.1, 0.0), (0.2, 0.0), (0.25, 0.0), (0.25, 0.0), (0.25, 0.0)]
#     ...                       # and the status
#
# def test_it_drives_backwards(robot):
#     robot.drive(0.2)
#     assert robot.set_speed(-0.5).success
#     ...                       # the last command of the next 0.6 s is (-0.5, 0.0)
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "drives_at or drives_backwards" | tail -n 15

# %% [markdown]
# #### F3: refuse, and change nothing
#
# This is one test with four speeds.
# Look at the answer (no success, and the limit in its words) and at what must *not* have changed: the speed in the status, and the last command after a second.

# %% tags=["piece"]
# %%into test/test_robot_controller.py
@pytest.mark.parametrize('speed', [0.75])  # TODO: backwards too, and what is no number
def test_a_speed_beyond_the_limit_changes_nothing(robot, speed):
    robot.set_speed(0.25)
    answer = robot.set_speed(speed)
    pytest.fail('not written yet: F3')  # TODO: the answer, and what has not changed

# %% [markdown]
# <details><summary>Hint 1: what you need</summary>
#
# `[0.75, -0.75, math.nan, math.inf]`; `not answer.success`; `'0.5 m/s' in answer.message`, in the words of your node.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     assert not answer.success
#     assert '0.5 m/s' in answer.message
#     assert robot.status().speed == 0.25
#     ...                       # and it still drives at 0.25
# ```
# </details>

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "beyond_the_limit" | tail -n 15

# %% [markdown] tags=["whole"]
# #### F4 and F5: which way it looks
#
# Three short ones, each with a wall: behind it when it drives forward (it drives on), behind it when it drives backwards (it stands all the time: `set(...) == {(0.0, 0.0)}`), and 0.65 m ahead, half of the margin (half of the speed).

# %% tags=["piece", "whole"]
# %%into test/test_robot_controller.py
def test_an_obstacle_behind_does_not_stop_it(robot):
    robot.set_speed(0.5)
    robot.scan = scan_of(behind=0.3)
    pytest.fail('not written yet: F5')  # TODO: full speed after a second, and the status


def test_driving_backwards_it_looks_backwards(robot):
    pytest.fail('not written yet: F4')  # TODO


def test_it_slows_down_near_an_obstacle(robot):
    pytest.fail('not written yet: F4')  # TODO

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `robot.drive(1.0)[-1]` is the last command, `set(robot.drive(1.0))` all different ones; `robot.status().status` is `'ACTIVE'` or `'OBSTACLE_DETECTED'`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def test_an_obstacle_behind_does_not_stop_it(robot):
#     robot.set_speed(0.5)
#     robot.scan = scan_of(behind=0.3)
#     assert robot.drive(1.0)[-1] == (0.5, 0.0)
#     assert robot.status().status == 'ACTIVE'
#
# def test_driving_backwards_it_looks_backwards(robot):
#     robot.set_speed(-0.5)
#     robot.scan = scan_of(behind=0.3)
#     assert set(robot.drive(1.0)) == {(0.0, 0.0)}
#     ...                       # and the status says so
#
# def test_it_slows_down_near_an_obstacle(robot):
#     robot.set_speed(0.5)
#     robot.scan = scan_of(ahead=0.65)
#     ...                       # the last command: half of the speed
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "behind or backwards_it or slows_down" | tail -n 15

# %% [markdown] tags=["whole"]
# #### F7: the pose
#
# The node hears one message of odometry, with three different numbers, so that a mix-up shows.

# %% tags=["piece", "whole"]
# %%into test/test_robot_controller.py
def test_the_status_tells_the_pose_from_odometry(robot):
    robot.bench.hear('odom', odometry(1.0, -2.0, 0.5))
    pytest.fail('not written yet: F7')  # TODO: the pose in the status

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `pose.position.x`, `pose.position.y`, and `pose.orientation == quaternion_from_yaw(0.5)`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     pose = robot.status().pose
#     assert (pose.position.x, pose.position.y) == (1.0, -2.0)
#     ...                       # the orientation
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "pose_from" | tail -n 15

# %% [markdown] tags=["whole"]
# #### F9, F10 and I6: four tests of your own design
#
# From here on only the name is given.
# Read the contract's sentence in the [handout](../docs/handout.md), and ask:
#
# - which mistake in *my* code would break this sentence?
# - which assert would notice exactly that one?
#
# Then make the mistake, see the test fail, and remove the mistake.

# %% tags=["piece", "design", "whole"]
# %%into test/test_robot_controller.py
def test_feedback_tells_the_distance_twenty_times_a_second(robot):
    pytest.fail('not written yet: F9')


def test_a_canceled_goal_stops_the_robot(robot):
    pytest.fail('not written yet: F10')

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `robot.feedback` has the messages, each with `distance_remaining`; `pytest.approx(2.0, abs=0.05)`; `goal.handle.cancel_goal_async()` gives a future for `robot.bench.until`; `GoalStatus.STATUS_CANCELED`.
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "feedback or canceled" | tail -n 15

# %% tags=["piece", "design", "whole"]
# %%into test/test_robot_controller.py
def test_a_lower_limit_slows_the_robot_down(robot):
    pytest.fail('not written yet: I6')


def test_another_threshold_is_in_force_at_once(robot):
    pytest.fail('not written yet: I6')

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `robot.bench.set_parameter(name, value)`; `robot.drive(0.1)` gives one command, and a second one if a scan stops the robot at once, so compare `set(robot.drive(0.1))`; `robot.scan = scan_of(ahead=0.9)`.
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_robot_controller.py -k "lower_limit or threshold" | tail -n 15

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for the cancel, once yours passes</summary>
#
# **One scene, many looks.** The course's test cancels one goal and looks at everything.
#
# ```python
# def test_a_canceled_goal_stops_the_robot(robot):
#     robot.drive(0.2)
#     goal = robot.send(2.0, 0.0)
#     assert robot.drive(1.0)[-1] == (0.5, 0.0)
#     answer = robot.bench.until(goal.handle.cancel_goal_async())
#     assert len(answer.goals_canceling) == 1
#     assert robot.drive(0.2)[-1] == (0.0, 0.0)
#     status, success, final = robot.outcome(goal)
#     assert (status, success) == (GoalStatus.STATUS_CANCELED, False)
#     assert final == pytest.approx((robot.x, robot.y), abs=0.05)
#     feedback = len(robot.feedback)
#     assert set(robot.drive(1.0)) == {(0.0, 0.0)}
#     assert len(robot.feedback) == feedback
# ```
#
# **One sentence, one test.** A fixture plays the scene, and each test looks at one thing.
#
# ```python
# @pytest.fixture
# def canceled(robot):
#     robot.drive(0.2)
#     goal = robot.send(2.0, 0.0)
#     robot.drive(1.0)
#     robot.bench.until(goal.handle.cancel_goal_async())
#     robot.drive(0.2)
#     return goal
#
#
# def test_after_a_cancel_it_stands(robot, canceled):
#     assert set(robot.drive(1.0)) == {(0.0, 0.0)}
#
#
# def test_a_cancel_is_no_success(robot, canceled):
#     assert robot.outcome(canceled)[:2] == (GoalStatus.STATUS_CANCELED, False)
# ```
#
# The second names the broken promise in the list of failures. The first is faster, but stops at the first failed assert.
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short -x test/test_robot_controller.py | cat

# %% [markdown] tags=["whole"]
# If no test failed, half of T1 is done. **This is the end of part 2.**
#
# ### The other node
#
# For `sensor_processor` the fixture `bench` is enough.
# Eight tests are finished; you write five.

# %% tags=["skeleton", "whole"]
# %%writefile test/test_sensor_processor.py
"""The node that fuses the sensors, on a bench."""

import math
import signal

from geometry_msgs.msg import Vector3
import pytest
import rclpy
from rclpy.exceptions import InvalidParameterValueException
from rclpy.qos import ReliabilityPolicy
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.sensor_processor import (
    alarm_state, battery_percent, main, SensorProcessor)
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

SENSELESS = [('fusion_frequency', 0.0), ('fusion_frequency', -20.0),
             ('battery_low_threshold', -1.0), ('battery_critical_threshold', 101.0)]


@pytest.fixture
def bench(make_bench):
    """Return a bench with the node on it."""
    return make_bench(SensorProcessor)


def scan_of(*ranges):
    """Return a scan that is good from 0.15 m to 12 m."""
    return LaserScan(ranges=ranges, range_min=0.15, range_max=12.0, angle_increment=0.1)


# Written already

@pytest.mark.parametrize(('percentage', 'percent'), [
    (0.0, 0.0), (0.5, 50.0), (1.0, 100.0), (1.2, 100.0), (-0.2, 0.0), (math.nan, 42.0),
])
def test_a_battery_reports_a_share_of_one(percentage, percent):
    assert battery_percent(percentage, previous=42.0) == pytest.approx(percent)


@pytest.mark.parametrize(('was_on', 'percent', 'is_on'), [
    (False, 19.9, True), (False, 20.0, False), (False, 21.0, False),
    (True, 19.9, True), (True, 21.9, True), (True, 22.0, False),
])
def test_an_alarm_ends_well_above_where_it_starts(was_on, percent, is_on):
    assert alarm_state(was_on, percent, 20.0) is is_on


def test_names_and_types_are_relative_and_as_agreed(bench):
    assert bench.node.get_name() == 'sensor_processor'
    for topic, message_type in (
            ('raw_scan', LaserScan), ('imu/data', Imu), ('battery/state', BatteryState)):
        subscription = bench.subscription(topic)
        assert subscription.msg_type is message_type
        assert subscription.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
    for topic, message_type in (
            ('sensor_fusion_data', SensorFusionData), ('obstacle_distance', Float32)):
        publisher = bench.publisher(topic)
        assert publisher.msg_type is message_type
        qos = publisher.qos_profile
        assert (qos.reliability, qos.depth) == (ReliabilityPolicy.RELIABLE, 10)


def test_nothing_is_published_before_the_first_scan(bench, published):
    bench.hear('imu/data', Imu())
    bench.hear('battery/state', BatteryState(percentage=0.5))
    bench.advance(1.0)
    assert published['sensor_fusion_data'] == []
    assert published['obstacle_distance'] == []


def test_without_other_sensors_the_battery_is_full_and_the_robot_at_rest(bench, published):
    bench.hear('raw_scan', scan_of(3.0))
    bench.advance(0.05)
    fused = published['sensor_fusion_data'][-1]
    assert fused.battery_level == 100.0
    assert fused.linear_acceleration == fused.angular_velocity == Vector3()


@pytest.mark.parametrize('ranges', [(), (math.inf,), (math.nan, 0.0, 0.1, 13.0)])
def test_a_scan_of_nothing_is_infinitely_far(bench, published, ranges):
    bench.hear('raw_scan', scan_of(*ranges))
    bench.advance(0.05)
    assert published['sensor_fusion_data'][-1].closest_obstacle_distance == math.inf
    assert published['obstacle_distance'][-1].data == math.inf


@pytest.mark.parametrize(('name', 'value'), SENSELESS)
def test_a_senseless_value_is_refused_at_start_and_at_run_time(make_bench, bench, name, value):
    with pytest.raises(InvalidParameterValueException, match=name):
        make_bench(SensorProcessor, **{name: value})
    assert not bench.set_parameter(name, value).successful


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it(interrupt, number):
    interrupt(number)
    assert main() == 0
    assert not rclpy.ok()


# Yours

def test_after_the_first_scan_data_comes_twenty_times_a_second(bench, published):
    pytest.fail('not written yet: F13')


def test_the_latest_of_each_sensor_is_in_the_data(bench, published):
    pytest.fail('not written yet: F12')


def test_each_alarm_sounds_once_on_the_way_down(bench, logged):
    pytest.fail('not written yet: F12')


def test_the_thresholds_are_parameters(make_bench, logged):
    pytest.fail('not written yet: F12')


def test_another_frequency_counts_at_start_and_at_once(make_bench, published):
    pytest.fail('not written yet: I6')

# %% [markdown] tags=["whole"]
# If your functions of notebook 04 have other names, change the import and the tables.
#
# #### F13: twenty a second, from the first scan on
#
# One scan, one second: 20 messages on each of the two topics.
# The last carries the frame `base_link`, the time by the node's clock, and the closest reading.

# %% tags=["piece", "whole"]
# %%into test/test_sensor_processor.py
def test_after_the_first_scan_data_comes_twenty_times_a_second(bench, published):
    bench.hear('raw_scan', scan_of(3.0, 2.0, math.inf))
    bench.advance(1.0)
    pytest.fail('not written yet: F13')  # TODO: both topics; frame, stamp, closest reading

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `fused = published['sensor_fusion_data'][-1]`, then `fused.header.frame_id`, `(fused.header.stamp.sec, fused.header.stamp.nanosec) == (1, 0)`; a `Float32` has `.data`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     assert len(published['sensor_fusion_data']) == 20
#     assert [m.data for m in published['obstacle_distance']] == [2.0] * 20
#     fused = published['sensor_fusion_data'][-1]
#     assert fused.header.frame_id == 'base_link'
#     assert (fused.header.stamp.sec, fused.header.stamp.nanosec) == (1, 0)
#     ...                       # closest_obstacle_distance
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_sensor_processor.py -k "first_scan" | tail -n 15

# %% [markdown] tags=["whole"]
# #### F12: the latest of each
#
# The second scan must win.
# After one tick of 0.05 s, all that the node has heard is in the data.

# %% tags=["piece", "whole"]
# %%into test/test_sensor_processor.py
def test_the_latest_of_each_sensor_is_in_the_data(bench, published):
    bench.hear('raw_scan', scan_of(3.0))
    bench.hear('raw_scan', scan_of(math.nan, 4.0, 0.0))
    bench.hear('battery/state', BatteryState(percentage=0.25))
    bench.hear('imu/data', Imu(linear_acceleration=Vector3(x=1.0, y=2.0, z=3.0),
                               angular_velocity=Vector3(x=4.0, y=5.0, z=6.0)))
    pytest.fail('not written yet: F12')  # TODO: one tick; the four fields

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `bench.advance(0.05)`; messages compare by value: `fused.linear_acceleration == Vector3(x=1.0, y=2.0, z=3.0)`. The battery is in percent.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     bench.advance(0.05)
#     fused = published['sensor_fusion_data'][-1]
#     assert fused.closest_obstacle_distance == 4.0
#     assert fused.battery_level == 25.0
#     assert fused.linear_acceleration == Vector3(x=1.0, y=2.0, z=3.0)
#     ...                       # angular_velocity
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_sensor_processor.py -k "latest" | tail -n 15

# %% [markdown] tags=["whole"]
# #### F12: each alarm once
#
# However often the battery crosses 20 and 10 on its way down, the log must hold one warning and one error, nothing else.
#
# And the thresholds are parameters: with 50 and 30 a battery at 40 % warns; when the critical one becomes 45 while the node runs, the next message at 40 % is an error.

# %% tags=["piece", "whole"]
# %%into test/test_sensor_processor.py
def test_each_alarm_sounds_once_on_the_way_down(bench, logged):
    for percentage in (0.5, 0.19, 0.15, 0.21, 0.19, 0.09, 0.05, 0.11, 0.09, 0.01):
        bench.hear('battery/state', BatteryState(percentage=percentage))
    pytest.fail('not written yet: F12')  # TODO: the log, whole


def test_the_thresholds_are_parameters(make_bench, logged):
    bench = make_bench(SensorProcessor, battery_low_threshold=50.0,
                       battery_critical_threshold=30.0)
    pytest.fail('not written yet: F12')  # TODO: hear 40 %, change one threshold, hear 40 % again

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `logged` is a list of (severity, words), with `'WARN'` and `'ERROR'`. If your words differ, compare only the severities: `[severity for severity, _ in logged]`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     # each alarm once
#     assert logged == [('WARN', 'Battery low: 19 %'), ('ERROR', 'Battery critical: 9 %')]
#
#     # the thresholds are parameters
#     bench.hear('battery/state', BatteryState(percentage=0.4))
#     bench.set_parameter('battery_critical_threshold', 45.0)
#     bench.hear('battery/state', BatteryState(percentage=0.4))
#     ...                       # a warning, then an error
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_sensor_processor.py -k "once_on_the_way or thresholds_are" | tail -n 15

# %% [markdown] tags=["whole"]
# #### I6: another frequency
#
# At the start 10 Hz: ten messages in the first second.
# Then 5 Hz at run time: five more in the next.

# %% tags=["piece", "whole"]
# %%into test/test_sensor_processor.py
def test_another_frequency_counts_at_start_and_at_once(make_bench, published):
    bench = make_bench(SensorProcessor, fusion_frequency=10.0)
    bench.hear('raw_scan', scan_of(3.0))
    pytest.fail('not written yet: I6')  # TODO: a second at 10 Hz, then one at 5 Hz

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# Count `published['sensor_fusion_data']` after each second: 10, then 15.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     bench.advance(1.0)
#     assert len(published['sensor_fusion_data']) == 10
#     bench.set_parameter('fusion_frequency', 5.0)
#     bench.advance(1.0)
#     ...                       # and now?
# ```
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=short test/test_sensor_processor.py -k "another_frequency" | tail -n 15

# %% [markdown] tags=["whole"]
# ### What the tests need
#
# If only the tests need a package, `package.xml` names it as `<test_depend>`.

# %% tags=["whole"]
# !grep -n "depend>" package.xml

# %% [markdown] tags=["whole"]
# You should see two lines with `test_depend`: `python3-pytest`, which runs the tests, and `ament_cmake_pytest`, which lets `colcon test` run them.
# A package that the nodes import must not be only a `test_depend`.

# %% [markdown] tags=["whole"]
# ## Which lines were reached
#
# T2 counts lines and branches of the whole package, and gives full marks at 90 %.

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: pytest says how long it took, and one's own numbers are one's own.
# !coverage run --branch --source=ros2_robot_controller --data-file=../../.coverage -m pytest -q --tb=no --no-summary test | cat
# !coverage report --data-file=../../.coverage --show-missing

# %% [markdown] tags=["whole"]
# Do not test a missing line, but the situation in which it matters.
# `102->exit` means: the `if` in line 102 was never false.
#
# Covered does not mean tested: your node tests say nothing about a beam at 61 degrees, because their scans have four beams.
#
# ### Where a thing is
#
# So `test_scans.py` tests `utils/scans.py` directly, with three tests. The last one is finished.

# %% tags=["skeleton", "whole"]
# %%writefile test/test_scans.py
"""What counts as a reading, and where it lies."""

import math

import pytest
from ros2_robot_controller.utils.scans import closest_reading, measure_proximity, Proximity
from sensor_msgs.msg import LaserScan

INF = math.inf


def scan_of(*ranges, angle_min=0.0, step=math.radians(10.0)):
    """Return a scan that is good from 0.15 m to 12 m."""
    return LaserScan(ranges=ranges, range_min=0.15, range_max=12.0, angle_min=angle_min,
                     angle_increment=step)


def test_an_invalid_reading_hides_no_real_one():
    assert closest_reading(scan_of(2.0, 3.0)) == pytest.approx(2.0)


def test_where_a_thing_is_goes_by_the_angle_of_its_beam():
    assert measure_proximity(scan_of(INF)) == Proximity()


def test_the_nearest_of_each_direction_counts():
    ranges = [5.0] * 36
    ranges[1], ranges[2], ranges[9], ranges[18], ranges[19] = 3.0, 2.0, 1.0, 4.0, 4.5
    assert measure_proximity(scan_of(*ranges)) == Proximity(ahead=2.0, behind=4.0, anywhere=1.0)

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/scans.py", "test/test_scans.py")

# %% [markdown] tags=["whole"]
# #### Seven kinds of nothing
#
# Make the first test a table with one column, `invalid`: NaN, both infinities, zero, a negative one, one below 0.15 m, one above 12 m.
# A real 2.0 between two invalid readings must be found; two invalid readings alone give `INF`.

# %% tags=["piece", "whole"]
# %%into test/test_scans.py
@pytest.mark.parametrize('invalid', [math.nan])  # TODO: six more
def test_an_invalid_reading_hides_no_real_one(invalid):
    assert closest_reading(scan_of(invalid, 2.0, invalid, 3.0)) == 2.0
    # TODO: and of two invalid ones alone?

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `INF` is at the top of the file, `-INF` is a number, too; `0.1` is below `range_min`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# @pytest.mark.parametrize('invalid', [math.nan, INF, -INF, 0.0, -1.0, 0.1, 12.5])
# def test_an_invalid_reading_hides_no_real_one(invalid):
#     assert closest_reading(scan_of(invalid, 2.0, invalid, 3.0)) == 2.0
#     ...                       # two alone: INF
# ```
# </details>

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/scans.py", "test/test_scans.py", "valid_readings")

# %% [markdown] tags=["whole"]
# #### Ahead, behind, neither
#
# One beam reads 1.0, at an angle that the table gives.
# Within 60 degrees of straight ahead it is ahead; of straight back, behind; otherwise only *anywhere*.
# Test both sides of each edge, left and right. (Some drivers send 359 degrees for -1.)

# %% tags=["piece", "whole"]
# %%into test/test_scans.py
@pytest.mark.parametrize(('degrees', 'ahead', 'behind'), [
    (0.0, 1.0, INF), (180.0, INF, 1.0),
    # TODO: 59, 61, 119 and 121 to each side, -180, 359
])
def test_where_a_thing_is_goes_by_the_angle_of_its_beam(degrees, ahead, behind):
    near = measure_proximity(scan_of(1.0, angle_min=math.radians(degrees)))
    assert near == Proximity(ahead=ahead, behind=behind, anywhere=1.0)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# 59 degrees is ahead, 61 is not: `(61.0, INF, INF)`; 121 is behind, 119 is not.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#     (0.0, 1.0, INF), (59.0, 1.0, INF), (-59.0, 1.0, INF), (359.0, 1.0, INF),
#     (61.0, INF, INF), (-61.0, INF, INF), (119.0, INF, INF), (-119.0, INF, INF),
#     ...                       # behind: 121 to each side, 180, -180
# ```
# </details>

# %% tags=["whole"]
mutant_matrix("ros2_robot_controller/utils/scans.py", "test/test_scans.py", "measure_proximity")

# %% [markdown] tags=["whole"]
# One row stays grey: `angle - math.pi` became `angle + math.pi`.
# The two differ by a whole turn, which `normalize_angle` folds away: an *equivalent* mutant.

# %% [markdown]
# ### What the grader finds
#
# T3 tries ten or twenty mutants of your package here, where the grading tries thirty to fifty. It takes a while.

# %% tags=["check"]
check("T1", "T2", "T3")

# %% [markdown] tags=["whole"]
# If T3 is not full, take the first mutant that survived, and ask what would go wrong on the robot.

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# Compare whole lists of commands; use numbers that are all different; give parameters values that are *not* their defaults; test both sides of every edge.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# For a mutant "the parameter safety_margin was ignored, its default 0.3 used":
#
# ```python
# def test_the_margin_is_a_parameter(make_robot):
#     robot = make_robot(safety_margin=1.0)      # not its default
#     robot.set_speed(0.5)
#     robot.scan = scan_of(ahead=1.0)
#     ...                       # half of the margin is left, so half of the speed
# ```
# </details>

# %% [markdown] tags=["whole"]
# ## Let a linter read it first
#
# A linter reads code without running it.
# ROS has its own rules, `ament_flake8`, such as at most 99 characters in a line.
#
# **How many findings** will it report for this file?

# %% tags=["whole"]
# %%writefile ../../careless.py
import os
import math

class Careless( object ):
    def on_scan(self, scan, seen=[]):
        l = [r for r in scan.ranges if r != None]
        if l == []: return
        seen.append(min(l))
        return math.hypot(*seen)

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: findings and their count go into two streams, and their order may change.
# !cd ../.. && ament_flake8 careless.py | grep careless.py:

# %% [markdown] tags=["whole"]
# It does not find the worst: `seen=[]`, one list that all calls share, and that a scan can hold NaN.

# %% [markdown] tags=["whole"]
# Now run it on your own package. Q1 asks for no finding.

# %% tags=["nbval-ignore-output", "whole"]
# As above: the order of the lines may change.
# !ament_flake8 . | grep -E "^\./|errors|No problems"

# %% tags=["check", "whole"]
check("Q1")

# %% [markdown] tags=["whole"]
# `# noqa` at the end of a line makes the linter ignore it, but the grader does not. T1 does not count tests that only run a linter.
#
# `colcon test` runs the tests of all packages that were built.
# In a terminal, in the folder `ws`:
#
#     colcon build
#     colcon test
#     colcon test-result --verbose
#
# **Why two commands?** `colcon test` ends with 0 even when tests have failed: it *ran* them. The exit code of `colcon test-result` is what a CI job looks at.
#
# > **On a real TurtleBot 4:** make the first drive a slow one, as [docs/turtlebot4.md](../docs/turtlebot4.md) says.

# %% [markdown] tags=["whole"]
# ## A hunt
#
# `hunt` looks for the faults that you did not think of: it makes up situations within the contract, runs your node in them, and stops at the first in which a promise of the contract is broken.
# Then it makes that situation smaller, for as long as the promise is still broken.
#
# **Predict:** which situation does your robot handle worst?

# %% tags=["whole"]
from grader.notebook import hunt

hunt("F4", cases=20)

# %% [markdown] tags=["whole"]
# No fault in 20 cases is no proof. More cases, or another `seed`, look further.
#
# `H1`, `H2` and `H3` are packages with one small fault each; `of` hunts in them.
# The hunt takes a minute or more.

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: how small the case becomes is no promise.
hunt("F9", of="H3", cases=40)

# %% [markdown] tags=["whole"]
# Drag the time, and say what the fault is before you read the code. It lies in `ws/hunt/H3`.
#
# <details><summary>Which line is it?</summary>
#
# In `navigator.py` the distance is that along x alone. Where the robot faces along y, it is 0.
# </details>
#
# What it found is also a file in `ws/hunt`.
# Turn it into a test on the bench, see the test fail, correct the line, and see it pass; `test_found_….py` beside it is such a test.
# `!grader hunt --again FILE --package DIR` then runs the case itself again.
# `H1` breaks F7, `H2` breaks F10. [The hunt](../docs/hunt.md) lists every step of a case.
#
# ## Go further
#
# - Write the other test files: `test_conversions.py`, `test_steering.py`, `test_settings.py`, `test_speed_server.py`, `test_running.py`.
# - A goal whose path is blocked, F11: a wall at 0.4 m for two seconds, then free again.

# %% [markdown]
# ## Recall
#
# <details><summary>What does 100 % coverage tell you?</summary>
#
# That some test ran every line and branch, but not that any assert checked them.
# </details>
#
# <details><summary>Why does <code>bench.hear</code> look for the subscription by its topic, and not call the callback by its name?</summary>
#
# So that a wrong topic or type fails: a test should know what the contract promises, and nothing about how it is done.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>A test passes on your machine, and one time in ten it fails on the server. What do you look for first?</summary>
#
# Look for wall time: a sleep, a time-out, a count "within a second".
# Set the clock by hand, or wait for the event itself.
# </details>

# %% [markdown]
# **Next:** [10 Show and hand in](10_show_and_hand_in.ipynb).

# %%
from grader.notebook import progress

progress()
