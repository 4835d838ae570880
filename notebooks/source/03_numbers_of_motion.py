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
# ![At the left a robot's path with an arrow for each heading, in the middle the same heading as a number that jumps, at the right two turns from -170° to 170°, one of them the long way round](pictures/03.png)
#
# A robot that drives needs three numbers: where it is, x and y, and which way it faces.
# The third one is the difficult one.
# It arrives as four numbers, it jumps when the robot looks west, and nearly everybody who programs robots gets it wrong once.
# In this notebook you see it go wrong, and write short functions that get it right.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - read a heading from a ROS message, and write one into it;
# - add, subtract and compare angles without turning the long way round;
# - say which numbers are in radians, and see what happens when one is not;
# - keep a number within limits without hiding that it is not a number at all;
# - write docstrings that state units, frames and ranges, and let a linter read them.
#
# **Time:** 55 to 110 minutes. A good place for a break is before "From four numbers back to one".
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# **Your package so far**, from notebooks 01 and 02, and what you add today:
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
# Before you run one below **Predict**, say your answer aloud or write it down.

# %%
import math
from math import inf, nan, pi

import numpy as np

from grader.notebook import begin, check, run_node, start_at, tries

begin("03")
CONVERSIONS = "ros2_robot_controller/utils/conversions.py"

# %% [markdown]
# If the lines above say that files are missing, and you would rather start here than go back, run `start_at("03")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 02: 0.3 is put into a <code>float32</code> field. What arrives?</summary>
#
# 0.30000001192…: the nearest number that a float32 holds. Never compare it with `==` to a 0.3 that you typed.
# </details>
# <details><summary>Notebook 02: two machines swap two fields of one message type. What happens, and what would tell you?</summary>
#
# The messages arrive and are read wrongly, in silence. The type hash differs.
# </details>
# <details><summary>Notebook 01: what is the difference between a folder of Python files and a ROS package?</summary>
#
# A `package.xml` that says what it is and needs, and a build file that installs its parts where ROS looks.
# </details>

# %% [markdown] tags=["whole"]
# ## Which way does it face?
#
# No nodes yet.
# This cell runs the simulator for eight seconds, with a driver that comes with it.

# %% tags=["whole"]
import matplotlib.pyplot as plt

from sim import Pose, Simulator, Tourist, Twist, World, drive, load_world
from sim.views import map_view

simulator = Simulator(load_world("office"))
recording = drive(simulator, Tourist(simulator), 8.0)
map_view(recording)

# %% [markdown] tags=["whole"]
# The short line from the centre to the rim is the robot's front.
# Next you look at what a robot *says* about this moment: its odometry, as the message that is published on the topic `odom`.
#
# **Predict:** the robot has turned to its left by about a right angle.
# How would *you* write that into a message?

# %% tags=["whole"]
from sim.bridge import to_message

odom = to_message(simulator.odometry())
print("position   ", odom.pose.pose.position)
print("orientation", odom.pose.pose.orientation)

# %% [markdown] tags=["whole"]
# The position is what you expect: metres, `x` and `y`, and a `z` of 0 for a robot on the floor.
# The orientation is a **quaternion**: four numbers, none of which is an angle.
#
# Why four numbers for one angle?
# The same message serves drones and arms, which can tilt in every direction.
# Three angles would be enough, but three angles fail in some positions (two of the three axes fall together), and quaternions never do.
# A robot on the floor only turns about its z axis.
# That one angle is called **yaw**, and then `x` and `y` of the quaternion stay 0.
#
# ROS fixes the rest once for all robots ([REP 103](https://www.ros.org/reps/rep-0103.html)):
#
# | | |
# |---|---|
# | x | forward |
# | y | left |
# | z | up |
# | angles | in **radians**, **counter-clockwise** is positive, 0 is along x |

