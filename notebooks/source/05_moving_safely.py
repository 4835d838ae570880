# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 05 Moving safely
#
# ![The robot drives at a wall, slows down and stops; the time line shows how far it rolled on](pictures/05.png)
#
# A robot must stop in time, also when its program ends.

# %% [markdown] tags=["whole"]
# You will be able to
#
# - work out how far a robot rolls after it has seen something, and find the speed that is too fast;
# - decide what is safe in plain functions that are tested without a robot;
# - publish at a fixed rate with a timer, and say why a robot needs a stream of commands;
# - say how a slow callback affects the others, and end a node so that its robot stands still.
#
# **Time:** part 1, what is safe: 45 to 85 minutes;
# part 2, the node that drives: 40 to 70 minutes;
# part 3, habits and the last zero: 25 to 50 minutes.
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# Your package so far, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/
#     ├── scripts/            robot_controller  sensor_processor
#     └── ros2_robot_controller/
#         ├── sensor_processor.py
#         ├── robot_controller.py    <- given in part 2; it grows until notebook 08
#         ├── driver.py              <- part 2: the node that drives
#         └── utils/
#             ├── conversions.py  scans.py  settings.py
#             ├── motion.py          <- part 1: what is safe
#             └── running.py         <- part 3: the last word

# %%
from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
begin("05")

# %% [markdown]
# If files are missing and you would rather start here, run `start_at("05")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 04: the readings are 0.4, NaN and 3.0 m. What do <code>min</code> and <code>np.min</code> say, and what should a robot believe?</summary>
#
# `min` says 0.4 or NaN, depending on the order; `np.min` says NaN. NaN is no measurement: drop it, and 0.4 m is the nearest thing.
# </details>
# <details><summary>Notebook 04: a sensor publishes best effort. Your subscription asks for reliable. What arrives?</summary>
#
# Nothing. Sensors are subscribed with `qos_profile_sensor_data`.
# </details>
# <details><summary>Notebook 03: what does <code>clamp(v, low, high)</code> do with a NaN?</summary>
#
# It returns the NaN. So ask `math.isfinite` where a number comes in.
# </details>

# %% [markdown]
# ## Stop before the wall
#
# ### How far does it roll?
#
# After the robot has seen something, its program takes a while to command zero: the **delay**.
# In that time it drives on at speed $v$.
# Then the wheels brake with the deceleration $a$.
#
# $$ d \;=\; \underbrace{v \cdot t_\mathrm{delay}}_{\text{while you think}} \;+\; \underbrace{\frac{v^2}{2a}}_{\text{while it brakes}} $$
#
# By hand, for 0.5 m/s, a delay of 0.3 s, and the 5 m/s² of this robot's wheels:
# 0.5 · 0.3 + 0.5² / (2 · 5) = 0.15 + 0.025 = **0.175 m**.
#
# A reading below 0.5 m is an obstacle, measured from the robot's centre; the hull's radius is 0.171 m.
# That leaves 0.5 − 0.171 = **0.329 m** to stop in, and 0.154 m should remain.

# %%
from sim import COURSE

ROOM = 0.5 - COURSE.radius


def stop_distance(v, delay, brake):
    """Return the metres that the robot rolls after an obstacle was seen."""
    return v * delay + v**2 / (2 * brake)


print(f"rolls {stop_distance(0.5, 0.3, 5.0):.3f} m, {ROOM - stop_distance(0.5, 0.3, 5.0):.3f} m are left")

# %% [markdown] tags=["whole"]
# Now ask the simulator, with a robot that starts a little nearer each time.
#
# **Predict:** will 0.154 m be left each time?

# %% tags=["whole"]
from dataclasses import replace

from sim import Pose, ScanReading, Simulator, load_world

DELAY = 0.3
fast_robot = replace(COURSE, drive=replace(COURSE.drive, max_v=2.0))


def step_until_near(simulator):
    """Let time pass until a scan reads less than 0.5 m."""
    near = False
    while not near:
        scans = [r for r in simulator.step(0.05) if isinstance(r, ScanReading)]
        near = any(scan.ranges.min() < 0.5 for scan in scans)

# %% tags=["whole"]
def clearance_left(v, start):
    """Drive at the wall, command zero DELAY after it was seen; return the metres left."""
    world = replace(load_world("wall_ahead"), start=Pose(start, 0.0, 0.0))
    simulator = Simulator(world, fast_robot, noise=False)
    simulator.command(v, 0.0)
    step_until_near(simulator)
    simulator.step(DELAY)
    simulator.command(0.0, 0.0)
    simulator.step(1.0)
    return simulator.clearance()


STARTS = (-0.50, -0.48, -0.46)
for start in STARTS:
    print(f"from x = {start:.2f} m: {clearance_left(0.5, start):.3f} m left")

# %% [markdown] tags=["whole"]
# Each time less than 0.154 m is left: the lidar measures ten times a second, and after a scan of 0.501 m the robot drives on for another 0.1 s.
# So the true delay lies between 0.3 s and **0.4 s**, by chance.
#
# **Predict:** at which speed does it touch the wall?

# %% tags=["whole"]
import matplotlib.pyplot as plt
import numpy as np

speeds = np.arange(0.1, 1.21, 0.1)
figure, axes = plt.subplots(figsize=(7.5, 4), layout="constrained")
for delay, style in ((DELAY, "-"), (DELAY + 0.1, "--")):
    left = ROOM - stop_distance(speeds, delay, 5.0)
    axes.plot(speeds, left, style, color="#0072B2", label=f"by the formula, delay {delay:.1f} s")
for start in STARTS:
    left = [clearance_left(v, start) for v in speeds]
    axes.plot(speeds, left, "o", color="#E69F00", label="simulated" if start == STARTS[0] else None)
axes.axhline(0, color="#D55E00")
axes.annotate("the wall", (0.12, 0.008), color="#D55E00")
axes.set(xlabel="speed (m/s)", ylabel="clearance of the hull (m)", title="What is left when it stands")
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown] tags=["whole"]
# The dots lie between the two lines, until the wall holds the robot.
# The formula gives two speeds: above the first it may hit, above the second it must.

# %% tags=["whole"]
candidates = np.arange(0.01, 2.0, 0.01)
for delay in (DELAY + 0.1, DELAY):
    too_fast = candidates[stop_distance(candidates, delay, 5.0) > ROOM].min()
    print(f"delay {delay:.1f} s: too fast from {too_fast:.2f} m/s on")

# %% [markdown]
# The contract (F4) allows a delay of 0.3 s, and 0.5 m/s at most: with these wheels that is safe.

# %% [markdown] tags=["whole"]
# **Your turn:** the wheels of a TurtleBot 4 brake with 0.9 m/s². Is 0.5 m/s still safe in the worst case, at 0.4 s? Call `stop_distance`.
#
# <details><summary>Answer</summary>
#
# No: it rolls 0.2 + 0.139 = 0.339 m, and 0.329 m are free. Up to a delay of 0.38 s it is safe.
# </details>

