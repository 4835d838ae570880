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
# # 01 Anatomy of a package
#
# ![At the left the files that you write, at the right the folders of the install tree into which the build copies them, with the command that looks there](pictures/01.png)
#
# A ROS 2 package is a folder, and most of it is not code.
# Two files say what it is and where its parts go. If one of them is wrong, even a perfect program cannot be built, found or started.
# Today you make a package whose nodes do nothing yet. It builds, it starts, and its files are correct.

# %% [markdown] tags=["whole"]
# At the end it drives for ten seconds.
#
# **You will be able to**
#
# - make a package from scratch, and say what each of its files is for;
# - write a correct `package.xml`, and know what each wrong entry breaks;
# - write a `CMakeLists.txt` that puts everything where ROS looks for it;
# - build with `colcon`, find what was built, and run it;
# - explain why a package with interfaces must be `ament_cmake`.
#
# **Time:** 50 to 90 minutes. A good place for a break is before "Build and install".
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# **Your package so far:** an empty folder.
# At the end of this notebook:
#
#     ros2_robot_controller/
#     ├── package.xml                      ← you write: what it is
#     ├── CMakeLists.txt                   ← you write: what is built, and where it goes
#     ├── setup.py  setup.cfg              given
#     ├── scripts/
#     │   ├── robot_controller             ← you write: what `ros2 run` starts
#     │   └── sensor_processor             given
#     └── ros2_robot_controller/
#         ├── __init__.py                  given
#         ├── robot_controller.py          given: a node that does nothing
#         ├── sensor_processor.py          given: another one
#         └── utils/
#             ├── __init__.py              given
#             └── running.py               given

# %%
from grader.notebook import begin, check, run_node, start_at, tries

begin("01")

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>A program subscribes to <code>/scan</code> and never spins. What does it hear?</summary>
#
# Nothing: messages are delivered by callbacks, and callbacks are called while something spins.
# </details>
# <details><summary>Which node has to be changed so that a second program can listen to <code>/odom</code>?</summary>
#
# None. A publisher does not know who listens.
# </details>
# <details><summary>A reading of the lidar is <code>inf</code>. Is the sensor broken?</summary>
#
# No: nothing within its range sent an echo in that direction.
# </details>

# %% [markdown] tags=["whole"]
# ## What makes a folder a package?
#
# Less than you think.
# ROS has a command that makes a new package. Try it in a separate folder.
# `mkdtemp` makes such a folder, and `{trial}` in a shell line is replaced by its path.
#
# (This kit has its own small `ros2` command, because ROS's command cannot be installed with pip.
# It has the commands, options and outputs that the course needs, and tells you if something is missing.
# The same holds for `launch` and `launch_ros` in notebook 08.
# `colcon`, CMake and all libraries are the real ones.)

# %% tags=["whole"]
import tempfile
from pathlib import Path

trial = Path(tempfile.mkdtemp())
# !mkdir {trial}/src
# !cd {trial}/src && ros2 pkg create greeter --build-type ament_python --license MIT >/dev/null
# !cd {trial} && find src -type f | sort

# %% [markdown] tags=["whole"]
# Eight files. (ROS's own command writes a ninth, `LICENSE`.)
# **Predict:** one of these files, copied alone into an empty folder, is enough for the build tool `colcon` to find a package there. Which one?

# %% tags=["whole"]
# !cd {trial} && mkdir -p alone/copy && cp src/greeter/package.xml alone/copy
# !cd {trial} && colcon list --base-paths src
# !cd {trial} && colcon list --base-paths alone && rm -r alone

# %% [markdown] tags=["whole"]
# `package.xml` makes a folder a package.
# `colcon` read the name and the build type, `ros.ament_python`, from this one file.
# You write yours in a moment.

# %% [markdown]
# ## A place for everything
#
# The contract of this course says where each file belongs, and requirement **Q3** checks that.
# Most of these places are conventions: tools look for the files there.
#
# | folder | holds | who looks there |
# |---|---|---|
# | `ros2_robot_controller/` | the Python modules | `import ros2_robot_controller` |
# | `ros2_robot_controller/utils/` | plain functions without ROS | your nodes and your tests |
# | `scripts/` | what can be started | `ros2 run`, once it is installed |
# | `msg/  srv/  action/` | interfaces (notebook 02) | rosidl, the generator |
# | `launch/  config/` | launch and parameter files (08) | `ros2 launch` |
# | `test/` | tests (09) | pytest, `colcon test` |

