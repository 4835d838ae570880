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
# # 04 Seeing
#
# ![At the left a robot's lidar scan on the map, at the right the distance to a moving cart over time: the true distance as a line, the closest valid reading as points on it](pictures/04.png)
#
# Your robot gets a lidar, which sends 360 distances ten times a second.
# Today you write a node that listens to lidar, inertial sensor and battery.
# Twenty times a second the node reports how near the nearest thing is, and the state of the robot.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - read a laser scan: which beam looks where, and which readings mean nothing;
# - find out why a subscriber hears nothing although the topic is there, and fix it;
# - combine sensors of different rates in one message, at a rate of your choice;
# - keep your node on simulated time;
# - warn once, and not a hundred times.
#
# **Time:** part 1, `scans.py`: 45 to 80 minutes.
# Part 2, the node, from "Be seen on the graph": 40 to 75 minutes.
# Part 3, from "Whose clock?": 10 to 25 minutes.
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# **Your package so far**, and what you add today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/  scripts/
#     └── ros2_robot_controller/
#         ├── __init__.py
#         ├── robot_controller.py                  an empty node
#         ├── sensor_processor.py                  an empty node  ← part 2: the real one
#         └── utils/
#             ├── __init__.py  running.py  conversions.py
#             ├── settings.py                      ← part 2, given
#             └── scans.py                         ← part 1

# %%
from grader.notebook import begin, check, run_node, start_at, tries

begin("04")

# %% [markdown]
# If something is missing above and you would rather start here, run `start_at("04")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 03: is <code>nan &lt; 0.5</code> true, and is <code>nan >= 0.5</code>?</summary>
#
# Neither. So ask whether a number is good, never whether it is bad.
# </details>
# <details><summary>Notebook 03: which way does a robot face at a yaw of −90°, and which way does it turn with a positive <code>angular.z</code>?</summary>
#
# It faces to the right, and it turns to the left: angles count counter-clockwise.
# </details>
# <details><summary>Notebook 02: which type has a field <code>float32[] ranges</code>, and where do you look that up?</summary>
#
# `sensor_msgs/msg/LaserScan`; `ros2 interface show sensor_msgs/msg/LaserScan`.
# </details>

# %% [markdown]
# ## What a scan is
#
# This is one scan of a robot in an office, a message on the topic `scan`.

# %%
import math
from math import inf, nan

import matplotlib.pyplot as plt
import numpy as np

from sim import Simulator, Tourist, Twist, drive, load_world
from sim.bridge import to_message
from sim.views import COLORS, run_view

PROCESSOR = "ros2_robot_controller/sensor_processor.py"  # a file of part 2

# %%
simulator = Simulator(load_world("office"))
drive(simulator, Tourist(simulator), 6.0)
scan = to_message(simulator.scan())
for name in ("angle_min", "angle_max", "angle_increment", "range_min", "range_max"):
    print(f"{name:16s} {getattr(scan, name):8.4f}")
print(f"ranges           {len(scan.ranges)} numbers:", [round(r, 2) for r in scan.ranges[:4]])

# %% [markdown]
# The message does not say at which angle a beam was measured; you compute it.
# Beam i looks along `angle_min + i * angle_increment`: 0 is ahead, and the angles grow to the left (counter-clockwise).

# %% [markdown] tags=["whole"]
# `angle_min` is -3.1416, so beam 0 looks straight back.
# **Predict:** which beam looks straight ahead? Which one to the left?

# %% tags=["whole"]
for beam in (0, 90, 180, 270, 359):
    angle = scan.angle_min + beam * scan.angle_increment
    print(f"beam {beam:3d} looks along {math.degrees(angle):6.1f}°, reads {scan.ranges[beam]:.2f} m")

# %% tags=["whole"]
def points(scan):
    """Return x and y of each reading in the frame of the lidar, in metres."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    return np.cos(angles) * scan.ranges, np.sin(angles) * scan.ranges

# %% tags=["whole"]
x, y = points(scan)
figure, (line, plan) = plt.subplots(1, 2, figsize=(11, 3.6), layout="constrained")
line.plot(scan.ranges, ".", color=COLORS["scan"], markersize=4)
line.set(xlabel="beam", ylabel="reading (m)", title="the message", xticks=range(0, 361, 90))
plan.plot(x, y, ".", color=COLORS["scan"], markersize=4)
plan.plot(0, 0, ">", color=COLORS["path"], markersize=11)
plan.set(xlabel="x (m)", ylabel="y (m)", title="in the frame of the lidar", aspect="equal")
for axes in (line, plan):
    axes.grid(alpha=0.3)

# %% [markdown] tags=["whole"]
# Many programs take beam 180 for "ahead"; the drivers of other lidars start at angle 0.
# So rely on the *angle* of a beam, never on its number.
#
# The angle is measured from the x axis of the *lidar*, whose frame `header.frame_id` names.
# On a TurtleBot 4 the lidar is turned by 90° to the left, so a wall ahead of the robot is at -90°, and a program that takes angle 0 for "ahead" drives into it.
# How two frames lie to each other, a **transform**, is the subject of notebook 12.
# On the contract's robot the lidar is in the centre, and angle 0 is "ahead".

# %% [markdown]
# ## Invalid readings

# %% [markdown] tags=["whole"]
# What does the message's own definition say about the readings?

# %% tags=["whole"]
# !ros2 interface show sensor_msgs/msg/LaserScan | tail -5

# %% [markdown]
# By the message's definition, your node must discard values outside the range.
# None of these is a distance:
#
# | reading | what it means |
# |---|---|
# | `inf` | nothing within reach ([REP 117](https://www.ros.org/reps/rep-0117.html)) |
# | `nan` | the measurement failed |
# | `-inf` | something is there, too near to measure |
# | `0.0` | nothing came back, in the language of older drivers |
# | below `range_min`, above `range_max` | not to be trusted: a reflection, or the robot's own cable |
# | `[]` | no readings at all: the driver is just starting, or its motor has stopped |
#
# A **valid reading** is finite and within `range_min` and `range_max`.
# Anything else is neither an obstacle nor a reason to crash.
# That is requirement **F6**, and most first versions fail it because they use `min`.

# %% [markdown] tags=["whole"]
# **Predict:** what will each line print? A wall is 0.4 m away.

# %% tags=["whole"]
print(min([0.4, nan, 3.0]))
print(min([nan, 0.4, 3.0]))
print(np.min([0.4, nan, 3.0]))
print(min([0.4, 0.0, 3.0]))

# %% [markdown] tags=["whole"]
# The last line is a false alarm.
# The second is dangerous: each comparison with NaN is False, so `min` keeps the first value. Whether it sees the wall depends on *where* the NaN is.
# With NumPy's `min` a single NaN anywhere hides every wall.
#
# Now a robot with Python's `min` drives towards a wall, and should stop below 0.5 m. Its beam 0, which looks straight *back*, is broken.
#
# **Predict:** what happens?

# %% tags=["whole"]
def careless(broken_beam):
    """Return a driver that stops before what is near, and forgets that a reading may be invalid."""

    def driver(seen):
        ranges = seen.scan.ranges.tolist()
        ranges[broken_beam] = math.nan
        return Twist(0.0, 0.0) if min(ranges) < 0.5 else Twist(0.3, 0.0)

    return driver


run_view(drive(Simulator(load_world("wall_ahead")), careless(broken_beam=0), 8.0))

# %% [markdown] tags=["whole"]
# It hits the wall at full speed, although its sensor saw the wall all the time: `nan < 0.5` is False.
#
# **Change one thing:** `broken_beam=1`. Why does it stop now?

# %% [markdown]
# ### Part 1's file
#
# Two nodes use this file: today's needs the closest reading, the one of notebook 05 also what is *ahead* and *behind*.
# You fill its three functions one by one.
#
# `Proximity` is a **dataclass**: from its fields Python writes `__init__`, what `print` shows, and `==`.
# `found = Proximity(0.4)` has 0.4 in its first field, `ahead`, and the defaults in the others; `found.ahead` reads a field.
# `frozen=True` forbids changing a field afterwards; `replace(found, behind=1.0)` makes a changed copy.

# %% tags=["skeleton"]
# %%writefile ros2_robot_controller/utils/scans.py
"""Find how near things are in a laser scan. Pure geometry: no node, no decisions."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

