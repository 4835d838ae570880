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
# # 07 Going there
#
# ![The robot visits three goals; the distance that it reports falls to zero three times](pictures/07.png)
#
# "Drive to the kitchen" takes a minute, can fail on the way, and you may want to cancel it.
# Today your robot learns to drive to a place, and to stop on the way if you cancel.

# %% [markdown] tags=["whole"]
# You will be able to
#
# - steer a robot to a place, and say why it turns first and slows down at the end;
# - work out how strongly it may steer before it oscillates;
# - offer an action, with a goal, feedback, a result and a cancel;
# - write a callback that waits without blocking the others;
# - send goals from Python, from the command line, and by a click on the map.
#
# This notebook has three parts, with a day between two of them if you like:
# part 1, how to steer: 40 to 75 minutes;
# part 2, the action: 45 to 85 minutes;
# part 3, feedback, cancel and a blocked way: 25 to 45 minutes.
#
# So far, your robot drives at a given speed, answers requests, and stops before walls.
# Two files are new:
#
#     ros2_robot_controller/
#     ├── action/                    NavigateToPosition.action          (notebook 02)
#     └── ros2_robot_controller/
#         ├── driver.py              drives, and stops before walls     (notebook 05)
#         ├── speed_server.py        takes a speed, reports its status  (notebook 06)
#         ├── navigator.py           <- part 2: the action
#         ├── robot_controller.py    <- given: starts the new class
#         └── utils/
#             ├── conversions.py  scans.py  motion.py  settings.py  running.py
#             └── steering.py        <- part 1: how to get there

# %%
from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
begin("07")

# %% [markdown]
# If files are missing and you would rather start here, run `start_at("07")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 05: which three questions does <code>_control</code> ask in each step, and in which order?</summary>
#
# What is wanted? What of it is safe? What can the robot reach in this step? Today only the first question gets a new answer.
# </details>
# <details><summary>Notebook 03: the robot faces 179°, the target lies at −179°. How far is its heading off?</summary>
#
# By +2°: the difference, −358°, is normalized into (−180°, 180°].
# </details>
# <details><summary>Notebook 06: a service's callback waits for an answer from the same node. Why does it wait for ever?</summary>
#
# The callback keeps the only thread busy, so no other callback can receive the answer. `await` frees the thread; a second callback group lets the answer in.
# </details>

# %% [markdown]
# ## Drive to a target
#
# F8: the robot gets within the tolerance of a target ahead, beside or behind it, and then stands still.
#
# ### Where is it?
#
# The robot knows its place from odometry: x, y, and the yaw.
# It stands at (1, 1) and faces along +y, so its yaw is 90 degrees.
# The target is at (3, 2).
#
# By hand:
#
# - the way there: dx = 3 − 1 = 2 m, dy = 2 − 1 = 1 m
# - the distance: √(2² + 1²) = **2.24 m**
# - the direction: atan2(1, 2) = 26.6°
# - seen from the robot: 26.6° − 90° = **−63.4°**. Negative is clockwise: to the right.
#
# Draw it on paper, and then let a function compute it:

# %%
import math

from sim import normalize_angle


def error_and_distance(x, y, yaw, target_x, target_y):
    """Return the angle (rad) between the robot's heading and the target, and the distance to it (m)."""
    dx, dy = target_x - x, target_y - y
    return normalize_angle(math.atan2(dy, dx) - yaw), math.hypot(dx, dy)


error, distance = error_and_distance(1.0, 1.0, math.radians(90), 3.0, 2.0)
print(f"{math.degrees(error):.1f} degrees, {distance:.2f} m")

# %% [markdown]
# This `normalize_angle` is the simulator's, and does the same as yours of notebook 03.
# Without it, a robot that faces 179 degrees and should face −179 would turn by 358 degrees, not by 2.
#
# ### How strongly to steer
#
# The nearer the target is to straight ahead, the less the robot has to turn.
# So the turning speed is a number times the error, $\omega = k \cdot \mathrm{error}$; $k$ is called the **gain**.
# Which gain is right? One that is too high lets the robot oscillate, because each measurement is up to 0.1 s old; 1.5 rad/s per rad is calm.

# %% [markdown] tags=["whole"]
# By hand: the control loop runs every 0.1 s.
# In one step the robot turns by $k \cdot 0.1$ of the error.
#
# - $k = 1.5$: 15 % of the error disappears in each step; after ten steps $0.85^{10}$ = 20 % is left.
# - $k = 10$: all of it disappears in one step.
#
# So is 10 the best?
# The error has to be measured, and the measurement is up to 0.1 s old: at $k = 10$ the robot turns once more, to correct an error that is already gone.
#
# **Predict:** how do the three gains in the next cell differ?

# %% tags=["whole"]
import matplotlib.pyplot as plt
import numpy as np

from sim import Pose, Simulator, Twist, World, drive
from sim.views import compare_view


def turn_with(gain, delay=0.1):
    """Return the recording of a robot that turns to a heading of 0.4 rad; what it measures is `delay` s old."""
    steps = round(delay / 0.1)  # of the control loop, ten a second: measured, sent, received
    late = [0.0] * steps

    def driver(seen):
        late.append(seen.odometry.pose.yaw)
        return Twist(0.0, gain * (0.4 - late[-1 - steps]))

    return drive(Simulator(World()), driver, 3.0)


figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for gain, style in ((1.5, "-"), (5.0, "--"), (10.0, ":")):
    trip = turn_with(gain)
    axes.plot(trip.t, 0.4 - trip.yaw, style, label=f"gain {gain:g}")
axes.axhline(0.0, color="0.6", linewidth=0.8)
axes.set(xlabel="simulated time (s)", ylabel="error (rad)")
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown] tags=["whole"]
# With 10 the robot oscillates, with 5 it overshoots, and with 1.5 it is calm but a little slow.
#
# **Why?** Let $T$ be the loop's period, here 0.1 s.
# If the measurement is one step old, each step changes the error by $k\,T$ times the error before it:
#
# $$ e_{i+1} = e_i - k\,T\,e_{i-1} $$
#
# Try $e_i = z^i$. It solves the equation if $z^2 - z + k\,T = 0$, so
#
# $$ z = \tfrac12 \left(1 \pm \sqrt{1 - 4\,k\,T}\right) $$
#
# | $k\,T$ | $k$ | the two $z$ | the error |
# |---|---|---|---|
# | up to ¼ | up to 2.5 | real, between 0 and 1 | fades without overshooting |
# | ¼ to 1 | 2.5 to 10 | complex, with $\lvert z\rvert^2 = k\,T$ | oscillates, and fades |
# | 1 and more | 10 and more | $\lvert z\rvert \ge 1$ | oscillates for ever |
#
# (Without a delay $e_{i+1} = (1 - k\,T)\,e_i$, and $k\,T = 1$ would be perfect.)
# An older measurement makes the polynomial longer and the limits lower.
# A rule of thumb for all of them: stay well below 1 / (period + delay), here 1 / 0.2 s = 5 per second.
# `TURN_GAIN` is 1.5 rad/s per rad.
#
# **Move the sliders.** Up to which gain does the robot stay calm with a delay of 0.4 s, as over a bad radio link?

