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
# You will be able to
#
# - steer a robot to a place, and say why it turns first and slows down at last;
# - offer an action: goal, feedback, result, cancel;
# - say what a callback blocks, and write one that waits without blocking;
# - send goals from Python, from the command line, and by a click on the map.
#
# Time: about 60 minutes.
#
# Your robot drives at a speed, answers questions, and stops before walls.
# Today it gets somewhere:
#
#     ros2_robot_controller/
#     ├── action/                    NavigateToPosition.action          (notebook 02)
#     └── ros2_robot_controller/
#         ├── driver.py              drives, and stops before walls     (notebook 05)
#         ├── speed_server.py        takes a speed, tells its status    (notebook 06)
#         ├── navigator.py           <- you write it today
#         ├── robot_controller.py    <- given: starts the new class
#         └── utils/
#             ├── conversions.py  scans.py  motion.py  settings.py  running.py
#             └── steering.py        <- you write it today

# %%
from grader.notebook import begin, check, run_node, start_at
begin("07")

# %% [markdown]
# ## Drive to a target
#
# F8: within the tolerance of a target ahead, beside, or behind; then it stands still.
#
# ### Where is it?
#
# The robot knows its place from odometry: x, y, and the yaw.
# It stands at (1, 1) and looks along +y, so its yaw is 90 degrees.
# The target is at (3, 2).
#
# By hand:
#
# - the way there: dx = 3 − 1 = 2 m, dy = 2 − 1 = 1 m
# - the distance: √(2² + 1²) = **2.24 m**
# - the direction: atan2(1, 2) = 26.6°
# - seen from the robot: 26.6° − 90° = **−63.4°**. Negative is clockwise: to the right.
#
# Draw it on a scrap of paper, then let a function do it:

# %%
import math

from sim import normalize_angle


def error_and_distance(x, y, yaw, target_x, target_y):
    """Return by which angle (rad) the robot looks past the target, and how far that is (m)."""
    dx, dy = target_x - x, target_y - y
    return normalize_angle(math.atan2(dy, dx) - yaw), math.hypot(dx, dy)


error, distance = error_and_distance(1.0, 1.0, math.radians(90), 3.0, 2.0)
print(f"{math.degrees(error):.1f} degrees, {distance:.2f} m")

# %% [markdown]
# `normalize_angle` is the one that you wrote in notebook 03; here it is the simulator's.
# Without it a robot that looks to 179 degrees and wants to −179 would turn by 358.
#
# ### Turn first
#
# The nearer the target is to straight ahead, the less there is to turn: turning speed = 1.5 × error.
# And why not drive at the same time?
#
# **Predict:** the target lies half a metre to the left. The robot drives at 0.5 m/s and turns at up to 1 rad/s towards it.

# %%
from sim import Pose, Simulator, Twist, World, drive
from sim.views import compare_view

TARGET = (0.0, 0.5)
beside = World("target beside", goals=(Pose(*TARGET),))


def look(seen):
    place = seen.odometry.pose
    error, distance = error_and_distance(place.x, place.y, place.yaw, *TARGET)
    return error, distance, max(-1.0, min(1.0, 1.5 * error))  # and the turning speed, 1 rad/s at most


# %%
def turn_while_driving(seen):
    error, distance, omega = look(seen)
    return Twist() if distance < 0.05 else Twist(0.5, omega)


def turn_then_drive(seen):
    error, distance, omega = look(seen)
    if distance < 0.05:
        return Twist()
    return Twist(0.0, omega) if abs(error) > 0.3 else Twist(min(0.5, distance), omega)


# %%
orbit = drive(Simulator(beside), turn_while_driving, 20.0)
straight = drive(Simulator(beside), turn_then_drive, 20.0)
compare_view(orbit, straight, ("turn while driving", "turn, then drive"))

# %% [markdown]
# It circles the target for ever.
# A robot that drives at $v$ and turns at $\omega$ moves on a circle of radius $v / \omega$: 0.5 m/s divided by 1 rad/s is **0.5 m**.
# Whatever lies inside that circle cannot be reached.
#
# So: while the target is more than 0.3 rad (17 degrees) off, turn in place.
# Then drive, and go on correcting.
#
# ### Slow down at last
#
# `min(0.5, distance)` made the second robot slower near the target.
#
# **Predict:** what happens at a constant 0.5 m/s, if it is to stop within 2 cm?

# %%
import matplotlib.pyplot as plt
import numpy as np

TARGET = (1.5, 0.0)


