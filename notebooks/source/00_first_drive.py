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
# # 00 First drive
#
# ![A robot's way through three offices, and the graph of the nodes and topics of the finished package](pictures/00.png)
#
# By the end of this course you will have written what is drawn in blue: two programs that drive this robot safely through these offices.
# Today you meet the robot.
# You drive it by hand, look at what its sensors see, and listen to what its parts say to each other.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - drive a robot by sending it messages, from Python and from a terminal;
# - say what a node, a topic and a message are, and find them in a running system with the `ros2` command;
# - read a laser scan: which beam looks where, and what `inf` means;
# - explain why a program that never spins hears nothing;
# - say what a requirement of the contract is, and where to read it.

# %% [markdown]
# **Time:** 45 to 75 minutes, in the core lane 20 to 32.
#
# **Two lanes** lead through notebooks 00 to 10; `begin` asks which one you take, and `begin("00", lane="core")` changes it at any time.
#
# | lane | hours | what you do |
# |---|---|---|
# | whole | 15 to 27 | everything: you write every file of the package that is not given |
# | core | 4 to 7 | one or two exercises of each notebook: the nearest obstacle, what is safe, the control loop, a speed that may be refused, steering, a parameter file, a launch file, a test. The course gives the rest of the package; most experiments and what goes further are left out |
#
# Both end with the same package, which is graded by the same rubric.
#
# **Your package so far:** nothing.
# The first cell makes the folder in which it will grow.
#
# Run the cells from top to bottom.
# **Keys:** Shift+Enter runs a cell; Esc, then I twice, interrupts one that goes on too long; on a live view, Space pauses, and the arrows and Enter send the robot to a place.
# Above some of them you find **Predict:** and a question.
# Say your answer aloud or write it down before you run the cell: you learn from a wrong prediction, too.

# %%
from grader.notebook import begin

begin("00")

# %% [markdown]
# ## A robot that drives
#
# The robot is a simulated TurtleBot 4: a round robot, 34 cm across, on two driven wheels, with a lidar on top.
# Here it stands in a corridor with three offices.

# %%
import sim
from sim.live import Live

tour = Live(sim.Simulator(sim.load_world("office")))
tour

# %% [markdown]
# A driver that comes with the simulator drives it to one star after another.
# The orange points are what the lidar sees.
#
# Now try it.
#
# - **Click** anywhere on the map: the robot goes there.
# - **Drag** a desk into a doorway, and send the robot through that door.
# - Press **Space** on the map to pause it, and set the speed to 5× if it is too slow for you.
#
# The next cell lets 12 simulated seconds pass, and then pauses.

# %%
tour.run(12.0)

# %% [markdown]
# **Look** at the orange points behind the desks: there are none.
# The lidar sees surfaces, and only the first one in each direction.
# What lies behind is not empty; it is *unknown*.

# %%
tour.stop()

# %% [markdown] tags=["whole"]
# On a web page no Python runs, so the live view stands still.
# A **film** moves there, too: it shows a finished drive, faster.
# Here is the whole tour, from the first star to the last.
# **Watch** the orange points when the robot goes through a door: from then on the lidar sees another part of the office.

# %% tags=["whole"]
from sim.film import Film

simulator = sim.Simulator(sim.load_world("office"))
Film(sim.drive(simulator, sim.Tourist(simulator), 58.0))

# %% [markdown] tags=["whole"]
# ## Two numbers move it
#
# A robot on two wheels cannot go sideways.
# Two numbers describe every motion it can make:
#
# | | | unit | positive is |
# |---|---|---|---|
# | v | how fast it drives | m/s | forward |
# | ω (omega) | how fast it turns | rad/s | to the left, counter-clockwise |
#
# Together they make a circle of radius v / ω.
# By hand: with v = 0.2 m/s and ω = 0.4 rad/s the radius is 0.2 / 0.4 = 0.5 m.
# Once around is 2π rad, which takes 2π / 0.4 ≈ 15.7 s.
#
# A driver is a function: it gets what the robot has seen and returns the two numbers.
# This one does not use what it gets.
#
# **Predict:** the robot starts at (0, 0) and looks along x. Where is the circle's centre?