# %% tags=["nbval-ignore-output", "whole"]
# A slider has another name in each run, so the output is not compared.
from grader.notebook.sliders import slide


def swaying(gain, delay):
    trip = turn_with(gain, delay)
    past = max(0.0, float((trip.yaw - 0.4).max()))
    _, axes = plt.subplots(figsize=(8, 2.6), layout="constrained")
    axes.plot(trip.t, 0.4 - trip.yaw, color="#0072B2")
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    axes.set(xlabel="simulated time (s)", ylabel="error (rad)", ylim=(-0.5, 0.5))
    axes.set_title(f"rule of thumb: stay well below {1 / (0.1 + delay):.1f} per second")
    return f"The error over time with gain {gain:.1f} and a delay of {delay:.1f} s: it overshoots by {past:.2f} rad"


slide(swaying, gain=(0.5, 10.5, 5.0), delay=(0.0, 0.5, 0.1))

# %% [markdown] tags=["whole"]
# <details><summary>Up to which gain, with a delay of 0.4 s?</summary>
#
# Up to 0.8 without overshooting; from 3.5 on the error never fades.
# The rule of thumb says well below 2.
# </details>

# %% [markdown]
# ### Turn first
#
# Could the robot drive and turn at the same time?

# %% [markdown] tags=["whole"]
# **Predict:** the target lies half a metre to the left. The robot drives at 0.5 m/s and turns at up to 1 rad/s towards it. What does its path look like?

# %% tags=["whole"]
TARGET = (0.0, 0.5)
beside = World("target beside", goals=(Pose(*TARGET),))


def look(seen):
    place = seen.odometry.pose
    error, distance = error_and_distance(place.x, place.y, place.yaw, *TARGET)
    return error, distance, max(-1.0, min(1.0, 1.5 * error))  # and the turning speed, 1 rad/s at most

# %% tags=["whole"]
def turn_while_driving(seen):
    error, distance, omega = look(seen)
    return Twist() if distance < 0.05 else Twist(0.5, omega)


def turn_then_drive(seen):
    error, distance, omega = look(seen)
    if distance < 0.05:
        return Twist()
    return Twist(0.0, omega) if abs(error) > 0.3 else Twist(min(0.5, distance), omega)

# %% tags=["whole"]
orbit = drive(Simulator(beside), turn_while_driving, 20.0)
straight = drive(Simulator(beside), turn_then_drive, 20.0)
compare_view(orbit, straight, ("turn while driving", "turn, then drive"))

# %% [markdown]
# A robot that does both at once circles a target beside it for ever: one that drives at $v$ and turns at $\omega$ moves on a circle of radius $v / \omega$: 0.5 m/s divided by 1 rad/s is **0.5 m**.
# It cannot reach a target inside that circle.
#
# So turn in place while the target is more than 0.3 rad (17 degrees) away from straight ahead.
# Then drive, and keep correcting.

# %% [markdown] tags=["whole"]
# ### Slow down at the end
#
# `min(0.5, distance)` made the second robot slower near the target.
#
# **Predict:** what happens at a constant 0.5 m/s, if the robot should stop within 2 cm of the target?

# %% tags=["whole"]
TARGET = (1.5, 0.0)


def approach(speed_at):
    def driver(seen):
        error, distance, omega = look(seen)
        if distance < 0.02:
            return Twist()
        return Twist(0.0, omega) if abs(error) > 0.3 else Twist(speed_at(distance), omega)

    return drive(Simulator(World()), driver, 10.0)

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
laws = {"always 0.5 m/s": lambda distance: 0.5, "min(0.5, distance)": lambda distance: min(0.5, distance)}
for (label, speed_at), style in zip(laws.items(), ("-", "--")):
    trip = approach(speed_at)
    axes.plot(trip.t, trip.x - TARGET[0], style, label=label)
axes.axhspan(-0.02, 0.02, color="#009E73", alpha=0.2, label="within 2 cm")
axes.set(xlabel="simulated time (s)", ylabel="x past the target (m)", ylim=(-0.5, 0.15))
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown] tags=["whole"]
# At 0.5 m/s it moves 5 cm from one step of the control loop to the next.
# The zone is 4 cm wide, so the robot drove past it, turned round, and came back.
# If the speed falls with the distance, that never happens.

# %% [markdown]
# ### The file `steering.py`
#
# Write plain functions again, without a node or a topic, in `utils/steering.py`.
# `steer(place, x, y, limits)` gives a `Command` (of `utils/motion.py`) on the way to (x, y):
#
# - while that place is far from straight ahead: turn in place, the shorter way round;
# - otherwise drive, at `limits.max_linear_speed` at most, and keep correcting. The speed falls with the distance, so that the robot does not drive past the target: `min(limits.max_linear_speed, distance)`.
#
# `make_safe` keeps omega within its limit later; limit v yourself.

# %% [markdown] tags=["whole"]
# **Your own design**, without a skeleton.
# Only the file's name and what its functions return are fixed, because `navigator.py` calls them in part 2:
#
# | call | gives |
# |---|---|
# | `place_of(pose)` | where the robot is, taken from a message's `Pose`: x, y and the yaw (notebook 03 has your function for the yaw). Choose the form yourself; the functions below get it as `place` |
# | `distance_to(place, x, y)` | the straight distance to (x, y), in metres |
# | `steer(place, x, y, limits)` | see above |
# | `has_arrived(distance, tolerance, blocked)` | whether this distance is near enough |
# | `goal_refusal(x, y, tolerance)` | why such a goal is impossible, in words; an empty text if it is possible |
#
# Make two decisions before you type.
#
# - *When has it arrived?* Do not stop as soon as the distance is within the tolerance: odometry is a little wrong, and what counts is where the robot really *is*. Drive on until it is well within the tolerance. Only if an obstacle is in the way (`blocked`) is it enough to be within the tolerance at all.
# - *What cannot be reached?* NaN and infinity are not places, and a tolerance must be finite and above zero.
#
# There is no third hint. The table and `check("F8")` in part 2 accept any design; at the end of this part come two to compare.

# %% tags=["exercise", "design"]
# %%writefile ros2_robot_controller/utils/steering.py
"""Decide how to get to a goal. No node, no topics; what is safe is decided in utils.motion."""

# TODO: place_of, distance_to, steer, has_arrived, goal_refusal

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `error_and_distance` above computes the two numbers that `steer` needs; here, give the numbers names.
# Import from your own `utils/conversions.py` and `utils/motion.py`. The refusal of a speed in notebook 06 asks whether the value is good, and negates that.
# </details>
# <details><summary>Hint 2: the formulas</summary>
#
# `math.hypot(dx, dy)`; `normalize_angle(math.atan2(dy, dx) - yaw)` is the error.
# `min(limits.max_linear_speed, distance)` is a speed that falls with the distance; `min(0.05, tolerance / 2)` is well within a tolerance.
# `not 0.0 < tolerance < math.inf` holds for NaN too.
# </details>

