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
# What the bytes mean is written in neither program but in an **interface**, a file of a few lines from which ROS generates code for both.
# Today you write the four interfaces of your package.
# They are short, but all that follows speaks through them, and a pair of swapped lines makes a robot believe that the wall is 80 metres away.
#
# **You will be able to**
#
# - choose between a topic, a service and an action;
# - write `.msg`, `.srv` and `.action` files, and have code generated from them;
# - read the bytes of a message by hand, and say why 0.3 is not 0.3 any more when it arrives;
# - tell by a type hash whether two machines mean the same, and explain what happens if they do not.
#
# **Time:** about 55 minutes. A good place for a break is before "Same name, same type".
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
from grader.notebook import begin, check, run_node, start_at, tries

begin("02")

# %% [markdown]
# ## Types that everyone knows
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
# A program that reads the bytes must know from elsewhere what comes when.
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
# The number is not converted: its memory is read as if it held a float.
# With types that you have built yourself it is worse: there the same mistake ends the whole program, with `Assertion 'PyFloat_Check(field)' failed`.
# A robot that gets `speed = 1` and stands still costs a long afternoon.
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
# | **topic**, `.msg` | again and again, to all who listen | none | what the sensors see |
# | **service**, `.srv` | once, to one node | at once | set the speed; how are you? |
# | **action**, `.action` | once, to one node | takes a while, reports on the way, can be cancelled | drive there |
#
# A `.msg` file is a list of fields.
# A `.srv` has two such lists, request and response, separated by a line `---`.
# An `.action` has three: goal, result and feedback, *in this order*.
#
# Here is a service that ROS brings, as a pattern:

# %%
# !ros2 interface show std_srvs/srv/SetBool

# %% [markdown]
# And an action, the one of ROS's own tutorial; it counts up the Fibonacci numbers:
#
# ```
# int32 order
# ---
# int32[] sequence
# ---
# int32[] partial_sequence
# ```
#
# A field of another package's type names the package and the type, without `msg`: `geometry_msgs/Pose pose`.
#
# Now write yours, one after the other; the fields are the contract's, in its order.
# A comment in the first line is worth it: `ros2 interface show` prints it to everyone who asks. State units there.
#
# After each file, a table reads it with rosidl's own parser, the one that the build uses, and compares names and types.

# %%
import re
from pathlib import Path

from rosidl_adapter.parser import parse_message_string


def parts(file):
    """Return the fields of each part of an interface file."""
    texts = re.split(r"^---\s*$", Path(file).read_text(), flags=re.MULTILINE)
    return [parse_message_string("any", "Name", text).fields for text in texts]


def names(file):
    """Return the names of the fields in their order, with --- between the parts."""
    return " --- ".join(" ".join(field.name for field in part) for part in parts(file))


def types(file):
    """Return the types that occur in the file, each once."""
    return sorted({str(field.type) for part in parts(file) for field in part})


# !mkdir -p msg srv action

# %% [markdown]
# ### Exercise 1: a message
#
# `msg/SensorFusionData.msg` has five fields: a `header` of the type `std_msgs/Header` (time and frame);
# two floats of 32 bits, `closest_obstacle_distance` and `battery_level`;
# two `geometry_msgs/Vector3`, `linear_acceleration` and `angular_velocity`.

# %% tags=["exercise"]
# %%writefile msg/SensorFusionData.msg
# One snapshot of everything the robot senses.
# TODO 1: the five fields, one a line: type, then name

# %%
tries(
    {
        "names('msg/SensorFusionData.msg')": "header closest_obstacle_distance battery_level linear_acceleration angular_velocity",
        "types('msg/SensorFusionData.msg')": ["float32", "geometry_msgs/Vector3", "std_msgs/Header"],
    }
)

# %% [markdown]
# ### Exercise 2: two services
#
# | file | request | response |
# |---|---|---|
# | `srv/SetSpeed.srv` | `speed`, a float of 32 bits | `success`, true or false; `message`, a text |
# | `srv/GetRobotStatus.srv` | nothing | `speed`, a float of 32 bits; `obstacle_detected`, true or false; `pose`, a `geometry_msgs/Pose`; `status`, a text |

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