# %% [markdown] tags=["whole"]
# ## Half the angle, in two numbers
#
# Turning by yaw about the z axis is this quaternion:
#
#     x = 0    y = 0    z = sin(yaw / 2)    w = cos(yaw / 2)
#
# Do one by hand.
# To the left is 90°, half of it is 45°, so z and w are both about 0.71.
#
# **Predict:** what are z and w for straight back, 180°?
# And for -90° and 270°, which are the same direction?

# %% tags=["whole"]
print("  yaw       z        w")
for degrees in (0, 90, 180, -90, 270):
    half = math.radians(degrees) / 2
    print(f"{degrees:4d}°   {math.sin(half):6.3f}   {math.cos(half):6.3f}")

# %% [markdown] tags=["whole"]
# The last two lines are the surprise: one direction, two quaternions, each the negative of the other.
# Draw it: at the left the arrow on the map, at the right the point (w, z).

# %% tags=["whole"]
def draw_arrow(axes, degrees, color, length=1.0, nudge=(0.0, 0.0)):
    """Draw a heading as an arrow from the origin; `nudge` moves its label."""
    x, y = length * math.cos(math.radians(degrees)), length * math.sin(math.radians(degrees))
    axes.quiver(0, 0, x, y, color=color, angles="xy", scale_units="xy", scale=1)
    label = {"color": color, "ha": "center", "va": "center"}
    axes.text(1.22 * x + nudge[0], 1.22 * y + nudge[1], f"{degrees:g}°", **label)


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

# %% [markdown] tags=["whole"]
# A full turn of the arrow is half a turn of the point.
# So a point and the one opposite, q and -q, are the *same* arrow: look at -90° and 270°.
#
# **Change one thing:** add -45 and 315 to the list of the drawing and run it again.

# %% [markdown]
# ### Today's file
#
# Here is the file that you fill today, `utils/conversions.py`, as a skeleton: everything is there except what the four functions do.
# They know nothing of nodes and topics, only numbers, so you can try them in a cell and test them without a robot.
#
# You fill it function by function: `%%into FILE` in the first line of a cell puts the function below it into that file, in place of the one with the same name.
# `tries`, below each exercise, reads your file, computes each line, and compares the result with the number at the right.

# %% tags=["skeleton"]
# %%writefile ros2_robot_controller/utils/conversions.py
"""Turn angles and quaternions into each other. Numbers only: no node, no topics."""

import math

from geometry_msgs.msg import Quaternion


def yaw_from_quaternion(q: Quaternion) -> float:
    return 0.0  # exercise 3


def quaternion_from_yaw(yaw: float) -> Quaternion:
    return Quaternion()  # exercise 1


def normalize_angle(angle: float) -> float:
    return angle  # exercise 2


def clamp(value: float, low: float, high: float) -> float:
    return value  # exercise 4

# %% [markdown] tags=["whole"]
# ### Exercise 1: write a heading
#
# Write `quaternion_from_yaw`: the table by hand from above, as code.
# The fields have names, and take floats, 0.0 and not 0: `Quaternion(x=0.0, y=0.0, z=…, w=…)`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/conversions.py
def quaternion_from_yaw(yaw: float) -> Quaternion:
    # TODO: half the angle, in two of the four numbers
    return Quaternion()

# %% [markdown] tags=["whole"]
# Try it on the spot.
# After `tries` you can use the file's functions in any cell below, such as `quaternion_from_yaw(1.0)`. (`%%into` alone changes only the file.)

