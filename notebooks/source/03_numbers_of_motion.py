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
# # 03 The numbers of motion
#
# ![A robot's way through three offices, with arrows for its heading, and the heading over time](pictures/03.png)
#
# A robot that drives needs three numbers: where it is, x and y, and which way it faces.
# The third one is the difficult one.
# It comes as four numbers, it jumps when the robot looks west, and half of all robot code gets it wrong once.
# In this notebook you get it wrong on purpose, and then write four functions that get it right.
#
# **You will be able to**
#
# - read a heading out of a ROS message, and write one into it;
# - add, subtract and compare angles without turning the long way round;
# - say which numbers are in radians, and see what happens when one is not;
# - keep a number within limits without hiding that it was none;
# - write docstrings that say units, frames and ranges, and let a linter read them.
#
# **Time:** about 40 minutes.
#
# **Your package so far**, from notebooks 01 and 02, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/                      the four interfaces
#     ├── scripts/                                 the two executables
#     └── ros2_robot_controller/
#         ├── __init__.py
#         ├── robot_controller.py                  an empty node
#         ├── sensor_processor.py                  an empty node
#         └── utils/
#             ├── __init__.py  running.py
#             └── conversions.py                   ← today
#
# Run the cells from top to bottom.
# Before you run one that asks *What will it be?*, say your answer aloud or write it down: a guess that fails teaches more than one that was never made.

# %%
from grader.notebook import begin, check, run_node, start_at

begin("03")

# %% [markdown]
# If the lines above say that files are missing, and you would rather start here than go back, run `start_at("03")` in a cell of its own.

# %% [markdown]
# ## Which way does it face?
#
# No nodes yet.
# You drive the simulator from this cell: for eight seconds, with a driver that comes with it.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

from sim import Pose, Simulator, Tourist, Twist, World, drive, load_world
from sim.views import map_view

simulator = Simulator(load_world("office"))
recording = drive(simulator, Tourist(simulator), 8.0)
map_view(recording)

# %% [markdown]
# The short line from the centre to the rim is the robot's front.
# Next you look at what a robot *says* about this moment: its odometry, as the message that goes over the topic `odom`.
#
# **What will it be?** The robot has turned to its left by about a right angle.
# How would *you* write that into a message?

# %%
from sim.bridge import to_message

odom = to_message(simulator.odometry())
print("position   ", odom.pose.pose.position)
print("orientation", odom.pose.pose.orientation)

# %% [markdown]
# The position is what you expect: metres, `x` and `y`, and a `z` of 0 for a robot on the floor.
# The orientation is a **quaternion**: four numbers, none of which is an angle.
#
# Why four numbers for one angle?
# The same message serves drones and arms, which can tilt in every direction.
# Three angles would do for them, but three angles have places where they fail (two of the three axes fall together), and quaternions have none.
# A robot on the floor only turns about its z axis.
# That one angle is called **yaw**, and then `x` and `y` of the quaternion stay 0.
#
# ROS agrees on the rest once for all robots ([REP 103](https://www.ros.org/reps/rep-0103.html)):
#
# | | |
# |---|---|
# | x | forward |
# | y | left |
# | z | up |
# | angles | in **radians**, **counter-clockwise** is positive, 0 is along x |

# %% [markdown]
# ## Half the angle, in two numbers
#
# Rotating by yaw about the z axis is this quaternion:
#
#     x = 0    y = 0    z = sin(yaw / 2)    w = cos(yaw / 2)
#
# Do one by hand.
# To the left is 90°, half of it is 45°, so z and w are both about 0.71.
#
# **What will it be** for straight back, 180°?
# And for -90° and 270°, which are the same direction?

# %%
print("  yaw       z        w")
for degrees in (0, 90, 180, -90, 270):
    half = math.radians(degrees) / 2
    print(f"{degrees:4d}°   {math.sin(half):6.3f}   {math.cos(half):6.3f}")

# %% [markdown]
# The last two lines are the surprise: one direction, two quaternions, each the other's negative.
# Draw it: at the left the arrow on the map, at the right the point (w, z).