# %% tags=["whole"]
from sim.views import map_view


def in_a_circle(seen):
    return sim.Twist(v=0.2, omega=0.4)


empty = sim.Simulator(sim.World("nothing anywhere"))
map_view(sim.drive(empty, in_a_circle, 15.7))

# %% [markdown] tags=["whole"]
# It is at (0, 0.5), one radius to the robot's left.
#
# **Change one thing.** Set `omega` to -0.4, and to 0.
# Then find a pair that makes a circle of radius 1 m in the same time.
#
# ## What it sees
#
# A lidar is a spinning laser that measures distances.
# This one takes 360 of them, ten times a second.
# We switch its noise off for a moment, so that the numbers are round.

# %% tags=["whole"]
simulator = sim.Simulator(sim.load_world("office"), noise=False)
scan = simulator.scan()
print(len(scan.ranges), "ranges in metres")
print(f"the first beam looks to {scan.angle_min:.4f} rad, each next one {scan.angle_increment:.4f} rad further left")

# %% [markdown] tags=["whole"]
# Beam number i looks to `angle_min + i * angle_increment`, and 0 rad is straight ahead.
# So beam 0 looks to -π, straight *back*, and each beam is 1° further left than the one before it.
#
# **Predict:** the robot stands at x = 0.6, y = 0.7 and looks along x.
# Read four distances from the map at the top: back, right, ahead and left.
# Which beam measures which?

# %% tags=["whole"]
for beam in (0, 90, 180, 270):
    angle = scan.angle_min + beam * scan.angle_increment
    print(f"beam {beam:3}: {angle:5.2f} rad, {scan.ranges[beam]:.2f} m")

# %% [markdown] tags=["whole"]
# Back 0.60 m to the outer wall, right 0.70 m, ahead 9.40 m down the corridor, and left 0.75 m: the wall at y = 1.5 is 10 cm thick.
#
# A distance and an angle make a point.
# That is how the orange points are drawn:

# %% tags=["whole"]
import matplotlib.pyplot as plt
import numpy as np

x = scan.ranges * np.cos(scan.angles)
y = scan.ranges * np.sin(scan.angles)

plt.figure(figsize=(9, 4), layout="constrained")
plt.plot(x, y, ".", markersize=3)
plt.plot(0, 0, "o", label="the lidar")
plt.axis("equal")
plt.xlabel("x, ahead of the robot (m)")
plt.ylabel("y, to its left (m)")
plt.legend();

# %% [markdown] tags=["whole"]
# Now a box 40 cm wide stands in its way, with its front 0.9 m ahead.
#
# **Predict:** how many of the 360 beams hit it?
# By hand: from the robot, half the box covers atan(0.2 / 0.9) = 12.5°.

# %% tags=["whole"]
before = scan.ranges
simulator.add_obstacle(sim.Box(center=(1.6, 0.7), size=(0.2, 0.4)))
after = simulator.scan().ranges
print(f"{(after < before).sum()} beams became shorter; straight ahead it is now {after[180]:.2f} m")

# %% [markdown] tags=["whole"]
# 12 on each side and one in the middle are 25.
# A chair's leg, 3 cm thick and 2 m away, covers less than one degree.
# It can stand *between* two beams.
#
# What does a beam read where there is nothing at all?

# %% tags=["whole"]
nowhere = sim.Simulator(sim.load_world("open_field"))
print(nowhere.scan().ranges[:5])

# %% [markdown] tags=["whole"]
# It reads `inf`: there was no echo within the lidar's 12 m.
# It is not an error, but a number that is larger than every limit.
# Remember it: in notebook 04 you meet other special numbers, and one of them makes a wall invisible.