# %% tags=["whole"]
tries(
    {
        "quaternion_from_yaw(0.0).w": 1.0,
        "quaternion_from_yaw(pi / 2).z": math.sqrt(0.5),
        "quaternion_from_yaw(-pi / 2).z": -math.sqrt(0.5),
        "quaternion_from_yaw(pi).z": 1.0,
        "quaternion_from_yaw(pi).w": 0.0,
    },
    of=CONVERSIONS,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The formula at the top of this section, and the cell that printed the table below it.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `math.sin` and `math.cos` take radians, and `yaw` is in radians already.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def quaternion_from_yaw(yaw: float) -> Quaternion:
#     half = yaw / 2.0
#     ...                  # return the Quaternion with its four fields
# ```
# </details>

# %% [markdown]
# ## Angles wrap
#
# A robot has measured its heading twice and wants the mean.
# Both times it faced almost exactly backwards: 179° and -179°.
#
# **Predict:** what is the mean?

# %%
readings = np.array([179.0, -179.0])
print("mean:", readings.mean(), "°")

# %% [markdown] tags=["whole"]
# It is zero, which is straight ahead.
# The two arrows are 2° apart, but their "mean" points the other way.

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(5.5, 2.6), layout="constrained")
draw_arrow(axes, readings.mean(), "C3")
draw_arrow(axes, 179, "C0", nudge=(0.0, 0.12))
draw_arrow(axes, -179, "C1", nudge=(0.0, -0.12))
axes.set(xlim=(-1.4, 1.4), ylim=(-0.6, 0.6), aspect="equal", xlabel="x (m)", ylabel="y (m)")
axes.grid(alpha=0.3)

# %% [markdown]
# Straight ahead is wrong: both readings look back, and are 2° apart.
# Angles lie on a circle, and you must cut the circle somewhere to write them as a line of numbers.
# ROS code usually cuts it behind the robot: from just above -180° up to 180°.
# Whenever you add or subtract two angles, the result can lie beyond the cut: 179 + 2 is 181, which is -179.
# Bringing it back is called **normalizing**.

# %% [markdown] tags=["whole"]
# Python's `%` does something similar.
# **Predict:** what does it return for -10°, a little to the right?

# %% tags=["whole"]
print("-10 % 360 =", -10 % 360)

# %% [markdown] tags=["whole"]
# It returns 350, the same direction. But the number now jumps straight ahead, where you steer most.
# "Turn by -10°" means a little to the right; "turn by 350°" means nearly a full turn to the left.

# %% [markdown]
# You need the sign: in (-π, π], positive is left and negative is right.
# The brackets matter: π is included but -π is *not*, so "straight back" has only one number.
#
# Python's `math` has another remainder, the one *nearest to zero*.
# **Predict:** what does it return for these angles, and for both ends?

# %%
for degrees in (-10, 181, 540, -180, 180):
    print(f"math.remainder({degrees:4d}, 360) = {math.remainder(degrees, 360):6.1f}")

# %% [markdown]
# That is almost what you need.
# But it can return both ends, 180 and -180, and you want only one of them (540, one and a half turns, gives the wrong one).
#
# ### Exercise 2: fold an angle
#
# Write `normalize_angle`, in radians: a full turn is `math.tau`, which is 2π.
# There is one more edge: an angle that is infinite or not a number has no direction.
# `math.remainder(inf, …)` raises an exception; return `math.nan` for those, so that the caller can see it.

# %% tags=["piece"]
# %%into ros2_robot_controller/utils/conversions.py
def normalize_angle(angle: float) -> float:
    # TODO: NaN for what is no direction; otherwise the remainder, one end for the other
    return angle

# %%
tries(
    {
        "normalize_angle(0.5)": 0.5,
        "normalize_angle(math.tau + 0.5)": 0.5,
        "normalize_angle(-pi - 0.1)": pi - 0.1,
        "normalize_angle(pi)": pi,
        "normalize_angle(-pi)": pi,
        "normalize_angle(nan)": nan,
        "normalize_angle(inf)": nan,
    },
    of=CONVERSIONS,
)

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# The cell above with `math.remainder`, with radians in place of degrees.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# - `math.isfinite(angle)` is False for NaN and for both infinities.
# - `math.remainder(angle, math.tau)` gives -π to π, both ends included.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def normalize_angle(angle: float) -> float:
#     if not math.isfinite(angle):
#         return math.nan
#     wrapped = math.remainder(angle, math.tau)
#     ...                  # one line: which of the two ends becomes the other?
# ```
# </details>

