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
# A robot that accepts every number is dangerous, and one that says only "error" does not help.
# Today yours answers, and can say no.
#
# You will be able to
#
# - say when a topic fits and when a service does;
# - write a service, and call it from Python and from the command line;
# - refuse a request so that the caller knows why, and what would be taken;
# - see a deadlock coming: a callback that waits for another one.
#
# **Time:** 50 to 95 minutes. A good place for a break is before "Ask for the status".
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# Your robot drives and stops.
# How fast is up to a temporary service, which accepts any number.
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
# If the lines above say that files are missing, and you would rather start here than go back, run `start_at("06")` in a cell of its own.

# %% [markdown]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 05: the obstacle has stopped the robot. What is in <code>self._speed</code> now?</summary>
#
# The same as before: the speed in force. The obstacle changes what is published, never what was asked for.
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
# A topic is a radio: one side talks, any number listen, and there is no answer.
# Good for a scan, ten times a second; if one is lost, the next one comes.
#
# "Drive at 0.3 m/s" is something else.
# It is said once, and the one who says it wants to know: did you hear me, and will you do it?
# That is a **service**: one request, one response.
#
# | | topic | service |
# |---|---|---|
# | who | any number of publishers and subscribers | one server, any number of clients |
# | answer | none | one per request |
# | good for | what flows: scans, speeds | what is asked: set, get, switch on |
# | how long | - | at once; what takes a while is an action (notebook 07) |
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
# **Predict:** what does the first `print` say, what the second?

# %%
future = client.call_async(SetBool.Request(data=True))
print("answered:", future.done())

executor.spin_until_future_complete(future, timeout_sec=5.0)
print("answered:", future.done(), "-", future.result().message)

# %% [markdown]
# `call_async` sends the request and returns at once.
# What it returns is a **future**: a place where the answer will be.
# The answer comes while an executor spins, just as with timers.
# Here one executor serves both nodes; usually they are two processes.
#
# **Break it.** A server that forgets `return response`:

# %%
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

# %% [markdown]
# The server is dead, the client waits.
# An exception in *any* callback ends `spin`, and with it the whole node.
# So a service must have an answer for everything that a client can send.

# %% [markdown]
# ## Set the speed
#
# The contract's service is `set_speed`: `float32 speed` in, `bool success` and `string message` out.
# F2: if abs(speed) is at most `max_linear_speed`, it succeeds and the robot drives at that speed, backwards for a negative one.
#
# **Predict:** the limit is 0.3, and a client asks for 0.3. Is that above the limit?

# %%
import numpy as np

arrives = float(np.float32(0.3))  # what a float32 field makes of it
print(f"asked for 0.3, arrives as {arrives:.17f}, above 0.3: {arrives > 0.3}")

# %% [markdown]
# A float32 has 32 bits, 24 of them for the digits, and no number of bits holds 0.3 exactly.
# The nearest float32 is a little above, the nearest float64 a little below.
# Anyone asking for exactly the limit would be refused.
# So allow a tiny tolerance: one millionth of the limit.
# Then `clamp` what you keep, so that no command is ever above it.
#
# **What does success mean?**
# The request was *accepted*.
# At 1 m/s² it takes 0.3 s until the robot is that fast, and a wall may keep it from ever being so.
# A callback that waited for it would keep the scans waiting too.
# So the service only sets `self._speed`, and the control loop of notebook 05 does the rest.
#
# ### A node that takes orders, of your own design
#
# From here on there is no skeleton.
# You know the file's name, and what must hold:
#
# - `ros2_robot_controller/speed_server.py` has a class `SpeedServer(Driver)`: it does whatever the driver does, and only adds. Its `__init__` hands `**node_options` on, as the driver's does;
# - it offers `set_speed` (`SetSpeed`) and `get_status` (`GetRobotStatus`), of `ros2_robot_controller.srv`. rosidl has made them of your files in notebook 02; each has a `Request` and a `Response`;
# - F2, in this section: an accepted speed goes into `self._speed`, clamped to the limit. The limit is a parameter, read at each request: `self._value('max_linear_speed')`;
# - F3, in the next section: what is refused changes nothing, and the message says why;
# - F7, in the section after it: the status;
# - notebook 07 builds on two methods without arguments: `_direction()`, whose sign is the direction of travel (0 looks forward), and `_obstacle_in_way()`.
#
# Which functions you make of it is yours to decide. Some 50 lines will do.
# Begin with the services and F2, and come back to this cell, or open the file in the editor, after each of the next two sections.
# There is no third hint. The tables and the checks accept any design; two to compare come after them.