# %%
def draw_arrow(axes, degrees, color, length=1.0, nudge=(0.0, 0.0)):
    """Draw a heading as an arrow from the origin; `nudge` moves its label."""
    x, y = length * math.cos(math.radians(degrees)), length * math.sin(math.radians(degrees))
    axes.quiver(0, 0, x, y, color=color, angles="xy", scale_units="xy", scale=1)
    label = {"color": color, "ha": "center", "va": "center"}
    axes.text(1.15 * x + nudge[0], 1.15 * y + nudge[1], f"{degrees:g}°", **label)


figure, (arrows, points) = plt.subplots(1, 2, figsize=(9, 4.3), layout="constrained")
for number, degrees in enumerate((0, 45, 90, 135, 180, -90, 270)):
    color, half = f"C{number}", math.radians(degrees) / 2
    if degrees == 270:  # shorter, or it would hide the arrow of -90°
        draw_arrow(arrows, degrees, color, length=0.6, nudge=(0.25, 0.15))
    else:
        draw_arrow(arrows, degrees, color)
    points.plot(math.cos(half), math.sin(half), "o", color=color, markersize=9)
    points.text(1.2 * math.cos(half), 1.2 * math.sin(half), f"{degrees}°", color=color, ha="center")
arrows.set(title="the arrow on the map", xlabel="x (m)", ylabel="y (m)")
points.set(title="its quaternion", xlabel="w", ylabel="z")
for axes in (arrows, points):
    axes.add_patch(plt.Circle((0, 0), 1, fill=False, color="0.8"))
    axes.set(xlim=(-1.45, 1.45), ylim=(-1.45, 1.45), aspect="equal")
    axes.grid(alpha=0.3)

# %% [markdown]
# A full turn of the arrow is half a turn of the point.
# So a point and the one opposite, q and -q, are the *same* arrow: look at -90° and 270°.
#
# The way back looks easy then: the point's own angle, times two.
# **What will it be** for the two quaternions of "to the right"?

# %%
for z, w in ((-0.7071, 0.7071), (0.7071, -0.7071)):
    print(f"z = {z:7.4f}, w = {w:7.4f}: {math.degrees(2 * math.atan2(z, w)):6.1f}°")

# %% [markdown]
# Same direction, and yet -90 and 270: two numbers that `==` calls different.
# And it breaks further on a ramp.
# There the robot tilts, x and y of the quaternion are no longer 0, and the formula does not even look at them.
# A formula that holds for every quaternion is one of the four things you will write below.
#
# **Change one thing:** add -45 and 315 to the list of the drawing and run it again.

# %% [markdown]
# ## Angles wrap
#
# A robot has looked at its compass twice and wants the mean.
# It faced almost exactly backwards both times: 179° and -179°.
#
# **What will it be?**

# %%
readings = np.array([179.0, -179.0])
print("mean:", readings.mean(), "°")

# %% [markdown]
# Zero: straight ahead.
# The two arrows are 2° apart, and their "mean" points the other way.

# %%
figure, axes = plt.subplots(figsize=(5.5, 2.6), layout="constrained")
draw_arrow(axes, readings.mean(), "C3")
draw_arrow(axes, 179, "C0", nudge=(0.0, 0.12))
draw_arrow(axes, -179, "C1", nudge=(0.0, -0.12))
axes.set(xlim=(-1.4, 1.4), ylim=(-0.6, 0.6), aspect="equal", xlabel="x (m)", ylabel="y (m)")
axes.grid(alpha=0.3)

# %% [markdown]
# Angles live on a circle, and a circle must be cut somewhere to be written as a line of numbers.
# ROS code mostly cuts behind the robot: from just above -180° up to 180°.
# Whenever you add or subtract two angles, the result can lie beyond the cut: 179 + 2 is 181, which is -179.
# Folding it back is called **normalizing**.
#
# Python's `%` folds too.
# **What will it be** for a little to the right, -10°?

# %%
print("-10 % 360 =", -10 % 360)

# %% [markdown]
# 350: the same direction, cut in front of the robot, where it hurts most.
# "Turn by -10°" means a little to the right; "turn by 350°" means nearly a full turn to the left.
# You want the sign: in (-π, π], positive is left and negative is right.
# The brackets are meant: -π itself is *not* in it, π is, so that "straight back" has one number and not two.