def approach(speed_at):
    def driver(seen):
        error, distance, omega = look(seen)
        if distance < 0.02:
            return Twist()
        return Twist(0.0, omega) if abs(error) > 0.3 else Twist(speed_at(distance), omega)

    return drive(Simulator(World()), driver, 10.0)


# %%
figure, axes = plt.subplots(figsize=(8, 3))
laws = {"always 0.5 m/s": lambda distance: 0.5, "min(0.5, distance)": lambda distance: min(0.5, distance)}
for (label, speed_at), style in zip(laws.items(), ("-", "--")):
    trip = approach(speed_at)
    axes.plot(trip.t, trip.x - TARGET[0], style, label=label)
axes.axhspan(-0.02, 0.02, color="#009E73", alpha=0.2, label="within 2 cm")
axes.set(xlabel="simulated time (s)", ylabel="x past the target (m)", ylim=(-0.5, 0.15))
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown]
# At 0.5 m/s it moves 5 cm from one step of the control loop to the next.
# The zone is 4 cm wide, so it jumped over it, had to turn right round, and came back.
# With a speed that falls with the distance it never does.
#
# **When has it arrived?**
# The caller gives a `tolerance`, say 0.1 m.
# Do not stop at 0.1 m.
# Odometry is not quite where the robot is, and the result is measured by where it *is*.
# Drive on to half the tolerance, or to 5 cm if that is less.
# Only if an obstacle ends the way, within the tolerance will do.
#
# ### Exercise: steering
#
# Plain functions again: no node, no topic.

# %%
# !mkdir -p ros2_robot_controller/utils

# %% tags=["exercise"]
# %%writefile ros2_robot_controller/utils/steering.py
"""Decide how to get to a goal. No node, no topics; what is safe is decided in utils.motion."""

from dataclasses import dataclass

from geometry_msgs.msg import Pose
from ros2_robot_controller.utils.motion import Command, Limits, STOP

FACING_RAD = 0.3  # turn in place until the goal is this near to straight ahead
TURN_GAIN = 1.5  # rad/s per rad: well below 1 / (control period + sensor delay), so no overshoot
APPROACH_GAIN = 1.0  # m/s per m: from here on the speed falls with the distance left
ARRIVAL_M = 0.05  # drive on to this near if allowed: odometry drifts, the tolerance does not
ARRIVAL_SHARE = 0.5  # and never use up more than this share of the tolerance


@dataclass(frozen=True)
class Place:
    """Where the robot is in the odom frame: x, y in metres, yaw in radians."""

    x: float
    y: float
    yaw: float


def place_of(pose: Pose) -> Place:
    """Return the place in a message's pose."""
    return Place(0.0, 0.0, 0.0)  # TODO 1


def goal_refusal(x: float, y: float, tolerance: float) -> str:
    """Return why nobody can drive to (x, y) within `tolerance`; empty if one can try."""
    return ''  # TODO 2: numbers that are none; a tolerance that nobody can meet


def distance_to(place: Place, x: float, y: float) -> float:
    """Return the straight distance from the robot to (x, y) in metres."""
    return 0.0  # TODO 3


def has_arrived(distance: float, tolerance: float, blocked: bool) -> bool:
    """
    Return whether the goal is reached at this distance.

    Drives on to well within the tolerance, because odometry is never quite where the robot is;
    where an obstacle ends the drive, the tolerance as such will do.
    """
    return False  # TODO 4


def steer(place: Place, x: float, y: float, limits: Limits) -> Command:
    """Return the way to (x, y): turn in place until it lies ahead, then drive, slower at last."""
    return STOP  # TODO 5: make_safe() keeps omega within its limit, v you keep yourself

# %% [markdown]
# **Look at it.** Around the robot, which stands in the middle and looks to the right: where does it only turn, and where does it drive?

# %%
def show_steering(steering, limits):
    """Plot for targets all around which v and omega steer() answers."""
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 41), np.linspace(-1.2, 1.2, 41))
    here = steering.Place(0.0, 0.0, 0.0)
    commands = [steering.steer(here, *target, limits) for target in zip(x.flat, y.flat)]
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    for axis, values, name in zip(axes, ("v", "omega"), ("v (m/s)", "omega (rad/s)")):
        z = np.reshape([getattr(command, values) for command in commands], x.shape)
        figure.colorbar(axis.pcolormesh(x, y, z, cmap="viridis"), label=name)
        axis.add_patch(plt.Circle((0, 0), 0.171, fill=False, color="white"))
        axis.set(xlabel="target's x (m)", ylabel="target's y (m)", aspect="equal")