# %%
tries(
    {
        "names('srv/SetSpeed.srv')": "speed --- success message",
        "types('srv/SetSpeed.srv')": ["bool", "float32", "string"],
        "names('srv/GetRobotStatus.srv')": " --- speed obstacle_detected pose status",
        "types('srv/GetRobotStatus.srv')": ["bool", "float32", "geometry_msgs/Pose", "string"],
    }
)

# %% [markdown]
# ### Exercise 3: an action
#
# `action/NavigateToPosition.action`, three parts:
#
# | part | fields |
# |---|---|
# | goal | `target_pose`, a `geometry_msgs/Pose`; `tolerance`, a float of 32 bits |
# | result | `success`, true or false; `final_pose`, a `geometry_msgs/Pose` |
# | feedback | `distance_remaining`, a float of 32 bits |

# %% tags=["exercise"]
# %%writefile action/NavigateToPosition.action
# Drive to the target's x, y in the odom frame; its orientation is ignored. Tolerance in metres.
# TODO 4: goal, result, feedback
---
---

# %%
tries(
    {
        "names('action/NavigateToPosition.action')": "target_pose tolerance --- success final_pose --- distance_remaining",
        "types('action/NavigateToPosition.action')": ["bool", "float32", "geometry_msgs/Pose"],
    }
)

# %% [markdown]
# <details><summary>Hint 1 to the files: where to look</summary>
#
# The table of types at the top of this notebook: which words stand for a float of 32 bits, true or false, and a text?
# And `SetBool` above: it is very like `SetSpeed`.
#
# </details>
#
# <details><summary>Hint 2 to the files: the form</summary>
#
# `float32`, `bool` and `string`. A service without a request begins with the line `---`.
# The order of an action's parts is goal, result, feedback.
#
# </details>
#
# <details><summary>Hint 3 to the files: all but the last line</summary>
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
# </details>
#
# ### Exercise 4: have them generated
#
# Files alone do nothing, as you saw in notebook 01.
# `CMakeLists.txt` must have them generated, by one command:
#
# ```cmake
# find_package(rosidl_default_generators REQUIRED)
# find_package(sensor_msgs REQUIRED)
#
# rosidl_generate_interfaces(${PROJECT_NAME}
#   "msg/Lamp.msg"
#   "srv/Switch.srv"
#   DEPENDENCIES sensor_msgs
# )
# ```
#
# That would be a lamp whose message has a field with a type of `sensor_msgs`.
# The generator and every package under DEPENDENCIES must be found first, each by a `find_package` line.
# Write the same for your four files. Of which two packages do their fields have types?
#
# (One trap: the generated module has the package's name, `ros2_robot_controller`, and so has your own.
# The usual command for Python modules, `ament_python_install_package`, refuses then.
# Yours, `install(DIRECTORY …)`, simply lays your files over the generated ones.)

# %% tags=["exercise"]
# %%writefile CMakeLists.txt
cmake_minimum_required(VERSION 3.20)
project(ros2_robot_controller)

find_package(ament_cmake REQUIRED)
# TODO 5: find the generator, and the two packages whose types your fields use

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
# ### Exercise 5: say what it needs
#
# And `package.xml` must declare what all this needs:
#
# | package | needed | tag | because |
# |---|---|---|---|
# | `rosidl_default_generators` | to build | `<buildtool_depend>` | it generates |
# | `rosidl_default_runtime` | to run | `<exec_depend>` | what was generated uses it |
# | `geometry_msgs`, `std_msgs` | for both | `<depend>` | your fields have their types |
# | `action_msgs` | to run | `<exec_depend>` | every action uses its messages |
#
# And one line of another kind, without which rosidl refuses to generate: `<member_of_group>rosidl_interface_packages</member_of_group>`.
#
# What the next notebooks import is given: odometry and scan, parameters, launch files.

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
  <!-- TODO 8: what the interfaces need to be built, and to run; the group -->

  <exec_depend>ament_index_python</exec_depend>
  <exec_depend>launch</exec_depend>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>nav_msgs</exec_depend>
  <exec_depend>rcl_interfaces</exec_depend>
  <exec_depend>rclpy</exec_depend>
  <exec_depend>sensor_msgs</exec_depend>

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
# For `CMakeLists.txt`, the lamp: which words are its files, which its packages?
# For `package.xml`, the table of exercise 5, row by row.
#
# </details>
#
# <details><summary>Hint 2: the lines</summary>
#
# Three `find_package` lines: the generator, `geometry_msgs`, `std_msgs`.
# Six lines for `package.xml`: one for each of the five packages of the table, and the group.
#
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
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
# Now there is something to compile: for each interface a few thousand lines of C and C++ are generated, so the first time this takes some twenty seconds, and longer on a busy machine.