from ros2_robot_controller.utils.conversions import normalize_angle
from sensor_msgs.msg import LaserScan

SECTOR_HALF_WIDTH = math.radians(60.0)  # what lies in the way: 60 degrees to each side


@dataclass(frozen=True)
class Proximity:
    """The closest valid reading, in metres, in each direction that matters; inf for none."""

    ahead: float = math.inf
    behind: float = math.inf
    anywhere: float = math.inf


def valid_readings(scan: LaserScan) -> Iterator[tuple[float, float]]:
    yield from ()  # exercise 1


def closest_reading(scan: LaserScan) -> float:
    return math.inf  # exercise 2


def measure_proximity(scan: LaserScan) -> Proximity:
    return Proximity()  # exercise 3

# %% [markdown]
# ### Exercise 1: the valid ones
#
# `valid_readings` goes through `scan.ranges` and *yields* a pair (angle, distance) for each reading that is valid.
# (`yield` hands out one value at a time; `list(valid_readings(scan))` collects them all.)
#
# `enumerate(scan.ranges)` gives the number and the distance of each beam.
# Ask "is it good?", never "is it bad?": NaN answers False to both.
# Some drivers leave both limits at 0, or set the upper one to infinity. Then 0 or `inf` is within the limits, so a valid distance is also above 0 and below `math.inf`.
# Give the function a docstring, too.

# %% tags=["piece"]
# %%into ros2_robot_controller/utils/scans.py
def valid_readings(scan: LaserScan) -> Iterator[tuple[float, float]]:
    # TODO: for each beam: is the distance valid? If so, yield its angle and the distance
    yield from ()

# %% [markdown]
# Try it on scans of your own, with beam 0 looking back.

# %%
from sensor_msgs.msg import LaserScan


def make_scan(ranges, angle_min=-math.pi, limits=(0.25, 12.0)):
    """Return a scan of a whole turn with these readings."""
    step = math.tau / max(1, len(ranges))
    made = LaserScan(angle_min=angle_min, angle_increment=step, ranges=ranges)
    made.range_min, made.range_max = limits
    return made


def valid(ranges, **more):
    """Return the distances of the valid ones."""
    return [distance for _, distance in valid_readings(make_scan(ranges, **more))]


SCANS = "ros2_robot_controller/utils/scans.py"
tries(
    {
        "valid([2.0, 1.5])": [2.0, 1.5],
        "valid([nan, 0.5, 3.0])": [0.5, 3.0],
        "valid([inf, nan, -inf, 0.0, 0.125, 25.0, 0.5])": [0.5],
        "valid([0.25, 12.0])": [0.25, 12.0],
        "valid([])": [],
        "valid([0.0, 2.0, inf], limits=(0.0, inf))": [2.0],
        "[round(math.degrees(a)) for a, _ in valid_readings(make_scan([4.0, nan, 2.0, 1.0]))]": [-180, 0, 90],
    },
    of=SCANS,
)

# %% [markdown]
# (A `float32` stores these numbers exactly. Do not compare other numbers in a message with `==`.)
#
# <details><summary>Hint 1: what you need</summary>
#
# - valid: `scan.range_min <= distance <= scan.range_max` and `0.0 < distance < math.inf`
# - the angle: `scan.angle_min + beam * scan.angle_increment`
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def valid_readings(scan: LaserScan) -> Iterator[tuple[float, float]]:
#     """Yield (angle, distance) of each beam that measured something, in radians and metres."""
#     for beam, distance in enumerate(scan.ranges):
#         in_range = scan.range_min <= distance <= scan.range_max
#         if in_range and 0.0 < distance < math.inf:
#             ...          # yield the beam's angle and the distance
# ```
# </details>

# %% [markdown] tags=["whole"]
# ### Exercise 2: the closest one
#
# `closest_reading` returns the smallest valid distance, and `inf` where there is none.
# `min` of an empty list needs a default: `min(numbers, default=math.inf)`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/scans.py
def closest_reading(scan: LaserScan) -> float:
    # TODO: the smallest distance among the valid readings
    return math.inf