# %%
try:
    from ros2_robot_controller.utils import motion, steering
except ImportError as missing:
    print(f"not yet: {missing}. Notebook 05 makes utils/motion.py.")
else:
    show_steering(steering, motion.Limits(0.5, 1.0, 1.0, 2.0, 0.5, 0.2, 0.3))

# %% [markdown]
# ### A deed that takes its time
#
# "Drive to (3, 2)" takes ten seconds.
# A service answers once, at the end.
# Until then its caller knows nothing, and cannot change its mind.
# For that there are **actions**:
#
# | part | who says it | here |
# |---|---|---|
# | goal | the client | `target_pose`, `tolerance`; the server accepts or rejects it |
# | feedback | the server, again and again | `distance_remaining` |
# | result | the server, once, with a status | `success`, `final_pose`; succeeded, canceled or aborted |
# | cancel | the client, at any time | the server may refuse that, too |
#
# An action is not a third kind of message.
# It is three services (send the goal, cancel it, get the result) and two topics (feedback, status) under one name.
#
# The server gets a callback `execute`: it runs from the goal's acceptance to its result.
# The textbook's `execute` is a loop with a sleep in it.
#
# **Predict:** while that loop sleeps and loops for two seconds, how many odometry messages arrive? And what becomes of a cancel?

# %%
from grader.notebook import interface_types, workspace

interface_types.load(workspace.find())  # the interface types, even where notebook 02 has not been built yet
from ros2_robot_controller.action import NavigateToPosition

# %%
import threading
import time
from functools import partial

import rclpy
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future


# %%
class Server(Node):
    """Counts odometry. A goal takes two seconds by a timer, less if it is canceled."""

    def __init__(self, execute, **options):
        super().__init__("server")
        self.odometry, self.ticks, self.goal, self.over = 0, 0, None, Future()
        self.create_subscription(Odometry, "lesson_odom", self.on_odom, 10)
        self.create_timer(0.1, self.tick)
        deed = partial(execute, self)  # not a lambda: that would hide from rclpy that it is async
        self.action = ActionServer(self, NavigateToPosition, "lesson_go", deed, **options)

# %% [markdown]
# Odometry is counted.
# The timer looks whether the goal is over, and if so completes a future.

# %%
def on_odom(self, odom):
    self.odometry += 1


def tick(self):
    if self.goal is not None and not self.over.done():
        self.ticks += 1
        if self.ticks == 20 or self.goal.is_cancel_requested:
            self.over.set_result(None)


Server.on_odom, Server.tick = on_odom, tick

# %% [markdown]
# Now two ways to execute a goal.
# The first sleeps and loops.
# The second says what it waits for, and steps aside.

# %%
def sleeping(server, goal):
    for _ in range(20):
        if goal.is_cancel_requested:
            break
        time.sleep(0.1)
    return end(goal)


async def awaiting(server, goal):
    server.goal = goal
    await server.over  # whoever completes this future wakes us up
    return end(goal)


# %%
def end(goal):
    goal.canceled() if goal.is_cancel_requested else goal.succeed()
    return NavigateToPosition.Result()


def wait(node, future):
    """Serve the node until the answer is there; return it."""
    rclpy.spin_until_future_complete(node, future, timeout_sec=10.0)
    return future.result()


# %% [markdown]
# The server runs in a thread of its own.
# You send a goal, odometry comes 20 times a second, and after a second you cancel.

# %%
if not rclpy.ok():
    rclpy.init()
me = rclpy.create_node("me")


def serve(server, done):
    """Spin the server until `done` is set."""
    executor = SingleThreadedExecutor()
    executor.add_node(server)
    while not done.is_set():
        executor.spin_once(timeout_sec=0.1)
    server.action.destroy()
    server.destroy_node()


# %%
def drive_along(odometry, server):
    """Publish odometry for a second; return how much of it the server has heard."""
    before = server.odometry
    for _ in range(20):
        odometry.publish(Odometry())
        time.sleep(0.05)
    return server.odometry - before



