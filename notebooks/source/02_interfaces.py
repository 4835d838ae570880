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
# # 02 Interfaces
#
# ![Three ways to talk: a topic as a stream, a service as one question and its answer, an action as a goal with feedback and a result](pictures/02.png)
#
# Two programs that have never met exchange bytes.
# What the bytes mean stands in neither program; it stands in an **interface**, a file of a few lines from which ROS generates code for both.
# Today you write the four interfaces of your package.
# They are short, but everything that follows speaks through them, and a pair of swapped lines makes a robot believe that the wall is 80 metres away.
#
# **You will be able to**
#
# - choose between a topic, a service and an action;
# - write `.msg`, `.srv` and `.action` files, and have code generated from them;
# - read the bytes of a message by hand, and say why 0.3 is not 0.3 any more when it arrives;
# - tell with a type hash whether two machines mean the same, and explain what happens if they do not.
#
# **Time:** about 45 minutes.
#
# **Your package so far**, from notebook 01, and what comes today:
#
#     ros2_robot_controller/
#     ├── package.xml                      ← today again: what interfaces need
#     ├── CMakeLists.txt                   ← today again: generate them
#     ├── setup.py  setup.cfg
#     ├── msg/SensorFusionData.msg         ← today
#     ├── srv/SetSpeed.srv                 ← today
#     ├── srv/GetRobotStatus.srv           ← today
#     ├── action/NavigateToPosition.action ← today
#     ├── scripts/                         the two executables
#     └── ros2_robot_controller/           two nodes that do nothing; utils/running.py

# %%
from grader.notebook import begin, check, run_node, start_at

begin("02")

# %% [markdown]
# ## Types that everybody knows
#
# ROS brings a few hundred interfaces for what most robots have.
# You have used some: `Twist`, `Odometry`, `LaserScan`.
# `ros2 interface show` unfolds one:

# %%
# !ros2 interface show geometry_msgs/msg/Pose

# %% [markdown]
# A line is a type and a name; `#` begins a comment.
# A type is another interface, or one of these:
#
# | in the file | in Python | |
# |---|---|---|
# | `bool` | `bool` | |
# | `int8` … `int64`, `uint8` … `uint64` | `int` | |
# | `float32`, `float64` | `float` | 7 and 16 digits |
# | `string` | `str` | |
# | `float32[]` | `array.array` | any number of them; `float32[9]` is exactly nine |
#
# Use what exists wherever it fits: other people's tools know it already.
# For a place and a heading take `geometry_msgs/Pose`, not three floats of your own.
#
# ## What travels
#
# A message in Python is an object.
# On the wire it is bytes, and you can have a look at them.
#
# **What will it be?** A `Vector3` has three `float64` of 8 bytes each. How many bytes travel?

# %%
from geometry_msgs.msg import Vector3
from rclpy.serialization import deserialize_message, serialize_message

raw = serialize_message(Vector3(x=1.0, y=2.0, z=3.0))
print(len(raw), "bytes:", raw.hex(" ", 4))

# %% [markdown]
# 28: the first four only say how the rest is written (here: the smallest byte of a number first).
# The rest you can read by hand, with Python's `struct`: skip 4 bytes (`4x`), then three doubles (`3d`).

# %%
import struct

struct.unpack("<4x3d", raw)

# %% [markdown]
# **Look** at what is *not* there: no "x", no "y", no "Vector3".
# Names do not travel.
# Who reads the bytes must know from elsewhere what comes when.
# Keep that in mind for the end of this notebook.
#
# ### 0.3 is not 0.3
#
# Your speed will travel as a `float32`, in four bytes.
#
# **What will it be?** 0.3 goes in; what comes out?

# %%
from std_msgs.msg import Float32

raw = serialize_message(Float32(data=0.3))
arrived = deserialize_message(raw, Float32).data
print(raw.hex(" ", 4), "->", arrived)
print("at most 0.3?", arrived <= 0.3)