# %% tags=["whole"]
tries(
    {
        "closest_reading(make_scan([nan, 0.5, 3.0]))": 0.5,
        "closest_reading(make_scan([3.0, 0.0, 0.5]))": 0.5,
        "closest_reading(make_scan([nan, inf, 0.0]))": inf,
        "closest_reading(make_scan([]))": inf,
    },
    of=SCANS,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `(distance for _, distance in valid_readings(scan))` are the distances.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def closest_reading(scan: LaserScan) -> float:
#     """Return the closest valid reading of the whole scan in metres, inf where there is none."""
#     distances = (distance for _, distance in valid_readings(scan))
#     ...                  # return the smallest
# ```
# </details>

# %% [markdown] tags=["whole"]
# Now the robot with the broken beam uses *your* `closest_reading`.

# %% tags=["whole"]
from dataclasses import replace


def careful(seen):
    """Drive, and stop before what is near, whatever beam 0 says."""
    ranges = seen.scan.ranges.copy()
    ranges[0] = nan
    closest = closest_reading(to_message(replace(seen.scan, ranges=ranges)))
    return Twist(0.0, 0.0) if closest < 0.5 else Twist(0.3, 0.0)


again = drive(Simulator(load_world("wall_ahead")), careful, 8.0)
print(f"contacts: {len(again.contacts)}, from hull to wall: {again.clearance[-1]:.2f} m")

# %% [markdown] tags=["whole"]
# You should see no contacts, and about 0.3 m.

# %% [markdown]
# ### Exercise 3: ahead and behind
#
# `closest_reading(scan)` is the smallest valid distance of a whole scan, `inf` if there is none.
# `measure_proximity` sorts the valid readings by their angle: within `SECTOR_HALF_WIDTH` of straight ahead (0), within the same angle of straight back (π), and anywhere.
#
# One trap: for drivers that start at angle 0, the right-hand side is 270°, not -90°.
# `normalize_angle`, from notebook 03, corrects that.

# %% tags=["piece"]
# %%into ros2_robot_controller/utils/scans.py
def measure_proximity(scan: LaserScan) -> Proximity:
    # TODO: collect the distances ahead and behind; the smallest of each, inf for none
    return Proximity()

# %%
around = [4.0, 3.0, 2.0, 1.0]  # four beams, a quarter turn apart
tries(
    {
        "measure_proximity(make_scan(around))": Proximity(ahead=2.0, behind=4.0, anywhere=1.0),
        "measure_proximity(make_scan(around, angle_min=0.0))": Proximity(ahead=4.0, behind=2.0, anywhere=1.0),
        "measure_proximity(make_scan([4.0] * 7 + [1.0], angle_min=0.0))": Proximity(ahead=1.0, behind=4.0, anywhere=1.0),
        "measure_proximity(make_scan([nan, 3.0, inf, 1.0]))": Proximity(anywhere=1.0),
        "measure_proximity(make_scan([]))": Proximity(),
    },
    of=SCANS,
)

# %% [markdown] tags=["whole"]
# The scan of the office again: every reading that is valid for your function, in the colour of its sector.

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
axes.plot(x, y, ".", color="0.85", markersize=7)
for angle, distance in valid_readings(scan):
    ahead, behind = math.cos(angle) >= 0.5, math.cos(angle) <= -0.5
    color = "C3" if ahead else "C0" if behind else "0.5"
    axes.plot(distance * math.cos(angle), distance * math.sin(angle), ".", color=color, markersize=4)
axes.plot(0, 0, ">", color=COLORS["path"], markersize=11)
axes.set(xlabel="x, ahead (m)", ylabel="y, left (m)", title="red ahead, blue behind", aspect="equal")
axes.grid(alpha=0.3)
print(measure_proximity(scan))

# %% [markdown] tags=["whole"]
# Only pale points? Then no reading counts as valid yet.

# %% [markdown]
# <details><summary>Hint 1: what you need</summary>
#
# - ahead: `abs(normalize_angle(angle)) <= SECTOR_HALF_WIDTH`
# - behind: the same for `angle - math.pi`
# - the smallest of a list that may be empty: `min(ahead, default=math.inf)`; anywhere: `closest_reading(scan)`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def measure_proximity(scan: LaserScan) -> Proximity:
#     """Return how near things are ahead, behind and anywhere."""
#     ahead, behind = [], []
#     for angle, distance in valid_readings(scan):
#         if abs(normalize_angle(angle)) <= SECTOR_HALF_WIDTH:
#             ahead.append(distance)
#         elif abs(normalize_angle(angle - math.pi)) <= SECTOR_HALF_WIDTH:
#             behind.append(distance)
#     ...                  # return a Proximity of the three smallest
# ```
# </details>

# %% [markdown] tags=["whole"]
# ### An empty scan ends a node
#
# What does an exception in a callback do?
# Here one node publishes like a lidar, and another listens and uses a plain `min`.

# %% tags=["whole"]
import os
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data

os.environ["RCUTILS_CONSOLE_OUTPUT_FORMAT"] = "[{severity}] [{name}]: {message}"  # no time of day
os.environ["RCUTILS_LOGGING_USE_STDOUT"] = "1"  # where print goes, too
if not rclpy.ok():
    rclpy.init()
lidar, listener = Node("lidar"), Node("listener")
executor = SingleThreadedExecutor()
executor.add_node(lidar)
executor.add_node(listener)
scans = lidar.create_publisher(LaserScan, "scan", qos_profile_sensor_data)


def spin_until(condition, seconds=3.0):
    """Serve callbacks until the condition holds, for so many seconds at most."""
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)

# %% tags=["whole"]
heard = []


def on_scan(message):
    """Note the closest reading, carelessly."""
    heard.append(min(message.ranges))


def send(ranges):
    """Publish a scan and let the listener hear it."""
    before = len(heard)
    scans.publish(LaserScan(ranges=ranges))
    spin_until(lambda: len(heard) > before)


ears = listener.create_subscription(LaserScan, "scan", on_scan, qos_profile_sensor_data)
spin_until(lambda: scans.get_subscription_count() == 1)
try:
    for ranges in ([2.0, 1.5], [nan, 0.4], [], [0.3]):
        send(ranges)
except ValueError as error:
    print("spin() has ended:", error)
listener.destroy_subscription(ears)
print("heard:", heard)

# %% [markdown] tags=["whole"]
# `spin` does not catch the exception, so the program ends. It never receives the fourth scan.
#
# **This is the end of part 1.**
# F6 is a requirement for nodes, so `check("F6")` comes in part 2.

# %% [markdown]
# ## Be seen on the graph
#
# A publisher and a subscriber are connected if three things match: the name of the topic, the *name* of the type, and the **quality of service**, QoS.
# QoS is what the publisher promises, and what the subscriber asks for.
#
# | | reliable | best effort |
# |---|---|---|
# | as an offer | "I send again what got lost" | "I send once" |
# | as a request | "I need every message" | "I take what comes" |
#
# Many sensor drivers send best effort, because a lost scan would be out of date before it could be sent again.
# In rclpy the number in `create_subscription(..., 10)` means: keep the last 10, and *reliable*.