# %% tags=["exercise", "design"]
# %%writefile ros2_robot_controller/speed_server.py
"""The robot takes orders: a speed to drive at, and the question how it is."""

# TODO: class SpeedServer

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `Lamp`, at the top, has a service, and notebook 05's temporary one set a speed. `driver.py` has the parameters, what it remembers of the last scan and the last odometry, and `motion.obstacle_in_way`.
# What may be refused is best a plain function: it returns the reason, and an empty text, which counts as false, if there is none.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `self.create_service(Type, 'name', callback)` after `super().__init__(**node_options)`; a callback gets the request and the response, and returns the response.
# `math.isfinite(speed)`, `abs(speed) > limit * (1.0 + 1e-6)`, `clamp(request.speed, -limit, limit)`.
# In a message, `f'{speed:.3g} m/s'` makes 0.3 of 0.30000001192092896.
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
# F3: above the limit, or not a number, `success` is false, the message states the limit, and the speed in force stays as it was.
#
# Four ways to ask.
# **Predict** which of them lets something through that it should not.

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
# The first and the second are the same for every number, and differ for NaN.
# The third and the fourth forget that a robot drives backwards, too.
# Only the first line is right.
#
# And then? NaN is neither below nor above a limit, so `clamp` returns it unchanged.

# %%
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

# %% [markdown]
# The robot drives on at its last speed: the motors refuse the NaN, and no zero comes.
# (Your `make_safe` would still stop it at a wall. On a free way nothing does.)
# What comes in from outside is checked where it comes in.
#
# **Say no in a helpful way.** Three messages:
#
# | message | what the caller knows |
# |---|---|
# | `error` | nothing |
# | `speed too high` | try less, but how much less? |
# | `Speed unchanged: 0.8 m/s is beyond the limit of 0.5 m/s` | what was heard, what happened, what would be taken |
#
# **Back to your file:** two reasons to refuse, the speed is not a finite number, or its size is above the limit (with the tiny tolerance).
# Both state the limit, and both leave the speed as it was.
# Log each answer with `self.get_logger().info(...)`, and name the robot by its parameter, `self._value('robot_name')`: two robots may share a log.
#
# **Predict** the first row: −0.5 is in force, 0.8 is refused. At which speed does the robot drive on?

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
})

# %% [markdown]
# ## Ask for the status
#
# `get_status` asks nothing and answers four things (F7).
#
# **Predict:** the robot was told 0.3 m/s and stands before a wall. Which speed does it report?
#
# The contract says: the speed **in force**, the one that was set.
# So 0.3. That it stands, and why, is in the other fields:
#
# | field | |
# |---|---|
# | `speed` | what was set and accepted, 0.3 |
# | `obstacle_detected` | true while something keeps it from driving that way |
# | `pose` | from `odom`, as it came |
# | `status` | `ACTIVE`, or `OBSTACLE_DETECTED` while there is one |
#
# **Back to your file** once more: the answer, and `_obstacle_in_way` for notebook 07.

# %% tags=["nbval-ignore-output"]
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

# %% [markdown]
# ### Start it
#
# This file is given; the temporary service is gone.

# %% tags=["given"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot, as far as it goes: it takes orders."""

from typing import Optional

from ros2_robot_controller.speed_server import SpeedServer
from ros2_robot_controller.utils.running import run


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SpeedServer, args)

# %% [markdown]
# Talk to it.
# The first time this builds the package, which takes a moment.

# %%
from sim import Box, World

run = run_node(world=World("free way"))
for speed in (0.3, 0.8, math.nan):
    answer = run.set_speed(speed)
    print(f"{speed}: success={answer.success}, {answer.message}")

# %% [markdown]
# The same from outside, as a colleague would do it at a terminal.
# `ros2 service call` wants the name, the type, and the request in YAML.
# It reads the types from what *you* have built, so this builds where that has not been done in notebook 02.

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
# The node's own pose is that of odometry; it need not be the true one.
#
# Now the checks.
# F2 is the set speed, F3 the refusals, F7 the status:

# %% tags=["check"]
check("F2", "F3", "F7")