# %% [markdown]
# ## The robot on a graph
#
# So far you have called functions of a simulator.
# On a real robot, one program reads the lidar, another drives the motors, and a third plans the way, perhaps on different computers.
# **ROS 2** lets such programs find each other and talk.
#
# | word | meaning |
# |---|---|
# | **node** | one program's place in the system, with a name |
# | **message** | a piece of data with a type, such as a scan |
# | **topic** | a name for a stream of messages; all its subscribers hear all its publishers |
#
# Look at the picture at the top again.
# Nodes are ovals and topics are boxes. A node does not know other nodes, only topics.
# So a simulated robot can replace a real one, and nothing else has to change.
#
# Now we put our robot on such a graph.
# `Bridge` does what a real robot's drivers do: it publishes what the sensors read, and obeys the commands that it hears.
# (Run this cell once. To start again, choose *Restart Kernel and Clear Outputs of All Cells* in the Kernel menu.)

# %%
import os

from sim.bridge import CONTROLLER, Bridge

simulator = sim.Simulator(sim.load_world("office"))
bridge = Bridge(simulator, CONTROLLER, "robot_controller", domain_id=int(os.environ["ROS_DOMAIN_ID"]))
robot = Live(simulator, step=bridge.tick).start()
robot

# %% [markdown]
# It stands still: it has received no command.
# You will drive it from cells further down.
# To keep it in sight, click with the right mouse button beside the map and choose *Create New View for Cell Output*.
#
# The robot sends messages, and the `ros2` command lets you read them.
# A line that begins with `!` is for the shell, as you would type it in a terminal.

# %%
# !ros2 node list

# %%
# !ros2 topic list -t

# %% [markdown]
# You see one node and its topics, each with the type of its messages in brackets.
# `/clock` is the simulated time; ROS itself uses `/parameter_events` for changed settings and `/rosout` for log lines.
#
# Two of them interest you most: `/scan`, which the robot publishes, and `/cmd_vel`, the *commanded velocity*.
# Who publishes there, and who subscribes?

# %%
# !ros2 topic info /scan
# !ros2 topic info /cmd_vel

# %% [markdown]
# The scan has a publisher and no subscriber, so no node receives its messages.
# `/cmd_vel` has a subscriber and no publisher, so no commands arrive.
# Neither end waits; a missing partner is no error.
#
# `echo` prints the messages of a topic.
# Here is a part of one odometry message. It says where the robot is, according to its wheels.

# %%
# !ros2 topic echo --once --field pose.pose.position /odom

# %% [markdown] tags=["whole"]
# And one scan, without the 360 numbers:

# %% tags=["nbval-ignore-output", "whole"]
# !ros2 topic echo --once --no-arr /scan
# The stamp is the moment at which the scan was taken; it differs each time.

# %% [markdown] tags=["whole"]
# These are the fields that you used above, under the same names.
# The stamp is in simulated time, which begins at 100 s here: in ROS, time 0 means that no clock has been heard yet.
# The ranges are sent as 32-bit numbers, so `range_min` is no longer exactly 0.15.
# More about that in notebook 02.
#
# **Watch it.** Open a terminal in JupyterLab (*File, New, Terminal*), and see the ranges change while you drag a desk towards the robot.
# In a new terminal, the first line sets up ROS, and the second one listens.
# Type both in the kit's folder (if you are in another folder, try `cd ..`):
#
#     source grader/ros2/setup.bash
#     ros2 topic echo --field ranges /scan
#
# `ROS_DOMAIN_ID` keeps apart the systems on one network: nodes with different numbers never hear each other.
# `begin` has chosen a number for your workspace, and the first line above sets it in the terminal as well.

# %% [markdown]
# ## Three lines to drive it
#
# A node of your own takes three lines: switch ROS on, make a node, and let it publish.

# %%
import rclpy
from geometry_msgs.msg import Twist

if not rclpy.ok():  # so that you can run this cell twice
    rclpy.init()
node = rclpy.create_node("my_first_node")
hand = node.create_publisher(Twist, "cmd_vel", 10)

# %% [markdown]
# `Twist` is the type of the message, `cmd_vel` the topic.
# The 10 is the length of the queue; you will meet it in a moment.
#
# Your node needs no address.
# The two nodes find each other in about a tenth of a second, and **a message that is sent before that is lost**.
# So wait until there is a subscriber:

# %%
import time