# %%
from geometry_msgs.msg import Point, Pose as PoseMessage, Quaternion

steering, motion = mine("utils.steering"), mine("utils.motion")
LEFT = math.pi / 2


def at(x, y, yaw=0.0):
    """Return your place of a robot at (x, y)."""
    turned = Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return steering.place_of(PoseMessage(position=Point(x=x, y=y), orientation=turned))


def steered(x, y, yaw=0.0):
    """Return (v, omega) of a robot at (0, 0) that goes to (x, y); 0.5 m/s at most."""
    command = steering.steer(at(0.0, 0.0, yaw), x, y, motion.Limits(0.5, 1.0, 1.0, 2.0, 0.5, 0.2, 0.3))
    return command.v, command.omega


def way(x, y, yaw=0.0):
    """Return in words what it does at first."""
    v, omega = steered(x, y, yaw)
    return ("drives " if v > 0.05 else "turns ") + ("left" if omega > 0.01 else "right" if omega < -0.01 else "straight")

# %%
tries({
    "steering.distance_to(at(1.0, 1.0), 3.0, 2.0)": math.sqrt(5),
    "steering.distance_to(at(1.0, 3.0, LEFT), 1.0, -1.0)": 4.0,
    "steered(0.2, 0.0)[0] < steered(3.0, 0.0)[0] <= 0.5": True,  # slower at the end
    "way(3.0, 0.0)": "drives straight",
    "way(0.0, 1.0)": "turns left",
    "way(0.0, -1.0)": "turns right",
    "way(0.0, -1.0, LEFT)[:5]": "turns",  # straight behind
    "way(1.0, 0.1)": "drives left",
    "way(-1.0, 0.1, yaw=math.radians(-175))": "drives right",  # the short way
})

# %% tags=["whole"]
tries({
    "steering.has_arrived(0.02, tolerance=0.1, blocked=False)": True,
    "steering.has_arrived(0.09, tolerance=0.1, blocked=False)": False,  # drive on
    "steering.has_arrived(0.05, tolerance=0.06, blocked=False)": False,
    "steering.has_arrived(0.08, tolerance=0.1, blocked=True)": True,
    "steering.has_arrived(0.12, tolerance=0.1, blocked=True)": False,
    "steering.goal_refusal(3.0, -2.0, 0.1)": "",
    "steering.goal_refusal(math.nan, 0.0, 0.1) != ''": True,
    "steering.goal_refusal(0.0, -math.inf, 0.1) != ''": True,
    "steering.goal_refusal(3.0, 2.0, 0.0) != ''": True,
    "steering.goal_refusal(3.0, 2.0, math.nan) != ''": True,
    "steering.goal_refusal(3.0, 2.0, math.inf) != ''": True,
})

# %% [markdown] tags=["whole"]
# **Look at it.** The robot stands in the middle and faces to the right. For which targets does it only turn, and for which does it drive?

# %% tags=["whole"]
def show_steering():
    """Plot the v and omega that steer() returns for targets all around the robot."""
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 41), np.linspace(-1.2, 1.2, 41))
    commands = np.array([steered(*target) for target in zip(x.flat, y.flat)])
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, values, name in zip(axes, commands.T, ("v (m/s)", "omega (rad/s)")):
        mesh = axis.pcolormesh(x, y, values.reshape(x.shape), cmap="viridis")
        figure.colorbar(mesh, label=name)
        axis.add_patch(plt.Circle((0, 0), 0.171, fill=False, color="white"))
        axis.set(xlabel="target's x (m)", ylabel="target's y (m)", aspect="equal")


try:
    show_steering()
except AttributeError:
    print("not yet: the plot needs your steering.py, and your motion.py of notebook 05")

# %% [markdown] tags=["whole"]
# **Click.** Your functions now drive the robot, still without a node.
# The cell first gives it five seconds to go to (1, 0.5). Then click on the map, and it goes there.
# (On a web page, without a kernel, it is a picture.)

# %% tags=["whole"]
from sim import room
from sim.live import Live


class Clicked:
    """Drives to where the map was clicked last."""

    target = (1.0, 0.5)

    def go(self, x, y):
        self.target = (x, y)

    def __call__(self, seen):
        here = seen.odometry.pose
        place = at(here.x, here.y, here.yaw)
        if steering.has_arrived(steering.distance_to(place, *self.target), 0.1, False):
            return Twist()
        command = steering.steer(place, *self.target, motion.Limits(0.5, 1.0, 1.0, 2.0, 0.5, 0.2, 0.3))
        return Twist(command.v, max(-1.0, min(1.0, command.omega)))


clicked = Clicked()
live = Live(Simulator(World("a room", obstacles=room((-1.5, -1.5), (2.5, 1.5)))), driver=clicked, on_goal=clicked.go)
try:
    live.run(5.0)
    display(live)
except AttributeError as missing:
    print("not yet:", missing)

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for <code>steer</code>, once yours arrives</summary>
#
# **Turn, then drive.** The course's design, with names for its numbers at the top of the file.
#
# ```python
# error = normalize_angle(math.atan2(y - place.y, x - place.x) - place.yaw)
# if abs(error) > FACING_RAD:
#     return Command(v=0.0, omega=TURN_GAIN * error)
# speed = min(limits.max_linear_speed, APPROACH_GAIN * distance_to(place, x, y))
# return Command(v=speed, omega=TURN_GAIN * error)
# ```
#
# **The more it faces the target, the faster.** No threshold, and no stop between turning and driving.
#
# ```python
# facing = max(0.0, math.cos(error)) ** 3
# speed = min(limits.max_linear_speed, APPROACH_GAIN * distance_to(place, x, y))
# return Command(v=facing * speed, omega=TURN_GAIN * error)
# ```
#
# The second one is faster and smoother. But it drives in arcs, through places to which you have not sent it; beside a wall the first one is easier to predict.
# </details>

# %% [markdown]
# If you stop here for today: your file is saved. Part 2 begins with a cell of its own.

# %% [markdown]
# ## Part 2: the action
#
# If you begin here, this cell is the first to run; from part 1 it needs only your file.
# After a break further down, *Run, Run All Above Selected Cell* brings back what the notebook had.

# %%
import math

import matplotlib.pyplot as plt
import numpy as np

from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
from sim import Box, Circle, Pose, World
from sim.views import run_view

begin("07")

# %% [markdown]
# ### A task that takes its time
#
# "Drive to (3, 2)" takes ten seconds.
# A service answers once, at the end.
# Until then its client knows nothing, and cannot cancel.
# That is why there are **actions**:
#
# | part | who sends it | here |
# |---|---|---|
# | goal | the client | `target_pose`, `tolerance`; the server accepts or rejects it |
# | feedback | the server, again and again | `distance_remaining` |
# | result | the server, once, with a status | `success`, `final_pose`; succeeded, canceled or aborted |
# | cancel | the client, at any time | the server may refuse that, too |
#
# An action is not a third kind of message.
# It is three services (send the goal, cancel it, get the result) and two topics (feedback, status) under one name.