# %% [markdown]
# <details><summary>Two designs for the status, once yours passes</summary>
#
# **Ask when asked.** Nothing new is remembered; the answer is worked out from what the driver knows at that moment.
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
# **Keep the answer ready.** Each scan works out a flag, and the service reads it.
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
# The second one answers faster, and pays for it: the flag is wrong from a change of the speed's sign, or of a parameter, until the next scan, and it needs a value before the first scan.
# What can be worked out in a microsecond is not worth remembering, so the course's package has the first one.
# </details>

# %% [markdown] tags=["whole"]
# And by hand: in Jupyter the next cell is a live view of your node.
# Drag the box in front of it, then run the cell after it, again and again.

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
# A last trap, and the reason why some nodes stand still for ever without a word.
# A service's callback asks another service, and waits for the answer.
#
# **Predict:** who answers, while the one thread waits?

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
# The first one has a limit of one second, for the sake of this notebook.
# Without it you would wait until you restart the kernel.

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
# The archive is in the same node, served by the same thread, and the thread sits at the desk.
# Even if the archive were another node it would hang: the *answer* has to be taken in by that same thread.
# This is a **deadlock**.
#
# The usual cure is `await`: the callback steps aside until the answer is there.

# %% tags=["whole"]
print(ask("desk_awaits"))

# %% [markdown] tags=["whole"]
# `None`: three seconds, and no answer either.
# The thread is free now, but there is a second lock.
# All callbacks of a node belong to one **callback group**, unless you say otherwise, and that group lets in one at a time.
# The desk has not finished, so the archive may not begin.
#
# Give the desk a group of its own:

# %% tags=["whole"]
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

print(ask("desk_awaits", MutuallyExclusiveCallbackGroup()))

# %% [markdown] tags=["whole"]
# One thread, `await`, and a group of its own: that works.
#
# The names of the other possibilities, for when you meet them in other people's code:
#
# | | callbacks in one `MutuallyExclusiveCallbackGroup` (the default: one for the node) | in one `ReentrantCallbackGroup`, or in two groups |
# |---|---|---|
# | `SingleThreadedExecutor`, what `rclpy.spin` uses | one after the other; while one awaits, the group stays closed | one after the other; while one awaits, the others run |
# | `MultiThreadedExecutor(num_threads=4)` | one after the other | at the same time, each in a thread |
#
# So a second thread alone changes nothing as long as all callbacks are in one group.
# With two threads *and* two groups even `desk_waits` gets its answer, and from then on two callbacks may change `self` at once.
#
# <details><summary>Which of the four fields of the table needs locks?</summary>
#
# Only the last one.
# </details>
#
# In the contract's package no service needs another one, and the simplest cure is the best: *do not ask inside a callback; remember what you know*.
# `_on_get_status` asks no other node. It reads what the last scan and the last odometry left in `self`.
#
# > **On a real TurtleBot 4:** the base cuts 0.5 m/s to 0.306 m/s without a word, so set `max_linear_speed` to what it can do; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.

# %% [markdown] tags=["whole"]
# ## Go further
#
# - `ros2 service type`, `ros2 service find`, and `ros2 interface show ros2_robot_controller/srv/SetSpeed` answer what you need before a call.
# - Who may set the speed? Anybody on the network. Look up *Security* in the ROS 2 documentation.
# - *Using callback groups* among the how-to guides of the ROS 2 documentation tells the whole story of the desk.

# %% [markdown]
# ## Recall
#
# <details><summary>A map of 5 MB is wanted once, by one node. Topic or service?</summary>
#
# A service: it is asked once, by one, and an answer is wanted. (Many robots do publish maps, once, on a topic that keeps the last message for latecomers.)
# </details>
# <details><summary>The answer says success. How fast does the robot drive?</summary>
#
# That is not known. The speed was accepted. It takes time to get there, and an obstacle may forbid it.
# </details>
# <details><summary>Why is <code>if abs(v) > limit: refuse</code> wrong?</summary>
#
# For NaN the comparison is false, so it is not refused. Ask for what is good: `math.isfinite(v) and abs(v) <= limit`.
# </details>
# <details><summary>What happens to a client when the server's callback raises?</summary>
#
# It gets no answer, ever. And the server's node is gone.
# </details>
# <details><summary>A service callback awaits an answer in the same node and hangs. Which two things must be free?</summary>
#
# The thread, which `await` frees, and the callback group: the one that waits needs another group than the ones that answer.
# </details>
#
# **Next:** [07 Going there](07_going_there.ipynb). "Drive to the kitchen" takes a minute, can fail on the way, and you may change your mind. A service is too little for that.