# %% [markdown] tags=["whole"]
# The lidar from above sends 30 scans, best effort, to two subscribers, one with each setting.
# **Predict:** how many will each hear?

# %% tags=["nbval-ignore-output", "whole"]
# The lines of the log may come in another order.
count = {"reliable": 0, "best effort": 0}


def counter(name):
    """Return a callback that counts under this name."""

    def callback(_message):
        count[name] += 1

    return callback


picky, modest = Node("picky"), Node("modest")
executor.add_node(picky)
executor.add_node(modest)
picky.create_subscription(LaserScan, "scan", counter("reliable"), 10)
modest.create_subscription(LaserScan, "scan", counter("best effort"), qos_profile_sensor_data)
spin_until(lambda: lidar.count_subscribers("scan") == 2 and scans.get_subscription_count() >= 1)
for _ in range(30):
    scans.publish(scan)
    executor.spin_once(timeout_sec=0.05)
spin_until(lambda: count["best effort"] == 30)
print(count)

# %% [markdown] tags=["whole"]
# Zero of thirty, and no exception; only a warning about "incompatible QoS" in the log.
#
# The command that tells you is `ros2 topic info -v`; `--spin-time` gives it a few seconds to discover your nodes:

# %% tags=["nbval-ignore-output", "whole"]
# The order of the endpoints may change.
# !ros2 topic info -v --spin-time 4 /scan | grep -E "Node name|Endpoint type|Reliability"

# %% [markdown]
# A subscriber must not request more than the publisher offers.
#
# | publisher offers | subscriber requests | |
# |---|---|---|
# | reliable | reliable | every message arrives |
# | reliable | best effort | messages arrive |
# | best effort | best effort | messages arrive |
# | best effort | reliable | **nothing**, and no error |
#
# So a node that should work on every robot requests little and offers much:
# it subscribes to sensors with `qos_profile_sensor_data` (best effort, the last 5), and publishes its results reliably, with `10`.
# **I4** asks that both nodes show the contract's names and types, and that their sensor subscriptions match best-effort publishers.

# %% [markdown] tags=["whole"]
# **Durability**, a second setting, says what happens to a message that was sent *before* a subscriber joined: *volatile* (the default, right for a scan) loses it, *transient local* keeps it.
# A map, a robot's description or the static transforms of notebook 12 are sent *once*; their publishers are transient local.
#
# <details><summary>A volatile publisher sends scans. What does a subscriber hear that requests transient local?</summary>
#
# Nothing, not even what is sent later: it requests stored messages; a volatile publisher offers none.
# In rclpy: `QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)`.
# </details>

# %% [markdown]
# The **names** matter, too. The contract's `raw_scan` is relative, without a slash in front. So you can change it when you start the node, with `--ros-args -r raw_scan:=scan` or a namespace.
# `/raw_scan` would fix the name for everyone.

# %% tags=["whole"]
for node in (lidar, listener, picky, modest):
    executor.remove_node(node)
    node.destroy_node()

# %% [markdown]
# ## Fuse scan, battery and motion

# %% [markdown] tags=["whole"]
# The picture shows when the messages arrive in the first second; the last row is your node's timer.

# %% tags=["whole"]
from sim.sensors import BatteryReading, ImuReading, ScanReading

readings = Simulator(load_world("office")).step(1.0)
kinds = {"battery/state": BatteryReading, "imu/data": ImuReading, "raw_scan": ScanReading}
rows = {topic: [r.stamp for r in readings if isinstance(r, kind)] for topic, kind in kinds.items()}
rows["your timer"] = np.arange(1, 21) / 20
figure, axes = plt.subplots(figsize=(9, 2.4), layout="constrained")
axes.eventplot(list(rows.values()), linelengths=0.7, colors=["C2", "C0", COLORS["scan"], "0.2"])
labels = [f"{name}, {len(times)} Hz" for name, times in rows.items()]
axes.set(yticks=range(4), yticklabels=labels, xlabel="simulated time (s)")
axes.invert_yaxis()

# %% [markdown]
# The three sensors have three rates: the scan 10 Hz, the battery 1 Hz, the inertial sensor (IMU) 100 Hz. When would you publish?
#
# - In the callback of the scan: then your node sends nothing when the lidar stops.
# - In every callback: 111 messages a second, most of them with nothing new.
# - On a **timer**: each callback only *remembers* the latest message of its kind; the timer publishes what is remembered.
#
# The third way is the usual one: you choose the rate.
# But the scan may be 0.1 s old when you publish it.

# %% [markdown] tags=["whole"]
# ### Part 2's files
#
# The first file is given: it declares a node's parameters.
# You replace it in notebook 08.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/utils/settings.py
"""Declare parameters. So far every value is taken; what makes no sense is refused later."""

from dataclasses import dataclass
from typing import Any

from rclpy.node import Node


@dataclass(frozen=True)
class Setting:
    """A parameter's default."""

    default: Any


def at_least_zero(default: float) -> Setting:
    """Return a setting for a size that may be zero: a distance, a speed limit."""
    return Setting(default)


def above_zero(default: float) -> Setting:
    """Return a setting for a size that must not be zero: an acceleration."""
    return Setting(default)


def rate(default: float) -> Setting:
    """Return a setting for a rate in Hz."""
    return Setting(default)


def percentage(default: float) -> Setting:
    """Return a setting for a share in percent."""
    return Setting(default)


def name(default: str) -> Setting:
    """Return a setting for a name."""
    return Setting(default)


def declare(node: Node, settings: dict[str, Setting]) -> None:
    """Declare the parameters on the node."""
    for parameter, setting in settings.items():
        node.declare_parameter(parameter, setting.default)

# %% [markdown]
# JupyterLab shows the skeleton of the node folded: run it. A click on the three dots opens it.

# %% [markdown] tags=["whole"]
# Read the parameters with their defaults, and the docstring of the class.
# The two functions that decide something are outside the class, so you can try them without a robot.
#
# Two methods are finished.
# `_period` is the *inverse* of the parameter: 20 Hz is a period of 1/20 s.
# A timer keeps the period with which it was made. So `_on_parameters_changed` makes a new timer; rclpy calls it after a parameter is set.

# %% tags=["skeleton"]
# %%writefile ros2_robot_controller/sensor_processor.py
"""The node that fuses the sensors into one message. It watches; it moves nothing."""

import math
from typing import Any, Optional