deadline = time.monotonic() + 10
while hand.get_subscription_count() == 0 and time.monotonic() < deadline:
    time.sleep(0.01)
print(hand.get_subscription_count(), "subscriber")

# %% [markdown] tags=["whole"]
# This is a `Twist` message:

# %% tags=["whole"]
# !ros2 interface show geometry_msgs/msg/Twist

# %% [markdown]
# A `Twist` has six numbers, for drones and submarines too.
# Your robot uses two of them: `linear.x` is v, the speed forward in m/s, and `angular.z` is ω, the turning speed in rad/s, positive to the left.
#
# **Predict:** you send *one* message with v = 0.2 m/s.
# How far has the robot come after 5 s?

# %%
robot.pause()
command = Twist()
command.linear.x = 0.2
hand.publish(command)

robot.run(5.0)
print(f"{simulator.pose.x - simulator.world.start.x:.1f} m")

# %% [markdown]
# It drives one metre, and does not stop.
# This robot keeps the last command until it gets another one.
# So what happens if your program crashes now?
#
# (`lambda: X` is a function without a name that returns X. Here `run` calls it after each step, until it returns something true.)

# %%
robot.set_rate(8.0)
robot.run(60.0, until=lambda: simulator.contacts)
for contact in simulator.contacts:
    print(f"touched the {contact.obstacle} at x = {contact.point[0]:.1f} m, at {contact.speed:.1f} m/s")

# %% [markdown]
# The robot got no command to stop.
# A safe program sends a *zero* before it ends (notebook 05), and looks at the scan before it drives.

# %% [markdown] tags=["whole"]
# Reset the robot, and drive it from the shell.
# The text in braces is the message; fields that you leave out are zero.

# %% tags=["nbval-ignore-output", "whole"]
robot.reset()
robot.set_rate(1.0)
# !ros2 topic pub --once /cmd_vel geometry_msgs/msg/Twist "{linear: {x: 0.1}, angular: {z: 0.4}}"
# How often it says that it waits for a subscriber depends on the machine.

# %% tags=["whole"]
robot.run(15.7)
print(f"x = {simulator.pose.x:.1f} m, y = {simulator.pose.y:.1f} m")

# %% [markdown] tags=["whole"]
# The robot drives one circle, with a radius of 0.25 m.
# The robot cannot tell whether a message comes from Python, from a shell or from a planner on another computer.

# %% [markdown]
# ## Three lines to listen
#
# Now the other direction: subscribe to the odometry, with a function that ROS calls for every message.
# Here that is the `append` of a list.

# %%
from nav_msgs.msg import Odometry

heard = []
listener = node.create_subscription(Odometry, "odom", heard.append, 10)

deadline = time.monotonic() + 10
while listener.get_publisher_count() == 0 and time.monotonic() < deadline:
    time.sleep(0.01)

# %% [markdown]
# Odometry comes 20 times a second.
#
# **Predict:** after 5 s, how many messages are in the list?

# %%
robot.run(5.0)
len(heard)

# %% [markdown]
# The list is empty.
# All messages have arrived, but ROS has not called your function.
# ROS calls your functions only while you let it, which is called **spinning**.
# `spin_once` lets it call one function.
#
# **Predict** again: 100 messages came while you were not spinning.

# %%
for _ in range(200):
    rclpy.spin_once(node, timeout_sec=0)
len(heard)

# %% [markdown]
# Ten remain, the length of the queue that you chose.
# When it is full, the oldest message is dropped, without a warning.
# A node that is busy with something else does not slow the others down; it misses things.
#
# So spin *while* it drives.
# A real node does nothing else.

# %% tags=["whole"]
def listen(seconds):
    end = simulator.time + seconds  # simulated seconds, however busy this machine is
    while simulator.time < end and robot.is_running:
        rclpy.spin_once(node, timeout_sec=0.05)

# %% [markdown] tags=["whole"]
# Now the robot stands for a second, drives for two, and stands for one.
# `command` still holds 0.2 m/s, and a new `Twist()` is zero everywhere.

