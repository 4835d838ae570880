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
# # 10 Show and hand in
#
# ![A simulated robot's drive through an office to three goals, and the hundred points of the assignment, one box for each requirement](pictures/10.png)
#
# Everything works, and your tests show it.
# But *other people* must be able to use your package, too.
# Think of a person who has five minutes and your README, and does not know the package.
# Today you write for that person, look at your work as an instructor does, and hand it in.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - write a demonstration that ends by itself, with an exit status that says whether it worked;
# - write a README whose commands run and whose table agrees with the graph;
# - find out what works only on your machine, before others do;
# - read a report as an instructor reads it, and decide what to fix first;
# - pack the package and know what is in it.
#
# **Time:** 40 to 85 minutes for the demonstration and its results (part 1), and 40 to 75 for the README, your report, the hand-in and a last drive (part 2).
#
# **Your package so far**, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/  config/  launch/  test/
#     ├── ros2_robot_controller/                   all modules
#     ├── scripts/
#     │   ├── robot_controller  sensor_processor
#     │   └── demo.py                              ← today, to your own design
#     ├── README.md  LICENSE                       ← today
#     └── test_results.xml                         ← today

# %%
from grader.notebook import begin, check, run_node, start_at

begin("10")
# %env PYTEST_DISABLE_PLUGIN_AUTOLOAD=1

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 09: all lines are covered, and a mutant survives. How can that be?</summary>
#
# The tests ran the line, but no assert looked at what it changed.
# </details>
# <details><summary>Notebook 08: <code>ros2 launch</code> starts your nodes with the old parameters. Which file does it read?</summary>
#
# The installed one, in the share folder. A change in `src/` takes effect after the next build.
# </details>
# <details><summary>Notebook 05: what is your node's last message when it is ended by Ctrl-C, and who sees to that?</summary>
#
# A zero on `cmd_vel`: `spin_until` calls `stop` while the context is still alive, because `run` has switched rclpy's own signal handler off.
# </details>

# %% [markdown] tags=["whole"]
# ## What a hundred points are made of
#
# The grader follows `rubric.yaml`, which is in the kit for everyone to read.
# Each point is either *core*, which you get by following the course, or *advanced*.
# **Predict:** which gives more points, a robot that works or everything else?
# How many of the hundred points are advanced?

# %% tags=["whole"]
import matplotlib.pyplot as plt

from grader.scoring.rubric import RUBRIC, load

rubric = load(RUBRIC)
for criterion in rubric.criteria:
    points = sum(requirement.points for requirement in criterion.requirements)
    advanced = sum(requirement.advanced for requirement in criterion.requirements)
    print(f"{criterion.title:18} {points:4g} points, {advanced:g} of them advanced")

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(9, 5.4), layout="constrained")
every = rubric.requirements[::-1]
core = [requirement.points - requirement.advanced for requirement in every]
axes.barh(range(len(every)), core, color="#0072b2", label="core")
axes.barh(range(len(every)), [r.advanced for r in every], left=core, color="#e69f00", label="advanced")
axes.set_yticks(range(len(every)), [f"{r.id:4} {r.title}" for r in every], fontsize=8)
axes.set_xlabel("points")
axes.legend();

# %% [markdown] tags=["whole"]
# You get forty for what the robot does, and sixty for a package that is usable, readable and tested.
# Nine of the hundred are advanced.
# On real robots, too, most work goes into usability, readability and tests.
#
# ## The demonstration
#
# A demonstration shows a stranger in half a minute what the package can do; requirement Q6 asks for one.
# It is a node, this time a client, so it can fail in a way that you know from notebook 06: **by waiting**.
#
# Here is a client for a service that no node offers.
# **Predict:** what would `call_async` do now, and how long would you wait for its future?

# %% tags=["whole"]
import rclpy
from std_srvs.srv import Trigger

if not rclpy.ok():
    rclpy.init()
node = rclpy.create_node("visitor", enable_rosout=False)
client = node.create_client(Trigger, "open_the_door")
future = client.call_async(Trigger.Request())
rclpy.spin_until_future_complete(node, future, timeout_sec=1.0)
print("after 1 s: done =", future.done())
print("is there anybody?", client.wait_for_service(timeout_sec=0.5))
node.destroy_node()