from geometry_msgs.msg import Vector3
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.utils import settings
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.running import run
from ros2_robot_controller.utils.scans import closest_reading
from sensor_msgs.msg import BatteryState, Imu, LaserScan
from std_msgs.msg import Float32

FULL_PERCENT = 100.0  # also what a battery counts as that has not reported yet
HYSTERESIS_PERCENT = 2.0  # rise by this much before the same alarm can sound again

SETTINGS = {
    'fusion_frequency': settings.rate(20.0),
    'battery_low_threshold': settings.percentage(20.0),
    'battery_critical_threshold': settings.percentage(10.0),
}


def battery_percent(percentage: float, previous: float) -> float:
    return 100.0  # exercise 4


def alarm_state(was_on: bool, percent: float, threshold: float) -> bool:
    return False  # exercise 5


class SensorProcessor(Node):
    """
    Publish what the sensors say together, once a scan has been seen.

    Subscribes: `raw_scan` (sensor_msgs/LaserScan), `imu/data` (sensor_msgs/Imu),
    `battery/state` (sensor_msgs/BatteryState), all best effort.
    Publishes at `fusion_frequency`: `sensor_fusion_data` (SensorFusionData, frame base_link) and
    `obstacle_distance` (std_msgs/Float32, metres, inf for nothing in range).
    Parameters: see SETTINGS. All of them may change while the node runs.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('sensor_processor', **node_options)
        settings.declare(self, SETTINGS)  # the rest is exercise 9

    def _value(self, parameter: str) -> Any:
        return self.get_parameter(parameter).value

    def _period(self) -> float:
        return 1.0 / self._value('fusion_frequency')

    def _on_scan(self, scan: LaserScan) -> None:
        pass  # exercise 6

    def _on_imu(self, imu: Imu) -> None:
        pass  # exercise 6

    def _on_battery(self, battery: BatteryState) -> None:
        pass  # exercise 7

    def _fuse(self) -> None:
        pass  # exercise 8

    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        # A timer keeps the period it was made with.
        if any(parameter.name == 'fusion_frequency' for parameter in parameters):
            self.destroy_timer(self._timer)
            self._timer = self.create_timer(self._period(), self._fuse)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SensorProcessor, args)

# %% [markdown] tags=["whole"]
# ### Exercise 4: percent
#
# Your message has `battery_level` in percent, 0 to 100.
# The sensor says:

# %% tags=["whole"]
# !ros2 interface show sensor_msgs/msg/BatteryState | grep percentage

# %% [markdown] tags=["whole"]
# This "percentage" goes from 0 to 1, but the thresholds are 20 and 10. **What does a node report if it compares the two directly**, for a full battery and for an unknown charge?

# %% tags=["whole"]
for percentage in (1.0, 0.5, nan):
    print(f"percentage {percentage}: below the threshold of 20? {percentage < 20}")

# %% [markdown] tags=["whole"]
# A full battery gives an alarm all the time, an unknown charge gives none.
#
# Write `battery_percent`: multiply by 100, keep the result within 0 and 100, and for NaN return what was known before.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/sensor_processor.py
def battery_percent(percentage: float, previous: float) -> float:
    # TODO: 0 to 1 becomes 0 to 100; NaN keeps the previous percentage
    return 100.0

# %% tags=["whole"]
tries(
    {
        "battery_percent(0.5, 80.0)": 50.0,
        "battery_percent(0.0, 80.0)": 0.0,
        "battery_percent(1.25, 80.0)": 100.0,
        "battery_percent(-1.0, 80.0)": 0.0,
        "battery_percent(nan, 80.0)": 80.0,
    },
    of=PROCESSOR,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `math.isnan(percentage)`, and your own `clamp(value, low, high)`. The skeleton has a name for 100: `FULL_PERCENT`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def battery_percent(percentage: float, previous: float) -> float:
#     """Return a BatteryState's percentage, which is 0 to 1, in percent; NaN keeps the previous one."""
#     if math.isnan(percentage):
#         return previous
#     ...                  # return it in percent, within 0 and FULL_PERCENT
# ```
# </details>
#
# ### Exercise 5: warn once
#
# A battery below `battery_low_threshold` is logged as a warning once, below `battery_critical_threshold` as an error once.
# Near the threshold, the percentage goes up and down.
# **How many warnings** does each version give?

# %% tags=["whole"]
percents = [20.6, 20.2, 19.9, 20.1, 19.8, 20.1, 19.7, 19.5, 19.6, 19.2, 18.9, 18.5]
each_message = sum(percent < 20 for percent in percents)
each_crossing = sum(now < 20 <= before for before, now in zip(percents, percents[1:], strict=False))
print(each_message, "warnings with: if percent < 20")
print(each_crossing, "warnings with: if percent < 20 and not previous < 20")

# %% [markdown] tags=["whole"]
# Both versions repeat themselves.
# Better: once the alarm is on, it is switched off only *well* above the threshold.
# This is called **hysteresis**; with a gap of 2 percentage points (`HYSTERESIS_PERCENT`) the alarm sounds once here.
#
# Write `alarm_state`: is the alarm on now, given whether it was on, the percentage and the threshold?

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/sensor_processor.py
def alarm_state(was_on: bool, percent: float, threshold: float) -> bool:
    # TODO: on below the threshold; off again only HYSTERESIS_PERCENT above it
    return False

# %% tags=["whole"]
def alarms(percents, threshold=20.0):
    """Return how often the alarm is switched on."""
    states = [False]
    for percent in percents:
        states.append(alarm_state(states[-1], percent, threshold))
    return sum(now and not before for before, now in zip(states, states[1:], strict=False))