# %% tags=["whole"]
heard.clear()
robot.reset()
robot.set_rate(1.0)
robot.start()
listen(1.0)
hand.publish(command)
listen(2.0)
hand.publish(Twist())
listen(1.0)
robot.pause()

# %% tags=["whole"]
import matplotlib.pyplot as plt

t = [message.header.stamp.sec + message.header.stamp.nanosec / 1e9 for message in heard]
v = [message.twist.twist.linear.x for message in heard]

plt.figure(figsize=(8, 3), layout="constrained")
plt.plot(t, v, ".-")
plt.xlabel("simulated time on /clock (s)")
plt.ylabel("v by odometry (m/s)");

# %% [markdown] tags=["whole"]
# You sent commands, the wheels turned, and the odometry reported it, all through messages.
# Every node that you write in this course does the same: it hears something, decides, and says something.
#
# ## Your turn: out of the corridor
#
# Drive the robot into the first office, through the first door, which is open from x = 1.15 m to x = 2.05 m.
# The function `route` returns your way as a list of (v, ω, seconds), one line for each piece. Do not touch the walls.
# Write all numbers with a point, `2.0` and not `2`: the fields of the message are floats, and ROS does not convert.

# %% tags=["function", "whole"]
def route():
    """Return the way into the office: (v, omega, seconds) for each piece."""
    return [
        (0.2, 0.0, 2.0),  # TODO: only two seconds straight on; where to from there?
    ]

# %% tags=["whole"]
robot.reset()
robot.set_rate(4.0)
for v, omega, seconds in route():
    command.linear.x, command.angular.z = v, omega
    hand.publish(command)
    robot.run(seconds)
hand.publish(Twist())
robot.picture()

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# On the map at the top: the door's middle is at x = 1.6 m, and the robot starts at x = 0.6 m, y = 0.7 m.
# Three pieces are enough: drive, turn, drive.
#
# </details>
#
# <details><summary>Hint 2: the formula</summary>
#
# distance = v · seconds, and angle = ω · seconds.
# A quarter turn to the left is π/2 ≈ 1.57 rad.
#
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
#     return [
#         (0.25, 0.0, 4.0),   # one metre ahead
#         (0.0, 0.785, 2.0),  # a quarter turn to the left
#         ...                 # from y = 0.7 m it is still more than a metre
#     ]
# ```
#
# </details>

# %% tags=["whole"]
here = simulator.pose
if simulator.contacts:
    print(f"not yet: it touched the {simulator.contacts[0].obstacle}")
elif here.y < 1.8:
    print(f"not yet: it is at x = {here.x:.1f} m, y = {here.y:.1f} m; all of it is in the office from y = 1.8 m on")
else:
    print(f"you are in: x = {here.x:.1f} m, y = {here.y:.1f} m")

# %%
robot.stop()
bridge.close()
node.destroy_node()
rclpy.try_shutdown()

# %% [markdown]
# ## What you will build
#
# So far you have driven without looking, by counting seconds.
# The package `ros2_robot_controller`, which you write from the next notebook on, does better.
# It has two nodes:
#
# | node | hears | says | can be asked |
# |---|---|---|---|
# | `robot_controller` | `scan`, `odom` | `cmd_vel` | `set_speed`, `get_status`, `navigate_to_position` |
# | `sensor_processor` | `raw_scan`, `imu/data`, `battery/state` | `sensor_fusion_data`, `obstacle_distance` | |
#
# It drives at a set speed, stops before whatever is in its way, goes to the places that it is given, and can be interrupted at any time.

# %% [markdown] tags=["whole"]
# Each notebook adds a file or an ability:
#
# | notebook | what comes |
# |---|---|
# | 01 Anatomy | a package that builds and does nothing, well |
# | 02 Interfaces | the types of its messages, services and action |
# | 03 Numbers of motion | headings, quaternions, angles that wrap |
# | 04 Seeing | the node that fuses the sensors |
# | 05 Moving safely | the node that drives, and stops |
# | 06 Services | set a speed, be refused, ask for the status |
# | 07 Going there | drive to a place, tell how far it is, cancel |
# | 08 Settings and launch | parameters; everything with one command |
# | 09 Tests that notice | tests, and small mistakes put in on purpose to test the tests |
# | 10 Show and hand in | the demonstration, the README, the hand-in |
# | 11 A clinic | nothing: ten broken packages to diagnose and to cure, without points |
# | 12 Frames | adds no file; you write what tf2 does; without points, any time after 05 |