# %%
def send_and_cancel(server):
    """Return odometry messages of one second, whether the cancel was taken, and the goal's status."""
    client = ActionClient(me, NavigateToPosition, "lesson_go")
    client.wait_for_server(timeout_sec=5.0)
    odometry = me.create_publisher(Odometry, "lesson_odom", 10)
    goal = wait(me, client.send_goal_async(NavigateToPosition.Goal()))
    heard = drive_along(odometry, server)
    cancel = wait(me, goal.cancel_goal_async())
    status = wait(me, goal.get_result_async()).status
    me.destroy_publisher(odometry)
    client.destroy()
    return heard, bool(cancel.goals_canceling), {4: "succeeded", 5: "canceled", 6: "aborted"}[status]


# %%
def experiment(name, execute, **options):
    server, done = Server(execute, **options), threading.Event()
    thread = threading.Thread(target=serve, args=(server, done))
    thread.start()
    heard, taken, status = send_and_cancel(server)
    done.set()
    thread.join()
    print(f"{name}: {heard} of 20 odometry messages, cancel taken: {taken}, the goal {status}")


def accept(goal):
    return CancelResponse.ACCEPT


# %% tags=["nbval-ignore-output"]
# One odometry message more or less depends on the machine's load.
experiment("sleeping", sleeping, cancel_callback=accept)

# %% [markdown]
# The node was deaf.
# No odometry, so it does not know where it is; no scan, so it would drive into the wall; no timer, so nobody commands anything.
# The cancel lay in the queue until the goal was over.
# `goal.is_cancel_requested` was asked twenty times and could not become true: the callback that sets it needs the same thread.
#
# A second thread is the textbook's cure.
# Then two callbacks change `self` at the same time, and you need locks.
# The better cure is not to wait:

# %% tags=["nbval-ignore-output"]
# One odometry message more or less depends on the machine's load.
experiment("awaiting", awaiting, cancel_callback=accept)

# %% [markdown]
# `await` gives the thread back.
# Sensors, timers and cancels go on, and the timer that steers anyway completes the future when the goal is over.
# One thread, no locks.
#
# **Predict:** the same again, without the `cancel_callback`.

# %% tags=["nbval-ignore-output"]
# One odometry message more or less depends on the machine's load.
experiment("awaiting, no cancel_callback", awaiting)

# %% [markdown]
# rclpy refuses a cancel unless you accept it.
# Nothing warns you.
# It is one line, and a robot that cannot be called back is no robot to stand beside.
#
# ### Exercise: the navigator
#
# The control loop of notebook 05 has a place for this: `_wanted`.
# A layer above may want another command than straight on.
# What is safe stays decided below.
#
#     goal accepted  ->  _navigate: remember it, await its `ending`
#     each step      ->  _control: is it over?  ->  _wanted: steer()   ->  (Driver) make_safe, gently, publish
#     it is over     ->  complete `ending`  ->  _navigate wakes up, says succeed, canceled or abort, returns the result
#
# Four decisions are yours to keep:
#
# - A **new goal replaces** the running one, which is aborted.
# - Without fresh odometry the robot does not know where it is: then `STOP` is wanted.
# - However a goal ends, the **speed in force is 0** afterwards. It should not drive off from where you sent it.
# - During a goal the direction of travel is forward, whatever the speed in force was.

# %% tags=["exercise"]
# %%writefile ros2_robot_controller/navigator.py
"""The robot finds its way: drive to a place, tell how far it still is, and be called back."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Optional

from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils.motion import Command, Limits


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
        # TODO 1: the action server, with _navigate, a goal_callback and a cancel_callback;
        #         self._feedback_timer at `fusion_rate`.

    # What others ask

    # TODO 2: _on_goal(request): GoalResponse.REJECT with a warning in the log where
    #         goal_refusal() has a reason, else ACCEPT.
    # TODO 3: _on_cancel(handle): what does rclpy do if you leave it out?
    # TODO 4: async _navigate(handle): end the goal that runs, keep the new one in self._goal,
    #         await its ending; then handle.succeed(), .canceled() or .abort(), and a Result.

    # On the way

    def _control(self) -> None:
        # TODO 5: first end the goal if a cancel is requested, or if it has arrived.
        super()._control()

    def _wanted(self, limits: Limits) -> Command:
        return super()._wanted(limits)  # TODO 6: steer, while there is a goal

    # TODO 7: _direction() and _give_feedback().

    # The end of the way

    # TODO 8: _end_goal(ending): complete the future, forget the goal, and the speed in force.

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `awaiting` above is the whole idea: the future is in `Goal.ending`, and `_control` does what `tick` did.
# For `steering.py`: `error_and_distance`, `turn_then_drive`, and the lines about arriving.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# - `ActionServer(self, NavigateToPosition, 'navigate_to_position', self._navigate, goal_callback=..., cancel_callback=...)`; keep it in `self`
# - `handle.request.target_pose.position.x`, `handle.request.tolerance`, `handle.is_cancel_requested`
# - `handle.publish_feedback(NavigateToPosition.Feedback(distance_remaining=...))`
# - `goal.ending.set_result(Ending.ARRIVED)` wakes up `await goal.ending`, which returns `Ending.ARRIVED`
# - `NavigateToPosition.Result(success=..., final_pose=self._pose)`
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def steer(place, x, y, limits):
#     error = normalize_angle(math.atan2(y - place.y, x - place.x) - place.yaw)
#     if abs(error) > FACING_RAD:
#         return Command(v=0.0, omega=TURN_GAIN * error)
#     speed = min(limits.max_linear_speed, APPROACH_GAIN * distance_to(place, x, y))
#     ...
#
# async def _navigate(self, handle):
#     self._end_goal(Ending.REPLACED)
#     target = handle.request.target_pose.position
#     goal = Goal(handle, target.x, target.y, handle.request.tolerance)
#     self._goal = goal
#     ending = await goal.ending
#     {Ending.ARRIVED: handle.succeed, Ending.CANCELED: handle.canceled, Ending.REPLACED: handle.abort}[ending]()
#     ...
# ```
# </details>
#
# Given, as before:

# %% tags=["given"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot, as far as it goes: it takes orders and finds its way."""