# %% [markdown] tags=["whole"]
# You get no error.
# The request reached no server, and without the time-out the script would wait for ever.
# Your audience would see nothing happen.
# So give each wait a time-out, and print a sentence that says what to do after it.
#
# Also let the **exit status** say how it went.
# 0 means success, and any other number means failure; a shell, a launch file, a CI job and the grader (Q6) all read that number first.

# %% tags=["whole"]
import subprocess

for code in ("print('all shown')", "raise SystemExit('No node offers set_speed.')"):
    ended = subprocess.run(["python3", "-c", code], capture_output=True, text=True)
    print(ended.returncode, "|", (ended.stdout + ended.stderr).strip())

# %% [markdown] tags=["whole"]
# ### A demonstration of your own design
#
# There is no skeleton this time.
# Your demonstration must follow these rules:
#
# - the file is `scripts/demo.py`; a stranger starts it with `python3 scripts/demo.py` while the nodes run;
# - it sets a speed, asks for one that is refused, sets 0 again, and shows each answer;
# - it asks for the status, and sends a goal half a metre ahead of the robot, in the direction in which it faces; it prints the feedback;
# - if the goal takes longer than 20 s, it cancels it: the client that sends a goal is responsible for it until it has ended;
# - if something does not answer, it prints a sentence that says what to do, and ends with the exit status 1; if everything answers, with 0;
# - it ends by itself, well within a minute.
#
# You need about 80 lines, and you have seen all of their parts before: a node in 05, clients in 06, an action's client in 07, a heading in 03.
# Write it in this order, and run the cells below after each step: a node that only ends with 0; one service; all of them; the goal; the cancel.
# There is no third hint. The runs below and `check("Q6")` accept any design; after them come two designs to compare.

# %% tags=["exercise", "design", "whole"]
# %%writefile scripts/demo.py
#!/usr/bin/env python3
"""Show what robot_controller can do."""

raise SystemExit('Not written yet.')

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# The client of the service that no node offers, above, has all the calls for a service.
# `rclpy.spin_until_future_complete(node, future, timeout_sec=...)` returns when the future is done, and also when the time is over; only `future.done()` says which of the two it was.
# You need this at least five times: write a function that returns the result or raises an exception of your own, and catch that exception in one place.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# - Half a metre ahead: x + 0.5 · cos(yaw), y + 0.5 · sin(yaw), with `yaw_from_quaternion` of your `utils/conversions.py` and the pose of the status.
# - `ActionClient(node, NavigateToPosition, 'navigate_to_position')` has `wait_for_server(timeout_sec=...)` and `send_goal_async(goal, callback)`; that future's result is a handle.
# - The handle has `accepted`, `get_result_async()` and `cancel_goal_async()`, which are futures too. A result has a `status`; `GoalStatus` of `action_msgs.msg` has their names.
# </details>
#
# The script talks to your built package, so build it, as a stranger would.

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: colcon says how long it took.
# !cd ../.. && colcon build --packages-select ros2_robot_controller 2>&1 | cat

# %% [markdown] tags=["whole"]
# First run it without any node: it must say so, and end with 1.

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: every script has words of its own.
# !python3 scripts/demo.py; echo "exit status: $?"

# %% [markdown] tags=["whole"]
# Now run it with your node.
# You see the robot drive in the simulator; the script runs in a separate process.
# You should see three answers about the speed, one about the status, and half a metre of driving.

# %% tags=["whole"]
import os

import sim

os.environ["RCUTILS_CONSOLE_OUTPUT_FORMAT"] = "[{severity}] {message}"  # without times


def perform(world):
    """Run the demonstration beside your node in this world, and return the drive."""
    with run_node(world=world) as run:
        live = run.live().start()
        display(live)
        # !python3 scripts/demo.py; echo "exit status: $?"
        live.pause()
        return run.recording

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: the demonstration runs in real time.
perform(sim.World("an empty floor"));

# %% [markdown] tags=["whole"]
# Now a box stands 0.6 m in front of the robot.
# Your node stops, as it should, and waits until the way is free.
#
# **Predict:** what does the demonstration do?

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: the demonstration runs in real time.
perform(sim.World("a chair in the way", obstacles=(sim.Box(center=(0.7, 0.0), size=(0.2, 0.6)),)));