# %% [markdown]
# ### The file: what is safe
#
# What is safe is decided in plain functions, which need no robot: `utils/motion.py`.
# The next cell writes a skeleton; read its two classes and run it.

# %% tags=["skeleton"]
# %%writefile ros2_robot_controller/utils/motion.py
"""Decide how to move safely: limits, ramps, obstacles. No node, no topics."""

from dataclasses import dataclass
import math

from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.scans import Proximity

MIN_SPEED_SHARE = 0.2  # of max_linear_speed, near an obstacle: slow, yet sure to reach the edge


@dataclass(frozen=True)
class Limits:
    """What the robot may do, in SI units; the fields are the node's parameters."""

    max_linear_speed: float
    max_angular_speed: float
    linear_acceleration: float
    angular_acceleration: float
    obstacle_detection_threshold: float
    emergency_stop_distance: float
    safety_margin: float


@dataclass(frozen=True)
class Command:
    """A velocity: v in m/s forward, omega in rad/s counter-clockwise."""

    v: float = 0.0
    omega: float = 0.0


STOP = Command()


def ramp(previous: float, wanted: float, largest_rise: float) -> float:
    return 0.0  # step 4


def speed_up_gently(previous: Command, wanted: Command, dt: float, limits: Limits) -> Command:
    return STOP  # step 4


def obstacle_in_way(near: Proximity, v: float, limits: Limits) -> bool:
    return False  # step 1


def clearance(near: Proximity, v: float) -> float:
    return near.ahead  # step 1


def speed_cap(distance: float, limits: Limits) -> float:
    return limits.max_linear_speed  # step 2


def make_safe(wanted: Command, near: Proximity, limits: Limits) -> Command:
    return STOP  # step 3

# %% [markdown]
# Two helpers for the tables of cases; `mine` imports a module of your package as it is saved now.

# %%
import math

nan, inf = math.nan, math.inf
scans = mine("utils.scans")


def near(ahead, behind=inf, beside=inf):
    """Return what your scans.py makes of a scan with these closest readings, in metres."""
    return scans.Proximity(ahead, behind, min(ahead, behind, beside))


def limits(**changed):
    """Return the contract's defaults, some of them changed."""
    names = "max_linear_speed", "max_angular_speed", "linear_acceleration", "angular_acceleration"
    names += "obstacle_detection_threshold", "emergency_stop_distance", "safety_margin"
    return motion.Limits(**dict(zip(names, (0.5, 1.0, 1.0, 2.0, 0.5, 0.2, 0.3))) | changed)

# %% [markdown] tags=["whole"]
# ### Step 1: what lies in the way?
#
# A robot drives along a wall, 0.45 m to its left; the threshold is 0.5 m.
#
# **Predict:** does `min(scan.ranges) < 0.5` stop it? Should it stop?

# %% tags=["whole"]
import matplotlib.pyplot as plt
import numpy as np
from sim import Simulator, Wall, World

beside = World("beside a wall", obstacles=(Wall((-2.0, 0.45), (6.0, 0.45)),))
scan = Simulator(beside, noise=False).scan()
ahead = np.abs(scan.angles) <= math.radians(60)
ranges = np.where(np.isfinite(scan.ranges), scan.ranges, nan)  # inf has no place on a map
x, y = ranges * np.cos(scan.angles), ranges * np.sin(scan.angles)

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(7.5, 2.6), layout="constrained")
for beams, where, color in ((ahead, "ahead", "#E69F00"), (~ahead, "elsewhere", "#7d8590")):
    label = f"{where}: nearest {scan.ranges[beams].min():.2f} m"
    axes.plot(x[beams], y[beams], ".", color=color, label=label)
for angle in (-1.047, 1.047):  # 60 degrees
    axes.plot([0, 2 * math.cos(angle)], [0, 2 * math.sin(angle)], ":", color="#b03060")
axes.add_patch(plt.Circle((0, 0), 0.171, facecolor="white", edgecolor="#0072B2"))
axes.plot([0, 0.171], [0, 0], color="#0072B2")
axes.set(xlim=(-1.5, 2.5), ylim=(-0.4, 0.6), aspect="equal", xlabel="x (m)", ylabel="y (m)")
axes.legend(loc="lower right");

# %% [markdown] tags=["whole"]
# The closest reading of all is 0.45 m, but within 60 degrees of straight ahead it is 0.52 m: nothing is in the way.
# (Anything the hull would hit outside the sector is nearer than 0.197 m, and there the emergency stop acts.)

# %% [markdown]
# A robot that drives backwards must look backwards.
# Your `scans.py` gives the three numbers that matter, in metres: `near.ahead`, `near.behind` and `near.anywhere`.
#
# Obstacles count within 60 degrees to each side of the direction of travel. Two functions ask for them:
#
# - `clearance`: which of the numbers counts at this `v`? 0 means forward.
# - `obstacle_in_way`: is that number below `limits.obstacle_detection_threshold`? Also true: something nearer than `limits.emergency_stop_distance`, *anywhere*.

# %% [markdown] tags=["whole"]
# **Exercise.** Write both.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/motion.py
def obstacle_in_way(near: Proximity, v: float, limits: Limits) -> bool:
    """Return whether something keeps the robot from driving as v points (0 means forward)."""
    return False  # TODO: the emergency first; then the clearance


def clearance(near: Proximity, v: float) -> float:
    """Return the closest reading in the direction of travel in metres (0 means forward)."""
    return near.ahead  # TODO: it may drive backwards

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# The sign of `v` decides: `a if condition else b`. The emergency is `near.anywhere < limits.emergency_stop_distance`; for the rest call `clearance`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def clearance(near, v):
#     return near.behind if v < 0.0 else near.ahead
#
# def obstacle_in_way(near, v, limits):
#     if near.anywhere < limits.emergency_stop_distance:
#         return True
#     ...  # whether the clearance is below the threshold
# ```
# </details>

# %% tags=["whole"]
motion = mine("utils.motion")
tries({
    "motion.clearance(near(ahead=0.7, behind=0.4), 0.3)": 0.7,
    "motion.clearance(near(ahead=0.7, behind=0.4), -0.3)": 0.4,
    "motion.clearance(near(ahead=0.7, behind=0.4), 0.0)": 0.7,
    "motion.obstacle_in_way(near(ahead=0.49), 0.3, limits())": True,
    "motion.obstacle_in_way(near(ahead=0.50), 0.3, limits())": False,  # *below* the threshold
    "motion.obstacle_in_way(near(ahead=0.49), -0.3, limits())": False,
    "motion.obstacle_in_way(near(ahead=inf, behind=0.4), -0.3, limits())": True,
    "motion.obstacle_in_way(near(ahead=inf, beside=0.19), 0.3, limits())": True,  # an emergency
    "motion.obstacle_in_way(near(ahead=inf, beside=0.45), 0.3, limits())": False,
})