from typing import Optional

from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(Navigator, args)

# %% [markdown]
# Send it somewhere.
# `go_to` is an action client: it sends the goal, lets simulated time pass, and collects the feedback.
#
# **Predict:** the target is at (−1, 1), behind the robot and to its left. Which way does it turn, and how long does it take?

# %%
from sim.views import run_view

run = run_node(world=World("two metres of floor", goals=(Pose(-1.0, 1.0),)))
went = run.go_to(-1.0, 1.0, tolerance=0.1)
print(went)
run_view(run.recording)

# %% [markdown]
# F8 asks for targets ahead, beside and behind: within the tolerance by ground truth, a `final_pose` that agrees with odometry, and a robot that stands still afterwards.
# F9 is about the feedback; it comes next, and both are checked there.
#
# ### By a click
#
# In Jupyter the next cell is a live view, and time runs as soon as you see it.
# Click on the map: a goal.
# Drag the pillar into the way.
# (Where nobody watches, as on a web page, it is a picture.)

# %%
from sim import Circle

floor = World("a pillar", obstacles=(Circle((1.0, 0.9), 0.2, name="pillar"),))
run = run_node(world=floor)
run.live()

# %% [markdown]
# The same from a terminal.
# `ros2` reads the type from what *you* have built, so this builds where that has not been done in notebooks 02 or 06.

# %% tags=["nbval-ignore-output"]
# How long colcon takes differs from run to run.
# !test -d ../../install || (cd ../.. && colcon build | tail -n 1)

# %% [markdown]
# Time must pass meanwhile, so the live view is started first.
# With `--feedback` you see each message; here are the last lines.

# %% tags=["nbval-ignore-output"]
# How much feedback comes depends on wall time.
live = run.live()
live.start()
kind = "ros2_robot_controller/action/NavigateToPosition"
goal = "{target_pose: {position: {x: 0.5, y: -0.3}}, tolerance: 0.1}"
# !ros2 action send_goal --feedback /navigate_to_position {kind} "{goal}" | tail -n 18
run.close()

# %% [markdown]
# ## Tell how far it still is
#
# F9: feedback at 2 Hz or faster, true within 0.15 m.
# A timer of its own sends it, `fusion_rate` times a second.
#
# **Predict:** how does `distance_remaining` look over time, if the robot first turns?

# %%
figure, axes = plt.subplots(figsize=(8, 3))
times, told = np.array(went.feedback or [(0.0, math.nan)]).T
axes.plot(times, told, ".", color="#009E73", label="feedback")
axes.set(xlabel="simulated time (s)", ylabel="distance_remaining (m)", ylim=(0, 1.6))
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown]
# Flat while it turns, then a slope of −0.5 m/s, then ever flatter: the slow-down.
# Feedback tells how far it is, not how long it takes.
#
# Feedback is a topic: who does not listen, misses it, and nobody waits for anybody.
# Nothing important belongs there alone.

# %% tags=["check"]
check("F8", "F9")