# %% [markdown]
# A robot that is allowed 0.3 m/s would refuse to drive at 0.3 m/s.
#
# A `float32` keeps 24 binary digits, and 0.3 has no end in binary, just as 1/3 has none in decimal.
# By hand, with `struct` alone: pack it into four bytes, and unpack it.

# %%
for speed in (0.5, 0.3, 0.25, 0.1, 0.75):
    (there,) = struct.unpack("<f", struct.pack("<f", speed))
    print(f"{speed:<5} arrives as {there:<20}", "exactly" if there == speed else f"off by {there - speed:.1e}")

# %% [markdown]
# Halves, quarters and their sums survive; most others do not.
# Here is the error for every speed up to 0.5 m/s:

# %%
import matplotlib.pyplot as plt
import numpy as np

speeds = np.linspace(0.0, 0.5, 2001)
plt.figure(figsize=(8, 3))
plt.plot(speeds, (speeds.astype(np.float32) - speeds) * 1e9, ".", markersize=2)
plt.xlabel("speed sent (m/s)")
plt.ylabel("error on arrival (nm/s)");

# %% [markdown]
# A few nanometres per second, and twice as many whenever the number passes a power of two.
# No robot cares.
# But `==` and `<=` do.
#
# **Remember:** compare what has travelled with a tolerance, and test limits with numbers that survive, such as 0.5.
#
# ### An int is not a float
#
# **What will it be?** The 1 in the next cell has no point.

# %%
print(deserialize_message(serialize_message(Float32(data=1)), Float32))

# %% [markdown]
# Zero!
# Nobody converts the number: its memory is read as if it held a float.
# With types that you have built yourself it is worse: there the same mistake ends the whole program, with `Assertion 'PyFloat_Check(field)' failed`.
# A robot that is told `speed = 1` and stands still is a long afternoon.
#
# Python can look at every value, if you ask it to before it starts:

# %%
# !ROS_PYTHON_CHECK_FIELDS=1 python3 -c "from std_msgs.msg import Float32; Float32(data=1)" 2>&1 | tail -1

# %% [markdown]
# It costs time with every message, so it is off by default.
# Write `1.0`, or `float(value)` where a number comes from elsewhere.
#
# ## Four files
#
# Which way to talk fits which need?
#
# | | says | answer | example |
# |---|---|---|---|
# | **topic**, `.msg` | again and again, to whoever listens | none | what the sensors see |
# | **service**, `.srv` | once, to one node | at once | set the speed; how are you? |
# | **action**, `.action` | once, to one node | takes a while, tells how it goes, can be cancelled | drive there |
#
# A `.msg` file is a list of fields.
# A `.srv` has two such lists, request and response, separated by a line `---`.
# An `.action` has three: goal, result and feedback, *in this order*.
#
# This is what the contract asks for, in the order of the fields:
#
# | file | fields |
# |---|---|
# | `msg/SensorFusionData.msg` | a `header` (`std_msgs/Header`: time and frame), two floats of 32 bits, `closest_obstacle_distance` and `battery_level`, then two `geometry_msgs/Vector3`, `linear_acceleration` and `angular_velocity` |
# | `srv/SetSpeed.srv` | request: `speed`, a float of 32 bits. Response: `success`, true or false, and `message`, a text |
# | `srv/GetRobotStatus.srv` | request: nothing. Response: `speed`, a float of 32 bits; `obstacle_detected`, true or false; `pose`, a `geometry_msgs/Pose`; `status`, a text |
# | `action/NavigateToPosition.action` | goal: `target_pose`, a `geometry_msgs/Pose`, and `tolerance`, a float of 32 bits. Result: `success`, true or false, and `final_pose`, a `geometry_msgs/Pose`. Feedback: `distance_remaining`, a float of 32 bits |
#
# Write them.
# A comment in the first line is worth it: `ros2 interface show` prints it to everybody who asks. Say units there.

# %%
# !mkdir -p msg srv action

