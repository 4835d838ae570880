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
# # 06 Services
#
# ![Requests arrive at the node, some are refused; the speed follows those that are not](pictures/06.png)
#
# A robot that accepts every number is dangerous, and a robot that only says "error" is no help.
# Today your robot learns to answer, and to say no.

# %% [markdown] tags=["whole"]
# You will be able to
#
# - say when a topic fits and when a service does;
# - write a service, and call it from Python and from the command line;
# - refuse a request so that the caller knows why, and what you would accept;
# - avoid a deadlock, in which one callback waits for another.
#
# **Time:** 50 to 95 minutes. A good place for a break is before "Ask for the status".
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# Your robot drives and stops.
# A temporary service sets its speed, and accepts any number.
# Today you replace it:
#
#     ros2_robot_controller/
#     ├── srv/                       SetSpeed.srv  GetRobotStatus.srv   (notebook 02)
#     └── ros2_robot_controller/
#         ├── driver.py              drives, and stops before walls     (notebook 05)
#         ├── speed_server.py        <- you write it today, to your own design
#         └── robot_controller.py    <- given: starts the new class

# %%
from grader.notebook import begin, bench, check, mine, run_node, start_at, tries
begin("06")

# %% [markdown]
# If files are missing and you would rather start here, run `start_at("06")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 05: the obstacle has stopped the robot. What is in <code>self._speed</code> now?</summary>
#
# The same as before, the speed in force. The obstacle changes what is published, never what was asked for.
# </details>
# <details><summary>Notebook 05: what happens to the scans while a callback sleeps for 0.3 s?</summary>
#
# They wait in the queue of five, then the oldest are dropped. There is one thread, and callbacks take turns in it.
# </details>
# <details><summary>Notebook 02: which file says what <code>set_speed</code> takes and answers, and who turns it into Python?</summary>
#
# `srv/SetSpeed.srv`: the request above the three dashes, the response below. rosidl makes the classes when the package is built.
# </details>

# %% [markdown]
# ## Ask, and get an answer
#
# A topic is like a radio: one side talks, any number can listen, and there is no answer.
# That is good for scans: if one is lost, the next comes 0.1 s later.
#
# "Drive at 0.3 m/s" is different.
# The client says it once, and wants to know whether the robot has heard it and will do it.
# That is a **service**: one request, one response.
#
# | | topic | service |
# |---|---|---|
# | who | any number of publishers and subscribers | one server, any number of clients |
# | answer | none | one per request |
# | good for | streams: scans, speeds | single requests: set, get, switch on |
# | how long | - | at once; use an action for what takes a while (notebook 07) |
#
# Here is a lamp with a switch.
# The service's type, `SetBool`, has `bool data` in the request, and `bool success` and `string message` in the response.

# %%
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import SetBool


class Lamp(Node):
    def __init__(self):
        super().__init__("lamp")
        self.create_service(SetBool, "switch_lamp", self.on_switch)

    def on_switch(self, request, response):
        response.success = True
        response.message = "the lamp is on" if request.data else "the lamp is off"
        return response

# %%
if not rclpy.ok():
    rclpy.init()
executor = SingleThreadedExecutor()
lamp, person = Lamp(), rclpy.create_node("person")
for node in (lamp, person):
    executor.add_node(node)
client = person.create_client(SetBool, "switch_lamp")
print("found it:", client.wait_for_service(timeout_sec=5.0))

# %% [markdown]
# **Predict:** what does the first `print` say, and what does the second say?

# %%
future = client.call_async(SetBool.Request(data=True))
print("answered:", future.done())

executor.spin_until_future_complete(future, timeout_sec=5.0)
print("answered:", future.done(), "-", future.result().message)

# %% [markdown]
# `call_async` sends the request and returns at once.
# It returns a **future**, an object that will hold the answer.
# The answer comes while an executor spins, as with timers.
# Here one executor serves both nodes; usually they are two processes.
# An exception in *any* callback ends `spin`, and with it the whole node: so a service must have an answer for everything that a client can send.