# %% [markdown] tags=["whole"]
# You should see the cancel and an exit status of 0: everything answered, and the robot has no goal left.
#
# <details><summary>Two designs, once yours works</summary>
#
# **A node with one function for waiting.** The course's design: only `wait_for` and `finish` spin, and a missing answer always raises the same exception.
#
# ```python
# def wait_for(self, future, what):
#     rclpy.spin_until_future_complete(self, future, timeout_sec=ANSWER_S)
#     if not future.done():
#         raise NoAnswer(f'{what} gave no answer within {ANSWER_S:g} s. Is the node busy?')
#     return future.result()
#
# def finish(self, handle):
#     result = handle.get_result_async()
#     rclpy.spin_until_future_complete(self, result, timeout_sec=DRIVE_S)
#     if not result.done():
#         self.wait_for(handle.cancel_goal_async(), 'The cancel request')
#     return self.wait_for(result, 'The result').status
# ```
#
# **A script that awaits.** The whole story is one coroutine, which an executor runs. A timer cancels a goal that takes too long.
#
# ```python
# async def show(node, goals):
#     handle = await goals.send_goal_async(goal_ahead(await status(node)), print_feedback)
#     late = node.create_timer(DRIVE_S, handle.cancel_goal_async)
#     result = await handle.get_result_async()
#     node.destroy_timer(late)
#     return result.status
#
# task = executor.create_task(show(node, goals))
# executor.spin_until_future_complete(task, timeout_sec=WHOLE_S)
# ```
#
# The second one reads like a story. But one time-out covers everything, so it cannot say *what* did not answer, and the timer fires again every `DRIVE_S`.
# The first one names each step, which helps in a script that people read to learn what happens.
# </details>

# %% [markdown]
# ### Test results
#
# `test_results.xml` records the results of your tests when *you* ran them, in a format that every build server reads.
# A command writes it; run that command after your last change.

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=no --no-summary --junit-xml=test_results.xml test | cat

# %% tags=["nbval-ignore-output"]
# Not compared: everybody has another number of tests.
import xml.etree.ElementTree as ET

suite = ET.parse("test_results.xml").getroot()[0]
print({name: suite.get(name) for name in ("tests", "failures", "errors", "skipped")})

# %% [markdown]
# The grader compares the package's tests with that file. If one is missing there, it was written after the run, or you have never run it.

# %% [markdown] tags=["whole"]
# (On the published page this run also has the six files from notebook 09's *Go further*. Without them there are about a hundred tests.)
#
# This is the end of part 1, and a good place for a break.
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.

# %% [markdown]
# ## A README that is true
#
# A README is the only part of your package that everyone reads.
# It answers five questions, in this order: what is it, how do I build it, how do I run it, how do I test it, what does it connect to?
# The last answer is a table of topics, services and actions. It is the first part of the documentation to become wrong, because people rename a topic and forget the table.
#
# So do not write it from memory.

# %% [markdown] tags=["whole"]
# `ros2 node info` prints what a running node really has.
# Here is its output for a node that this cell makes.
# **Predict:** which of the lines are not from this cell?

# %% tags=["whole"]
import rclpy
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger

if not rclpy.ok():
    rclpy.init()
node = rclpy.create_node("mower", enable_rosout=False)
node.create_publisher(Twist, "cmd_vel", 10)
node.create_subscription(LaserScan, "scan", print, 10)
node.create_service(Trigger, "come_home", print)
# !ros2 node info /mower
node.destroy_node()

# %% [markdown] tags=["whole"]
# Seven services come with every node, six of them for its parameters, and so does the topic `parameter_events`; leave these out of a README.
# The other lines are your table: name, type, direction.

# %% [markdown]
# So let the graph write it.
# The next cells start your two nodes, read from the graph what each has, and print the rows.

# %%
import rclpy
from rclpy.action import get_action_server_names_and_types_by_node as actions_of

if not rclpy.ok():
    rclpy.init()
OF_EVERY_NODE = ("/parameter_events", "/rosout", "/clock")