# %% [markdown]
# ## Cancel a goal
#
# F10: a cancelled goal ends as *canceled*, with `success` false, and the robot stands still within 1 s.
#
# Two things happen, and they are easily taken for one.
# `cancel_callback` says whether the wish is *taken*.
# Then your own code has to end the goal and say `handle.canceled()`.
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
# `handle.succeed()` would make it *succeeded*, and the client would believe that the robot is there.
# And who returns without any of the three, gets *aborted* and a warning.

# %% [markdown]
# ## When the way is blocked
#
# A box drops into the way, and goes away again after a while.
#
# **Predict:** what should the goal do meanwhile? Fail? Wait? Drive around?
#
# The contract (F11): never a collision, and completed once the way is free.
# So it waits.
# And you need not write a line for it: `_wanted` steers on, `make_safe` below says no, and when the box is gone it says yes.
# Driving around needs a map and a planner; that is another robot, with Nav2.

# %%
from sim import Box

box = Box((1.2, 0.0), (0.2, 0.6), name="box", appears=1.0, vanishes=6.0)
with run_node(world=World("blocked way", obstacles=(box,), goals=(Pose(2.0, 0.0),))) as run:
    went = run.go_to(2.0, 0.0)
    recording = run.recording
print(went, "- contacts:", len(recording.contacts))
run_view(recording)

# %% [markdown]
# Did it twitch forward while it stood before the box?
# Then the lidar's noise read 0.501 m once, and the next scan took it back.
#
# Turning in place stays allowed before an obstacle, unless something is nearer than the emergency distance.
# Otherwise a robot before a wall could never turn away from it.
#
# F11 also wants the limits kept throughout: neither speed above its maximum, and none rising faster than the acceleration.
# `make_safe` and `speed_up_gently` do that, for whatever a layer above wants.

# %% tags=["check"]
check("F10", "F11")

# %% [markdown]
# Now that all services and the action are there, three older questions can be asked:
# I3, the nodes use the four interfaces; I4, the graph shows what the contract says; Q4, the habits of notebook 05.

# %% tags=["check"]
check("I3", "I4", "Q4")

# %% [markdown]
# > **On a real TurtleBot 4**
# >
# > - There *is* an action `navigate_to_position` on it: the base's own, of the type `irobot_create_msgs/action/NavigateToPosition`. Same name, another type: put your node into a namespace, or remap the name.
# > - Odometry drifts: 1 cm in 5 m here, several on a carpet. For goals on a map one needs localisation, which publishes `map` → `odom`.
# > - Nav2's `NavigateToPose` is the big brother: the same four parts, with a planner, and recoveries when it is blocked.
# > - Keep a finger on the cancel.

# %% [markdown]
# ## Go further
#
# - **Progress.** A goal that is blocked for ever waits for ever. Add a watchdog that aborts when `distance_remaining` has not fallen for 30 s. What should `success` be?
# - **One at a time, or a queue?** Yours replaces. The ROS 2 examples `server_single_goal.py` and `server_queue_goals.py` show two policies.
# - **Two locks.** In notebook 06 an awaiting *service* needed a callback group of its own. An action's `execute` does not: the executor runs it as a task outside the groups, as the 20 of 20 messages show.
# - In the ROS 2 documentation: *Actions* under *Concepts*, and *Writing an action server and client (Python)*. Compare its `execute_callback` with yours.

# %% [markdown]
# ## Recall
#
# <details><summary>A robot drives at 0.4 m/s and turns at 0.8 rad/s at most. Which targets does it never reach if it does both at once?</summary>
#
# Those inside a circle of radius 0.4 / 0.8 = 0.5 m that touches the robot from the side.
# </details>
# <details><summary>Why does it drive on to half the tolerance?</summary>
#
# The distance is measured by odometry, which errs. The rest of the tolerance is for that error.
# </details>
# <details><summary>An execute callback loops with <code>time.sleep(0.1)</code>. What does <code>goal.is_cancel_requested</code> say in it, in a node with one thread?</summary>
#
# False, to the end. The callback that takes the cancel cannot run.
# </details>
# <details><summary>You await a future. Who may complete it?</summary>
#
# Any other callback of the node: here the control timer, which notices the arrival or the cancel.
# </details>
# <details><summary>Your action server takes no cancels, and there is no error anywhere. What is missing?</summary>
#
# `cancel_callback`. Without one rclpy refuses.
# </details>
#
# Next: `08_settings_and_launch`. All these numbers are parameters already. Now they come from a file, may change while the node runs, and one command starts everything.