# %% [markdown] tags=["whole"]
# **Break it.** A server that forgets `return response`:

# %% tags=["whole"]
def forgetful(request, response):
    response.success = True


lamp.create_service(SetBool, "forgetful_lamp", forgetful)
client = person.create_client(SetBool, "forgetful_lamp")
client.wait_for_service(timeout_sec=5.0)
future = client.call_async(SetBool.Request())
try:
    executor.spin_until_future_complete(future, timeout_sec=5.0)
except TypeError:
    print("the server's spin ended with a TypeError; answered:", future.done())

# %% [markdown] tags=["whole"]
# The server has ended, and the client still waits.

# %% [markdown]
# ## Set the speed
#
# The contract's service is `set_speed`. The request has `float32 speed`; the response has `bool success` and `string message`.
# F2: if abs(speed) is at most `max_linear_speed`, it succeeds and the robot drives at that speed, backwards if it is negative.
#
# **Predict:** the limit is 0.3, and a client asks for 0.3. Is that above the limit?

# %%
import numpy as np

arrives = float(np.float32(0.3))  # what a float32 field makes of it
print(f"asked for 0.3, arrives as {arrives:.17f}, above 0.3: {arrives > 0.3}")

# %% [markdown]
# A float32 has 24 binary digits, and no number of binary digits holds 0.3 exactly.
# The nearest float32 is a little above 0.3, the nearest float64 a little below.
# So a client that asks for exactly the limit would be refused.
# Allow a tiny tolerance: one millionth of the limit.
# Then `clamp` the speed that you store, so that no command is ever above the limit.
#
# **What does success mean?**
# The request was *accepted*.
# At 1 m/s² the robot needs 0.3 s to reach that speed, and if there is a wall it may never reach it.
# If the callback waited for that, the scans would have to wait too.
# So the service only sets `self._speed`, and the control loop of notebook 05 does the rest.

# %% [markdown]
# ### A node that takes orders
#
# `ros2_robot_controller/speed_server.py` has a class `SpeedServer(Driver)`: it does everything that the driver does, and offers two services of `ros2_robot_controller.srv`, `set_speed` (`SetSpeed`) and `get_status` (`GetRobotStatus`).
# rosidl generated these classes from your files of notebook 02; each has a `Request` and a `Response`.
#
# - F2, in this section: an accepted speed goes into `self._speed`, clamped to the limit. The limit is a parameter, read at each request: `self._value('max_linear_speed')`.
# - F3, in the next section: a refused request changes nothing, and the message says why.
# - F7, in the section after it: the status.

# %% [markdown] tags=["whole"]
# **Your own design.** From here on there is no skeleton.
# Only the file's name, those rules and these are fixed:
#
# - `__init__` passes `**node_options` on, as the driver's does;
# - notebook 07 builds on two methods without arguments: `_direction()`, whose sign is the direction of travel (0 looks forward), and `_obstacle_in_way()`.
#
# You decide which functions you write. About 50 lines are enough.
# Begin with the services and F2. After each of the next two sections, come back to this cell or open the file in the editor.
# There is no third hint. The tables and the checks accept any design; after them come two designs to compare.

# %% tags=["exercise", "design"]
# %%writefile ros2_robot_controller/speed_server.py
"""The robot takes orders: a speed to drive at, and the question how it is."""

# TODO: class SpeedServer

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `Lamp`, at the top, has a service, and the temporary service of notebook 05 set a speed. `driver.py` has the parameters, the last scan and odometry, and `motion.obstacle_in_way`.
# A plain function is best for the refusals: it returns the reason, or an empty text (which counts as false) if there is none.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `self.create_service(Type, 'name', callback)` after `super().__init__(**node_options)`; a callback gets the request and the response, and returns the response.
# `math.isfinite(speed)`, `abs(speed) > limit * (1.0 + 1e-6)`, `clamp(request.speed, -limit, limit)`.
# In a message, `f'{speed:.3g} m/s'` shortens 0.30000001192092896 to 0.3.
# </details>
#
# `ask` calls a service of the node on the bench, as a client would.