def rows(visitor, name):
    """Yield the README's rows of a running node, as the graph knows it."""
    kinds = {
        "subscribes": visitor.get_subscriber_names_and_types_by_node(name, "/"),
        "publishes": visitor.get_publisher_names_and_types_by_node(name, "/"),
        "service": visitor.get_service_names_and_types_by_node(name, "/"),
        "action": actions_of(visitor, name, "/"),
    }
    for kind, found in kinds.items():
        for path, types in found:
            if path not in OF_EVERY_NODE and "/_action/" not in path and not path.startswith(f"/{name}/"):
                yield f"| `{name}` | {kind} | `{path[1:]}` | `{types[0]}` |"

# %%
import time


def print_rows(visitor, name):
    """Print a node's rows as soon as the graph gives the same ones twice: it learns of a node bit by bit."""
    found = []
    for _ in range(20 if visitor.wait_for_node(f"/{name}", 10.0) else 0):
        before, found = found, list(rows(visitor, name))
        if found and found == before:
            break
        time.sleep(0.5)
    print("\n".join(found))

# %%
visitor = rclpy.create_node("visitor", enable_rosout=False)
print("| node | kind | name | type |\n|---|---|---|---|")
for name in ("robot_controller", "sensor_processor"):
    with run_node(name) as run:
        if not run.trouble:
            print_rows(visitor, name)
visitor.destroy_node()

# %% [markdown]
# Q5 reads your table in any reasonable form and compares it with the running nodes.
# A row for something that does not exist also counts as wrong.
#
# Now write the README.
# Write its commands for a new terminal with ROS sourced, and a workspace with your package in `src/`.
# It must have three commands: `colcon build`, then `ros2 launch` with your launch file, then `pytest` or `colcon test`.
# Markdown shows a line that begins with four spaces as code.

# %% tags=["exercise"]
# %%writefile README.md
# ros2_robot_controller

TODO 1: what it does, in three sentences for somebody who meets it today. What does it *not* do?

## Build, run, test

TODO 2: the commands, to copy and paste.

## Interfaces

TODO 3: the rows that the graph has written.

| node | kind | name | type |
|---|---|---|---|

## Decisions

TODO 4 (if you like): what you decided where the contract leaves it open, and why.

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# For what the package does, see the class docstrings of your two nodes.
# You have run all the commands before, in notebooks 01, 08 and 09.
# Copy the rows that the cell above has printed, and compare them with the contract's table in the handout.
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# `colcon build --packages-select ros2_robot_controller`, then `source install/setup.bash`, in the workspace.
# `ros2 launch ros2_robot_controller` and the name of a launch file.
# `python -m pytest test`, in the package's folder.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```markdown
# | node | kind | name | type |
# |---|---|---|---|
# | `robot_controller` | subscribes | `scan` | `sensor_msgs/msg/LaserScan` |
# | `robot_controller` | service | `set_speed` | `ros2_robot_controller/srv/SetSpeed` |
# ...                       # and nine more
# ```
# </details>

# %% [markdown] tags=["whole"]
# Try each command in a new terminal, one after the other.
# In each new terminal of this kit, first type `source grader/ros2/setup.bash` in the kit's folder: it says where ROS is.

# %% [markdown]
# Your `package.xml` names a licence; put the licence's text beside it.
# The next cell copies the full text of the Apache License 2.0; open it in the editor if you have never read one.

# %%
import shutil

from grader import KIT

shutil.copy(KIT / "LICENSE", "LICENSE");

# %% [markdown] tags=["whole"]
# ## It works on my machine
#
# This may be the most expensive sentence in software.
# Two lines are enough for it: a script that reads its settings.

# %% tags=["whole"]
# %%writefile ../../settings_reader.py
import pathlib

print(pathlib.Path("limits.yaml").read_text().strip())

# %% [markdown] tags=["whole"]
# It works in the folder in which you wrote it.
# **Predict:** what will it do when it is started from another folder?

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: Python words its tracebacks otherwise in other versions.
# !cd ../.. && echo "max_linear_speed: 0.5" > limits.yaml
# !cd ../.. && python3 settings_reader.py
# !cd ../../src && python3 ../settings_reader.py 2>&1 | tail -n 1