# %%
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.executors import SingleThreadedExecutor

NavigateToPosition = mine("action").NavigateToPosition
if not rclpy.ok():
    rclpy.init()

# %% [markdown] tags=["whole"]
# ### A client and its two futures
#
# We begin with the client, and a server that only talks.
# Its callback `execute` runs from the goal's acceptance to its result.

# %% tags=["whole"]
talker, person = rclpy.create_node("talker"), rclpy.create_node("person")


def execute(goal):
    for metres in (0.3, 0.2, 0.1):
        goal.publish_feedback(NavigateToPosition.Feedback(distance_remaining=metres))
    goal.succeed()
    return NavigateToPosition.Result(success=True)


server = ActionServer(talker, NavigateToPosition, "lesson_talk", execute)
client = ActionClient(person, NavigateToPosition, "lesson_talk")
executor = SingleThreadedExecutor()
for node in (talker, person):
    executor.add_node(node)
print("found it:", client.wait_for_server(timeout_sec=5.0))

# %% [markdown] tags=["whole"]
# A service's client has one future (notebook 06). An action's client has **two**: was the goal accepted, and what was the result?
#
# **Predict:** in which order are the lines printed?

# %% tags=["nbval-ignore-output", "whole"]
# Feedback is a topic of its own: now and then a message overtakes the result.
sent = client.send_goal_async(
    NavigateToPosition.Goal(), feedback_callback=lambda m: print(f"feedback {m.feedback.distance_remaining:.1f} m"))
executor.spin_until_future_complete(sent, timeout_sec=5.0)
handle = sent.result()
print("accepted:", handle.accepted)
result = handle.get_result_async()
executor.spin_until_future_complete(result, timeout_sec=5.0)
print("success: ", result.result().result.success)

# %% tags=["whole"]
server.destroy()
client.destroy()
for node in (talker, person):
    executor.remove_node(node)
    node.destroy_node()

# %% [markdown] tags=["whole"]
# The goal is accepted before `execute` begins, but you may see the first feedback before the acceptance. Feedback comes on a topic and the acceptance from a service, and ROS does not keep the two in order.
#
# `run.go_to(x, y)`, further down, is such a client, and in notebook 09 you write one for a test.

# %% [markdown]
# ### Wait without blocking
#
# `execute` must last as long as the drive.
# In textbooks it is often a loop that sleeps:

# %%
import time


def sleeping(server, goal):
    for _ in range(20):
        if goal.is_cancel_requested:
            break
        time.sleep(0.1)
    return end(goal)


def end(goal):
    goal.canceled() if goal.is_cancel_requested else goal.succeed()
    return NavigateToPosition.Result()

# %% [markdown]
# `send_and_cancel` serves an action with such a function, in a node that also counts the odometry messages that arrive.
# It sends a goal, 20 messages of odometry within a second, and then a cancel.
#
# **Predict:** how many of the 20 messages arrive while the loop sleeps? What happens to the cancel?

# %% tags=["nbval-ignore-output"]
# One odometry message more or less depends on the machine's load.
from grader.notebook.lessons import send_and_cancel


def accept(goal):
    return CancelResponse.ACCEPT


print(send_and_cancel(sleeping, cancel_callback=accept))

# %% [markdown]
# The node heard nothing.
# Without odometry it does not know where it is, without scans it would drive into the wall, and without its timer it commands nothing.
# The cancel waited in the queue until the goal was over.
# The loop asked `goal.is_cancel_requested` twenty times, but it could not become true: the callback that sets it needs the same thread.
#
# A second thread is the textbook's cure.
# But then two callbacks can change `self` at the same time, and you need locks.
# A better cure is to say what you wait for, and to free the thread meanwhile.
# `server.over` is a future; ten times a second a timer of that node checks whether the goal is over, and if so completes the future:

# %% tags=["nbval-ignore-output"]
# One odometry message more or less depends on the machine's load.
async def awaiting(server, goal):
    server.goal = goal
    await server.over  # whoever completes this future wakes us up
    return end(goal)


print(send_and_cancel(awaiting, cancel_callback=accept))

# %% [markdown]
# `await` frees the thread.
# **Who resumes the callback?** The executor.
# It runs an `async def` callback as a *task*.
# At `await`, the task asks the executor to call it when the future is done, and pauses.
# When another callback calls `set_result`, the executor continues the task after the `await`.
# Meanwhile it serves sensors, timers and cancels, and the timer that steers can also complete the future when the goal is over.
# You need only one thread and no locks.

# %% [markdown] tags=["whole"]
# **Predict:** what happens without the `cancel_callback`?

# %% tags=["nbval-ignore-output", "whole"]
# One odometry message more or less depends on the machine's load.
print(send_and_cancel(awaiting))

# %% [markdown] tags=["whole"]
# rclpy refuses a cancel unless you accept it.
# There is no warning.
# You need only one line to accept it, and a robot that you cannot stop is dangerous.

# %% [markdown]
# ### The navigator
#
# The class `Navigator` in `navigator.py` serves the action like that.
# The control loop of notebook 05 has a place for its steering: `_wanted`.
# There, a layer above can ask for a command other than straight on.
# What is safe is still decided below, in the driver.
#
#     goal accepted  ->  _navigate: remember it, await its `ending`
#     each step      ->  _control: is it over?  ->  _wanted: steer()   ->  (Driver) make_safe, gently, publish
#     it is over     ->  complete `ending`  ->  _navigate wakes up, says succeed, canceled or abort, returns the result

# %% [markdown] tags=["whole"]
# It comes in six steps. Follow these four decisions:
#
# - A **new goal replaces** the running one, which is aborted. (The contract leaves that to you: its trials send one goal after another.)
# - Without fresh odometry the robot does not know where it is: then `STOP` is wanted.
# - However a goal ends, the **speed in force is 0** afterwards. The robot should not drive away from the place to which you sent it.
# - During a goal the direction of travel is forward, whatever the speed in force was.
#
# The skeleton, which JupyterLab shows folded, already takes care of the last one, and has two small classes: the three ways in which a goal ends, and a goal with its future. Open it with a click on the three dots.
#
# `Ending` is an **Enum**: a type with exactly these three values, written `Ending.ARRIVED`.
# A typing error, `Ending.ARIVED`, raises an exception at once; with texts, `'arived'` would raise nothing, and would never be equal to anything.
# `field(default_factory=Future)` makes a new future for each goal; with `= Future()` all goals would share one.