# %% [markdown]
# ## Turning the long way round
#
# Now it costs time and power.
# A robot faces -170° and shall face 170°.
# That is 20° to the right.
# It turns as many robots do: the further off, the faster.
#
#     omega = 1.5 * (wanted - yaw)
#
# **Which way will it turn, and how far?**

# %%
def turner(wanted_deg, difference):
    """Return a driver that turns to a heading: the further off, the faster."""
    wanted = math.radians(wanted_deg)
    return lambda seen: Twist(0.0, 1.5 * difference(wanted, seen.odometry.pose.yaw))


def turn(start_deg, wanted_deg, difference):
    """Return the recording of a robot that turns from one heading to another, in degrees."""
    robot = Simulator(World(start=Pose(yaw=math.radians(start_deg))))
    return drive(robot, turner(wanted_deg, difference), 9.0)


def minus(wanted, yaw):
    """Return what one writes at first."""
    return wanted - yaw


def turned(run):
    """Return how far a run turned in all, in degrees."""
    return math.degrees(np.abs(np.diff(np.unwrap(run.yaw))).sum())


print(f"turned by {turned(turn(-170, 170, minus)):.0f}°")

# %% [markdown]
# 340° instead of 20°, to the left instead of to the right.
# It did arrive, though.
# So change one thing: the robot starts at 90° and shall face 183°.
# Nobody writes 183°, but "my heading plus a quarter turn" does, when the heading is 93°.
#
# **What will it do?**

# %%
def heading_view(runs):
    """Draw the heading over time; `runs` is a list of (label, recording)."""
    figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
    for label, run in runs:
        axes.plot(run.t, np.degrees(run.yaw), ".", markersize=3, label=label)
    axes.set(xlabel="simulated time (s)", ylabel="heading (°)", yticks=range(-180, 181, 90))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=8, frameon=False)


first, second = turn(-170, 170, minus), turn(90, 183, minus)
heading_view([("from -170° to 170°", first), ("from 90° to 183°", second)])

# %% [markdown]
# It never arrives.
# The heading in the message jumps from 180 to -180 just before the goal; the difference jumps from 3 to 363; the robot turns on, for ever.
# Watch it in a corridor; it starts at 0° this time.

# %%
from sim.live import Live

live = Live(Simulator(load_world("corridor")), driver=turner(183, minus))
live

# %% [markdown]
# (`live.stop()` ends it; so does the next cell. Where no kernel runs you see a picture.)
#
# It works in every test that does not look backwards, and that is why this bug is so common.
# You will come back to this plot with a function of your own.

# %% [markdown]
# ## Degrees in a radians field
#
# The message says `float64` and no more.
# Somebody means 90° and writes 90.
#
# **Which way does that robot face?**
# Do it by hand: a full turn is 6.283 rad.

# %%
from geometry_msgs.msg import Quaternion

live.stop()
oops = Quaternion(z=math.sin(90 / 2), w=math.cos(90 / 2))
print(oops)
rest = 90 % math.tau
print(f"{90 / math.tau:.2f} turns; the rest is {rest:.3f} rad or {math.degrees(rest):.1f}°")

# %% [markdown]
# Fourteen full turns, and then 116.6°.
# Nothing complains: it is a valid quaternion, in a valid message, of the right type.
# Wrong units do not crash; they arrive somewhere else.
# Two habits help: a name or a docstring that says the unit, and a number that is asked whether it can be true.
# No robot in this course turns faster than 1.9 rad/s, so an `angular.z` of 90 is no speed, it is a mistake in degrees.

# %% [markdown]
# ## Limits, and a number that is none
#
# The last of the four functions keeps a number within limits; every robot does it before it commands a speed.
#
#     speed = min(max(speed, -0.5), 0.5)
#
# Now a sensor fails, numpy divides 0 by 0, and the speed is **NaN**, "not a number".
# NaN has one property you have to know by heart: *every* comparison with it is False.

# %%
nan = math.nan
print("nan < 0.5:", nan < 0.5, "  nan > 0.5:", nan > 0.5, "  nan == nan:", nan == nan)

# %% [markdown]
# Here are four ways to write the same limit, all equal for ordinary numbers.
# **What will each make of NaN?**