# %% [markdown] tags=["whole"]
# ### Step 2: the nearer, the slower
#
# A robot that stops from full speed jerks.
# So within the `safety_margin` of 0.3 m above the threshold, the highest speed falls in a straight line.
# By hand, at 0.65 m: 0.65 − 0.5 = 0.15 m is half of the margin, so half of 0.5 m/s: **0.25 m/s**.
#
# The lowest share is `MIN_SPEED_SHARE`, a fifth; at zero the robot would never arrive.
#
# **Exercise.** `speed_cap`: the highest speed at this distance.
# **Predict** two edges first: below the threshold, and with a margin of 0.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/motion.py
def speed_cap(distance: float, limits: Limits) -> float:
    """Return the highest speed at this distance of an obstacle, in m/s, never 0."""
    # TODO: the room above the threshold; the maximum beyond the margin; in the margin the line.
    return limits.max_linear_speed

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# Three cases: beyond the margin, in it, below the threshold. In the margin the share is `room / limits.safety_margin`.
# Test `room >= limits.safety_margin` first. With a margin of 0 this test catches every room ≥ 0; below 0 the share is 0. So nothing is divided by 0.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# room = distance - limits.obstacle_detection_threshold
# if room >= limits.safety_margin:
#     return limits.max_linear_speed
# share = room / limits.safety_margin if room > 0.0 else 0.0
# ...  # that share of the maximum, but at least MIN_SPEED_SHARE of it
# ```
# </details>

# %% tags=["whole"]
motion = mine("utils.motion")
tries({
    "motion.speed_cap(2.0, limits())": 0.5,
    "motion.speed_cap(0.8, limits())": 0.5,
    "motion.speed_cap(0.65, limits())": 0.25,
    "motion.speed_cap(0.501, limits())": 0.1,  # a fifth
    "motion.speed_cap(0.3, limits())": 0.1,  # below the threshold: what is there stops it, not this
    "motion.speed_cap(inf, limits())": 0.5,
    "motion.speed_cap(0.6, limits(safety_margin=0.0))": 0.5,
    "motion.speed_cap(0.5, limits(safety_margin=0.0))": 0.5,
    "motion.speed_cap(0.4, limits(safety_margin=0.0))": 0.1,
})

# %% [markdown]
# ### Step 3: three distances
#
# | closest reading | in which direction | what to do |
# |---|---|---|
# | below `emergency_stop_distance`, 0.2 m | any | zero for everything, turning too |
# | below `obstacle_detection_threshold`, 0.5 m | of travel | stop if it wants to drive; turning in place may go on |
# | less than `safety_margin`, 0.3 m, above that | of travel | drive more slowly |
#
# At 0.4 m it may turn in place, or it could never turn away from a wall.
#
# **Exercise.** `make_safe` is the table from top to bottom; `speed_cap(distance, limits)` is the speed that is allowed at a clearance.
# Both kinds of stopping return `STOP`, which is (0, 0).
# At the end comes the wanted command within its limits, forwards and backwards: `clamp(value, low, high)`.

# %% tags=["piece"]
# %%into ros2_robot_controller/utils/motion.py
def make_safe(wanted: Command, near: Proximity, limits: Limits) -> Command:
    """
    Return `wanted`, slowed down or stopped as the obstacles demand, and within the limits.

    Too close in any direction stops everything. An obstacle in the way stops driving, so turning
    in place towards a goal goes on.
    """
    # TODO: the emergency; an obstacle, if it wants to drive; else v within the cap, omega too.
    return STOP

# %% [markdown]
# <details><summary>Hint 1: what you need</summary>
#
# You have `obstacle_in_way`, `clearance` and `speed_cap`. "Wants to drive" is `wanted.v != 0.0`. The cap is `speed_cap(clearance(near, wanted.v), limits)`; v lies within −cap and cap, omega within −`limits.max_angular_speed` and its positive.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# if near.anywhere < limits.emergency_stop_distance:
#     return STOP
# if wanted.v != 0.0 and obstacle_in_way(near, wanted.v, limits):
#     return STOP
# cap = speed_cap(clearance(near, wanted.v), limits)
# ...  # a Command of two clamps
# ```
# </details>

# %%
motion = mine("utils.motion")


def safe(v, omega=0.0, ahead=inf, behind=inf, beside=inf, **changed):
    """Return what make_safe leaves of a command, as (v, omega)."""
    command = motion.make_safe(motion.Command(v, omega), near(ahead, behind, beside), limits(**changed))
    return command.v, command.omega


tries({
    "safe(0.4)": (0.4, 0.0),
    "safe(0.9, omega=-3.0)": (0.5, -1.0),  # both limits at once
    "safe(-0.9)": (-0.5, 0.0),
    "safe(0.5, omega=0.8, ahead=0.65)": (0.25, 0.8),
    "safe(-0.5, behind=0.65)": (-0.25, 0.0),
    "safe(0.5, omega=0.8, ahead=0.45)": (0.0, 0.0),  # an obstacle in the way
    "safe(0.0, omega=0.8, ahead=0.45)": (0.0, 0.8),  # turning in place goes on
    "safe(0.0, omega=0.8, beside=0.19)": (0.0, 0.0),  # an emergency
    "safe(0.5, ahead=0.51, safety_margin=0.0)": (0.5, 0.0),
})

# %% [markdown] tags=["whole"]
# ### Step 4: gently
#
# `linear_acceleration` 1.0 m/s² at 10 Hz means: at most 0.1 m/s more in each tick of the timer.
#
# | tick | wanted | published |
# |---|---|---|
# | 0 | 0.5 | 0.0 |
# | 1 | 0.5 | 0.1 |
# | 2 | 0.5 | 0.2 |
# | 3 | 0.0 | 0.0 |
# | 4 | −0.5 | −0.1 |
#
# Look at tick 3: **braking is free.**
# From forward to backward the command passes through exactly zero.
#
# **Exercise.** `ramp` makes the next number out of the previous one; `speed_up_gently` does it for v and for omega, each with its own acceleration.
# In `dt` seconds an acceleration of `a` allows a rise of `a * dt`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/motion.py
def ramp(previous: float, wanted: float, largest_rise: float) -> float:
    """
    Return the next value on the way to `wanted`; its size grows by at most `largest_rise`.

    Slowing down is free. Turning round passes through a moment of exactly zero.
    """
    return 0.0  # TODO: does the sign change? Otherwise the smaller of two sizes, with its sign.