# %% [markdown] tags=["whole"]
# ## Turning the long way round
#
# If you do not normalize, the robot wastes time and power.
# It faces -170° and should face 170°.
# That is 20° to the right.
# Like many robots, it turns faster if the error is larger.
#
#     omega = 1.5 * (wanted - yaw)
#
# **Predict:** which way will it turn, and how far?

# %% tags=["whole"]
def turner(wanted_deg, difference):
    """Return a driver that turns to a heading: the farther off, the faster."""
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

# %% [markdown] tags=["whole"]
# It turns by 340° to the left instead of 20° to the right.
# But it does arrive.
# Now change one thing: the robot starts at 90° and should face 183°.
# You would not write 183°, but "my heading plus a quarter turn" gives exactly that for a heading of 93°.
#
# **Predict:** what will it do?

# %% tags=["whole"]
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

# %% [markdown] tags=["whole"]
# It never arrives.
# Just before the goal the heading in the message jumps from 180 to -180, and the difference from 3 to 363. So the robot turns for ever.
# Watch it in a corridor; it starts at 0° this time.

# %% tags=["whole"]
from sim.live import Live

live = Live(Simulator(load_world("corridor")), driver=turner(183, minus))
live

# %% [markdown] tags=["whole"]
# (`live.stop()` ends it; so does the next cell. Where no kernel runs you see a picture.)
#
# It works in every test in which the robot does not face backwards, so this bug is very common.
#
# Here is the same robot with one change: the difference is normalized, by *your* function.

# %% tags=["whole"]
def shortest(wanted, yaw):
    """Return the turn from yaw to wanted, in rad, positive to the left."""
    return normalize_angle(wanted - yaw)


live.stop()
first, second = turn(-170, 170, shortest), turn(90, 183, shortest)
print(f"from -170° to 170°: turned by {turned(first):.0f}°")
print(f"from   90° to 183°: turned by {turned(second):.0f}°")
heading_view([("from -170° to 170°", first), ("from 90° to 183°", second)])

# %% [markdown] tags=["whole"]
# You should see 20° and 93°. Until your function works, the numbers are those from before.
# You did *not* have to change the goal, which is still 183°, or the heading, which still jumps at 180°.
# If you normalize differences, it does not matter where the circle is cut.
#
# **Change one thing:** let the robot turn from 0° to 180°, then from 1° to 180° and from -1° to 180°. Which way does it turn, and why is either way right in the first case?

# %% [markdown] tags=["whole"]
# ## From four numbers back to one
#
# Now the way back, from a message to a heading.
# On a flat floor it looks easy: the point (w, z) has half the angle, so double it.
#
# **Predict:** what is the result for the two quaternions of "to the right"?

# %% tags=["whole"]
for z, w in ((-0.7071, 0.7071), (0.7071, -0.7071)):
    print(f"z = {z:7.4f}, w = {w:7.4f}: {math.degrees(2 * math.atan2(z, w)):6.1f}°")

# %% [markdown] tags=["whole"]
# They have the same direction, but you get -90 and 270, which are different for `==`.
# It is worse on a ramp.
# There the robot tilts, so x and y of the quaternion are no longer 0, and this formula does not use them.
#
# ### The formula, in four lines
#
# A quaternion is a number with four parts, w + x·i + y·j + z·k, and a few rules for multiplying: i·i = j·j = k·k = -1; i·j = k, j·k = i, k·i = j; and a minus if the two change places (j·i = -k).
# It turns an arrow into q · arrow · q\*, where q\* is q with x, y and z negated.
#
# Turn the arrow that matters: "ahead", the robot's own x axis, which is simply i.
#
# | | |
# |---|---|
# | ahead, seen by the robot | i |
# | multiply by q from the left | q·i = -x + w·i + z·j - y·k |
# | multiply by q\* from the right | (w² + x² - y² - z²)·i + 2(wz + xy)·j + … ·k |
# | the heading of that arrow on the map | yaw = atan2( 2(wz + xy), w² + x² - y² - z² ) |
#
# Go through the second line by hand; it is four small products.
# The third line is sixteen of them, so let Python check it, for a robot on a ramp that tilts forward and to the side.
# **Predict:** does "twice the angle" agree with the arrow?