# %%
low, high = -0.5, 0.5
print("min(max(nan, low), high) =", min(max(nan, low), high))
print("min(max(low, nan), high) =", min(max(low, nan), high))
print("max(low, min(nan, high)) =", max(low, min(nan, high)))
print("max(low, min(high, nan)) =", max(low, min(high, nan)))

# %% [markdown]
# Only the first line still says that something is wrong.
# With the others one broken sensor makes the robot drive at full speed: backwards twice, and once forwards.
# `max(a, b)` keeps `a` unless `b > a`, so with NaN it is the *order* that decides.
#
# A clamp that turns NaN into a limit hides the fault and makes a command of it.
# Yours shall let NaN through as NaN, so that whoever asks next, "is this a finite number?", can still see it.

# %% [markdown]
# ## Four functions and their edges
#
# Now write them: `utils/conversions.py`, the contract's four functions.
# They know nothing of nodes and topics, only numbers, so they can be tried in a cell and tested without a robot.
#
# | function | gives | edges |
# |---|---|---|
# | `yaw_from_quaternion(q)` | yaw in rad, in (-π, π] | q and -q give the same; x and y may be other than 0 |
# | `quaternion_from_yaw(yaw)` | a `Quaternion` | any yaw, also beyond a full turn |
# | `normalize_angle(angle)` | the same direction in rad, in (-π, π] | -π gives π; 3π too; NaN gives NaN |
# | `clamp(value, low, high)` | `value`, or the nearer limit | NaN gives NaN |
#
# Write into the cell below and run it: `%%writefile` saves it as a file of your package.
# The `TODO`s that ask for docstrings can wait for the next section.
# (`%%writefile` makes no folders, so the line before it makes sure that there is one.)

# %%
# !mkdir -p ros2_robot_controller/utils

# %% tags=["exercise"]
# %%writefile ros2_robot_controller/utils/conversions.py
# TODO 5: a docstring for the module: what is in here, and what stays out?
import math

from geometry_msgs.msg import Quaternion

# TODO 6: a docstring in each of the four functions: what it gives, in which unit, in which range.


def yaw_from_quaternion(q: Quaternion) -> float:
    # TODO 1: the yaw of any quaternion, in (-pi, pi].
    return 0.0


def quaternion_from_yaw(yaw: float) -> Quaternion:
    # TODO 2: half the angle, in two of the four numbers.
    return Quaternion()


def normalize_angle(angle: float) -> float:
    # TODO 3: fold the angle into (-pi, pi]. Which of the two ends needs care?
    return angle


def clamp(value: float, low: float, high: float) -> float:
    # TODO 4: keep the value between low and high. Comparisons with NaN are False: use that.
    return value

# %% [markdown]
# Try them here first: `%run` runs your file as it is saved now and puts its functions into the notebook.
# Add lines of your own to the list.
# An edge is where the next bug sits: 0, both ends, one step beyond each end, and a value that is none.

# %%
# %run ros2_robot_controller/utils/conversions.py
pi = math.pi
right, tilted = Quaternion(z=0.7071, w=-0.7071), Quaternion(x=0.5, y=0.5, z=0.5, w=0.5)
tries = [
    (normalize_angle, (0.5,), 0.5),
    (normalize_angle, (3 * pi,), pi),
    (normalize_angle, (-pi,), pi),
    (normalize_angle, (-pi - 0.1,), pi - 0.1),
    (yaw_from_quaternion, (right,), -pi / 2),
    (yaw_from_quaternion, (tilted,), pi / 2),
    (clamp, (7.0, -0.5, 0.5), 0.5),
    (clamp, (-7.0, -0.5, 0.5), -0.5),
    (clamp, (nan, -0.5, 0.5), nan),
]
for function, values, wanted in tries:
    got = function(*values)
    fits = math.isnan(got) if math.isnan(wanted) else math.isclose(got, wanted, abs_tol=1e-3)
    verdict = "right" if fits else "NOT YET"
    print(f"{function.__name__:20s} gave {got:7.3f}, wanted {wanted:7.3f}  {verdict}")
for yaw, wanted in ((0.0, 0.0), (3.0, 3.0), (-3.0, -3.0), (pi, pi), (4.0, 4.0 - 2 * pi)):
    got = yaw_from_quaternion(quaternion_from_yaw(yaw))
    fits = math.isclose(got, wanted, abs_tol=1e-3)
    verdict = "right" if fits else "NOT YET"
    print(f"{yaw:6.3f} there and back gave {got:7.3f}, wanted {wanted:7.3f}  {verdict}")