def speed_up_gently(previous: Command, wanted: Command, dt: float, limits: Limits) -> Command:
    """Return `wanted` as far as the accelerations let the robot get there within dt seconds."""
    return STOP  # TODO: ramp() for v, and again for omega

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# - The sign changes if `previous * wanted` is below zero.
# - Limited is the size, without its sign: `min(abs(wanted), abs(previous) + largest_rise)`.
# - `math.copysign(size, wanted)` gives it the sign of `wanted`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# def ramp(previous, wanted, largest_rise):
#     if previous * wanted < 0.0:
#         return 0.0
#     ...  # the size, with the sign of wanted
#
# def speed_up_gently(previous, wanted, dt, limits):
#     return Command(
#         v=ramp(previous.v, wanted.v, limits.linear_acceleration * dt),
#         ...  # omega likewise
#     )
# ```
# </details>

# %% tags=["whole"]
motion = mine("utils.motion")
tries({
    "motion.ramp(0.0, 0.5, 0.1)": 0.1,
    "motion.ramp(0.45, 0.5, 0.1)": 0.5,
    "motion.ramp(0.2, 0.0, 0.1)": 0.0,  # braking is free
    "motion.ramp(0.5, 0.3, 0.1)": 0.3,
    "motion.ramp(0.2, -0.5, 0.1)": 0.0,  # through zero
    "motion.ramp(0.0, -0.5, 0.1)": -0.1,
    "motion.ramp(-0.1, -0.5, 0.1)": -0.2,
    "motion.speed_up_gently(motion.STOP, motion.Command(0.5, -1.0), 0.1, limits()).v": 0.1,
    "motion.speed_up_gently(motion.STOP, motion.Command(0.5, -1.0), 0.1, limits()).omega": -0.2,
})

# %% [markdown] tags=["whole"]
# ### Drag a box in front of it
#
# Now your functions drive, still without a node.
# In Jupyter the next cell is a live view: drag the box in front of the robot, and away again.

# %% tags=["whole"]
from sim import Box, Twist as Speeds
from sim.bridge import to_message
from sim.live import Live


class MyRobot:
    """Drives at 0.4 m/s as far as your motion.py lets it."""

    def __init__(self):
        self.last = motion.STOP

    def __call__(self, seen):
        proximity = scans.measure_proximity(to_message(seen.scan))
        allowed = motion.make_safe(motion.Command(0.4), proximity, limits())
        self.last = motion.speed_up_gently(self.last, allowed, 0.1, limits())
        return Speeds(self.last.v, self.last.omega)


floor = World("a box", obstacles=(Box((1.5, 0.6), (0.3, 0.3), name="box"),))
try:
    live = Live(Simulator(floor), driver=MyRobot())
    live.run(2.0)
    display(live)
except AttributeError as missing:
    print("not yet:", missing)

# %% [markdown] tags=["whole"]
# It slows down, it stops, and it drives on as soon as the way is free.
#
# **This is the end of part 1.** Your file is saved.

# %% [markdown]
# ## Part 2: the node that drives
#
# After a break, start here: the cell needs only your files.

# %%
import math

from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
from sim import COURSE, TB4, Box, Simulator, World, load_world

begin("05")

# %% [markdown]
# ## A zero, ten times a second
#
# You tell a robot *once* to drive at 0.3 m/s, then nothing more.
#
# **Predict:** where are the robot of this course and a TurtleBot 4 after 5 seconds?

# %%
for robot in (COURSE, TB4):
    simulator = Simulator(load_world("open_field"), robot)
    simulator.command(0.3, 0.0)  # once
    simulator.step(5.0)
    print(f"{robot.name:6}  is {simulator.pose.x:.2f} m away and drives at {simulator.twist.v:.1f} m/s")

# %% [markdown]
# The course's robot drives on: a command stays in force until another one comes.
# The TurtleBot stopped half a second after the last command, because it takes silence for a fault.
#
# So a controller says what it wants **all the time**, and a zero is something to say.
#
# In ROS 2 a *timer* does that: the **executor**, the loop inside `spin`, calls the timer's callback in each period.

# %% tags=["whole"]
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

if not rclpy.ok():
    rclpy.init()


class Ticker(Node):
    def __init__(self):
        super().__init__("ticker")
        self.sent = 0
        self.publisher = self.create_publisher(Twist, "lesson_cmd_vel", 10)
        self.create_timer(1 / 10.0, self.tick)

    def tick(self):
        self.publisher.publish(Twist())  # a Twist without arguments is a standstill
        self.sent += 1

# %% [markdown] tags=["whole"]
# **Predict:** how many messages leave in 1.05 seconds of spinning? And in the next 1.05 seconds, without?

# %% tags=["nbval-ignore-output", "whole"]
# A busy machine may be one tick short, so the number is not compared.
ticker = Ticker()
end = time.monotonic() + 1.05
while time.monotonic() < end:
    rclpy.spin_once(ticker, timeout_sec=0.05)
print("spinning:     ", ticker.sent)

before = ticker.sent
time.sleep(1.05)
print("not spinning: ", ticker.sent - before)
ticker.destroy_node()

# %% [markdown]
# A timer does nothing by itself: an executor has to spin.
# Missed calls are not repeated: the timer fires once, then on schedule.
#
# This is requirement F1: with no command, a zero ten times a second, by the node's clock.
#
# ### The node
#
# The node is a class `Driver` in `driver.py`.
# Its callbacks only move data; the functions of part 1 decide.
# At each tick of its timer it asks three questions:
#
#     what is wanted?   ->  what of it is safe?  ->  what can it reach in this tick?  ->  publish
#     self._wanted()        motion.make_safe()       motion.speed_up_gently()
#
# Keep all the skeleton's names, also those with an underscore, because the next notebooks build on this class.
# JupyterLab shows it folded: run it. A click on the three dots opens it.

# %% tags=["skeleton"]
# %%writefile ros2_robot_controller/driver.py
"""The robot's reflexes: drive at the speed in force, and never into anything."""

from dataclasses import fields
import math
from typing import Any

from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from ros2_robot_controller.utils import motion, settings
from ros2_robot_controller.utils.conversions import clamp, yaw_from_quaternion
from ros2_robot_controller.utils.motion import Command, Limits, STOP
from ros2_robot_controller.utils.scans import measure_proximity, Proximity
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

NEVER = -math.inf  # the time of what has not happened yet
STALE_S = 0.5  # node time; older scans and odometry tell nothing: five missed ones at 10 Hz
MAX_DT_PERIODS = 2.0  # a late control step speeds up by no more than this many steps' worth
LAST_WORD_S = 0.2  # wall time the last command gets to reach the robot

SETTINGS = {
    'robot_name': settings.name('turtlebot4'),
    'max_linear_speed': settings.at_least_zero(0.5),
    'max_angular_speed': settings.at_least_zero(1.0),
    'linear_acceleration': settings.above_zero(1.0),
    'angular_acceleration': settings.above_zero(2.0),
    'laser_processing_rate': settings.rate(10.0),
    'fusion_rate': settings.rate(20.0),
    'obstacle_detection_threshold': settings.at_least_zero(0.5),
    'emergency_stop_distance': settings.at_least_zero(0.2),
    'safety_margin': settings.at_least_zero(0.3),
}