# %% tags=["whole"]
def multiply(p, q):
    """Return the product of two quaternions (w, x, y, z), by the rules above."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


w, x, y, z = 0.9, 0.1, 0.3, 0.3  # 0.81 + 0.01 + 0.09 + 0.09 = 1
_, east, north, up = multiply(multiply((w, x, y, z), (0, 1, 0, 0)), (w, -x, -y, -z))
print(f"ahead points to x = {east:.2f}, y = {north:.2f}, z = {up:.2f}")
print(f"by the table:   x = {w * w + x * x - y * y - z * z:.2f}, y = {2 * (w * z + x * y):.2f}")
print(f"heading of the arrow {math.degrees(math.atan2(north, east)):.1f}°")
print(f"twice the angle      {math.degrees(2 * math.atan2(z, w)):.1f}°")

# %% [markdown] tags=["whole"]
# The arrow points 43.2° to the left (and 29° down: the robot faces downhill).
# "Twice the angle" is wrong by 6°, and you would get no warning.
#
# (On flat ground both agree: with x = y = 0 the two terms are w² - z² and 2wz, the cosine and the sine of twice the half angle.)
#
# ### Exercise 3: read a heading
#
# Write `yaw_from_quaternion` by the last line of the table.
# `math.atan2(sine, cosine)` takes the y part first, and returns -π to π with both ends. Your function of exercise 2 corrects that.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/conversions.py
def yaw_from_quaternion(q: Quaternion) -> float:
    # TODO: the heading of the arrow "ahead", in (-pi, pi]
    return 0.0

# %% tags=["whole"]
right = Quaternion(z=math.sqrt(0.5), w=-math.sqrt(0.5))
ramp = Quaternion(x=0.1, y=0.3, z=0.3, w=0.9)
tries(
    {
        "yaw_from_quaternion(Quaternion(w=1.0))": 0.0,
        "yaw_from_quaternion(right)": -pi / 2,
        "yaw_from_quaternion(ramp)": math.atan2(0.60, 0.64),
        "yaw_from_quaternion(Quaternion(z=1.0, w=0.0))": pi,
        "yaw_from_quaternion(Quaternion(z=-1.0, w=0.0))": pi,
        "yaw_from_quaternion(quaternion_from_yaw(3.0))": 3.0,
        "yaw_from_quaternion(quaternion_from_yaw(4.0))": 4.0 - math.tau,
    },
    of=CONVERSIONS,
)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The last row of the table in "The formula, in four lines".
# </details>
#
# <details><summary>Hint 2: the formula</summary>
#
# - sine: `2 * (q.w * q.z + q.x * q.y)`
# - cosine: `q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z`
# - `normalize_angle(...)` around the result, because `atan2` can give -π.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def yaw_from_quaternion(q: Quaternion) -> float:
#     sine = 2.0 * (q.w * q.z + q.x * q.y)
#     cosine = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
#     ...                  # return the normalized angle of the two
# ```
# </details>

# %% [markdown] tags=["whole"]
# ## Degrees in a radians field
#
# The message only says `float64`.
# You mean 90° and write 90.
#
# **Predict:** which way does that robot face?
# Compute it by hand: a full turn is 6.283 rad.

# %% tags=["whole"]
from geometry_msgs.msg import Quaternion

oops = Quaternion(z=math.sin(90 / 2), w=math.cos(90 / 2))
print(oops)
rest = 90 % math.tau
print(f"{90 / math.tau:.2f} turns; the rest is {rest:.3f} rad or {math.degrees(rest):.1f}°")

# %% [markdown] tags=["whole"]
# It makes fourteen full turns, and then faces 116.6°.
# You get no error: it is a valid quaternion in a valid message of the right type.
# A wrong unit does not stop the program; the robot just drives somewhere else.
# Two habits help: state the unit in a name or a docstring, and ask whether a number can be true.
# No robot in this course turns faster than 1.9 rad/s, so an `angular.z` of 90 must be a mistake: it is in degrees.

# %% [markdown]
# ## Limits, and NaN
#
# The last of the four functions keeps a number within limits; every robot does that before it commands a speed.
#
#     speed = min(max(speed, -0.5), 0.5)
#
# Now a sensor fails, numpy divides 0 by 0, and the speed is **NaN**, "not a number".
# NaN has one property that you have to know by heart: *every* comparison with it is False.

# %%
print("nan < 0.5:", nan < 0.5, "  nan > 0.5:", nan > 0.5, "  nan == nan:", nan == nan)

# %% [markdown]
# Here are four ways to write the same limit, all equal for ordinary numbers.
# **Predict:** what will each make of NaN?

# %%
low, high = -0.5, 0.5
print("min(max(nan, low), high) =", min(max(nan, low), high))
print("min(max(low, nan), high) =", min(max(low, nan), high))
print("max(low, min(nan, high)) =", max(low, min(nan, high)))
print("max(low, min(high, nan)) =", max(low, min(high, nan)))

# %% [markdown]
# Only the first line still says that something is wrong.
# The others turn it into a command: with one broken sensor the robot drives at full speed, backwards twice and forwards once.
# `max(a, b)` keeps `a` unless `b > a`, so with NaN it is the *order* that decides.
#
# ### Exercise 4: keep a number within limits
#
# A clamp that turns NaN into a limit hides the fault.
# Yours returns NaN for NaN, so that the next function that asks "is this a finite number?" can still see it.
# Do it without `min` and `max`, with two questions that are both False for NaN.

# %% tags=["piece"]
# %%into ros2_robot_controller/utils/conversions.py
def clamp(value: float, low: float, high: float) -> float:
    # TODO: below low, above high, and everything else
    return 0.0

# %%
tries(
    {
        "clamp(0.2, -0.5, 0.5)": 0.2,
        "clamp(7.0, -0.5, 0.5)": 0.5,
        "clamp(-7.0, -0.5, 0.5)": -0.5,
        "clamp(-inf, -0.5, 0.5)": -0.5,
        "clamp(nan, -0.5, 0.5)": nan,
    },
    of=CONVERSIONS,
)

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# The line with `nan < 0.5` above: which branch of an `if` does NaN take?
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# Two `if`s, each with a `return` of its own, and a last `return` for all that is left.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def clamp(value: float, low: float, high: float) -> float:
#     if value < low:
#         return low
#     if value > high:
#         return high
#     ...                  # what is left: values within the limits, and NaN
# ```
# </details>

# %% [markdown]
# ## Four functions and their edges
#
# Your file now holds the contract's four functions.
# Requirement **F14** asks that they are right at their edges, where most bugs are: 0, both ends, one step beyond each end, and NaN.
#
# | function | returns | edges |
# |---|---|---|
# | `yaw_from_quaternion(q)` | yaw in rad, in (-π, π] | q and -q give the same; x and y may differ from 0 |
# | `quaternion_from_yaw(yaw)` | a `Quaternion` | any yaw, also beyond a full turn |
# | `normalize_angle(angle)` | the same direction in rad, in (-π, π] | -π gives π; 3π too; NaN gives NaN |
# | `clamp(value, low, high)` | `value`, or the nearer limit | NaN gives NaN |
#
# This is the grader's own check, the same as for your hand-in.
# It builds the package first, so the first time takes a while.

# %% tags=["check"]
check("F14")

# %% [markdown] tags=["whole"]
# ## Say what a function gives
#
# Next week another person uses your functions.
# They see this:

# %% tags=["whole"]
help(clamp)
help(normalize_angle)

# %% [markdown] tags=["whole"]
# Without a docstring they see only a name and a type, and `float` says nothing about radians or a range.
# So they may make the mistake of the 116.6° above.
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
# Do not repeat the name and the type, and do not explain how it works: the code does that, and is never out of date.
#
# For the *form* of docstrings, ROS packages follow the rules of PEP 257, and a linter checks it: `ament_pep257`.
# Here are three functions with something to find, in a file beside your package.
# **Predict:** what will it say about each of them?

# %% tags=["whole"]
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

# %% tags=["nbval-ignore-output", "whole"]
# The linter writes its findings and its count into two streams, and their order may change.
# !cd ../.. && ament_pep257 three_docstrings.py

# %% [markdown] tags=["whole"]
# The first function gets three findings: no full stop (two rules say so), and "Returns", where an order was wanted.
# The second lacks an empty line after its first sentence.
#
# What does it say about the third, which has no docstring at all?
# **Nothing.**
# With ROS's settings the linter checks the form of docstrings, but not whether they exist.
# So no finding does not mean that everything is right.
# So requirement **Q2** counts the missing ones too: public modules, classes and functions, with full marks at 90 %.
#
# Here is the second one, corrected. In ROS the summary starts on the line after the quotes:
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
# **Your turn:** go back to exercises 1 to 4 and give each function a docstring: what it returns, in which unit, in which range; one line or two each.
# Run the four cells again, and then these two.

# %% tags=["nbval-ignore-output", "whole"]
# As above: the order of the lines may change.
# !ament_pep257 ros2_robot_controller/utils/conversions.py

# %% tags=["check", "whole"]
check("Q2")

# %% [markdown] tags=["whole"]
# Q2 looks at the whole package, so each new file must follow it.
#
# <details><summary>Hint 1: where to look</summary>
#
# The check names file and line of what lacks a docstring.
# It is the first thing below `def`, indented like the code.
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
# > **On a real TurtleBot 4:** odometry begins at yaw 0 wherever the robot is switched on; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.

# %% [markdown] tags=["whole"]
# ## Go further
#
# Not needed for the next notebook.
#
# - Most books write 1 - 2(y² + z²) for the cosine. Show that it is the same for a quaternion of length 1, and try both with one of length 2.
# - The mean of angles that does work: add up the arrows, `atan2(sum of sines, sum of cosines)`. What does it say for 0° and 180°, and what *should* it say?
# - Two turns one after the other are one product of quaternions. Use `multiply` from above for two turns about z, and check that it adds the angles.

# %% [markdown]
# ## Recall
#
# <details><summary>Why does <code>wanted - yaw</code> work in most tests and still fail?</summary>
#
# As long as the difference stays within half a turn it is right.
# It fails only where the two lie on different sides of the cut, which is behind the robot.
# </details>
#
# <details><summary>What is <code>max(low, min(high, value))</code> for a value of NaN, and why is that bad?</summary>
#
# `high`: `min(high, nan)` keeps `high`, because `nan < high` is False.
# A broken sensor becomes the command "full speed ahead".
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>A message says z = 1, w = 0. Which way does the robot face?</summary>
#
# Backwards: half the angle has sine 1, so it is 90°, and the yaw is 180°.
# </details>
#
# <details><summary>Why is "twice the angle of (w, z)" not enough on a ramp?</summary>
#
# A robot that tilts forward and to the side has x and y other than 0, and they change where "ahead" points.
# </details>
#
# <details><summary>ament_pep257 finds nothing in a file. Does every function have a docstring?</summary>
#
# Not necessarily: its ROS setting leaves out the rules about missing docstrings.
# </details>

# %% [markdown]
# **Next:** [04 Seeing](04_seeing.ipynb). The robot gets eyes: 360 numbers ten times a second, and some of them are wrong.

# %%
from grader.notebook import progress

progress()