# %% tags=["nbval-ignore-output"]
# The log has the time of day.
server = bench("speed_server.SpeedServer")
tries({
    "[s.service_name for s in server.services if s.srv_type.__name__ == 'SetSpeed']": ["/set_speed"],
    "server.ask('set_speed', speed=0.3).success, round(server._speed, 6)": (True, 0.3),
    "server.ask('set_speed', speed=-0.5).success, server._speed": (True, -0.5),
})

# %% [markdown]
# ## Refuse a speed
#
# F3: if the speed is above the limit or not a number, `success` is false, the message states the limit, and the speed in force stays as it was.
#
# Here are four ways to test a speed.
# **Predict** which of them accept a speed that they should not.

# %%
import math

limit = 0.5
ways = {
    "ok if abs(v) <= limit": lambda v: abs(v) <= limit,
    "refuse if abs(v) > limit": lambda v: not abs(v) > limit,
    "refuse if v > limit": lambda v: not v > limit,
    "ok if min(v, limit) == v": lambda v: min(v, limit) == v,
}

# %%
values = (0.3, -0.5, 0.51, -9.0, math.inf, math.nan)
print(" " * 26 + "".join(f"{value:>7}" for value in values))
for words, accepts in ways.items():
    print(f"{words:26}" + "".join(f"{'yes' if accepts(value) else '-':>7}" for value in values))

# %% [markdown]
# The first and the second give the same answer for every number, but not for NaN.
# The third and the fourth forget that a robot can also drive backwards.
# Only the first one is right.

# %% [markdown] tags=["whole"]
# What happens after the second? NaN is neither below nor above a limit, so `clamp` returns it unchanged.

# %% tags=["whole"]
from sim import Simulator, load_world

simulator = Simulator(load_world("open_field"))
simulator.command(0.3, 0.0)
simulator.step(1.0)
try:
    simulator.command(math.nan, 0.0)
except ValueError as error:
    print("the motors say:", error)
simulator.step(4.0)
print(f"4 s later: x = {simulator.pose.x:.2f} m, still at {simulator.twist.v:.1f} m/s")

# %% [markdown] tags=["whole"]
# The robot drives on at its last speed: the motors refuse the NaN, and no zero comes.
# (Your `make_safe` would still stop it at a wall. On a free way nothing does.)
# So check every value from outside where it comes in.

# %% [markdown]
# **Say no in a helpful way.** Three messages:
#
# | message | what the caller knows |
# |---|---|
# | `error` | nothing |
# | `speed too high` | it should be lower, but not how much |
# | `Speed unchanged: 0.8 m/s is beyond the limit of 0.5 m/s` | what the node received, what happened, what it would accept |
#
# **Back to your file:** it refuses a speed that is not a finite number, and one whose size is above the limit (with the tiny tolerance).
# In both cases the message states the limit, and the speed stays as it was.
# It logs each answer with `self.get_logger().info(...)`, and the robot's name, `self._value('robot_name')`, because two robots may share a log.
# Write what it lacks.
#
# **Predict** the first row: −0.5 is in force, and 0.8 is refused. At which speed does the robot go on?

# %% tags=["nbval-ignore-output"]
# The log has the time of day.
server = bench("speed_server.SpeedServer")


def after_half_backwards(speed):
    """Return (success, whether the message states the limit, the speed in force), where -0.5 was in force."""
    server.ask("set_speed", speed=-0.5)
    answer = server.ask("set_speed", speed=speed)
    return answer.success, "0.5" in answer.message, round(server._speed, 6)


tries({
    "after_half_backwards(0.8)": (False, True, -0.5),
    "after_half_backwards(-9.0)": (False, True, -0.5),
    "after_half_backwards(math.nan)": (False, True, -0.5),
    "after_half_backwards(-math.inf)": (False, True, -0.5),
    "after_half_backwards(0.0)[::2]": (True, 0.0),
    "after_half_backwards(float(np.float32(0.5000001)))[::2]": (True, 0.5),  # the tolerance
    "server._speed <= 0.5": True,  # and not a bit more
})