# %% tags=["exercise"]
# %%writefile msg/SensorFusionData.msg
# One snapshot of everything the robot senses.
# TODO 1: the five fields, one a line: type, then name

# %% tags=["exercise"]
# %%writefile srv/SetSpeed.srv
# Set the speed at which the robot drives when nothing else commands it, in m/s.
# TODO 2: the request above the line, the response below it
---

# %% tags=["exercise"]
# %%writefile srv/GetRobotStatus.srv
# Ask how the robot is doing.
# TODO 3: what is asked, and what is answered
---

# %% tags=["exercise"]
# %%writefile action/NavigateToPosition.action
# Drive to the target's x, y in the odom frame; its orientation is ignored. Tolerance in metres.
# TODO 4: goal, result, feedback
---
---

# %% [markdown]
# Files alone do nothing, as you saw in notebook 01.
# `CMakeLists.txt` must have them generated, by one command:
#
# ```cmake
# rosidl_generate_interfaces(${PROJECT_NAME}
#   "folder/File.kind"
#   "folder/Another.kind"
#   DEPENDENCIES packages whose types the fields use
# )
# ```
#
# Before it, `find_package` must load the generator, `rosidl_default_generators`, and every package that you name under DEPENDENCIES.
#
# One trap lies here.
# The generated module has the package's name, `ros2_robot_controller`, and so has your own.
# The usual command for Python modules, `ament_python_install_package`, refuses then.
# Yours, `install(DIRECTORY …)`, simply lays your files over the generated ones.

# %% tags=["exercise"]
# %%writefile CMakeLists.txt
cmake_minimum_required(VERSION 3.20)
project(ros2_robot_controller)

find_package(ament_cmake REQUIRED)
# TODO 5: find the generator, and the packages whose types your fields use

# 1. The interfaces: rosidl turns these into Python (and C, C++) types.
# TODO 6: generate the four

# 2. The Python modules, laid over the generated ones.
ament_get_python_install_dir(PYTHON_INSTALL_DIR)
install(DIRECTORY ${PROJECT_NAME}/
  DESTINATION ${PYTHON_INSTALL_DIR}/${PROJECT_NAME}
  PATTERN "__pycache__" EXCLUDE)

# 3. The executables, where `ros2 run` looks: lib/<package>/<executable>.
install(PROGRAMS scripts/robot_controller scripts/sensor_processor
  DESTINATION lib/${PROJECT_NAME})

# 4. Launch and parameter files, and the demonstration. None is there yet, so: OPTIONAL.
install(DIRECTORY launch config
  DESTINATION share/${PROJECT_NAME}
  OPTIONAL
  PATTERN "__pycache__" EXCLUDE)
install(PROGRAMS scripts/demo.py
  DESTINATION lib/${PROJECT_NAME}
  OPTIONAL)

# 5. `colcon test` runs what `pytest` runs.
if(BUILD_TESTING AND EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/test)
  find_package(ament_cmake_pytest REQUIRED)
  ament_add_pytest_test(test test TIMEOUT 120)
endif()

ament_package()

# %% [markdown]
# And `package.xml` must say what all this needs:
#
# | package | needed | because |
# |---|---|---|
# | `rosidl_default_generators` | to build | it generates |
# | `rosidl_default_runtime` | to run | what was generated uses it |
# | `geometry_msgs`, `std_msgs` | for both | your fields have their types |
# | `action_msgs` | to run | every action uses its messages |
#
# And one line of another kind, without which rosidl refuses to generate: `<member_of_group>rosidl_interface_packages</member_of_group>`.
#
# While you are there, declare what the next notebooks import, all of it to run: `nav_msgs` and `sensor_msgs` (odometry and scan), `rcl_interfaces` (parameters), and for launch files `launch`, `launch_ros` and `ament_index_python`.