# %% [markdown]
# And now the grader's own check, the same that will look at what you hand in.
# It builds the package first, so the first time takes a while.

# %% tags=["check"]
check("F14")

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# - Yaw: the heading is the direction in which the robot's x axis points, once it has been rotated by q. Two formulas give that direction's sine and cosine, `math.atan2(sine, cosine)` gives the angle. "Quaternion to yaw" is worth a search; the ROS 2 page is [Quaternion fundamentals](https://docs.ros.org/en/jazzy/Tutorials/Intermediate/Tf2/Quaternion-Fundamentals.html).
# - Normalizing: Python's `math` has a function for the remainder that is *nearest to zero*. It is not `%` and not `fmod`.
# - Clamp: two `if`s are enough, and need no `min` or `max`.
# </details>
#
# <details><summary>Hint 2: the formulas</summary>
#
# - `sine = 2 * (w * z + x * y)` and `cosine = 1 - 2 * (y * y + z * z)`, for a quaternion of length 1.
# - `math.remainder(angle, math.tau)` gives -π ... π, with both ends possible. One of them is not allowed.
# - `atan2` can give -π too.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def normalize_angle(angle: float) -> float:
#     if not math.isfinite(angle):
#         return math.nan  # math.remainder(inf, ...) raises ValueError
#     wrapped = math.remainder(angle, math.tau)
#     ...                  # one line: which of the two ends does it give back as the other?
#
# def clamp(value: float, low: float, high: float) -> float:
#     if value < low:
#         return low
#     if value > high:
#         return high
#     ...                  # what is left: values within, and NaN
# ```
#
# `yaw_from_quaternion` ends in a call of `normalize_angle`; `quaternion_from_yaw` is the table by hand from above, with names: `Quaternion(x=0.0, ...)`.
# </details>
#
# ### Your functions at work
#
# Here is the robot that turned the long way round, with one change: the difference is normalized, by *your* function.

# %%
def shortest(wanted, yaw):
    """Return the turn from yaw to wanted, in rad, positive to the left."""
    return normalize_angle(wanted - yaw)


first, second = turn(-170, 170, shortest), turn(90, 183, shortest)
print(f"from -170° to 170°: turned by {turned(first):.0f}°")
print(f"from   90° to 183°: turned by {turned(second):.0f}°")
heading_view([("from -170° to 170°", first), ("from 90° to 183°", second)])

# %% [markdown]
# Look for 20° and 93°; until your function works, the numbers are those from before.
# Notice what did *not* have to change: the goal is still 183°, the heading still jumps at 180°.
# Normalize differences, and it does not matter where the circle is cut.
#
# **Change one thing:** let the robot turn from 0° to 180°, then from 1° to 180° and from -1° to 180°. Which way does it turn, and why may it choose in the first case?

# %% [markdown]
# ## Say what a function gives
#
# Somebody uses your functions next week.
# What they see is this:

# %%
help(clamp)
help(normalize_angle)

# %% [markdown]
# Without a docstring that is a name and a type, and `float` says neither radians nor range.
# The 116.6° from above began exactly there.
#
# A docstring's first line says **what you get**, as an order: "Return the ...".
# After it comes what the type cannot say:
#
# | say | for example |
# |---|---|
# | the unit | in radians, in metres, in percent |
# | the frame, for places and directions | in the odom frame |
# | the range | in (-pi, pi] |
# | what happens at the edges | NaN stays NaN; inf where there is none |
#
# Do not say what the name and the type say already, and do not tell how it works: the code does that, and it is never out of date.
#
# How docstrings are *written* is a matter of agreement, and ROS packages agree on the rules of PEP 257, checked by a linter: `ament_pep257`.
# Here are three functions with something to find, in a file beside your package.
# **What will it say about each?**

# %%
# %%writefile ../../three_docstrings.py
"""Three functions that do nothing."""


def yaw(q):
    """Returns the yaw of q"""
    return 0.0


def limit(value):
    """
    Return the value within the limits.
    NaN stays NaN.
    """
    return value


def bare(value):
    return value