# %% [markdown] tags=["whole"]
# The path should mean "beside this script", but it means "in the current folder".
# Ask for the place instead of assuming it, with `Path(__file__).parent` in a script, `get_package_share_directory` for installed files, and `FindPackageShare` in a launch file.
#
# These are the usual ways in which a package works only at home:
#
# | it works at home because | elsewhere | how you notice it here |
# |---|---|---|
# | you are in the right folder | no such file | run it from `/` |
# | the file lies in `src/` | it was never installed | I1: look into `install/` |
# | you once installed a package by hand | `ModuleNotFoundError` | I2: every import is in `package.xml` |
# | an old `build/` still holds it | it is gone | delete `build/ install/ log/`, build again |
# | a path begins with your home folder | it is not there | search for it: `grep -rn "/home/" .` |
# | your computer is fast and quiet | some tests are flaky | control the clock in the test, as in notebook 09 |
#
# The grader builds only what you hand in, in an empty sandbox without a network, a home folder or an old build.
# You have used that sandbox before: each `check` ran in it.
#
# ### A fresh machine for each push
#
# Teams do the same with a **CI job** (continuous integration), which builds and tests each commit on a fresh machine.
# For that, the package must be in a Git repository. Type once, in `ws/src/ros2_robot_controller`:
#
#     git init
#     printf '%s\n' __pycache__/ '*.pyc' .pytest_cache/ > .gitignore
#     git add . && git commit -m "The package as handed in"
#
# `build/`, `install/` and `log/` are two folders higher, so they are not part of it. Do not commit files that a command can make again.
# On GitHub, the job is a file `.github/workflows/test.yaml` (this kit does not run it; other hosts have the same steps under other names):
#
# ```yaml
# on: [push, pull_request]
# jobs:
#   test:
#     runs-on: ubuntu-24.04
#     container: ros:jazzy                          # an image with ROS 2 from apt
#     steps:
#       - uses: actions/checkout@v4
#         with: {path: src/ros2_robot_controller}   # a workspace, as in this course
#       - run: apt-get update && rosdep update && rosdep install -y --from-paths src
#       - run: . /opt/ros/jazzy/setup.sh && colcon build
#       - run: . install/setup.sh && colcon test
#       - run: colcon test-result --verbose         # ends with 1 if a test has failed
# ```
#
# **Which line makes the job fail if a test fails, and why do two steps begin by sourcing a `setup.sh`?**
# The last one: `colcon test` ends with 0 as long as it could run the tests.
# Each `run` is a new shell, without what the one before it has sourced.
#
# <details><summary>You import <code>irobot_create_msgs</code> and have forgotten it in <code>package.xml</code>. At home everything works. What fails in this job, and why only here?</summary>
#
# The tests, with `ModuleNotFoundError`: `rosdep install` installs what `package.xml` names, and the image has little else. The build passes, because CMake does not look for packages that only Python imports. So the job has found what I2 asks for.
# </details>
# <details><summary>The job fails once in ten pushes, without a change. What do you do, and what do you not do?</summary>
#
# One of the tests is flaky (notebook 09): find out what it waits for, and control the clock in the test. Do not just run the job again until it passes, or you will also do so when the failure is real.
# </details>
#
# ## Read it like an instructor
#
# Now look at your package like an instructor who has thirty of them to grade.
# You know Q3 (everything in its place) from notebook 01; it is checked once more. Q5 and Q6 are new.
#
# Tools can measure two parts of Q3.
# The **cyclomatic complexity** of a function is the number of its decisions (`if`, `for`, `while`, `except`, ...) plus one.
# A function of complexity 4 needs at most four tests to take each of its branches once.
# `flake8` measures it, with its plug-in mccabe. The contract's limit is 10; which of your functions lie above 3?

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: your own functions may be others.
# !python3 -m flake8 --isolated --select C901 --max-complexity 3 ros2_robot_controller

# %% [markdown] tags=["whole"]
# The other part is duplication: no block of six lines may occur twice. Indentation and comments do not count.
# The check below looks for such blocks; outside this course, `pylint --disable=all --enable=duplicate-code` does.
#
# <details><summary>Which of the two improves if you split a long function in two?</summary>
#
# The complexity. Duplication goes away if a function is *called* twice instead of written twice.
# </details>