# %% [markdown] tags=["whole"]
# Q3 also asks that no function is too complex and that nothing is written twice.
# You check it in "Build and install", for the files that belong here by then; each later notebook adds its own.

# %% [markdown]
# The package and its module folder have the same name, one inside the other.
# ROS builds the outer one, the *package*; `import` finds the inner one, the *Python package*.
#
# `%%writefile` at the top of a cell writes the rest of the cell into a file, below the package's folder, and makes the folders that it needs.
# It overwrites without asking. If you have changed the file in an editor meanwhile, it keeps a copy in `ws/kept` and prints a line about it.

# %% [markdown] tags=["whole"]
# Some files are given. The first two are for Python tools, such as an editor or a linter. ROS itself builds with the `CMakeLists.txt` that you write below.

# %% tags=["given", "whole"]
# %%writefile setup.py
"""Let plain Python tools find the modules. ROS builds the package with CMakeLists.txt."""

from setuptools import find_packages, setup

setup(
    name='ros2_robot_controller',
    version='1.0.0',
    packages=find_packages(exclude=['test']),
)

# %% tags=["given", "whole"]
# %%writefile setup.cfg
[tool:pytest]
testpaths = test

[flake8]
max-line-length = 99
import-order-style = google

# %% [markdown] tags=["whole"]
# `setup.cfg` holds the settings of tools: where pytest finds the tests, and how long a line may be (99 columns, as everywhere in ROS).
#
# The next files make the inner folder a Python package that can be imported.
# You need the unusual line in the first file in notebook 02: ROS generates a part of this package elsewhere, and the line lets Python look in both places.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/__init__.py
"""Drive a robot safely with ROS 2."""

# rosidl generates msg, srv and action into a package of this very name. In the source tree they
# lie elsewhere, so let Python look in every folder of this name on its path.
__path__ = __import__('pkgutil').extend_path(__path__, __name__)

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/utils/__init__.py
"""The decisions behind the nodes: plain functions that a test can call without a robot."""

# %% [markdown] tags=["whole"]
# Every node begins and ends in the same way, so you write that code only once.
# Read it line by line; it is the skeleton of any ROS 2 program in Python:
# switch ROS on, make the node, *spin* (serve its callbacks, for ever), and switch ROS off again.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/utils/running.py
"""Run a node from its start to Ctrl-C. Knows no particular node."""

from collections.abc import Callable
from typing import Optional

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


def run(make_node: Callable[[], Node], args: Optional[list[str]] = None) -> int:
    """Spin the node that `make_node` makes until Ctrl-C or SIGTERM; return the exit code."""
    rclpy.init(args=args)
    try:
        rclpy.spin(make_node())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass  # this is how a node is told to end
    finally:
        rclpy.try_shutdown()
    return 0

# %% [markdown] tags=["whole"]
# `try_shutdown` and not `shutdown`: after Ctrl-C, rclpy has already shut down, and a second `shutdown` raises an error.
# Many programs on the web end with that error.
#
# And two nodes.
# A node is a class that derives from `Node`: it has everything that `Node` has, and adds to it.
# `super()` is the class above: `super().__init__(...)` runs what `Node` does to set itself up, and gives it its name.
# Without that call, the object is not a working node.

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/robot_controller.py
"""The node that drives the robot. So far it has a name and does nothing."""

from typing import Any, Optional

from rclpy.node import Node
from ros2_robot_controller.utils.running import run