# %% tags=["exercise"]
# %%writefile package.xml
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>ros2_robot_controller</name>
  <version>1.0.0</version>
  <description>Drives a TurtleBot 4 safely.</description>
  <maintainer email="todo@todo.todo">TODO 7: you, as before</maintainer>
  <license>Apache-2.0</license>

  <buildtool_depend>ament_cmake</buildtool_depend>
  <!-- TODO 8: what the interfaces need to be built, and to run; the group; what comes next -->

  <exec_depend>rclpy</exec_depend>

  <test_depend>ament_cmake_pytest</test_depend>
  <test_depend>python3-pytest</test_depend>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>

# %% tags=["check"]
check("I2")

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `!ros2 interface show std_srvs/srv/SetBool` shows a service that is very like `SetSpeed`.
# In the table of types, a float of 32 bits, true or false, and a text are `float32`, `bool` and `string`.
#
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# A field of another package's type names the package, without `msg`: `geometry_msgs/Pose pose`.
# A service without a request begins with the line `---`.
# In `package.xml`, what is needed for both building and running is `<depend>`; tools for building are `<buildtool_depend>`.
#
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```
# geometry_msgs/Pose target_pose
# float32 tolerance
# ---
# bool success
# geometry_msgs/Pose final_pose
# ---
# ```
#
# ```cmake
# find_package(rosidl_default_generators REQUIRED)
# find_package(geometry_msgs REQUIRED)
# find_package(std_msgs REQUIRED)
#
# rosidl_generate_interfaces(${PROJECT_NAME}
#   "msg/SensorFusionData.msg"
#   "srv/SetSpeed.srv"
#   "srv/GetRobotStatus.srv"
#   "action/NavigateToPosition.action"
# ```
#
# and then the DEPENDENCIES.
#
# </details>
#
# Build.
# Now there is something to compile: for each interface a few thousand lines of C and C++ are generated, so this takes up to half a minute.

# %% tags=["nbval-ignore-output"]
# !cd ../.. && colcon build 2>&1 | cat
# The number of seconds in what colcon prints differs each time.

# %% [markdown]
# Did it fail? Read the first error. "Cannot find" a folder of your package means that a file of notebook 01 is missing.
#
# ## Same name, same type
#
# What does ROS say about your interfaces now?

# %%
# !ros2 interface package ros2_robot_controller
# !ros2 interface show ros2_robot_controller/srv/SetSpeed
# !ros2 interface proto ros2_robot_controller/srv/SetSpeed

# %% [markdown]
# `show` prints the file, `proto` a request that you can copy behind `ros2 service call`.
# And in Python, each part is a class of its own:

# %%
# !python3 -c "from ros2_robot_controller.srv import SetSpeed; print(SetSpeed.Request(speed=0.5))" 2>&1 | tail -1
# !python3 -c "from ros2_robot_controller.srv import SetSpeed; print(SetSpeed.Response())" 2>&1 | tail -1

# %% [markdown]
# Would another team's node understand yours?
# Its interfaces have the same names.
# But are they the *same*?
#
# For that, ROS computes a **type hash** of every interface: a fingerprint of all its fields, names and types, in their order.
# There is no secret in it. It is the SHA-256 of a description in JSON, and for a simple type you can write that by hand:

# %%
import hashlib
import json

FLOAT64 = {"type_id": 11, "capacity": 0, "string_capacity": 0, "nested_type_name": ""}


def type_hash(name, fields):
    described = {"type_name": name, "fields": [{"name": field, "type": FLOAT64} for field in fields]}
    whole = {"type_description": described, "referenced_type_descriptions": []}
    return "RIHS01_" + hashlib.sha256(json.dumps(whole).encode()).hexdigest()


type_hash("geometry_msgs/msg/Vector3", ["x", "y", "z"])

# %% [markdown]
# Did that get it right?
# ROS installs the hash of each interface beside it:

# %%
import sys
from pathlib import Path


def installed_hash(prefix, interface):
    file = Path(prefix) / "share" / f"{interface}.json"
    return json.loads(file.read_text())["type_hashes"][0]["hash_string"] if file.exists() else "not built yet"