# %% [markdown]
# ## Ask for the status
#
# The request of `get_status` is empty; its answer has four fields (F7).

# %% [markdown] tags=["whole"]
# **Predict:** a robot's speed was set to 0.3 m/s, and it stands in front of a wall. Which speed does it report?

# %% [markdown]
# Say that 0.3 m/s was set, and the robot stands in front of a wall. The speed is the one **in force**, so the answer says 0.3; the other fields say that it stands, and why:
#
# | field | |
# |---|---|
# | `speed` | what was set and accepted, 0.3 |
# | `obstacle_detected` | true while an obstacle keeps it from driving that way |
# | `pose` | unchanged from `odom` |
# | `status` | `ACTIVE`, or `OBSTACLE_DETECTED` while there is an obstacle |

# %% [markdown] tags=["whole"]
# **Back to your file** once more: write the answer, and `_obstacle_in_way` for notebook 07.

# %% tags=["nbval-ignore-output", "whole"]
# The log has the time of day.
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

server = bench("speed_server.SpeedServer")


def status(ahead, behind, speed):
    """Return (speed, obstacle, status) at this speed in force, after a scan with two readings."""
    server.ask("set_speed", speed=speed)
    server.hear("scan", LaserScan(ranges=[behind, ahead], angle_min=-math.pi, angle_increment=math.pi,
                                  range_min=0.15, range_max=12.0))
    answer = server.ask("get_status")
    return answer.speed, answer.obstacle_detected, answer.status


def pose_after_odometry(x, y):
    """Return the place that the status reports after odometry has said (x, y)."""
    odom = Odometry()
    odom.pose.pose.position.x, odom.pose.pose.position.y = x, y
    server.hear("odom", odom)
    place = server.ask("get_status").pose.position
    return place.x, place.y


tries({
    "status(ahead=3.0, behind=3.0, speed=0.25)": (0.25, False, "ACTIVE"),
    "status(ahead=0.4, behind=3.0, speed=0.25)": (0.25, True, "OBSTACLE_DETECTED"),
    "status(ahead=0.4, behind=3.0, speed=-0.25)": (-0.25, False, "ACTIVE"),
    "status(ahead=3.0, behind=0.4, speed=-0.25)": (-0.25, True, "OBSTACLE_DETECTED"),
    "status(ahead=0.4, behind=3.0, speed=0.0)": (0.0, True, "OBSTACLE_DETECTED"),  # 0 looks forward
    "status(ahead=3.0, behind=0.19, speed=0.25)": (0.25, True, "OBSTACLE_DETECTED"),  # an emergency
    "pose_after_odometry(1.5, -0.5)": (1.5, -0.5),
})

# %% [markdown] tags=["whole"]
# ### Start it
#
# This file is given. It no longer has the temporary service.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot, as far as it goes: it takes orders."""

from typing import Optional

from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SpeedServer, args)

# %% [markdown]
# Talk to your node.
# The first time, this cell builds the package.

# %%
from sim import Box, World

run = run_node(world=World("free way"))
for speed in (0.3, 0.8, math.nan):
    answer = run.set_speed(speed)
    print(f"{speed}: success={answer.success}, {answer.message}")

# %% [markdown]
# Now do the same as in a terminal.
# `ros2 service call` needs the name, the type, and the request in YAML.
# It reads the types from what *you* have built, so the cell builds the package if necessary.

# %% tags=["nbval-ignore-output"]
# How long colcon takes differs from run to run.
# !test -d ../../install || (cd ../.. && colcon build 2>&1 | cat)

# %% tags=["nbval-ignore-output"]
# Without a node of that name it tells how long it has waited.
# !ros2 service call /set_speed ros2_robot_controller/srv/SetSpeed "{speed: -0.25}"

# %% [markdown]
# **Predict:** in which direction does the robot drive in the next cell, and how fast?

# %%
from sim.views import run_view

recording = run.drive(3.0)
print(f"speed in force {run.status().speed:.2f} m/s, driven {recording.v[-1]:.2f} m/s")
run_view(recording)