tries(
    {
        "alarm_state(False, 19.5, 20.0)": True,
        "alarm_state(False, 20.0, 20.0)": False,
        "alarm_state(True, 21.0, 20.0)": True,
        "alarm_state(True, 22.0, 20.0)": False,
        "alarms(percents)": 1,
        "alarms([19.0, 80.0, 19.0])": 2,
    },
    of=PROCESSOR,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# Below the threshold: on. Otherwise: on only if it was on *and* `percent < threshold + HYSTERESIS_PERCENT`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def alarm_state(was_on: bool, percent: float, threshold: float) -> bool:
#     """Return whether the alarm is on: from below the threshold until well above it again."""
#     if percent < threshold:
#         return True
#     ...                  # return whether it stays on
# ```
# </details>
#
# ### Exercise 6: remember the scan and the motion
#
# `_on_scan` keeps the closest reading as `self._closest`; `_on_imu` keeps the two vectors of the message, as `self._acceleration` and `self._angular_velocity`.
# Copy them without any conversion.
#
# **Predict:** what does the accelerometer of a robot that stands still say along z?

# %% tags=["whole"]
imu = to_message(Simulator(load_world("office"), noise=False).imu())
print(imu.linear_acceleration)

# %% [markdown] tags=["whole"]
# It says 9.81 m/s² upwards, because the floor pushes it ([REP 145](https://www.ros.org/reps/rep-0145.html)).
# Do not "correct" it.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/sensor_processor.py
class SensorProcessor:
    def _on_scan(self, scan: LaserScan) -> None:
        pass  # TODO: remember the closest reading; scans.py has the function

    def _on_imu(self, imu: Imu) -> None:
        pass  # TODO: remember imu.linear_acceleration and imu.angular_velocity

# %% [markdown] tags=["whole"]
# The table calls each callback with a message of its own, and looks at what the node remembers.

# %% tags=["whole"]
from sensor_msgs.msg import BatteryState, Imu


def after(**heard):
    """Return a sensor processor that has heard these messages: after(scan=..., battery=[0.5, 0.2])."""
    node = SensorProcessor()
    node._battery, node._battery_low, node._battery_critical = 100.0, False, False
    for name, messages in heard.items():
        for message in messages if isinstance(messages, list) else [messages]:
            getattr(node, f"_on_{name}")(message)
    node.destroy_node()
    return node


moving = Imu()
moving.linear_acceleration.x, moving.angular_velocity.z = 0.25, 0.5
tries(
    {
        "after(scan=make_scan([nan, 0.5, 3.0]))._closest": 0.5,
        "after(scan=make_scan([]))._closest": inf,
        "after(imu=moving)._acceleration.x": 0.25,
        "after(imu=moving)._angular_velocity.z": 0.5,
    },
    of=PROCESSOR,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `closest_reading(scan)` returns the number; to remember is to assign, `self.name = value`; a message's field is an attribute, `imu.linear_acceleration`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# class SensorProcessor:
#     def _on_scan(self, scan: LaserScan) -> None:
#         self._closest = closest_reading(scan)
#
#     def _on_imu(self, imu: Imu) -> None:
#         self._acceleration = imu.linear_acceleration
#         ...              # and the other vector
# ```
# </details>
#
# ### Exercise 7: remember the battery, and warn
#
# `_on_battery` does four things, with the two functions that you have:
#
# 1. it puts the new percentage into `self._battery`;
# 2. it finds out whether the low alarm is on now, and whether the critical one is;
# 3. it logs a warning if the low alarm is on now and was not on before (`self._battery_low`), and in the same way an error for the critical one;
# 4. it remembers both alarms.
#
# A node logs with `self.get_logger().warning(text)` and `.error(text)`; `self._value('battery_low_threshold')` reads a parameter.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/sensor_processor.py
class SensorProcessor:
    def _on_battery(self, battery: BatteryState) -> None:
        pass  # TODO: the four steps; battery.percentage is 0 to 1

# %% tags=["nbval-ignore-output", "whole"]
# The log has a stream of its own, so its lines may come before or after those of the table.
def falling(*shares):
    """Return one battery message for each share, 0 to 1."""
    return [BatteryState(percentage=share) for share in shares]


tries(
    {
        "after(battery=falling(0.5))._battery": 50.0,
        "after(battery=falling(0.5, nan))._battery": 50.0,
        "after(battery=falling(0.5))._battery_low": False,
        "after(battery=falling(0.125, 0.25))._battery_low": False,
        "after(battery=falling(0.125))._battery_low": True,
        "after(battery=falling(0.125))._battery_critical": False,
        "after(battery=falling(0.0625))._battery_critical": True,
    },
    of=PROCESSOR,
)

# %% [markdown] tags=["whole"]
# Find the log lines near the table. When your function works, there are three warnings at 12 %, and a warning and an error at 6 %.
#
# <details><summary>Hint 1: what you need</summary>
#
# `battery_percent` wants the previous percentage, `alarm_state` the previous alarm: both are attributes of `self`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# class SensorProcessor:
#     def _on_battery(self, battery: BatteryState) -> None:
#         percent = battery_percent(battery.percentage, self._battery)
#         low = alarm_state(self._battery_low, percent, self._value('battery_low_threshold'))
#         critical = alarm_state(self._battery_critical, percent,
#                                self._value('battery_critical_threshold'))
#         if low and not self._battery_low:
#             self.get_logger().warning(f'Battery low: {percent:.0f} %')
#         ...              # the same for critical, with error()
#         self._battery = percent
#         ...              # remember both alarms
# ```
# </details>
#
# Requirement **F12** asks for the closest reading, the battery in percent, the motion, and two alarms.

# %% [markdown] tags=["whole"]
# ## Publish at a rate
#
# ### Exercise 8: say it
#
# `_fuse` is what your timer calls.
# Two more sentences of the contract, requirement **F13**:
#
# - "once a scan has been seen, and not before": `inf` means "nothing is near", and before the first scan that would be a lie. So `self._closest` is `None` until then, and `_fuse` returns at once.
# - "stamp from the node's clock, frame `base_link`": `header.stamp` says *when*, `header.frame_id` in *whose axes*. The stamp is `self.get_clock().now().to_msg()`.
#
# Make a `SensorFusionData`, fill its header and its four fields from what is remembered, publish it on `self._fused`; then publish `Float32(data=…)` with the closest reading on `self._distance`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/sensor_processor.py
class SensorProcessor:
    def _fuse(self) -> None:
        pass  # TODO: nothing before the first scan; then fill and publish both messages

# %% [markdown] tags=["whole"]
# In this table, two stand-ins for publishers collect the messages.

# %% tags=["whole"]
from types import SimpleNamespace

import rclpy
from geometry_msgs.msg import Vector3

if not rclpy.ok():
    rclpy.init()


def said(closest):
    """Return what a node publishes after this closest reading, a battery of 50 % and a turn."""
    node, messages = SensorProcessor(), []
    node._closest, node._battery = closest, 50.0
    node._acceleration, node._angular_velocity = Vector3(x=0.25), Vector3(z=0.5)
    node._fused = node._distance = SimpleNamespace(publish=messages.append)
    node._fuse()
    node.destroy_node()
    return messages


tries(
    {
        "len(said(None))": 0,
        "len(said(0.5))": 2,
        "said(0.5)[0].header.frame_id": "base_link",
        "said(0.5)[0].header.stamp.sec > 0": True,
        "said(0.5)[0].closest_obstacle_distance": 0.5,
        "said(0.5)[0].battery_level": 50.0,
        "said(0.5)[0].linear_acceleration.x": 0.25,
        "said(0.5)[0].angular_velocity.z": 0.5,
        "said(inf)[1].data": inf,
    },
    of=PROCESSOR,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `fused = SensorFusionData()`, then one line for each field that you wrote in notebook 02, such as `fused.battery_level = …`; at the end `self._fused.publish(fused)`.
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# class SensorProcessor:
#     def _fuse(self) -> None:
#         if self._closest is None:
#             return
#         fused = SensorFusionData()
#         fused.header.stamp = self.get_clock().now().to_msg()
#         fused.header.frame_id = 'base_link'
#         fused.closest_obstacle_distance = self._closest
#         fused.battery_level = self._battery
#         ...              # the two vectors
#         self._fused.publish(fused)
#         ...              # and the closest reading, as a Float32
# ```
# </details>

# %% [markdown]
# ### Exercise 9: wire it up
#
# `__init__` connects all this. What it remembers at the start is given; add what the cell lacks of these:
#
# - the second publisher, `obstacle_distance`, a `Float32`;
# - three subscriptions with the QoS for sensors (`qos_profile_sensor_data`): `raw_scan`, `imu/data` and `battery/state`;
# - the timer, `self._timer`, that calls `self._fuse` every `self._period()` seconds: a period, not a rate.

# %% tags=["piece"]
# %%into ros2_robot_controller/sensor_processor.py
class SensorProcessor:
    def __init__(self, **node_options: Any) -> None:
        super().__init__('sensor_processor', **node_options)
        settings.declare(self, SETTINGS)

        self._closest: Optional[float] = None  # metres; None until the first scan
        self._battery = FULL_PERCENT
        self._battery_low = False
        self._battery_critical = False
        self._acceleration = Vector3()
        self._angular_velocity = Vector3()

        self._fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 10)
        # TODO: the other publisher, three subscriptions, the timer
        self.add_post_set_parameters_callback(self._on_parameters_changed)

# %%
import rclpy

if not rclpy.ok():
    rclpy.init()


def wired():
    """Return what a new node publishes, how it hears each topic, and its timers' callbacks and periods in seconds."""
    node = SensorProcessor()
    said = {each.topic_name for each in node.publishers}
    heard = {s.topic_name: (s.callback.__name__, s.qos_profile.reliability.name) for s in node.subscriptions}
    timers = [(getattr(t.callback, "__name__", None), t.timer_period_ns / 1e9) for t in node.timers]
    node.destroy_node()
    return said, heard, timers


tries(
    {
        "'/obstacle_distance' in wired()[0]": True,
        "wired()[1].get('/raw_scan')": ("_on_scan", "BEST_EFFORT"),
        "wired()[1].get('/imu/data')": ("_on_imu", "BEST_EFFORT"),
        "wired()[1].get('/battery/state')": ("_on_battery", "BEST_EFFORT"),
        "wired()[2]": [("_fuse", 0.05)],  # the function itself; with () after it, what it returns
    },
    of=PROCESSOR,
)

# %% [markdown]
# <details><summary>Hint 1: what you need</summary>
#
# `self.create_publisher(Type, 'name', 10)`, `self.create_subscription(Type, 'name', callback, qos)`, `self.create_timer(period_in_seconds, callback)`
# </details>
#
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
#         self._fused = self.create_publisher(SensorFusionData, 'sensor_fusion_data', 10)
#         self._distance = self.create_publisher(Float32, 'obstacle_distance', 10)
#         self.create_subscription(LaserScan, 'raw_scan', self._on_scan, qos_profile_sensor_data)
#         self.create_subscription(Imu, 'imu/data', self._on_imu, qos_profile_sensor_data)
#         ...              # the battery; break the line after the bracket, or it has more than 99 characters
#         ...              # self._timer = the timer
#         self.add_post_set_parameters_callback(self._on_parameters_changed)
# ```
# </details>
#
# Four requirements apply to the node: F12 and F13 as a whole, F6 and I4 as far as they concern this node.

# %% tags=["check"]
check("F12", "F13", "F6", "I4")

# %% [markdown] tags=["whole"]
# ### Your node on a drive
#
# The robot drives towards a cart, which moves back and forth.
# `run_node` starts *your* node as `ros2 run` does, with the simulated sensors.
# On the way, the battery drops to 19 %, and later to 9 %.

# %% tags=["whole"]
run = run_node("sensor_processor", world="moving_cart")
run.simulator.command(0.25, 0.0)  # m/s, rad/s
run.drive(4.0)
run.simulator.set_battery(0.19)
run.simulator.command(0.25, 0.5)
run.drive(3.0)
run.simulator.set_battery(0.09)
run.simulator.command(0.15, -0.6)
recording = run.drive(5.0)
fused = run.messages("sensor_fusion_data")
print(f"{len(fused)} messages of sensor_fusion_data in {recording.duration:.0f} s of simulated time")

# %% tags=["whole"]
figure, (distance, battery, motion) = plt.subplots(
    3, 1, figsize=(9, 6), sharex=True, layout="constrained"
)
times = [t for t, _ in fused]
truth = recording.clearance + recording.radius  # from the robot's centre, where the lidar is
distance.plot(recording.t, truth, color=COLORS["clearance"], lw=1, label="true distance", zorder=3)
said = [m.closest_obstacle_distance for _, m in fused]
distance.plot(times, said, ".", color=COLORS["scan"], markersize=5, label="your node")
distance.set(ylabel="nearest thing (m)", ylim=(0, None))
distance.legend(loc="lower left", ncols=2, fontsize=8)
battery.plot(times, [m.battery_level for _, m in fused], ".", color="C2")
for threshold in (20, 10):
    battery.axhline(threshold, color=COLORS["threshold"], linestyle=":")
battery.set(ylabel="battery (%)", ylim=(0, 105))
motion.plot(times, [m.angular_velocity.z for _, m in fused], ".", color="C0", markersize=4)
motion.set(ylabel="turning (rad/s)", xlabel="simulated time (s)", ylim=(-1, 1))
for axes in (distance, battery, motion):
    axes.grid(alpha=0.3)

# %% [markdown] tags=["whole"]
# Your points come in pairs, because a scan comes ten times a second. They lie a little below the line, because the *smallest* of many noisy readings is too low.
#
# What did the node say, and how often?

# %% tags=["nbval-ignore-output", "whole"]
# Each line carries the time of day.
print(run.output or "nothing")

# %% [markdown] tags=["whole"]
# One warning and one error, each only once.
#
# Your node is still running, so you can examine it from outside.

# %% tags=["nbval-ignore-output", "whole"]
# What is listed depends on how far your node is.
# !ros2 node info --spin-time 3 /sensor_processor | head -12
# !ros2 topic info -v --spin-time 3 /raw_scan | grep -E "Node name:|Endpoint type|Reliability"
run.close()

# %% [markdown] tags=["whole"]
# Compare with the contract: three subscriptions beside `/clock`, two publishers beside `/parameter_events` and `/rosout`, which every node has.
# `/raw_scan` should say BEST_EFFORT.

# %% [markdown] tags=["whole"]
# ## Whose clock?
#
# The drive of twelve simulated seconds ran as fast as your node could answer.
# That works only if the node never looks at the clock on the wall.
#
# A node with the parameter `use_sim_time` takes its time from the topic `/clock`, and its timers and stamps follow, if *the node* makes them:
#
# | follows /clock | does not |
# |---|---|
# | `self.get_clock().now()` | `time.time()`, `datetime.now()` |
# | `self.create_timer(...)` | `threading.Timer`, a loop with `time.sleep` |
#
# Here are two nodes, each with a timer of one second.
# One follows `/clock`, which the second cell below advances by ten seconds, faster than real time.
# **Predict:** how often does each timer fire?

# %% tags=["whole"]
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

by_clock = Node("by_clock", parameter_overrides=[Parameter("use_sim_time", value=True)])
by_wall = Node("by_wall")
for node in (by_clock, by_wall):
    executor.add_node(node)
fired = {"by /clock": [], "by the wall": []}


def seconds(node):
    """Return what time it is for this node."""
    return node.get_clock().now().nanoseconds / 1e9


by_clock.create_timer(1.0, lambda: fired["by /clock"].append(round(seconds(by_clock), 1)))
by_wall.create_timer(1.0, lambda: fired["by the wall"].append(round(seconds(by_wall), 1)))
clock = by_wall.create_publisher(Clock, "/clock", 10)
spin_until(lambda: clock.get_subscription_count() == 1)
print("before the first /clock it is", seconds(by_clock), "s")


def set_clock(tenths):
    """Publish the time on /clock, in tenths of a second, and serve the callbacks."""
    message = Clock()
    message.clock.sec, message.clock.nanosec = tenths // 10, tenths % 10 * 100_000_000
    clock.publish(message)
    spin_until(lambda: seconds(by_clock) > tenths / 10 - 0.001, 1.0)
    spin_until(lambda: False, 0.01)

# %% tags=["nbval-ignore-output", "whole"]
# How long ten simulated seconds take depends on the machine.
started = time.monotonic()
for tenths in range(1000, 1101):  # from 100.0 s to 110.0 s
    set_clock(tenths)
print(f"{time.monotonic() - started:.0f} s by the wall, 10 s by /clock")
print("fired by /clock:   ", fired["by /clock"])
print("fired by the wall:", len(fired["by the wall"]), "times")

# %% [markdown] tags=["whole"]
# The timer that follows `/clock` fires at its start, when its time jumps from 0 to 100 s, and then ten times.
# The other one fires once for each second that you waited.
#
# Requirement **I7** asks that timers and stamps of *both* nodes follow `/clock`.
# Today the check asks the sensor processor alone, in notebook 05 both.

# %% tags=["check", "whole"]
check("I7")

# %% [markdown] tags=["whole"]
# **Change one thing:** in your `sensor_processor.py` take the stamp from `time.time()`, and run `check("F13")`. Read what it says, change it back, and run the check again.

# %% tags=["whole"]
for node in (by_clock, by_wall):
    executor.remove_node(node)
    node.destroy_node()
rclpy.try_shutdown()

# %% [markdown] tags=["whole"]
# > **On a real TurtleBot 4:** [docs/turtlebot4.md](../docs/turtlebot4.md) lists what differs.

# %% [markdown] tags=["whole"]
# ## Beyond your robot: another lidar
#
# An optional task without points, hints or a table of cases: only the check judges it.
#
# Your robot gets another lidar.
# It has 240 beams, one degree apart, so it does not look all around; its limits differ, too.
# It is bolted on turned to the left by `mounted` radians: that is where its x axis points on the robot.
# Some of these lidars count their beams clockwise.
#
# Write `around`: it returns the `Proximity` of the *robot*, as `measure_proximity` does for the contract's lidar.
# `ahead` and `behind` are `0.0` if no beam looks into that sector at all: what the lidar cannot see is not free.
# Leave the scan as it is; use what is in your `scans.py`.

# %% tags=["function", "unseen", "whole"]
from grader.notebook.unseen import check


def around(scan, mounted):
    """Return the Proximity of a robot whose lidar is turned to the left by `mounted` (rad)."""
    return measure_proximity(scan)  # TODO

# %% tags=["check", "whole"]
check("U1", around)

# %% [markdown] tags=["whole"]
# ## Go further
#
# - Make `measure_proximity` right for a TurtleBot 4: add a second argument, `mount_yaw`, to each angle.
# - Publish `inf`, or nothing, when the last scan is old. Which is better?
# - One wrong beam stops a robot. Require two neighbouring beams that agree, and say what you lose by it.

# %% [markdown]
# ## Recall
#
# <details><summary>Why <code>low &lt;= x &lt;= high</code> and not <code>not (x &lt; low or x &gt; high)</code>?</summary>
#
# For NaN each comparison is False: the first form says "not valid", the second "valid".
# </details>
#
# <details><summary>The topic is listed, the types agree, nothing arrives. What do you type?</summary>
#
# `ros2 topic info -v /topic`, and compare "Reliability", then "Durability": a request must not be more than the offer.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Which beam looks ahead?</summary>
#
# The one whose angle, `angle_min + i * angle_increment`, is 0 *in the frame of the robot*.
# In the frame of a TurtleBot 4's lidar that is -90°.
# </details>
#
# <details><summary>Why does the node say nothing before the first scan, and not <code>inf</code>?</summary>
#
# `inf` says "I have looked, nothing is there".
# </details>
#
# <details><summary>A node stamps with <code>time.time()</code>. On the robot all is well. Where does it fail?</summary>
#
# Wherever time is not the wall's: in simulation, and when a recorded bag is played.
# </details>

# %% [markdown]
# **Next:** [05 Moving safely](05_moving_safely.ipynb).

# %%
from grader.notebook import progress

progress()