# %% tags=["nbval-ignore-output"]
# !cd ../.. && colcon build 2>&1 | cat
# The number of seconds in what colcon prints differs each time.

# %% [markdown]
# Did it fail? Read the first error. If it "cannot find" a folder of your package, a file of notebook 01 is missing.
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
# If one differs, compare the file with its exercise: type, name, order.
# I3 also wants your *nodes* to use these types; that half comes with the last of them, in notebook 07.

# %% tags=["check"]
check("I3")

# %% [markdown]
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
# The middleware of this kit (Fast DDS, the default of ROS 2 Jazzy) connects two ends when the topic and the *name* of the type agree (and some settings, notebook 04).
# It publishes the hashes, and leaves comparing them to you: `ros2 topic info -v TOPIC` shows the hash of each end.
#
# **Remember:** never change an interface that is in use; make a new one with a new name.
#
# ### Same topic, other name: silence of another kind
#
# This one has cost owners of a TurtleBot 4 many hours.
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
print("of them connected to this publisher:", sender.get_subscription_count())

# %% [markdown]
# Nothing, and no message about it.
# But the two numbers show it: there *is* a subscriber, and it is not connected.
# When a robot does not move, look at that first: `ros2 topic info -v /cmd_vel`, and compare the types.

# %%
planner.destroy_node()
elsewhere.try_shutdown()
node.destroy_node()
rclpy.try_shutdown()

# %% [markdown]
# ## Ten seconds of driving
#
# Your types are good for something already.
# This program takes your empty node, as in notebook 01, and gives it a service of *your* type `SetSpeed`: it drives at the speed that it was last asked for.

# %%
# %%writefile ../../speed_drive.py
"""Drive at the speed of the last request: the empty node of the package, with a service of its own type."""
import sys

from geometry_msgs.msg import Twist
from ros2_robot_controller.robot_controller import RobotController
from ros2_robot_controller.srv import SetSpeed
from ros2_robot_controller.utils.running import run


class SpeedDrive(RobotController):
    def __init__(self):
        super().__init__()
        self.twist = Twist()
        self.create_service(SetSpeed, 'set_speed', self.on_set_speed)
        self.speeds = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, lambda: self.speeds.publish(self.twist))

    def on_set_speed(self, request, response):
        self.twist.linear.x = request.speed
        response.success, response.message = True, f'driving at {request.speed} m/s'
        return response


sys.exit(run(SpeedDrive))

# %% [markdown]
# **What will it be?** The answer's text has the speed that *arrived*. What does it say for 0.3?

# %%
run = run_node(program="../../speed_drive.py", world="open_field")
for speed in (0.5, 0.3, -0.25):
    print(f"asked for {speed}:", run.set_speed(speed).message)
    recording = run.drive(3.4)

# %%
plt.figure(figsize=(8, 2.6), layout="constrained")
plt.plot(recording.t, recording.v)
plt.xlabel("simulated time (s)")
plt.ylabel("speed (m/s)")
plt.grid(alpha=0.3)
run.close()

# %% [markdown]
# It does whatever it is asked, at any speed and into any wall.
# Notebook 05 makes it stop, notebook 06 makes it refuse.
#
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
# A photo: a service, one question and one answer. The voltage: a topic, it changes and several nodes may want it. Docking: an action, it takes a while and you may want to cancel.
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
# Not with Jazzy's default middleware: the bytes are read in the wrong order, silently. The type hashes differ, but you have to look.
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