# %% tags=["check"]
check("Q3", "Q5", "Q6")

# %% [markdown] tags=["whole"]
# Where you lose points, a report has three lines. They answer an instructor's three questions.
#
# - **seen**: what happened? It states an observation, with a number or a line, and never just "wrong".
# - **expected**: by which rule? It quotes the contract, so the loss is not a matter of taste.
# - **try**: what would I tell the student? It gives a direction, not the solution.
#
# If you lose points in several places, look for the *first cause*.
# "Not reached, because the package does not build" nine times is one fault, not nine.
# So fix the build first (I1), then what keeps a node from starting, then what the robot does, and then the rest by points.
# In which order would you fix these?

# %% tags=["whole"]
lost = {"Q2": "2 of 5", "F8": "0 of 6", "I3": "2 of 4", "F9": "0 of 2", "F10": "0 of 2", "T2": "4.1 of 5"}
for name in lost:
    requirement = rubric.requirement(name)
    print(f"{name:4} {lost[name]:>9}   {requirement.title}")

# %% [markdown] tags=["whole"]
# I3 first: if the action has a wrong type, no client can send a goal, and F8, F9 and F10 fail only because of that.
# Twelve points depend on one wrong field in one file.
#
# One command makes the full report. Type it in a terminal, in the kit's folder; it takes a few minutes:
#
#     source grader/ros2/setup.bash
#     grader grade ws/src/ros2_robot_controller --out out/mine
#
# `out/mine/report.html` is what your instructor will see, with a picture of each trial.
# A seed decides the speeds, places and obstacles, and your instructor uses another seed.
# A package that works only in the public trials loses points there; use `--seed 7` to find out whether yours does.

# %% [markdown]
# ## Hand in
#
# `grader submit` packs the package: sources, tests, README, results, without `build/`, caches and hidden files.
# Then it opens the archive as the grader will, and lists what it finds.
# It names the files that the course has laid out, by `start_at` or in your lane: they do not count as your own work.
#
# With `--no-check` it does only that.
# Without it, it also runs all public checks on the archive, which takes a few minutes; do that in a terminal.

# %% tags=["nbval-ignore-output"]
# Not compared: sizes are those of one's own files.
# !grader submit --no-check

# %% [markdown] tags=["whole"]
# Before you hand it in, do three more things:
#
# - Unpack the archive in an empty folder and look: is everything there, and nothing that should not be seen, such as a password or another person's name?
# - Follow your own README there, word for word, in a new terminal. Your nodes need a robot: the cell with `Bridge` in `docs/ros2-session.md` starts one.
# - Make `test_results.xml` again if you have changed anything since.
#
# > **On a real TurtleBot 4:** before the demonstration, check where it points; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.
#
# ## Go further
#
# - Press Ctrl-C while the demonstration waits for its goal: the robot drives on without it. Let the script cancel the goal first.
# - Put `grader check` into a CI job of your own repository, so that each push is checked.
# - Write the README's interface table by a script, from the running graph. Then it cannot become wrong.
# - Give the package to a person who was not in the course. Say nothing, and watch where they get stuck.

# %% [markdown]
# ## Recall
#
# <details><summary>A package builds in your workspace and nowhere else. What do you try first?</summary>
#
# Delete `build/`, `install/` and `log/`, and build again from what you would hand in.
# Then look for undeclared dependencies and for paths that exist only on your machine.
# </details>
#
# <details><summary>A report says "not reached" for F8, F9 and F10. How many faults are that?</summary>
#
# Probably one, in something that all three need.
# The report says why they were not reached.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Why does each wait in a demonstration need a time-out?</summary>
#
# A request to a service that no node offers is not an error.
# The future is never done, and the script waits without a message.
# </details>
#
# <details><summary>How does a build server know that your demonstration went well?</summary>
#
# By its exit status, which is 0.
# The printed text is for people.
# </details>