installed_hash(sys.prefix, "geometry_msgs/msg/Vector3")

# %% [markdown]
# The same, to the last digit.
#
# **What will it be?** Which of these changes the hash: another order of the fields, or another comment?

# %%
print(type_hash("geometry_msgs/msg/Vector3", ["x", "y", "z"])[:20])
print(type_hash("geometry_msgs/msg/Vector3", ["z", "y", "x"])[:20])

# %% [markdown]
# The order does.
# Comments are not part of the description, so write as many as you like.
#
# Requirement **I3** says that your four interfaces have the contract's hashes.
# The contract's begin like this; do yours?

# %%
contract = {
    "msg/SensorFusionData": "RIHS01_4594d365e707",
    "srv/SetSpeed": "RIHS01_78ae1e690919",
    "srv/GetRobotStatus": "RIHS01_fbb12d2b01cc",
    "action/NavigateToPosition": "RIHS01_b0ff38849090",
}
for interface, wanted in contract.items():
    yours = installed_hash("../../install/ros2_robot_controller", f"ros2_robot_controller/{interface}")
    print(f"{interface:26}", "as in the contract" if yours.startswith(wanted) else f"not yet: {yours[:19]}")

# %% [markdown]
# If one differs, compare the file with the table above: type, name, order.
# I3 also wants your *nodes* to use these types, so `check("I3")` comes when the last of them does, in notebook 07.
#
# ### Same name, other hash: silence
#
# Suppose that a colleague's `SensorFusionData.msg` has the two floats in the other order.
# It compiles, it installs, it has the same name.
# The colleague's robot sends: closest obstacle 0.4 m, battery 80 %.
#
# **What will it be?** What do you read?

# %%
sent = struct.pack("<2f", 80.0, 0.4)  # their order: battery_level, closest_obstacle_distance
distance, battery = struct.unpack("<2f", sent)  # your order
print(f"closest obstacle {distance:.1f} m, battery {battery:.1f} %")

# %% [markdown]
# Free way for 80 metres, in front of a wall.
#
# Do such bytes pass through ROS?
# Try it: a listener for `Vector3`, and a talker that sends the bytes of a `Vector3` whose fields are in the order z, y, x.
# (A publisher takes finished bytes, too. They are what a node built from such a file would send.)

# %%
import rclpy

if not rclpy.ok():  # so that you can run this cell twice
    rclpy.init()
node = rclpy.create_node("colleagues")
heard = []
node.create_subscription(Vector3, "wind", heard.append, 10)
talker = node.create_publisher(Vector3, "wind", 10)
swapped = bytes([0, 1, 0, 0]) + struct.pack("<3d", 0.0, 0.0, 9.0)  # z = 0, y = 0, x = 9

# %%
for _ in range(100):
    if not heard:
        talker.publish(swapped)
        rclpy.spin_once(node, timeout_sec=0.1)
print(*heard[:1])

# %% [markdown]
# It arrives, without a warning, and the wind blows upwards.
#
# You may object that here both ends have the same hash: only the bytes are swapped.
# You are right, and the full proof needs two builds of one package, which takes too long for this page.
# It was done once, with a type `pair/msg/Pair` of two floats, swapped in the second build.
# The talker sent a distance of 0.4 and a battery of 80, and the listener printed:
#
# ```
# pair.msg.Pair(battery=0.4000000059604645, distance=80.0)
# hash of the talker    RIHS01_d00c84df8294…
# hash of the listener  RIHS01_a77cd476e75c…
# ```
#
# The middleware of this kit (Fast DDS, the default of ROS 2 Jazzy) joins two ends when the topic and the *name* of the type agree (and some settings, notebook 04).
# It tells the hashes around, and leaves comparing them to you: `ros2 topic info -v TOPIC` shows the hash of each end.
#
# **Remember:** interfaces that are in use are never changed; make a new one with a new name.
#
# ### Same topic, other name: silence of another kind
#
# This one has cost owners of a TurtleBot 4 many an hour.
# The robot listens on `cmd_vel` for `TwistStamped`, and your program sends `Twist`.
#
# (Two nodes of one program may not even try this, so the sender gets a context of its own: as if it were another program.)