class Driver(Node):
    """
    Drive at the speed in force, which is 0 until a layer above sets another.

    Subscribes: `scan` (sensor_msgs/LaserScan), `odom` (nav_msgs/Odometry), both best effort.
    Publishes: `cmd_vel` (geometry_msgs/Twist) at `laser_processing_rate`, and a stop at once.
    Parameters: see SETTINGS; they are those of all layers.

    The robot stands still while it has no scan younger than STALE_S. A layer above may want
    another command than straight on: it overrides `_wanted`, and what is safe stays decided here.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)  # step 1

    # Values that change over time

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _value(self, parameter: str) -> Any:
        return self.get_parameter(parameter).value

    def _period(self, rate: str) -> float:
        return 1.0 / self._value(rate)

    def _limits(self) -> Limits:
        return Limits(**{limit.name: self._value(limit.name) for limit in fields(Limits)})

    def _is_fresh(self, time: float) -> bool:
        return False  # step 3

    # Sensors

    def _measured(self, header: Header) -> float:
        return Time.from_msg(header.stamp).nanoseconds * 1e-9

    def _on_scan(self, scan: LaserScan) -> None:
        """Step 5."""

    def _on_odom(self, odom: Odometry) -> None:
        pose = odom.pose.pose
        yaw = yaw_from_quaternion(pose.orientation)
        if math.isfinite(pose.position.x + pose.position.y + yaw):
            self._pose, self._odom_time = pose, self._measured(odom.header)

    # The control loop

    def _control(self) -> None:
        """Step 4."""

    def _wanted(self, limits: Limits) -> Command:
        return Command(v=self._speed)

    def _publish(self, command: Command) -> None:
        """Step 2."""

    def stop(self) -> None:
        """Command a standstill and give the message time to leave; in "The last zero"."""

# %% [markdown]
# Some lines that you will need:
#
# - `_now` is the time by the **node's clock**, in seconds; `_measured` is the **stamp** of a message, in the same seconds: when the sensor measured, not when the message arrived.
# - `def __init__(self, **node_options)` takes any named arguments, and `super().__init__(...)` hands them on to `Node`.
# - `_limits` reads the parameters each time, so that a change takes effect at once.

# %% [markdown] tags=["whole"]
# ### Step 1: wire it up
#
# **Exercise.** What the node remembers is there.
# Add four lines at the end: the publisher of `cmd_vel`, two subscriptions, the timer.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)
        settings.declare(self, SETTINGS)

        self._speed = 0.0  # the speed in force, m/s
        self._near = Proximity()
        self._scan_time = NEVER
        self._pose = Pose()
        self._odom_time = NEVER
        self._last_command = STOP
        self._last_command_time = self._now()

        # TODO: self._cmd_vel publishes Twist on 'cmd_vel'.
        #       'scan' (LaserScan) calls self._on_scan, 'odom' (Odometry) calls self._on_odom.
        #       self._control_timer calls self._control at the rate 'laser_processing_rate'.

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# Your `sensor_processor.py` has all three forms, and sensors take `qos_profile_sensor_data`. `self._period('laser_processing_rate')` is 0.1. Names are relative: `'scan'`, not `'/scan'`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# self._cmd_vel = self.create_publisher(Twist, 'cmd_vel', 10)
# self.create_subscription(LaserScan, 'scan', self._on_scan, qos_profile_sensor_data)
# self.create_subscription(Odometry, 'odom', self._on_odom, qos_profile_sensor_data)
# ...  # self._control_timer
# ```
# </details>

# %% [markdown]
# `bench` puts your node on a **bench**: its clock stands until you set it, what it commands is written down, and no robot hears it.

# %% tags=["whole"]
driver = bench("driver.Driver")
tries({
    "[p.topic_name for p in driver.publishers if 'cmd' in p.topic_name]": ["/cmd_vel"],
    "sorted(s.topic_name for s in driver.subscriptions if s.topic_name != '/clock')": ["/odom", "/scan"],
    "{s.qos_profile.reliability.name for s in driver.subscriptions if s.topic_name != '/clock'}": {"BEST_EFFORT"},
    "[timer.timer_period_ns for timer in driver.timers]": [100_000_000],
    "driver._control_timer.callback == driver._control": True,
})

# %% [markdown] tags=["whole"]
# ### Step 2: say it
#
# **Exercise.** `_publish` makes a `Twist` of a `Command`, sends it, and remembers the command in `self._last_command` and the time in `self._last_command_time`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def _publish(self, command: Command) -> None:
        twist = Twist()
        # TODO: fill it, send it with self._cmd_vel, remember the command and the time.

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `twist.linear.x` is v, `twist.angular.z` is omega. `self._cmd_vel.publish(twist)`. `self._now()`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# twist = Twist()
# twist.linear.x = command.v
# twist.angular.z = command.omega
# self._cmd_vel.publish(twist)
# self._last_command = command
# ...  # and when
# ```
# </details>

# %% tags=["whole"]
motion = mine("utils.motion")
driver = bench("driver.Driver")
tries({
    "driver.commands_of(driver._publish, motion.Command(0.3, -0.5))": [(0.3, -0.5)],
    "driver._last_command == motion.Command(0.3, -0.5)": True,
    "driver.set_clock(7.0), driver._publish(motion.STOP), driver._last_command_time": (None, None, 7.0),
})

# %% [markdown] tags=["whole"]
# ### Step 3: silence does not mean the way is clear
#
# If the last scan is old, you do not know what is ahead.
# "Old" is more than `STALE_S`, half a second.
# A time far in the *future* is wrong, too: the clock was set back.
#
# **Exercise.** `_is_fresh(time)`: is `time` at most `STALE_S` away from now, before or after?

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def _is_fresh(self, time: float) -> bool:
        return True  # TODO: how far is it from self._now()?

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# The age is now minus then; `abs(age)` is the distance of the two times. `NEVER` is −∞: its age is ∞.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# `return abs(...) <= STALE_S`, with the age in the brackets.
# </details>

# %% tags=["whole"]
driver = bench("driver.Driver")
tries({
    "driver.set_clock(10.0)": None,
    "driver._is_fresh(10.0)": True,
    "driver._is_fresh(9.6)": True,
    "driver._is_fresh(9.4)": False,
    "driver._is_fresh(10.4)": True,  # another computer's clock
    "driver._is_fresh(10.6)": False,  # from the future: the clock was set back
    "driver._is_fresh(-math.inf)": False,  # never
})

# %% [markdown]
# ### Step 4: the control loop
#
# **Exercise.** `_control` is called by the timer. It asks the three questions and publishes:
#
# - *What is wanted?* `self._wanted(limits)`, but `STOP` without a fresh scan.
# - *What of it is safe?* `motion.make_safe`, with `self._near`.
# - *What can it reach?* `motion.speed_up_gently`, from `self._last_command` on. A timer may come late, so `dt` is **measured**: the time since the last command, but at most `MAX_DT_PERIODS` periods, or the robot would jump ahead after a hiccup.

# %% tags=["piece"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def _control(self) -> None:
        limits = self._limits()
        # TODO: wanted, safe, dt, and publish what can be reached.

# %% [markdown]
# <details><summary>Hint 1: what you need</summary>
#
# Each question is a line. The scan is fresh if `self._is_fresh(self._scan_time)`. `dt` is what has passed, by `clamp(value, low, high)` within 0 and `MAX_DT_PERIODS * self._period('laser_processing_rate')`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# limits = self._limits()
# wanted = self._wanted(limits) if self._is_fresh(self._scan_time) else STOP
# safe = motion.make_safe(wanted, self._near, limits)
# period = self._period('laser_processing_rate')
# dt = clamp(self._now() - self._last_command_time, 0.0, MAX_DT_PERIODS * period)
# ...  # publish what speed_up_gently makes of it
# ```
# </details>
#
# `advance` lets time pass on the bench, and returns what was commanded; the cell sets the time of the last scan.

# %%
driver = bench("driver.Driver")


def drive_on(speed, seconds, scan_time):
    """Let time pass with a speed in force and a scan of that time; return the commands."""
    driver.node._speed, driver.node._scan_time = speed, scan_time
    return driver.advance(seconds)


def after_a_hiccup(seconds):
    """Return the command of a first step that comes this late."""
    late = bench("driver.Driver")
    late.node._speed, late.node._scan_time = 0.5, seconds
    late.set_clock(seconds)
    return late.commands_of(late._control)


tries({
    "driver.advance(0.3)": [(0.0, 0.0)] * 3,  # F1: zeros, ten a second
    "drive_on(0.5, 0.3, scan_time=0.3)": [(0.1, 0.0), (0.2, 0.0), (0.3, 0.0)],  # gently
    "drive_on(0.5, 0.4, scan_time=0.35)": [(0.4, 0.0), (0.5, 0.0), (0.0, 0.0), (0.0, 0.0)],  # silence
    "drive_on(-0.5, 0.2, scan_time=1.0)": [(-0.1, 0.0), (-0.2, 0.0)],
    "driver.set_clock(1.35), driver.commands_of(driver._control)": (None, [(-0.35, 0.0)]),  # 0.15 s after the last one
    "driver.set_clock(1.36), driver.commands_of(driver._control)": (None, [(-0.36, 0.0)]),  # and only 0.01 s later
    "after_a_hiccup(seconds=5.0)": [(0.2, 0.0)],  # at most two periods' worth
})

# %% [markdown]
# In the third row the command becomes zero half a second after the last scan.

# %% [markdown] tags=["whole"]
# ### Step 5: a scan need not wait
#
# A scan that comes just after a tick would be looked at 0.1 s later: 5 cm at 0.5 m/s.
# So the scan's callback publishes a stop at once.
#
# **Predict:** a scan waits in the queue for 0.6 s, because a callback is slow. How old is it by its arrival, and how old by its stamp?
#
# <details><summary>Answer</summary>
#
# By its arrival it counts as new, and the robot drives on by what was true 0.6 s ago. By its stamp it is old, and the robot stops.
# </details>
#
# **Exercise.** `_on_scan` keeps `measure_proximity(scan)` in `self._near`, and when it was measured, `self._measured(scan.header)`, in `self._scan_time`.
# Then: if `make_safe` turns the last command into `STOP`, and it was not `STOP` already, publish `STOP`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def _on_scan(self, scan: LaserScan) -> None:
        self._near = measure_proximity(scan)
        # TODO: when was that? And is the last command still safe?

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `make_safe` takes `self._last_command`, what is near, and `self._limits()`. Two commands are compared with `==`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# self._near = measure_proximity(scan)
# self._scan_time = self._measured(scan.header)
# # Do not let a stop wait for the next control step.
# if motion.make_safe(self._last_command, self._near, self._limits()) == STOP:
#     if self._last_command != STOP:
#         ...  # publish it
# ```
# </details>

# %% tags=["whole"]
from sensor_msgs.msg import LaserScan


def scan_of(ahead):
    """Return a scan of four beams, the first one backwards."""
    return LaserScan(ranges=[math.inf, math.inf, ahead, math.inf], angle_min=-math.pi,
                     angle_increment=math.pi / 2, range_min=0.15, range_max=12.0)


driver = bench("driver.Driver")
tries({
    "driver.hear('scan', scan_of(3.0))": [],  # nothing to stop
    "drive_on(0.5, 0.2, driver._scan_time)": [(0.1, 0.0), (0.2, 0.0)],
    "driver.hear('scan', scan_of(0.6))": [],  # slower is early enough in the next step
    "driver.hear('scan', scan_of(0.4))": [(0.0, 0.0)],  # at once
    "driver.hear('scan', scan_of(0.39)), driver._speed": ([], 0.5),  # it has been said; the speed in force stays
    "driver.advance(0.1)": [(0.0, 0.0)],
    "driver.hear('scan', scan_of(3.0)), driver.advance(0.3)": ([], [(0.1, 0.0), (0.2, 0.0), (0.3, 0.0)]),  # on it goes
    "driver.hear('scan', scan_of(3.0), age=0.6), driver.advance(0.1)": ([], [(0.0, 0.0)]),  # it was in a queue
})

# %% [markdown]
# ### Start it
#
# The file `robot_controller.py`, which is given, starts the node.
# It takes the speed from a parameter, and from a temporary service, which you replace in notebook 06.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot, as far as it goes: it takes any speed."""