# %% tags=["skeleton", "whole"]
# %%writefile ros2_robot_controller/navigator.py
"""The robot finds its way: drive to a place, tell how far it still is, and be called back."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Optional

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from ros2_robot_controller.action import NavigateToPosition
from ros2_robot_controller.driver import NEVER
from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils import steering
from ros2_robot_controller.utils.motion import Command, Limits, STOP


class Ending(Enum):
    """How a goal ends."""

    ARRIVED = 'arrived'
    CANCELED = 'canceled'
    REPLACED = 'replaced'


@dataclass
class Goal:
    """The goal being driven to; `ending` gets an Ending when the drive is over."""

    handle: ServerGoalHandle
    x: float
    y: float
    tolerance: float
    ending: Future = field(default_factory=Future)


class Navigator(SpeedServer):
    """
    Drive to a goal when there is one, and at the speed in force otherwise.

    Action: `navigate_to_position` (NavigateToPosition), feedback at `fusion_rate`.
    Parameters: `fusion_rate`.

    During a goal the robot stands still while it has no odometry younger than STALE_S. A new
    goal replaces the running one. However a goal ends, the speed in force is 0 afterwards.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self._goal: Optional[Goal] = None

    # What others ask

    def _on_goal(self, request: NavigateToPosition.Goal) -> GoalResponse:
        return GoalResponse.REJECT  # step 2

    def _on_cancel(self, _: ServerGoalHandle) -> CancelResponse:
        return CancelResponse.REJECT  # step 2

    async def _navigate(self, handle: ServerGoalHandle) -> NavigateToPosition.Result:
        handle.abort()  # step 4
        return NavigateToPosition.Result()

    # On the way

    def _control(self) -> None:
        self._end_goal_if_over()
        super()._control()

    def _wanted(self, limits: Limits) -> Command:
        return super()._wanted(limits)  # step 6

    def _direction(self) -> float:
        # It drives to a goal forwards, whatever the speed in force.
        return super()._direction() if self._goal is None else 0.0

    def _distance_to(self, goal: Goal) -> float:
        return steering.distance_to(steering.place_of(self._pose), goal.x, goal.y)

    def _give_feedback(self) -> None:
        """In the section "Tell how far it still is"."""

    # The end of the way

    def _end_goal_if_over(self) -> None:
        """Step 5."""

    def _end_goal(self, ending: Ending) -> None:
        """Step 3."""

# %% [markdown] tags=["whole"]
# **Step 1: offer the action.**
# Add two things at the end of `__init__`, and keep both in `self`:
#
# - `ActionServer(self, Type, 'name', execute, goal_callback=..., cancel_callback=...)`: the execute callback is `self._navigate`;
# - a timer at `fusion_rate` that calls `self._give_feedback`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self._goal: Optional[Goal] = None
        # TODO: self._action_server, with self._on_goal and self._on_cancel; self._feedback_timer

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The talker above has an `ActionServer`; `driver.py` has a timer with a rate.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `self.create_timer(self._period('fusion_rate'), ...)`. The action's name is `'navigate_to_position'`.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# self._action_server = ActionServer(
#     self, NavigateToPosition, 'navigate_to_position', self._navigate,
#     goal_callback=self._on_goal, cancel_callback=self._on_cancel)
# ...  # self._feedback_timer
# ```
# </details>

# %% tags=["whole"]
from rclpy.action import get_action_server_names_and_types_by_node as actions_of

navigator = bench("navigator.Navigator")
tries({
    "[name for name, _ in actions_of(navigator.node, 'robot_controller', '/')]": ["/navigate_to_position"],
    "navigator._feedback_timer.timer_period_ns": 50_000_000,
    "navigator._action_server._cancel_callback == navigator._on_cancel": True,  # without it rclpy refuses every cancel
})

# %% [markdown] tags=["whole"]
# **Step 2: accept or reject.**
# `_on_goal` answers `GoalResponse.REJECT`, with a warning in the log, if `steering.goal_refusal` gives a reason; otherwise `GoalResponse.ACCEPT`.
# `_on_cancel` accepts every cancel.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def _on_goal(self, request: NavigateToPosition.Goal) -> GoalResponse:
        target = request.target_pose.position
        return GoalResponse.REJECT  # TODO: is there a reason against it?

    def _on_cancel(self, _: ServerGoalHandle) -> CancelResponse:
        return CancelResponse.REJECT  # rclpy's default; TODO

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# `_on_set_speed` of notebook 06 asks for a refusal in the same way.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `steering.goal_refusal(target.x, target.y, request.tolerance)`; `self.get_logger().warning(...)`.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# refusal = steering.goal_refusal(target.x, target.y, request.tolerance)
# if refusal:
#     self.get_logger().warning(f'Goal rejected: {refusal}')
#     return GoalResponse.REJECT
# ...  # and otherwise?
# ```
# </details>
#
# To try it here, `Handle` takes the place of rclpy's goal handle: it has the goal's `request`, and records what the server says.

# %% tags=["nbval-ignore-output", "whole"]
# The log has the time of day.
from grader.notebook.lessons import Handle

navigator, module = bench("navigator.Navigator"), mine("navigator")


def with_goal(handle, speed=0.3):
    """Give the navigator a goal and a speed in force, by hand; return the goal."""
    target = handle.request.target_pose.position
    navigator.node._goal = module.Goal(handle, target.x, target.y, handle.request.tolerance)
    navigator.node._speed = speed
    return navigator.node._goal


tries({
    "navigator._on_goal(Handle(3.0, 2.0).request).name": "ACCEPT",
    "navigator._on_goal(Handle(math.nan, 2.0).request).name": "REJECT",
    "navigator._on_goal(Handle(3.0, 2.0, tolerance=0.0).request).name": "REJECT",
    "navigator._on_cancel(Handle(3.0, 2.0)).name": "ACCEPT",
})

# %% [markdown] tags=["whole"]
# **Step 3: the end of a goal.**
# `_end_goal(ending)` does three things, if there is a goal: it completes the goal's future (`self._goal.ending`), forgets the goal, and sets the speed in force to 0.
# Without a goal it does nothing.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def _end_goal(self, ending: Ending) -> None:
        """TODO: complete the future, forget the goal and the speed in force."""

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# `server.over` above is completed by that node's timer: `set_result`.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `future.set_result(ending)`: whoever awaits it gets `ending`.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# if self._goal is not None:
#     self._goal.ending.set_result(ending)
#     self._goal = None
#     ...  # or the robot would drive off from where it was sent
# ```
# </details>

# %% tags=["whole"]
navigator, module = bench("navigator.Navigator"), mine("navigator")


def ended(ending):
    """End a goal; return what its future holds, the goal in force and the speed in force."""
    goal = with_goal(Handle(3.0, 2.0))
    navigator._end_goal(module.Ending[ending])
    return goal.ending.result().name, navigator._goal, navigator._speed


tries({
    "ended('ARRIVED')": ("ARRIVED", None, 0.0),
    "ended('CANCELED')": ("CANCELED", None, 0.0),
    "navigator._end_goal(module.Ending.REPLACED)": None,  # no goal: nothing to do
})