# %%
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.context import Context

obeyed = []
node.create_subscription(TwistStamped, "cmd_vel", obeyed.append, 10)
elsewhere = Context()
rclpy.init(context=elsewhere)
planner = rclpy.create_node("planner", context=elsewhere)
sender = planner.create_publisher(Twist, "cmd_vel", 10)

# %% [markdown]
# **What will it be?** An error, a warning, or nothing?

# %%
for _ in range(20):
    sender.publish(Twist())
    rclpy.spin_once(node, timeout_sec=0.1)
print("messages heard:", len(obeyed))
print("subscribers on the topic:", planner.count_subscribers("cmd_vel"))
print("of them joined to this publisher:", sender.get_subscription_count())

# %% [markdown]
# Nothing, and no word.
# But the two numbers tell it: there *is* a subscriber, and it is not joined.
# When a robot does not move, ask that first: `ros2 topic info -v /cmd_vel`, and compare the types.

# %%
planner.destroy_node()
elsewhere.try_shutdown()
node.destroy_node()
rclpy.try_shutdown()

# %% [markdown]
# > **On a real TurtleBot 4**
# >
# > - Its base takes `TwistStamped` on `cmd_vel`; the course's robot takes `Twist`, as the contract asks. Between the two you need a node of ten lines that puts the header on.
# > - Its own interfaces live in packages of their own, `irobot_create_msgs` and `turtlebot4_msgs`, so that a laptop can install them without the robot's software. Larger projects all do that.
# > - Robot and laptop must have built the *same* files. After a change, build both.
#
# ## Go further
#
# - Constants: a line `uint8 OK=0` in a `.msg` is a name for a number, in every language. Would `status` be better as one? A default value: `float32 tolerance 0.1`.
# - Swap two fields for real: make a second workspace with a copy of the package, swap two lines of the `.msg` there, build, and let a node of each talk. `ros2 topic info -v` then shows two hashes on one topic.
# - Another middleware, `rmw_zenoh`, puts the type hash into the address of a topic. There you would have heard nothing at all from your colleague. Which silence do you prefer?
# - In the ROS 2 documentation: *About ROS 2 interfaces*, and *Creating custom msg and srv files*.
#
# ## Recall
#
# <details><summary>Topic, service or action: "take a photo", "battery voltage", "dock at the charger"?</summary>
#
# A photo: a service, one question and one answer. The voltage: a topic, it changes and several may want it. Docking: an action, it takes a while and you may want to cancel.
#
# </details>
#
# <details><summary>In which order are the three parts of an <code>.action</code>?</summary>
#
# Goal, result, feedback. The result comes before the feedback, though it arrives after it.
#
# </details>
#
# <details><summary>A limit is 0.3 m/s, and a client that asks for 0.3 is refused. What happened?</summary>
#
# The request travelled as float32 and arrived as 0.30000001192092896. Compare with a tolerance, or choose limits that survive.
#
# </details>
#
# <details><summary>Two packages define <code>SensorFusionData</code> with the same fields in another order. Does the subscriber notice?</summary>
#
# Not with Jazzy's default middleware: the bytes are read in the wrong order, silently. The type hashes differ; somebody has to look.
#
# </details>
#
# <details><summary>The publisher publishes, the subscriber hears nothing, both are on the same topic. Two suspects?</summary>
#
# Another type name (today), or settings of quality that do not fit, QoS (notebook 04). A third: they are in different domains.
#
# </details>
#
# **Next:** [03 The numbers of motion](03_numbers_of_motion.ipynb). A heading is one angle, and it travels as four numbers.