from typing import Any, Optional

from ros2_robot_controller.driver import Driver
from ros2_robot_controller.srv import SetSpeed
from ros2_robot_controller.utils.running import run


class RobotController(Driver):
    """
    Drive at the speed that the parameter `speed` says at the start, in m/s, or `set_speed` later.

    For now: the service that replaces it can say no.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self._speed = self.declare_parameter('speed', 0.0).value
        self.create_service(SetSpeed, 'set_speed', self._on_set_speed)

    def _on_set_speed(self, request: SetSpeed.Request,
                      response: SetSpeed.Response) -> SetSpeed.Response:
        self._speed = request.speed
        response.success = True
        return response


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)

# %% tags=["check"]
check("F1", "I7")

# %% [markdown]
# I7: both nodes follow `/clock`, the simulated time.
#
# Send the robot at a wall at x = 2 m.
# **Predict:** at which x does it stand?

# %%
from sim.views import run_view

with run_node(world="wall_ahead", parameters={"speed": 0.5}) as run:
    recording = run.drive(9.0)
    commands = run.messages("cmd_vel")
run_view(recording)

# %% [markdown]
# The closest reading ends just below 0.5 m, and about 0.3 m are left between hull and wall. (The twitch at 4.3 s is the lidar's noise.)

# %% [markdown] tags=["whole"]
# How long did it take until the zero came?

# %% tags=["whole"]
too_near = recording.t[recording.closest < 0.5]
zeros = [t for t, twist in commands if too_near.size and t >= too_near[0] and twist.linear.x == 0.0]
if zeros:
    print(f"contacts: {len(recording.contacts)}, zero after {zeros[0] - too_near[0]:.2f} s")
else:
    print("not yet: it has not been stopped by the wall")

# %% [markdown]
# F4 wants no contact, and a zero within 0.3 s of the first scan below 0.5 m, at several speeds, forwards and backwards.

# %% [markdown] tags=["whole"]
# F4's advanced point is the first row of step 3: something appears right beside the robot as it creeps on (from notebook 07 on, also behind it).

# %% [markdown]
# F6 is from notebook 04: invalid readings must neither stop the robot nor hide a wall.

# %% tags=["check"]
check("F4", "F6")

# %% [markdown] tags=["whole"]
# ## Drive on when the way is free
#
# A box stands in the way for six seconds, then it is gone.
# A node that stores the obstacle in a flag, or sets `self._speed = 0.0` to stop, never drives on. That is called a **latch**.
#
# Keep apart what is *wanted* and what is *safe now*.
#
# **Predict:** what does your node do? The film shows its drive.

# %% tags=["whole"]
from sim.film import Film

room = World("a box that leaves", obstacles=(Box((1.5, 0.0), (0.3, 0.3), name="box", vanishes=6.0),))
with run_node(world=room, parameters={"speed": 0.4}) as run:
    recording = run.drive(10.0)
Film(recording)

# %% [markdown] tags=["whole"]
# F5 puts an obstacle in front of your robot and removes it, and puts one *behind* it, which should not matter.

# %% tags=["check", "whole"]
check("F5")

# %% [markdown] tags=["whole"]
# **This is the end of part 2.** Your files are saved.

# %% [markdown] tags=["whole"]
# ## Habits that hurt in a callback
#
# Part 3. After a break, start here.

# %% tags=["whole"]
import time

import rclpy
from rclpy.node import Node

# %% tags=["whole"]
from grader.notebook import begin, bench, check, mine, run_node, tries
from sim import World

begin("05")
if not rclpy.ok():
    rclpy.init()

# %% [markdown] tags=["whole"]
# Your node has one thread, in which timers and subscriptions take turns.
# Look at it: once as it is, once with a control loop that sleeps for 0.3 s.
# Blue is a callback that runs, orange a scan that waits for its turn.
#
# **Predict:** how long does a scan wait in the second picture, and does the control loop still run ten times a second?

# %% tags=["whole"]
from grader.notebook.lessons import timeline

if hasattr(mine("driver"), "Driver"):
    Driver = mine("driver").Driver

    class SlowDriver(Driver):
        def _control(self):
            time.sleep(0.3)
            super()._control()

# %% tags=["nbval-ignore-output", "whole"]
# Wall time is measured, so no two pictures are the same.

try:
    timeline(Driver, SlowDriver)
except (NameError, AttributeError):
    print("not yet: the picture needs your driver.py")

# %% [markdown] tags=["whole"]
# A scan waits up to half a second, and the loop runs only three times a second: while one callback works, all others wait.
# The queue holds five scans; then the oldest are dropped, without an error.
#
# So never use `time.sleep` in a callback, wait for an answer, or loop "until it is there".
# Store what you need in `self`, return, and let the timer ask again.
#
# Requirement Q4 reads your code for this and five more habits:
#
# | habit | what it costs |
# |---|---|
# | `except:` without a type | it hides Ctrl-C and your own typing errors |
# | `print` | no time, no level, no node name, not in `/rosout`: use `self.get_logger()` |
# | `def f(scans=[])` | one list for all calls, it remembers |
# | `if distance < 0.5` | the contract calls that number a parameter; read it from there |
# | no type annotations on public functions | a reader must guess: `def ramp(previous: float, wanted: float, ...) -> float` |

# %% tags=["check", "whole"]
check("Q4")

# %% [markdown] tags=["whole"]
# The line about `fusion_rate` goes away in notebook 07.
#
# **Break it:** put `time.sleep(0.2)` into a method of the temporary `robot_controller.py` above, run its cell, and ask again. Then take it out.

# %% [markdown] tags=["whole"]
# ## The last zero
#
# When you press Ctrl-C, the robot should stand still.
# Textbooks often publish a zero in `finally`, as this node does.

# %% tags=["whole"]
# %%writefile ../../textbook.py
from geometry_msgs.msg import Twist, Vector3
import rclpy
rclpy.init()
node = rclpy.create_node('textbook')
publisher = node.create_publisher(Twist, 'lesson_cmd_vel', 10)
node.create_timer(0.1, lambda: publisher.publish(Twist(linear=Vector3(x=0.3))))
try:
    rclpy.spin(node)
finally:
    publisher.publish(Twist())  # the last word

# %% [markdown] tags=["whole"]
# `last_words` starts it, sends the signal of Ctrl-C (SIGINT), and returns the last speed heard and the last line printed.
#
# **Predict:** what is the last speed?

# %% tags=["nbval-ignore-output", "whole"]
# Which of the two wins is a race, so the output is not compared.
from grader.notebook.lessons import last_words

for attempt in range(3):
    speed, complaint = last_words("../../textbook.py")
    print(speed, complaint.split(", at")[0])

# %% [markdown] tags=["whole"]
# The last command is 0.3 m/s, and there is a traceback.
# rclpy's own signal handler **shuts the context down** at once; when your `finally` runs, the publisher is no longer valid.
# It is a race, which the zero wins only sometimes.
#
# ### The life of an executor
#
# Three things are made at a node's start, and ended in the reverse order:
#
# | | made by | ended by |
# |---|---|---|
# | the **context**: the connection to the network | `rclpy.init()` | `rclpy.try_shutdown()` |
# | the **node**: publishers, timers, ... | `MyNode()` | `node.destroy_node()` |
# | the **executor**: the loop that calls the callbacks | `SingleThreadedExecutor()`, `executor.add_node(node)` | `executor.shutdown()` |
#
# `rclpy.spin(node)` is an executor with a loop around it:
#
#     while rclpy.ok():
#         executor.spin_once()     # wait for one callback that is due, and call it
#
# If you write that loop yourself, *you* decide when it ends and what happens after it.
#
# ### Exercise: the last word
#
# Three pieces: the first goes into `driver.py`, the other two into `running.py`.
# Here is the skeleton of `running.py`: the plain spin of notebook 01.

# %% tags=["skeleton", "whole"]
# %%writefile ros2_robot_controller/utils/running.py
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
    """Piece 3."""
    rclpy.init(args=args)
    try:
        rclpy.spin(make_node())
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()
    return 0


def spin_until(asked_to_stop: Event, node: Node) -> None:
    """Piece 2."""

# %% [markdown] tags=["whole"]
# **Piece 1, the node's last word.**
# `stop`, in `driver.py`, publishes `STOP`, then waits at most `LAST_WORD_S` until the message has left: `self._cmd_vel.wait_for_all_acked(Duration(seconds=...))`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/driver.py
class Driver:
    def stop(self) -> None:
        """Command a standstill and give the message time to leave."""
        # TODO: two lines

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `self._publish(STOP)`, from step 2.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# After it, the call that the text above the cell gives, with `seconds=LAST_WORD_S`.
# </details>

# %% tags=["whole"]
driver = bench("driver.Driver")
tries({"driver.commands_of(driver.stop)": [(0.0, 0.0)]})

# %% [markdown] tags=["whole"]
# **Piece 2, a loop that can be ended.**
# `spin_until` spins **in short turns** until the event is set: `executor.spin_once(timeout_sec=WAKE_UP_S)` comes back after one callback, or after 0.1 s without one.
# Then it calls the node's `stop`, if it has one, *while the context still lives*, and shuts the executor down.
#
# An `Event` is a flag that threads and signal handlers may set: `event.set()`; `event.is_set()` asks.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/running.py
def spin_until(asked_to_stop: Event, node: Node) -> None:
    """Serve the node's callbacks until the event is set, then call the node's `stop`."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    # TODO: the loop; the node's stop(); shut the executor down.

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# `while not asked_to_stop.is_set():`; `hasattr(node, 'stop')` tells whether there is such a method; the table above ends an executor.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# while not asked_to_stop.is_set():
#     executor.spin_once(timeout_sec=WAKE_UP_S)
# if hasattr(node, 'stop'):
#     node.stop()
# ...  # shut the executor down
# ```
# </details>
#
# Try it with a node whose timer sets the event at the third tick:

# %% tags=["whole"]
from threading import Event


class Counter(Node):
    """Asks to stop at its third tick."""

    def __init__(self):
        super().__init__("counter")
        self.ticks, self.done, self.words = 0, Event(), []
        self.create_timer(0.05, self.tick)

    def tick(self):
        self.ticks += 1
        if self.ticks == 3:
            self.done.set()

    def stop(self):
        self.words.append("stop")


running, counter = mine("utils.running"), Counter()
tries({
    "running.spin_until(counter.done, counter)": None,
    "counter.ticks": 3,
    "counter.words": ["stop"],
    "counter.executor is None or counter not in counter.executor.get_nodes()": True,  # it has let go
})
counter.destroy_node()

# %% [markdown] tags=["whole"]
# **Piece 3, from the first handler to the exit code.**
# Two things are missing in `run`:
#
# - A signal only sets the event, no more: `signal.signal(number, handler)` says what is called when that signal comes. SIGINT is Ctrl-C, and the first thing that `ros2 launch` sends; SIGTERM comes next.
# - rclpy leaves the signals alone: `rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)`.
#
# The rest is there; a `ParameterException` is a parameter that makes no sense.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/running.py
def run(make_node: Callable[[], Node], args: Optional[list[str]] = None) -> int:
    """
    Spin the node that `make_node` makes until Ctrl-C or SIGTERM; return the exit code.

    rclpy's own signal handler shuts the context down before anybody can publish a last message,
    so it is left out. A node with a method `stop` has it called while publishing still works.
    """
    asked_to_stop = Event()
    # TODO: SIGINT and SIGTERM set the event.
    rclpy.init(args=args)  # TODO: and rclpy leaves the signals to us
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

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: what you need</summary>
#
# A `for` over the two signals saves a line. A handler gets two arguments that you do not need: `lambda *_: asked_to_stop.set()`.
# </details>
# <details><summary>Hint 2: all but the last line</summary>
#
# ```python
# for number in (signal.SIGINT, signal.SIGTERM):
#     ...  # signal.signal(number, and the handler)
# rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
# ```
# </details>
#
# Press Ctrl-C on your own node, while it drives:

# %% tags=["whole"]
run = run_node(world=World("free way"), parameters={"speed": 0.3})
run.drive(2.0)
ended = run.interrupt()
if ended.last_command is not None:
    print(f"exit code {ended.exit_code}, last command: {ended.last_command.linear.x:.1f} m/s")
    # 0 is a program that ended well; -2 would be one that SIGINT, signal 2, has killed
    print(f"two seconds later it drives at {run.drive(2.0).v[-1]:.1f} m/s")
else:
    print("not yet: it has commanded nothing")

# %% tags=["check", "whole"]
check("I8")

# %% [markdown] tags=["whole"]
# > **On a real TurtleBot 4:** `cmd_vel` is a `TwistStamped`, and the base stops by itself; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.

# %% [markdown] tags=["whole"]
# ## Beyond your robot: another base
#
# An optional task without points, hints or a table of cases: only the check judges it.
#
# Four bases are to drive with your code. A `base` has
#
# - `base.radius`: the radius of its hull, in m;
# - `base.brake`: how fast its wheels brake, in m/s²;
# - `base.delay`: the longest time from a measurement until it brakes, in s;
# - `base.max_speed`: in m/s.
#
# Write `safe_speed`: the highest speed at which a base may drive when the closest reading ahead is `distance`, in m from its centre.
# The base must stand before its hull touches, even if it gets no other reading.
# A speed more than 2 % below the highest safe one is too slow.
# `inf` is a free way; for NaN the base stands.

# %% tags=["function", "unseen", "whole"]
from grader.notebook.unseen import check


def safe_speed(distance, base):
    """Return the highest speed (m/s) from which the base stops before its hull touches."""
    return 0.5  # TODO

# %% tags=["check", "whole"]
check("U2", safe_speed)

# %% [markdown] tags=["whole"]
# ## Go further
#
# - **A threshold that flickers** at 0.5 m, with the lidar's noise. Use the hysteresis of notebook 04.

# %% [markdown]
# ## Recall
#
# <details><summary>Why does a controller publish zeros when it has nothing to do?</summary>
#
# A robot keeps the last command, or stops after its own time-out. Only a stream says what is wanted now.
# </details>
#
# <details><summary>The delay doubles. The speed doubles. Which is worse for the stop distance?</summary>
#
# The speed: it doubles the first part and makes the second four times as long. The delay doubles the first part alone.
# </details>
#
# <details><summary>Where in the node may the obstacle write to <code>self._speed</code>?</summary>
#
# Nowhere. That speed was asked for; the obstacle changes what is published.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Why does <code>finally: publisher.publish(Twist())</code> not stop the robot?</summary>
#
# By then rclpy's signal handler has, most of the time, shut the context down.
# </details>

# %% [markdown]
# **Next:** [06 Services](06_services.ipynb). Your node accepts any speed, even NaN; next it can refuse one.

# %%
from grader.notebook import progress

progress()