# %% [markdown] tags=["whole"]
# ## The tour, driven by your node
#
# In notebook 00 a program of the kit drove a robot through an office to three stars.
# Now your node drives it.
#
# Your `navigator.py` drives straight to a goal and has no map, so another program has to find the way around the walls.
# `plan` is the planner of that tour: it returns the corners of a way that stays 0.4 m away from everything.

# %% tags=["whole"]
from sim.film import Film
from sim.tourist import plan

office = sim.load_world("office")
here, corners = (office.start.x, office.start.y), []
for star in office.goals:
    corners += plan(office, here, (star.x, star.y), clearance=0.4)
    here = (star.x, star.y)
print(*(f"({x:.1f}, {y:.1f})" for x, y in corners))

# %% [markdown] tags=["whole"]
# Each corner becomes a goal for your node.
#
# **Predict:** the doors are 0.9 m wide. Why does the next cell lower the threshold, which is 0.5 m otherwise?

# %% tags=["whole"]
with run_node(world=office, parameters={"obstacle_detection_threshold": 0.35}) as run:
    for x, y in corners:
        goal = run.go_to(x, y)
        if goal.status != "succeeded":
            print(f"on the way to ({x:.1f}, {y:.1f}): {goal.status}")
            break
    recording = run.recording
print(f"{recording.distance:.1f} m in {recording.duration:.0f} s, {len(recording.contacts)} contacts")
Film(recording)

# %% [markdown] tags=["whole"]
# In the middle of a door, each side is 0.45 m away.
# "Ahead" is 60 degrees to each side (notebook 05), and 0.45 m / sin 60° = 0.52 m, only 2 cm above the contract's threshold.
# So with 0.5 m, a robot that is 2 cm off the middle stops for ever at an open door. It may not even get there, because the planner keeps only 0.4 m away from the walls.
# Thanks to notebook 08, you change one parameter and no code.
#
# The planner knows the map but does not see a chair; your node sees the chair but does not know the map.
# **Change one thing:** leave out `parameters`, or put a box into the first door with `run.simulator.add_obstacle(sim.Box((1.6, 1.5), (0.3, 0.3)))` before the loop. Where does the robot stop, and does it touch anything?

# %% [markdown]
# ## What you can do now
#
# That was the last notebook with points; [11](11_clinic.ipynb) is a clinic of broken packages, [12](12_frames.ipynb) is about frames.
# Tick off what you could do tomorrow without looking it up:
#
# - [ ] make a package that builds anywhere, with interfaces of its own (01, 02)
# - [ ] read a heading, a scan and a stamp, and find what is wrong with each (03, 04)
# - [ ] write a node that stops in time, and say why it does (05)
# - [ ] offer a service that refuses in words, and an action that can be cancelled (06, 07)
# - [ ] start two robots with one command, each with its own settings (08)
# - [ ] show that a test would notice a mistake, by making one (09)
# - [ ] hand over a package that others can use from its README (10)
#
# If you are not sure about a box, open that notebook again: each begins and ends with questions.

# %% [markdown] tags=["whole"]
# **Five next steps**, from an evening to a term:
#
# - **Surprise your robot.** A world is a file of a few lines ([docs/simulator.md](../docs/simulator.md); `sim/worlds` has the examples). Make one that no trial has, a narrow door, a pole, a cart that cuts in, and drive your node through it with `run_node(world=...)`. An evening.
# - **Hunt mutants.** Draw the matrix of notebook 09 for every file of your package, until no test could notice the rows that are left. Then swap packages with another learner: each puts three small mistakes into the other's code, and sees how many of them the tests find. A day.
# - **Let it patrol, and dock.** In the capstone the robot drives from place to place, finds another way when a corridor is closed, and reaches its dock before the battery is empty. It has no skeleton and no hints, but a league; ask your lecturer for it. A week or two.
# - **Drive a real one.** Start your package on it with the launch file of [docs/turtlebot4.md](../docs/turtlebot4.md), which lists what differs: topic names, a `TwistStamped`, a lidar that is turned by 90 degrees (notebook 12 is about that, and about tf2).
# - **Let Nav2 drive.** With a map and a planner it does what your `navigator.py` does along a straight line. Its action has the same four parts as yours, and its controllers the same questions as your `_control`.

# %%
from grader.notebook import progress

progress()