# %%
place = run.simulator.pose.x - 0.45  # it drives backwards, so the box goes behind it
run.simulator.add_obstacle(Box((place, 0.0), (0.1, 0.5), name="box"))
run.drive(1.0)
answer = run.status()
print(f"speed {answer.speed:.2f}, obstacle {answer.obstacle_detected}, {answer.status}, x = {answer.pose.position.x:.2f}")
run.close()

# %% [markdown]
# The node's pose comes from odometry, so it may differ a little from the true one.
#
# Now run the checks.
# F2 is the set speed, F3 the refusals, and F7 the status:

# %% tags=["check"]
check("F2", "F3", "F7")

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for the status, once yours passes</summary>
#
# **Compute on request.** The node stores nothing new. It computes the answer from what the driver knows at that moment.
#
# ```python
# def _on_get_status(self, _, response):
#     response.speed = self._speed
#     response.obstacle_detected = self._obstacle_in_way()
#     response.pose = self._pose
#     response.status = 'OBSTACLE_DETECTED' if response.obstacle_detected else 'ACTIVE'
#     return response
#
# def _obstacle_in_way(self):
#     return motion.obstacle_in_way(self._near, self._direction(), self._limits())
# ```
#
# **Keep the answer ready.** The node computes a flag with each scan, and the service reads it.
#
# ```python
# def _on_scan(self, scan):
#     super()._on_scan(scan)
#     self._blocked = motion.obstacle_in_way(self._near, self._direction(), self._limits())
#
# def _obstacle_in_way(self):
#     return self._blocked
# ```
#
# The second one answers faster, but its flag can be wrong: after the sign of the speed or a parameter changes, until the next scan comes. It also needs a value before the first scan.
# A value that takes a microsecond to compute need not be stored, so the course's package has the first design.
# </details>

# %% [markdown] tags=["whole"]
# You can also try it by hand: in Jupyter the next cell is a live view of your node.
# Drag the box in front of the robot, and run the cell after the view several times.

# %% tags=["whole"]
run = run_node(world=World("a box", obstacles=(Box((1.5, 0.6), (0.3, 0.3), name="box"),)))
run.set_speed(0.2)
run.drive(2.0)
run.live()

# %% tags=["whole"]
answer = run.status()
print(f"speed {answer.speed:.2f}, {answer.status}")
run.close()

# %% [markdown] tags=["whole"]
# ## A service that asks a service
#
# The last trap makes some nodes stop for ever without a message.
# The callback of a service calls another service and waits for the answer.
#
# **Predict:** who can answer while the only thread waits?

# %% tags=["whole"]
from std_srvs.srv import Trigger


class Office(Node):
    def __init__(self, group=None):
        super().__init__("office")
        self.create_service(Trigger, "archive", self.on_archive)
        self.create_service(Trigger, "desk_waits", self.on_desk_waits)
        self.create_service(Trigger, "desk_awaits", self.on_desk_awaits, callback_group=group)
        self.client = self.create_client(Trigger, "archive")

    def on_archive(self, request, response):
        response.message = "here is your file"
        return response

# %% [markdown] tags=["whole"]
# The desk has two ways to ask the archive.
# The first one has a time limit of one second.
# Without the limit you would have to restart the kernel.

# %% tags=["whole"]
def on_desk_waits(self, request, response):
    answer = self.client.call(Trigger.Request(), timeout_sec=1.0)
    response.message = "no answer from the archive" if answer is None else answer.message
    return response


async def on_desk_awaits(self, request, response):
    answer = await self.client.call_async(Trigger.Request())
    response.message = answer.message
    return response


Office.on_desk_waits, Office.on_desk_awaits = on_desk_waits, on_desk_awaits

# %% tags=["whole"]
def ask(service, group=None):
    """Start an office, ask one of its services, and return its answer, or None after 3 s."""
    executor, office, visitor = SingleThreadedExecutor(), Office(group), rclpy.create_node("visitor")
    for node in (office, visitor):
        executor.add_node(node)
    client = visitor.create_client(Trigger, service)
    client.wait_for_service(timeout_sec=5.0)
    future = client.call_async(Trigger.Request())
    executor.spin_until_future_complete(future, timeout_sec=3.0)
    executor.shutdown()
    office.destroy_node(), visitor.destroy_node()
    return future.result().message if future.done() else None