# %% [markdown] tags=["whole"]
# **Step 4: the goal's life.**
# `_navigate` is the `execute` callback, and works like `awaiting` above:
#
# 1. end the running goal, if there is one: `Ending.REPLACED`;
# 2. make a `Goal` from the handle's request, and keep it in `self._goal`;
# 3. `await goal.ending`: here the method pauses until the goal ends;
# 4. tell the client how it ended: the dictionary in the cell picks the handle's method, and the last pair of brackets calls it;
# 5. return a `NavigateToPosition.Result` with `success` and `final_pose`.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    async def _navigate(self, handle: ServerGoalHandle) -> NavigateToPosition.Result:
        # Awaiting, not looping: the one thread goes on serving sensors, control and cancels.
        ending = Ending.REPLACED  # TODO: points 1 to 3
        {
            Ending.ARRIVED: handle.succeed,
            Ending.CANCELED: handle.canceled,
            Ending.REPLACED: handle.abort,
        }[ending]()
        self.get_logger().info(f"{self._value('robot_name')}: goal {ending.value}")
        return NavigateToPosition.Result()  # TODO: success, and where it is (self._pose)

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# `awaiting` and `end` above. The future is in `goal.ending`.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# - `handle.request.target_pose.position.x`, `handle.request.tolerance`
# - `ending = await goal.ending` gives what `set_result` was called with
# - `NavigateToPosition.Result(success=ending is Ending.ARRIVED, final_pose=self._pose)`
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# self._end_goal(Ending.REPLACED)
# target = handle.request.target_pose.position
# goal = Goal(handle, target.x, target.y, handle.request.tolerance)
# self._goal = goal
# ending = await goal.ending
# ...  # the dictionary and the log line stay; the result gets its two fields
# ```
# </details>
#
# The bench's own method `navigator.begin` starts such a method and returns its future. (The `begin` of the first cell is another one: it opens the notebook.)

# %% tags=["nbval-ignore-output", "whole"]
# The log has the time of day.
from nav_msgs.msg import Odometry

navigator, module = bench("navigator.Navigator"), mine("navigator")
first, second = Handle(3.0, 2.0), Handle(-1.0, 1.0, tolerance=0.2)


def odometry(x, y):
    """Return the odometry of a robot at (x, y) that looks along x."""
    odom = Odometry()
    odom.pose.pose.position.x, odom.pose.pose.position.y = x, y
    odom.pose.pose.orientation.w = 1.0
    return odom


def result_of(ending):
    """Return `success` and x of `final_pose` of a goal that ends so, with the robot at x = 2.5 m."""
    future = navigator.begin(navigator._navigate, Handle(3.0, 2.0))
    navigator.hear("odom", odometry(2.5, 0.0))
    navigator._end_goal(ending)
    navigator.advance(0.1)
    return future.result().success, future.result().final_pose.position.x


tries({
    "navigator.begin(navigator._navigate, first).done()": False,  # it waits
    "(navigator._goal.x, navigator._goal.y)": (3.0, 2.0),
    "navigator.begin(navigator._navigate, second).done()": False,
    "navigator._goal.tolerance": 0.2,  # the new one
    "first.said": ["abort"],  # replaced
    "navigator._end_goal(module.Ending.ARRIVED), navigator.advance(0.1), second.said": (None, [(0.0, 0.0)], ["succeed"]),
    "result_of(module.Ending.ARRIVED)": (True, 2.5),
    "result_of(module.Ending.CANCELED)": (False, 2.5),
})

# %% [markdown] tags=["whole"]
# **Step 5: is it over?**
# `_control` calls `_end_goal_if_over` in each step.
# If there is a goal, it is over when
#
# - a cancel is requested: `goal.handle.is_cancel_requested`;
# - or the odometry is fresh, and the robot has arrived: `steering.has_arrived`, with the distance, the goal's tolerance, and whether an obstacle is in the way.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def _end_goal_if_over(self) -> None:
        goal = self._goal
        if goal is None:
            return
        # TODO: CANCELED or ARRIVED

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# Step 3 of the driver asks whether a message is fresh; the skeleton has a method for the distance, and `speed_server.py` one for the obstacle.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `self._is_fresh(self._odom_time)`, `self._distance_to(goal)`, `self._obstacle_in_way()`.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# if goal.handle.is_cancel_requested:
#     self._end_goal(Ending.CANCELED)
# elif self._is_fresh(self._odom_time) and steering.has_arrived(
#         self._distance_to(goal), goal.tolerance, self._obstacle_in_way()):
#     ...  # it has arrived
# ```
# </details>

# %% tags=["whole"]
from sensor_msgs.msg import LaserScan


def scan_of(ahead):
    """Return a scan with one reading, straight ahead."""
    return LaserScan(ranges=[ahead], range_min=0.15, range_max=12.0)


def over(x, y, canceled=False, blocked=False, age=0.0):
    """Return how a goal at (3, 2) ends for a robot at (x, y), None if it goes on; `age` is that of the odometry."""
    handle = Handle(3.0, 2.0)
    handle.is_cancel_requested = canceled
    goal = with_goal(handle)
    navigator.set_clock(10.0)
    navigator.hear("scan", scan_of(0.4 if blocked else math.inf))
    navigator.hear("odom", odometry(x, y))
    navigator.set_clock(10.0 + age)
    navigator._end_goal_if_over()
    return goal.ending.result().name if goal.ending.done() else None


navigator, module = bench("navigator.Navigator"), mine("navigator")
tries({
    "over(0.0, 0.0)": None,
    "over(2.97, 2.0)": "ARRIVED",
    "over(2.92, 2.0)": None,  # within the tolerance: drive on
    "over(2.92, 2.0, blocked=True)": "ARRIVED",  # it will get no nearer
    "over(2.97, 2.0, age=0.6)": None,  # that was long ago
    "over(0.0, 0.0, canceled=True)": "CANCELED",
})

# %% [markdown] tags=["whole"]
# **Step 6: what is wanted?**
# Without a goal, `_wanted` returns what the layer below wants.
# With a goal, but without fresh odometry, it returns `STOP`.
# Otherwise it returns what `steering.steer` gives for the way from the robot's place to the goal.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def _wanted(self, limits: Limits) -> Command:
        return super()._wanted(limits)  # TODO: steer, while there is a goal

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# Three cases, three `return`s. `_distance_to` in the skeleton shows how to get the place.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `super()._wanted(limits)`; `steering.place_of(self._pose)`; `steering.steer(place, x, y, limits)`.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# if self._goal is None:
#     return super()._wanted(limits)
# if not self._is_fresh(self._odom_time):
#     return STOP
# place = steering.place_of(self._pose)
# ...  # the way to the goal
# ```
# </details>

# %% tags=["whole"]
def wanted(target=None, at=(0.0, 0.0), age=0.0):
    """Return (v, omega) wanted at a speed in force of 0.3, with or without a target; `age` is that of the odometry."""
    navigator.node._goal, navigator.node._speed = None, 0.3
    if target:
        with_goal(Handle(*target))
    navigator.set_clock(10.0)
    navigator.hear("odom", odometry(*at), age)
    command = navigator._wanted(navigator._limits())
    return command.v, command.omega