# %% tags=["nbval-ignore-output"]
# The linter writes its findings and its count into two streams, and their order may change.
# !cd ../.. && ament_pep257 three_docstrings.py

# %% [markdown]
# The first function gets three findings: no full stop (two rules say so) and "Returns", where an order was wanted.
# The second lacks an empty line after its first sentence.
#
# And the third, which says nothing at all?
# **No finding.**
# ROS's setting of the linter looks at how docstrings are written, not at whether they are there.
# A linter that is silent has not said that all is well.
# The grader counts the missing ones itself: public modules, classes and functions, with full marks at 90 %.
#
# This is how the second one reads when it is right; the summary starts on the line after the quotes, as ROS likes it:
#
# ```python
# def limit(value: float) -> float:
#     """
#     Return the value within the limits.
#
#     NaN stays NaN.
#     """
# ```
#
# Now go back to your `conversions.py` above, do TODO 5 and 6, run its cell again, and then these two.

# %% tags=["nbval-ignore-output"]
# As above: the order of the lines may change.
# !ament_pep257 ros2_robot_controller/utils/conversions.py

# %% tags=["check"]
check("Q2")

# %% [markdown]
# Q2 looks at the whole package; from now on each new file has to keep it.
#
# <details><summary>Hint 1: where to look</summary>
#
# The check names file and line of what lacks a docstring.
# A module's docstring is the first thing in the file, above the imports; a function's is the first thing below `def`.
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# One line: `"""Return ... in radians, in (-pi, pi]."""`
# Several: quotes alone on their line, the summary in one line with a full stop, an empty line, the rest, quotes alone.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# """Turn angles and quaternions into each other. ..."""   # and what is it that does not belong here?
#
# def quaternion_from_yaw(yaw: float) -> Quaternion:
#     """Return the unit quaternion of a rotation by `yaw` radians about z."""
#
# def normalize_angle(angle: float) -> float:
#     """
#     Return the same direction in radians, in (-pi, pi].
#
#     ...                                                  # and for NaN and infinity?
#     """
# ```
# </details>
#
# > **On a real TurtleBot 4**
# >
# > - `ros2 topic echo --once --field pose.pose.orientation /odom` shows the same four numbers. x and y are not quite 0 there: floors and sensors are never level.
# > - The lidar is mounted turned by 90° to the left. Its frame relative to the robot is the quaternion z = w = 0.7071, which you can now read at a glance. A program that takes the beam at angle 0 for "ahead" looks to the robot's left.
# > - Odometry starts at yaw 0 wherever the robot stands when it is switched on. A heading means nothing until you say in which frame.

# %% [markdown]
# ## Go further
#
# Not needed for the next notebook.
#
# - Quaternions can be longer than 1, for example after many multiplications. For those, 1 - 2(y² + z²) is wrong. Multiply out w² + x² - y² - z² for length 1 and see that it is the same; use it, and your function holds for every length.
# - The mean of angles that does work: add up the arrows, `atan2(sum of sines, sum of cosines)`. What does it say for 0° and 180°, and what *should* it say?
# - Two turns one after the other are one multiplication of quaternions. Write it for z and w only, and check that it adds the angles.

# %% [markdown]
# ## Do you remember?
#
# <details><summary>A message says z = 1, w = 0. Which way does the robot face?</summary>
#
# Backwards: half the angle has sine 1, so it is 90°, and the yaw is 180°.
# </details>
#
# <details><summary>Why does <code>wanted - yaw</code> work in most tests and still fail?</summary>
#
# As long as the difference stays within half a turn it is right.
# It fails only where the two lie on different sides of the cut, which is behind the robot.
# </details>
#
# <details><summary>What is <code>max(low, min(high, value))</code> for a value of NaN, and why is that bad?</summary>
#
# `high`: `min(high, nan)` keeps `high`, for `nan < high` is False.
# A broken sensor becomes the command "full speed ahead".
# </details>
#
# <details><summary>ament_pep257 finds nothing in a file. Does every function have a docstring?</summary>
#
# Not at all: its ROS setting leaves out the rules about missing docstrings.
# </details>

# %% [markdown]
# **Next:** [04 Seeing](04_seeing.ipynb). The robot gets eyes: 360 numbers ten times a second, some of which are lies.