# %% [markdown]
# ### The contract
#
# The contract says what the package must do, in 31 numbered sentences called **requirements**.
# Their letters show what they are about: **F** is functionality, **I** integration with other ROS programs, **Q** the quality of the code, **T** tests.
# They are worth 100 points in all, and nothing else is graded. You find the same sentences in the [handout](../docs/handout.md), each with the notebook that teaches it.
# From now on a cell such as `check("F4")` asks the grader about one requirement.
# It answers "passed" or "not yet", and "not yet" comes with what was *seen*, what was *expected*, and what to *try*.
# Ask as often as you like: it helps you to work, and is not an exam.
# Each notebook ends with `progress()`, which shows where you stand: each requirement as your last check found it, your minutes (counted in your workspace, and sent nowhere), and what is next. In the core lane it shows the requirements that the lane checks, 85 points of the 100.
# Words and `ros2` commands are explained in one sentence each in the [glossary and cheat sheet](../docs/glossary.md).

# %% [markdown] tags=["whole"]
# One requirement of each kind:
#
# | | about | for example |
# |---|---|---|
# | F1 to F14 | **f**unctionality: what the robot does | F4: driven at an obstacle, it stops and never touches it |
# | I1 to I8 | **i**ntegration: a good neighbour among other ROS programs | I8: Ctrl-C ends each node, and the last command is zero |
# | Q1 to Q6 | **q**uality: code that others can read | Q5: a README that is true |
# | T1 to T3 | **t**ests that notice when something breaks | T1: tests exist for both nodes, and pass |

# %% [markdown] tags=["whole"]
# ### The workspace
#
# The package grows in a **workspace**, a folder of which only `src` is written by hand.
# `begin` has made it beside the notebooks, and changed into the package's folder:

# %% tags=["whole"]
# !cd ../.. && find . -maxdepth 2 -type d -not -path "*/.*" | sort

# %% [markdown] tags=["whole"]
# > **On a real TurtleBot 4:** a command carries its time, the top speed is 0.306 m/s, and the lidar is turned by 90°; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.
#
# ## Go further
#
# In a terminal, `ros2 bag record -o drive /odom /scan` writes the messages into a file, and `ros2 bag play drive` sends them again.
# Record a drive, restart the kernel, and play it: the messages come, but there is no robot.

# %% [markdown]
# ## Recall
#
# <details><summary>You publish one command directly after you have made the publisher, and nothing happens. Why?</summary>
#
# Publisher and subscriber had not found each other yet. What is published before that is lost.
#
# </details>
#
# <details><summary>You subscribe to a topic with 20 messages a second, compute for 5 s, and then spin with a queue of 10. What do you get?</summary>
#
# The newest 10. The 90 before them are gone.
#
# </details>
#
# <details><summary>Which node must be changed so that a second program can listen to <code>/scan</code> too?</summary>
#
# None. Publishers do not know who listens.
#
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>A beam reads <code>inf</code>. What do you know?</summary>
#
# That nothing sent an echo within `range_max` in that direction. It is a measurement, not a fault.
#
# </details>
#
# <details><summary>Beam 270 of this lidar looks where?</summary>
#
# At -180° + 270 · 1° = +90°: to the left.
#
# </details>
#
# <details><summary>A check says "I3 not yet". What is it about, and where do you read what is asked?</summary>
#
# About integration with ROS, by its letter.
# The sentence itself is in the handout, and the check's answer quotes what was expected.
#
# </details>

# %% [markdown]
# **Next:** [01 Anatomy of a package](01_anatomy.ipynb). Two lines in the wrong file, and ROS does not find your program; you write the right ones.

# %%
from grader.notebook import progress

progress()