def by_steer(target, at):
    """Return (v, omega) of your own steer()."""
    place = module.steering.place_of(odometry(*at).pose.pose)
    command = module.steering.steer(place, *target, navigator._limits())
    return command.v, command.omega


navigator, module = bench("navigator.Navigator"), mine("navigator")
tries({
    "wanted()": (0.3, 0.0),
    "wanted(target=(3.0, 0.0), at=(1.0, 0.0), age=0.6)": (0.0, 0.0),  # where is it by now?
    "wanted(target=(3.0, 0.0), at=(1.0, 0.0)) == by_steer((3.0, 0.0), (1.0, 0.0))": True,
    "wanted(target=(3.0, 0.0), at=(2.8, 0.0)) == by_steer((3.0, 0.0), (2.8, 0.0))": True,
    "wanted(target=(1.0, 2.0), at=(1.0, 0.0)) == by_steer((1.0, 2.0), (1.0, 0.0))": True,
})

# %% [markdown] tags=["whole"]
# ### Start it
#
# This file is given, as before:

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot, as far as it goes: it takes orders and finds its way."""

from typing import Optional

from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(Navigator, args)

# %% [markdown]
# Send the robot to a place.
# `go_to` is an action client: it sends the goal, lets simulated time pass, and collects the feedback.
#
# **Predict:** the target is at (−1, 1), behind the robot and to its left. Which way does it turn, and how long does it take?

# %%
run = run_node(world=World("two metres of floor", goals=(Pose(-1.0, 1.0),)))
went = run.go_to(-1.0, 1.0, tolerance=0.1)
print(went)
run_view(run.recording)

# %% [markdown]
# It turns left, the shorter way (135°, not 225°), and arrives after about 7 s.

# %% [markdown] tags=["whole"]
# You write the feedback in part 3. Without it the simulator cannot tell whether your node follows `/clock`, so the picture warns that the drive is perhaps not repeatable.

# %% [markdown]
# F8 sends the robot to targets ahead, beside and behind.
# By ground truth it must end up within the tolerance, its `final_pose` must agree with odometry, and it must stand still afterwards.

# %% tags=["check"]
check("F8")

# %% [markdown] tags=["whole"]
# ### By a click
#
# In Jupyter the next cell is a live view, and time runs as soon as you see it.
# Click on the map to send a goal, and drag the pillar into the way.
# (On a web page, without a kernel, it is a picture.)

# %% tags=["whole"]
floor = World("a pillar", obstacles=(Circle((1.0, 0.9), 0.2, name="pillar"),))
run = run_node(world=floor)
run.live()

# %% [markdown] tags=["whole"]
# If you stop here for today: your files are saved. Part 3 begins with a cell of its own.

# %% [markdown] tags=["whole"]
# ## Tell how far it still is
#
# Part 3: 25 to 45 minutes.
# If you begin here, this cell is the first to run; it brings back the two helpers of part 2.

# %% tags=["whole"]
import math

import matplotlib.pyplot as plt
import numpy as np
from nav_msgs.msg import Odometry

from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
from grader.notebook.lessons import Handle
from sim import Box, Circle, Pose, World
from sim.views import run_view

begin("07")


def odometry(x, y):
    """Return the odometry of a robot at (x, y) that looks along x."""
    odom = Odometry()
    odom.pose.pose.position.x, odom.pose.pose.position.y = x, y
    odom.pose.pose.orientation.w = 1.0
    return odom

# %% [markdown] tags=["whole"]
# F9: feedback at 2 Hz or faster, accurate to 0.15 m.
# The timer of step 1 calls `_give_feedback`, `fusion_rate` times a second.
#
# **Your own design.** When does the node know the distance, and when would a number be wrong?
# There is no third hint. `check("F9")` accepts any design that is right; the rows below expect feedback with each call of the timer. After the check come two designs to compare.

# %% tags=["piece", "design", "whole"]
# %%into ros2_robot_controller/navigator.py
class Navigator:
    def _give_feedback(self) -> None:
        """Tell the client how far it still is, if that is known."""

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The talker at the top of part 2 gives feedback. `__init__` of the driver shows what the node holds before the first message.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `goal.handle.publish_feedback(NavigateToPosition.Feedback(distance_remaining=...))`; `self._distance_to(goal)`; `NEVER`.
# </details>

# %% tags=["whole"]
def given(handle):
    """Give the navigator a goal by hand, and return it."""
    target = handle.request.target_pose.position
    navigator.node._goal = module.Goal(handle, target.x, target.y, handle.request.tolerance)
    return navigator.node._goal


navigator, module, told = bench("navigator.Navigator"), mine("navigator"), Handle(3.0, 4.0)
tries({
    "given(told).x, navigator.advance(0.2), told.told": (3.0, [(0.0, 0.0)] * 2, []),  # where is it?
    "navigator.hear('odom', odometry(0.0, 0.0)), navigator.advance(0.2), told.told": (
        [], [(0.0, 0.0)] * 2, [5.0] * 4),
})
if hasattr(navigator, "close"):
    navigator.close()

# %% [markdown] tags=["whole"]
# **Predict:** how does `distance_remaining` look over time, if the robot first turns?

# %% tags=["whole"]
with run_node(world=World("two metres of floor", goals=(Pose(-1.0, 1.0),))) as run:
    went = run.go_to(-1.0, 1.0, tolerance=0.1)
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
times, told = np.array(went.feedback or [(0.0, math.nan)]).T
axes.plot(times, told, ".", color="#009E73", label="feedback")
axes.set(xlabel="simulated time (s)", ylabel="distance_remaining (m)", ylim=(0, 1.6))
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown] tags=["whole"]
# The line is flat while the robot turns, then it falls by 0.5 m/s, and at the end it becomes flatter as the robot slows down.
# Feedback says how far it still is, not how long that will take.
#
# Feedback is a topic: a client that does not listen misses it, and the server does not wait.
# So never send anything important as feedback only.

# %% tags=["check", "whole"]
check("F9")

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for the feedback, once yours passes</summary>
#
# **At a rate of its own.** The timer reports what the last odometry left in `self._pose`.
#
# ```python
# def _give_feedback(self):
#     goal = self._goal
#     if goal is None or self._odom_time == NEVER:
#         return
#     goal.handle.publish_feedback(
#         NavigateToPosition.Feedback(distance_remaining=self._distance_to(goal)))
# ```
#
# **With each odometry.** `_on_odom` is extended, and no timer is needed.
#
# ```python
# def _on_odom(self, odom):
#     super()._on_odom(odom)
#     if self._goal is not None:
#         self._goal.handle.publish_feedback(
#             NavigateToPosition.Feedback(distance_remaining=self._distance_to(self._goal)))
# ```
#
# The second one never reports an old distance, and falls silent when odometry does, which a client can notice.
# But the rate is then that of the sensor, and the contract names a parameter for it: `fusion_rate`. So the course's package has the first one.
# </details>
#
# You see the same in a terminal.
# `ros2` reads the type from what *you* have built, so the next cell builds the package, unless you did so in notebook 02 or 06.

# %% tags=["nbval-ignore-output", "whole"]
# How long colcon takes differs from run to run.
# !test -d ../../install || (cd ../.. && colcon build 2>&1 | cat)

# %% [markdown] tags=["whole"]
# Simulated time must pass while the robot drives, so the live view is started first.
# With `--feedback` you see each message; here are the last lines.

# %% tags=["nbval-ignore-output", "whole"]
# How much feedback comes depends on wall time.
run = run_node(world=World("a pillar", obstacles=(Circle((1.0, 0.9), 0.2, name="pillar"),)))
live = run.live()
live.start()
kind = "ros2_robot_controller/action/NavigateToPosition"
goal = "{target_pose: {position: {x: 0.5, y: -0.3}}, tolerance: 0.1}"
# !ros2 action send_goal --feedback /navigate_to_position {kind} "{goal}" | tail -n 18
run.close()

# %% [markdown]
# ## Cancel a goal
#
# F10: a cancelled goal ends as *canceled*, with `success` false, and the robot stands still within 1 s.
#
# A cancel has two steps, which are easy to confuse.
# `cancel_callback` says whether the request is *accepted*.
# Then your own code must end the goal and call `handle.canceled()`.
#
# **Predict:** what would the status be if `_navigate` called `handle.succeed()` after a cancel?

# %%
with run_node(world=World("free way")) as run:
    went = run.go_to(3.0, 0.0, cancel_after=3.0)
    stopped = run.t
    recording = run.drive(1.0)
print(went)
print(f"one second later it drives at {abs(recording.v[-1]):.2f} m/s, x = {recording.x[-1]:.2f} m")

# %% [markdown]
# With `handle.succeed()` the status would be *succeeded*, and the client would believe that the robot is there.
# If you call none of `succeed`, `canceled` and `abort`, the goal is *aborted*, with a warning.

# %% [markdown] tags=["whole"]
# ## When the way is blocked
#
# A box appears in the way, and disappears after a while.
#
# **Predict:** what should the robot do meanwhile: give up, wait, or drive around the box?
#
# The contract (F11) asks for two things: the robot never collides, and it completes the goal once the way is free.
# So it waits.
# You do not need to write code for that: `_wanted` steers on, but `make_safe` below stops the robot until the box is gone.
# To drive around the box, it would need a map and a planner, such as Nav2.

# %% tags=["whole"]
box = Box((1.2, 0.0), (0.2, 0.6), name="box", appears=1.0, vanishes=6.0)
with run_node(world=World("blocked way", obstacles=(box,), goals=(Pose(2.0, 0.0),))) as run:
    went = run.go_to(2.0, 0.0)
    recording = run.recording
print(went, "- contacts:", len(recording.contacts))
run_view(recording)

# %% [markdown] tags=["whole"]
# Here is the same drive as a film. Watch the box.

# %% tags=["whole"]
from sim.film import Film

Film(recording)

# %% [markdown] tags=["whole"]
# Did the robot move forward a little while it stood before the box?
# If so, the lidar's noise made one scan read 0.501 m, and the next scan stopped the robot again.
#
# Turning in place is still allowed before an obstacle, unless something is nearer than the emergency distance.
# Without that, a robot in front of a wall could never turn away from it.
#
# F11 also requires that the robot always keeps its limits: neither speed may exceed its maximum, or rise faster than its acceleration allows.
# `make_safe` and `speed_up_gently` of notebook 05 do that, whatever a layer above wants; the accelerations are in its step 4.
# If F11 complains about a speed that rises too fast, look there.

# %% tags=["check"]
check("F10", "F11")

# %% [markdown]
# Your node now has all services and the action, so you can check three more requirements.
# I3: the nodes use the four interfaces. I4: the graph shows what the contract says. Q4: the habits of notebook 05.

# %% tags=["check"]
check("I3", "I4", "Q4")

# %% [markdown] tags=["whole"]
# > **On a real TurtleBot 4:** the base has an action `navigate_to_position` of another type, so your node needs a namespace; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.

# %% [markdown] tags=["whole"]
# ## Beyond your robot: another contract
#
# An optional task without points, hints or a table of cases: only the check judges it.
#
# Another team's remote control knows one service: `pause`, of the type `std_srvs/srv/SetBool`.
#
# - After `data: true` the robot stands still.
# - After `data: false` it does what was asked of it: it drives at the speed in force, or goes on to its goal. A speed that is set during the pause counts afterwards.
# - `success` says whether the request has changed anything: a second pause has not. `message` is never empty.
#
# `pausable` gets your class `Navigator`.
# Write a class that builds on it inside the function, as `Navigator` builds on `SpeedServer`, and return that class.
# No file of your package changes.

# %% tags=["function", "unseen", "whole"]
from grader.notebook.unseen import check
from std_srvs.srv import SetBool


def pausable(Navigator):
    """Return a class that is a Navigator and offers the service `pause` as well."""
    return Navigator  # TODO

# %% tags=["check", "whole"]
check("U3", pausable)

# %% [markdown] tags=["whole"]
# ## Go further
#
# - **Progress.** If the way is blocked for ever, your robot waits for ever. Add a watchdog that aborts when `distance_remaining` has not fallen for 30 s. What should `success` be?
# - **One at a time, or a queue?** Your new goal replaces the old one. The ROS 2 examples `server_single_goal.py` and `server_queue_goals.py` show two other ways.
# - **Two locks.** In notebook 06 an awaiting *service* needed a callback group of its own. An action's `execute` does not: the executor runs it as a task outside the groups, as the 20 of 20 messages show.
# - In the ROS 2 documentation: *Actions* under *Concepts*, and *Writing an action server and client (Python)*. Compare its `execute_callback` with yours.

# %% [markdown]
# ## Recall
#
# <details><summary>A robot drives at 0.4 m/s and turns at 0.8 rad/s at most. Which targets does it never reach if it does both at once?</summary>
#
# Those inside two circles of radius 0.4 / 0.8 = 0.5 m, one on its left and one on its right, which touch at the robot.
# </details>
#
# <details><summary>An execute callback loops with <code>time.sleep(0.1)</code>. What is <code>goal.is_cancel_requested</code> in that loop, if the node has one thread?</summary>
#
# It stays False, because the callback that receives the cancel cannot run meanwhile.
# </details>
#
# <details><summary>You await a future. Who may complete it?</summary>
#
# Any other callback of the node. Here it is the control timer, which notices the arrival or the cancel.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Why does the robot drive on until it is within half the tolerance?</summary>
#
# The distance is measured by odometry, which is a little wrong. The rest of the tolerance is for that error.
# </details>
#
# <details><summary>Your action server takes no cancels, and there is no error anywhere. What is missing?</summary>
#
# `cancel_callback`. Without one rclpy refuses.
# </details>

# %% [markdown]
# **Next:** [08 Settings and launch](08_settings_and_launch.ipynb). All these numbers are already parameters. Next you set them in a file, change them while the node runs, and start everything with one command.

# %%
from grader.notebook import progress

progress()