print(ask("desk_waits"))

# %% [markdown] tags=["whole"]
# The archive is in the same node and needs the same thread, which waits in the desk's callback.
# The desk would hang even if the archive were another node, because the same thread would have to receive the *answer*.
# This is a **deadlock**.
#
# The usual cure is `await`: it frees the thread until the answer is there.

# %% tags=["whole"]
print(ask("desk_awaits"))

# %% [markdown] tags=["whole"]
# `None` means that there was no answer after three seconds either.
# Now the thread is free, but something else is blocked.
# By default, all callbacks of a node belong to one **callback group**, which lets only one of them run at a time.
# The desk has not finished, so the archive may not begin.
#
# Give the desk its own group:

# %% tags=["whole"]
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

print(ask("desk_awaits", MutuallyExclusiveCallbackGroup()))

# %% [markdown] tags=["whole"]
# It works with one thread, `await`, and a separate group.
#
# In other people's code you will also meet these:
#
# | | callbacks in one `MutuallyExclusiveCallbackGroup` (the default: one for the node) | in one `ReentrantCallbackGroup`, or in two groups |
# |---|---|---|
# | `SingleThreadedExecutor`, what `rclpy.spin` uses | one after the other; while one awaits, the group stays closed | one after the other; while one awaits, the others run |
# | `MultiThreadedExecutor(num_threads=4)` | one after the other | at the same time, each in a thread |
#
# So a second thread alone changes nothing while all callbacks are in one group.
# With two threads *and* two groups even `desk_waits` gets its answer, but then two callbacks may change `self` at the same time.
#
# <details><summary>Which of the four fields of the table needs locks?</summary>
#
# Only the last one.
# </details>
#
# In your package no service needs another one, so the simplest cure is the best: *do not call a service inside a callback; store what you know*.
# `_on_get_status` asks no other node. It reads what the last scan and the last odometry stored in `self`.
#
# > **On a real TurtleBot 4:** the base reduces 0.5 m/s to 0.306 m/s without a message, so set `max_linear_speed` to what it can do; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.

# %% [markdown] tags=["whole"]
# ## Go further
#
# - `ros2 service type`, `ros2 service find`, and `ros2 interface show ros2_robot_controller/srv/SetSpeed` tell you what you need for a call.
# - Who may set the speed? Everyone on the network. Look up *Security* in the ROS 2 documentation.
# - *Using callback groups*, a how-to guide of the ROS 2 documentation, explains the deadlock of the desk in full.

# %% [markdown]
# ## Recall
#
# <details><summary>The answer says success. How fast does the robot drive?</summary>
#
# You do not know. The speed was accepted, but the robot needs time to reach it, and an obstacle may prevent that.
# </details>
#
# <details><summary>Why is <code>if abs(v) > limit: refuse</code> wrong?</summary>
#
# For NaN the comparison is false, so it is not refused. Ask for what is good: `math.isfinite(v) and abs(v) <= limit`.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>A map of 5 MB is wanted once, by one node. Topic or service?</summary>
#
# A service: one node asks once, and needs an answer. (Many robots do publish maps, once, on a topic that keeps the last message for nodes that start later.)
# </details>
#
# <details><summary>What happens to a client when the server's callback raises?</summary>
#
# It never gets an answer, and the server's node has ended.
# </details>
#
# <details><summary>A service callback awaits an answer in the same node and hangs. Which two things must be free?</summary>
#
# The thread, which `await` frees, and the callback group: the one that waits needs another group than the ones that answer.
# </details>

# %% [markdown]
# **Next:** [07 Going there](07_going_there.ipynb). "Drive to the kitchen" takes a minute, can fail on the way, and can be cancelled. A service is not enough for that.

# %%
from grader.notebook import progress

progress()