class RobotController(Node):
    """A node that is there, and that is all."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('robot_controller', **node_options)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)

# %% tags=["given", "whole"]
# %%writefile ros2_robot_controller/sensor_processor.py
"""The node that fuses the sensors. So far it has a name and does nothing."""

from typing import Any, Optional

from rclpy.node import Node
from ros2_robot_controller.utils.running import run


class SensorProcessor(Node):
    """A node that is there, and that is all."""

    def __init__(self, **node_options: Any) -> None:
        super().__init__('sensor_processor', **node_options)


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(SensorProcessor, args)

# %% [markdown] tags=["whole"]
# `main` is a function because three programs call it: the script that `ros2 run` starts, your tests, and the coverage tool.
#
# You do not have to build anything to try this.
# `__init__` makes the node, and you can look at it from here:

# %% tags=["whole"]
import rclpy
from ros2_robot_controller.robot_controller import RobotController

if not rclpy.ok():  # so that you can run this cell twice
    rclpy.init()
node = RobotController()
print(node.get_name(), "offers", len(node.get_service_names_and_types_by_node(node.get_name(), "/")), "services")
node.destroy_node()
rclpy.try_shutdown()

# %% [markdown] tags=["whole"]
# A node that does nothing has services already!
# Six are for its parameters: you can ask every ROS 2 node for its settings (notebook 08).
# The seventh describes the types that the node uses.

# %% [markdown]
# ## package.xml, line by line
#
# This file is the package's passport, and **I2** checks it.
# Other tools do, too: `colcon` decides from it how to build and in which order, `rosdep` installs what it names, and a search engine for ROS packages shows it.
#
# | line | who reads it | what it is for, or what a mistake costs |
# |---|---|---|
# | `<package format="3">` | all | format 1 does not know `<depend>` |
# | `<name>` | colcon, `ros2 run` | the package goes by another name |
# | `<version>` | release tools | must be three numbers, `1.0.0` |
# | `<maintainer email=…>` | people | a malformed address stops the build |
# | `<license>` | lawyers, tools | a name that tools know: `Apache-2.0` |
# | `<buildtool_depend>` | colcon, rosdep | needed *to build*: `ament_cmake` |
# | `<exec_depend>` | rosdep | needed *to run*: `rclpy`. Missing: it works here, and fails on another machine |
# | `<depend>` | both | needed for both |
# | `<test_depend>` | rosdep, `colcon test` | needed to test |
# | `<export><build_type>` | colcon | how to build: `ament_cmake` or `ament_python` |
#
# Missing dependencies are the most common mistake: everything is installed on your machine, so you do not notice them.

# %% [markdown] tags=["whole"]
# ### A licence tag that one tool takes and another refuses
#
# The licence has a short official name, from the [SPDX list](https://spdx.org/licenses/).
# Two tools read it here. `colcon` uses `catkin_pkg` to read `package.xml`. Python's own tools use `packaging`, which contains the SPDX list, to check a licence.
# **Predict:** which of these tags does each tool accept?

# %% tags=["whole"]
from catkin_pkg.package import parse_package_string
from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression


def catkin_pkg_takes(tag):
    text = Path(trial, "src/greeter/package.xml").read_text().replace(">MIT<", f">{tag}<")
    return parse_package_string(text).licenses == [tag]


for tag in ("Apache License 2.0", "apache-2.0", "BSD", "BSD-3-Clause", "TODO: License declaration"):
    try:
        spdx = f"it is {canonicalize_license_expression(tag)}"
    except InvalidLicenseExpression:
        spdx = "refused"
    print(f"{tag:28} catkin_pkg: {'taken' if catkin_pkg_takes(tag) else 'refused':10} packaging: {spdx}")

# %% [markdown] tags=["whole"]
# `catkin_pkg` accepts any text, so the package builds. But a tool that collects the licences of a whole robot does not recognise such a licence.
# Many `package.xml` files say "Apache License 2.0". That is the licence's full name, but it is not in the list.
# "BSD" is refused because there are several.
# `ros2 pkg create` writes the last one if you do not name a licence.
# I2 goes by the SPDX list.

# %% [markdown]
# ### Exercise 1: the passport
#
# Complete the file. In the end the package has a description, one sentence that says what the robot does with it (such as "Drives a TurtleBot 4 safely."), version 1.0.0, *you* as the maintainer, and Apache-2.0 as its licence.
# It also declares what today's files need, one tag for each:
# `ament_cmake` to build (the table has the tag), `rclpy` to run, `ament_cmake_pytest` and `python3-pytest` to test.
# Its build type is `ament_cmake`: only CMake generates the code for the interfaces of notebook 02.

# %% tags=["exercise"]
# %%writefile package.xml
<?xml version="1.0"?>
<?xml-model href="http://download.ros.org/schema/package_format3.xsd" schematypens="http://www.w3.org/2001/XMLSchema"?>
<package format="3">
  <name>ros2_robot_controller</name>
  <version>0.0.0</version>
  <description>TODO 1: the description</description>
  <maintainer email="todo@todo.todo">TODO 2: you</maintainer>
  <license>TODO 3: a name that tools know</license>

  <!-- TODO 4: what is needed to build it, to run it, and to test it -->

  <export>
    <!-- TODO 5: not this one -->
    <build_type>ament_python</build_type>
  </export>
</package>

# %% [markdown] tags=["whole"]
# What does ROS's own reader make of it?

# %% tags=["whole"]
from catkin_pkg.package import parse_package

passport = parse_package("package.xml")
print(passport.name, passport.version, "by", passport.maintainers[0])
print("licence  ", passport.licenses)
print("to build ", *passport.buildtool_depends, *passport.build_depends)
print("to run   ", *passport.exec_depends)
print("to test  ", *passport.test_depends)
print("type     ", passport.get_build_type())

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# In the table above: its first column has the tags.
#
# </details>
#
# <details><summary>Hint 2: the tags</summary>
#
# `<buildtool_depend>`, `<exec_depend>` and `<test_depend>`, one line for each package.
# What `CMakeLists.txt` asks for by `find_package(...)` must be declared, and so must what a module imports.
# pytest is not a ROS package; its name in rosdep's list is `python3-pytest`.
#
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```xml
# <license>Apache-2.0</license>
#
# <buildtool_depend>ament_cmake</buildtool_depend>
# <exec_depend>rclpy</exec_depend>
# <test_depend>ament_cmake_pytest</test_depend>
# <test_depend>python3-pytest</test_depend>
# ```
#
# and in `<export>` the build type that the package really has.
#
# </details>

# %% [markdown]
# I2 compares the dependencies with what your files *use*, and the build type with the files of your package.
# So its check comes below, when all files are there.
#
# ## Build and install
#
# Why build a package in which there is nothing to compile?
# Because ROS starts programs from an **install** folder, not from your sources, and `colcon build` fills it:
#
# | in your sources | after the build, below `install/ros2_robot_controller/` | found by |
# |---|---|---|
# | `ros2_robot_controller/*.py` | `lib/python3.x/site-packages/ros2_robot_controller/` | `import` |
# | `scripts/robot_controller` | `lib/ros2_robot_controller/robot_controller` | `ros2 run` |
# | `launch/ config/` | `share/ros2_robot_controller/` | `ros2 launch` |
# | `package.xml` | `share/ros2_robot_controller/package.xml` | everything else |
#
# `CMakeLists.txt` says what goes where. Requirement **I1** checks that the build succeeds, and looks at the second and third of these places.

# %% [markdown] tags=["whole"]
# `CMakeLists.txt` is a list of commands in CMake's own language, with spaces between the arguments.
#
# | command | does |
# |---|---|
# | `find_package(ament_cmake REQUIRED)` | load ROS's own commands |
# | `ament_get_python_install_dir(VAR)` | ask where Python modules go |
# | `install(DIRECTORY a/ DESTINATION b)` | copy what is *in* folder a to b (`a` without the slash copies the folder itself) |
# | `install(PROGRAMS f DESTINATION b)` | copy file f to b and make it executable |
# | `ament_package()` | the last command: install `package.xml`, and add the package to ROS's index |
#
# `${PROJECT_NAME}` is the name that you gave to `project(...)`.
#
# Here is an example for a package called `lamp`, with its modules in the folder `lamp` and one program in `tools`:
#
# ```cmake
# ament_get_python_install_dir(PYTHON_INSTALL_DIR)
# install(DIRECTORY lamp/ DESTINATION ${PYTHON_INSTALL_DIR}/lamp)
# install(PROGRAMS tools/switch_on DESTINATION lib/lamp)
# ```
#
# The first line stores the folder's name, `lib/python3.x/site-packages`, in the variable `PYTHON_INSTALL_DIR`; `${...}` reads it.
#
# ### Exercise 2: what goes where
#
# Write the same for your package: its modules, and its two scripts.
# The parts that come later are given: `OPTIONAL` makes CMake skip a missing folder, such as `launch` and `config`; notebook 08 fills them.

# %% tags=["exercise", "whole"]
# %%writefile CMakeLists.txt
cmake_minimum_required(VERSION 3.20)
project(ros2_robot_controller)

find_package(ament_cmake REQUIRED)

# 1. The interfaces come here, in notebook 02.

# 2. The Python modules.
# TODO 1: ask ament where modules go, and install what is in the module folder there.

# 3. The executables, where `ros2 run` looks: lib/<package>/<executable>.
# TODO 2: install the two scripts.

# 4. Launch and parameter files, and the demonstration. None is there yet, so: OPTIONAL.
install(DIRECTORY launch config
  DESTINATION share/${PROJECT_NAME}
  OPTIONAL
  PATTERN "__pycache__" EXCLUDE)
install(PROGRAMS scripts/demo.py
  DESTINATION lib/${PROJECT_NAME}
  OPTIONAL)

# 5. `colcon test` runs what `pytest` runs; the tests come in notebook 09.
if(BUILD_TESTING AND EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/test)
  find_package(ament_cmake_pytest REQUIRED)
  ament_add_pytest_test(test test TIMEOUT 120)
endif()

ament_package()

# %% [markdown] tags=["whole"]
# ### Exercise 3: what `ros2 run` starts
#
# An installed script has no `.py`, because its file name is the name of the command.
# One of the two is given.

# %% tags=["given", "whole"]
# %%writefile scripts/sensor_processor
#!/usr/bin/env python3
"""Run the sensor_processor node."""
import sys

from ros2_robot_controller.sensor_processor import main

sys.exit(main())

# %% [markdown] tags=["whole"]
# The first line tells the system which program runs the script: `python3`, wherever it is found on the path.
# `sys.exit(main())` passes the exit code on to the program that started it.
#
# Write the other script. It has two lines.

# %% tags=["exercise", "whole"]
# %%writefile scripts/robot_controller
#!/usr/bin/env python3
"""Run the robot_controller node."""
import sys

# TODO: import the node's main(), call it, and hand its exit code on.
sys.exit('not yet: scripts/robot_controller starts no node')

# %% [markdown]
# Before you build: does `package.xml` agree with your files, and is every file in its place?

# %% tags=["check"]
check("I2", "Q3")

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The three lines for `lamp`: which words are its name, which its folders?
# The script is like the given one, with another module.
#
# </details>
#
# <details><summary>Hint 2: the destinations</summary>
#
# Modules go to `${PYTHON_INSTALL_DIR}/${PROJECT_NAME}`, if `PYTHON_INSTALL_DIR` is the variable that you let `ament_get_python_install_dir` fill.
# Executables go to `lib/${PROJECT_NAME}`: without `bin`, and without a version.
#
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```cmake
# ament_get_python_install_dir(PYTHON_INSTALL_DIR)
# install(DIRECTORY ${PROJECT_NAME}/ DESTINATION ${PYTHON_INSTALL_DIR}/${PROJECT_NAME})
# install(PROGRAMS scripts/robot_controller scripts/sensor_processor DESTINATION …)
# ```
#
# ```python
# from ros2_robot_controller.robot_controller import main
# ```
#
# </details>

# %% [markdown]
# Now build.
# You always call `colcon` in the **workspace**, the folder that contains `src`, so go there first.

# %% tags=["nbval-ignore-output"]
# !cd ../.. && colcon build 2>&1 | cat
# How long it takes differs each time. (`| cat` removes colours and the terminal's title; the lines about progress stay.)

# %% [markdown]
# If something is wrong, read the *first* error: it often causes the others.

# %% [markdown] tags=["whole"]
# What did the build install?

# %% tags=["whole"]
INSTALL = Path("../../install/ros2_robot_controller").resolve()


def installed(pattern):
    """Return whether the build has installed a file with this path."""
    return any(INSTALL.glob(pattern))


tries(
    {
        "installed('share/ros2_robot_controller/package.xml')": True,
        "installed('lib/python3*/site-packages/ros2_robot_controller/robot_controller.py')": True,
        "installed('lib/python3*/site-packages/ros2_robot_controller/utils/running.py')": True,
        "installed('lib/ros2_robot_controller/robot_controller')": True,
        "installed('lib/ros2_robot_controller/sensor_processor')": True,
    }
)

# %% [markdown]
# What does the grader say?
# It builds a copy of your package, and looks for what `ros2 run` and `ros2 launch` would find.
# The first check on a machine also builds the contract's interfaces, once: that takes a minute, and some on a busy machine.
# One of I1's three points is for launch and config files; you write them in notebook 08.

# %% tags=["check"]
check("I1")

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The first row of the table above that is not right, and the line of `CMakeLists.txt` that installs it.
#
# </details>
#
# <details><summary>Hint 2: slashes and places</summary>
#
# `DIRECTORY ros2_robot_controller/` with a slash copies what is *in* the folder; without it you get the folder twice, one inside the other.
# `ros2 run` looks in `lib/ros2_robot_controller`, and nowhere else.
#
# </details>
#
# <details><summary>Hint 3: start from nothing</summary>
#
# `colcon` never removes anything, so an older build may hide what the present one does: `!cd ../.. && rm -r build install && colcon build`.
#
# </details>

# %% tags=["whole"]
# !ros2 pkg executables ros2_robot_controller

# %% [markdown]
# In a terminal you must first *source* a built workspace: `source install/setup.bash` adds it to the paths that ROS searches.
# Your notebook does that by itself after each build.
# In a new terminal of this kit, go to the kit's folder before that and type `source grader/ros2/setup.bash`.
#
# I1 asks only whether the two executables exist. You see only at the start whether a node can import its module.
# So start one: `ros2 run` lets it run until Ctrl-C; `timeout -s INT 3` presses Ctrl-C after three seconds, and `--preserve-status` passes on how the node ended.

# %% tags=["nbval-ignore-output"]
# !timeout --preserve-status -s INT 3 ros2 run ros2_robot_controller robot_controller; echo "exit status $?"
# What it says depends on whether your package has been built.

# %% [markdown] tags=["whole"]
# A node that does nothing prints nothing, and ends without an error: its exit status is 0.
#
# **Change one thing.** In `CMakeLists.txt` write `bin/${PROJECT_NAME}` instead of `lib/${PROJECT_NAME}`, and build again.
# The build succeeds, but what does `ros2 pkg executables` say?
# It still lists what an *earlier* build installed, because `colcon` never removes anything.
# Run `!cd ../.. && rm -r build install`, build again, and look once more.
#
# **And another.** Put `raise SystemExit('new')` at the top of `robot_controller.py`, and start the node again without building: it runs the *old* file, the installed one.
# `colcon build --symlink-install` makes links instead of copies, so that a changed Python file needs no new build.
#
# Take both changes back before you go on.
#
# ## The build that succeeds and does nothing
#
# Back to the trial package.
# You made it with the build type `ament_python`, the one for packages that hold only Python.
# Most tutorials begin with it, and our nodes are all written in Python.
# So why does our package not use it?
#
# Give it an interface: a service that takes a name and returns a greeting.

# %% tags=["nbval-ignore-output", "whole"]
(trial / "src/greeter/srv").mkdir()
(trial / "src/greeter/srv/Greet.srv").write_text("string name\n---\nstring greeting\n")
# !cd {trial} && colcon build 2>/dev/null | cat
# The number of seconds in what colcon prints differs each time.

# %% [markdown] tags=["whole"]
# One package finished.
# **Predict:** what does `from greeter.srv import Greet` do, as you would write it in a node?

# %% tags=["whole"]
# !cd {trial} && . install/setup.sh && python3 -c "from greeter.srv import Greet" 2>&1 | tail -1
# !cd {trial} && echo "files about Greet: $(find install -name '*Greet*' | wc -l)"

# %% [markdown] tags=["whole"]
# The build generated nothing, and no tool said so.
# ("1 package had stderr output" is about something else: setuptools warns there about the way `colcon` calls it, with or without a `srv/`.)
# **rosidl** makes Python (and C and C++) code from an interface, and rosidl is a set of *CMake* commands.
# The `ament_python` build only runs `setup.py`, which knows nothing of CMake.
# It does not even look into `srv/`.
#
# So there are two ways:
#
# - the interfaces are in a package of their own, of the type `ament_cmake`, and the nodes in another one, of the type `ament_python`. Many projects do that;
# - one package of the type `ament_cmake` holds both. That is ours: its CMake file generates the interfaces *and* installs the Python modules.
#
# Some packages have both a `CMakeLists.txt` and `<build_type>ament_python</build_type>`.
# That is a contradiction: `colcon` follows the tag and never opens the `CMakeLists.txt`.
#
# ## Ten seconds of driving
#
# Your node is empty, but it is a class, and another program can build on it.
# The next program is a file beside your package, and imports it as any program would. It takes *your* node, adds a publisher and a timer, and starts it with *your* `run`.
# You write such a node yourself from notebook 04 on; for now, read it.

# %% tags=["whole"]
# %%writefile ../../first_drive.py
"""Drive in a circle: the empty node of the package, with a publisher and a timer."""
import sys

from geometry_msgs.msg import Twist
from ros2_robot_controller.robot_controller import RobotController
from ros2_robot_controller.utils.running import run


class FirstDrive(RobotController):
    def __init__(self):
        super().__init__()
        self.speeds = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.1, self.say_speed)  # ten times a second

    def say_speed(self):
        speed = Twist()
        speed.linear.x, speed.angular.z = 0.3, 0.6  # m/s, rad/s
        self.speeds.publish(speed)


sys.exit(run(FirstDrive))

# %% [markdown] tags=["whole"]
# `run_node` builds your package and starts the program beside a simulated robot; `drive` lets ten simulated seconds pass.
# **Predict:** how large is the circle? (How long does a full turn take at 0.6 rad/s, and how far does the robot drive in that time?)

# %% tags=["whole"]
from sim import World
from sim.views import map_view

run = run_node(program="../../first_drive.py", world=World("an empty floor"))
recording = run.drive(10.0)
map_view(recording)

# %% [markdown] tags=["whole"]
# A full turn takes 2π / 0.6 = 10.5 s. In that time the robot drives 3.1 m, nearly a whole circle with a diameter of 1 m.
#
# **Change one thing:** let it drive in a figure of eight, or show it live with `run.live()` in place of the last two lines.

# %% tags=["whole"]
run.close()

# %% [markdown] tags=["whole"]
# > **On a real TurtleBot 4:** copy `src` to it, not `install`, because it has another processor; [docs/turtlebot4.md](../docs/turtlebot4.md) has the commands.
#
# ## Go further
#
# - `!cd ../.. && colcon graph` draws which package needs which. Try it with two packages in `src`.
# - `!ros2 pkg xml ros2_robot_controller` prints the installed passport. Where does it find it?
# - Look into `log/latest_build/` in the workspace: every build records there what it did and printed.

# %% tags=["whole"]
import shutil

shutil.rmtree(trial, ignore_errors=True)

# %% [markdown]
# ## Recall
#
# <details><summary>Your node imports <code>nav_msgs</code>. It runs on your machine and fails on the robot. What did you forget?</summary>
#
# `<exec_depend>nav_msgs</exec_depend>` (or `<depend>`) in `package.xml`: `rosdep` installs only what is named there.
#
# </details>
#
# <details><summary>You changed a Python file, and the node behaves as before. Why?</summary>
#
# It runs the installed copy. Build again, or build once with `--symlink-install`.
#
# </details>
#
# <details><summary>Why is this package <code>ament_cmake</code> although it holds only Python?</summary>
#
# Because it will hold interfaces, and only CMake runs the generator for them.
#
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Which single file makes a folder a package?</summary>
#
# `package.xml`.
#
# </details>
#
# <details><summary><code>ros2 run</code> says that there is no such executable, though the build succeeded. Where do you look?</summary>
#
# In `install/PACKAGE/lib/PACKAGE/`: is the script there, and is it executable? If not, the `install(PROGRAMS …)` line is missing or has another destination.
#
# </details>

# %% [markdown]
# **Next:** [02 Interfaces](02_interfaces.ipynb). You write four short files that define the messages of your nodes, and see what two swapped lines can do.

# %%
from grader.notebook import progress

progress()
