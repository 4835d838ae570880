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
# ![A robot on its way through three offices, and the hundred points of the assignment, requirement by requirement](pictures/10.png)
#
# Everything works, and the tests prove it.
# What is missing is the other half of every piece of software: that somebody *else* can use it.
# Somebody who has five minutes, your README and no idea what you meant.
# Today you write for that person, look at your own work through the eyes of the one who grades it, and hand it in.
#
# **You will be able to**
#
# - write a demonstration that ends by itself, and says in its exit status whether it worked;
# - write a README whose commands run and whose table agrees with the graph;
# - find out what works only on your machine, before somebody else does;
# - read a report as an instructor reads it, and decide what to mend first;
# - pack the package and know what is in it.
#
# **Time:** about 45 minutes.
#
# **Your package so far**, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/  config/  launch/  test/
#     ├── ros2_robot_controller/                   all modules
#     ├── scripts/
#     │   ├── robot_controller  sensor_processor
#     │   └── demo.py                              ← today
#     ├── README.md  LICENSE                       ← today
#     └── test_results.xml                         ← today

# %%
from grader.notebook import begin, check, run_node, start_at

begin("10")
# !mkdir -p scripts
# %env PYTEST_DISABLE_PLUGIN_AUTOLOAD=1

# %% [markdown]
# ## What a hundred points are made of
#
# `rubric.yaml` lies in the kit, in plain sight: it is what the grader goes by.
# Each point is either *core*, what one gets by following the course, or *advanced*.
# **Guess first:** what weighs more, that the robot works, or all the rest together?
# And how many of the hundred are advanced?

# %%
import matplotlib.pyplot as plt

from grader.scoring.rubric import RUBRIC, load

rubric = load(RUBRIC)
for criterion in rubric.criteria:
    points = sum(requirement.points for requirement in criterion.requirements)
    advanced = sum(requirement.advanced for requirement in criterion.requirements)
    print(f"{criterion.title:18} {points:4g} points, {advanced:g} of them advanced")

# %%
figure, axes = plt.subplots(figsize=(9, 5.4), layout="constrained")
every = rubric.requirements[::-1]
core = [requirement.points - requirement.advanced for requirement in every]
axes.barh(range(len(every)), core, color="#0072b2", label="core")
axes.barh(range(len(every)), [r.advanced for r in every], left=core, color="#e69f00", label="advanced")
axes.set_yticks(range(len(every)), [f"{r.id:4} {r.title}" for r in every], fontsize=8)
axes.set_xlabel("points")
axes.legend();

# %% [markdown]
# Forty for what the robot does.
# Sixty for what makes it usable, readable and trustworthy: that is about how the time is spent on real robots, too.
#
# ## The demonstration
#
# A demonstration shows a stranger in half a minute what the package can do.
# It is a node like any other, a client this time, so it can fail in a way you have not met yet: **by waiting**.
#
# Here is a client for a service that nobody offers.
# **What would `call_async` do now, and how long would you wait for its future?**

# %%
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

# %% [markdown]
# Nothing complains.
# The request was sent to nobody, and without the time-out the script would stand there for ever.
# A demonstration that hangs in front of an audience is a long silence.
# So each wait gets a time-out, and each time-out a sentence that says what to do.
#
# The second habit: say with the **exit status** how it went.
# 0 means well, anything else means not; a shell, a launch file, a CI job and the grader (Q6) all read that number first.

# %%
import subprocess

for code in ("print('all shown')", "raise SystemExit('No node offers set_speed.')"):
    ended = subprocess.run(["python3", "-c", code], capture_output=True, text=True)
    print(ended.returncode, "|", (ended.stdout + ended.stderr).strip())

# %% [markdown]
# Write `scripts/demo.py`.
# It runs beside the running nodes, uses a service and the action, and ends by itself, well within a minute:
#
# 1. set a speed, ask for one that is refused, set 0 again;
# 2. ask for the status;
# 3. send a goal half a metre ahead of where the robot is, tell its feedback, wait for the result;
# 4. cancel the goal if that takes longer than 20 s: on a stranger's floor there may be a chair.

# %% tags=["exercise"]
# %%writefile scripts/demo.py
#!/usr/bin/env python3
"""Show what robot_controller can do: set the speed, be refused, read the status, go somewhere."""

import sys

import rclpy
from rclpy.node import Node


class Demo(Node):
    """A client of everything that robot_controller offers."""

    def __init__(self) -> None:
        super().__init__('demo')
        # TODO 1: clients for set_speed and get_status, an ActionClient for navigate_to_position.

    def show(self) -> bool:
        """Go through the demonstration; return whether everything answered."""
        # TODO 2: the four steps. Each wait has a time-out, and words for when it is over.
        self.get_logger().warning('There is nothing to show yet.')
        return False


def main() -> int:
    """Run the demonstration; return 0 if everything answered."""
    rclpy.init()
    demo = Demo()
    try:
        return 0 if demo.show() else 1
    finally:
        demo.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    sys.exit(main())

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# Notebook 06 called the services from the shell and 07 sent goals; the names and types are the same.
# `CMakeLists.txt` installs `scripts/demo.py` beside the other two, so `ros2 run ros2_robot_controller demo.py` finds it.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `client.wait_for_service(timeout_sec=10.0)` and `action_client.wait_for_server(timeout_sec=10.0)` return whether somebody is there.
# `rclpy.spin_until_future_complete(self, future, timeout_sec=10.0)`, then `future.done()`, then `future.result()`.
# `send_goal_async(goal, feedback_callback)` gives a handle; `handle.accepted`, `handle.get_result_async()`, `handle.cancel_goal_async()`.
# Half a metre ahead: `x + 0.5 * cos(yaw)`, with the pose from `get_status` and `yaw_from_quaternion`.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def call(self, client, request):
#     if not client.wait_for_service(timeout_sec=ANSWER_S):
#         raise NoAnswer(f'No node offers {client.srv_name}. Start robot_controller first.')
#     future = client.call_async(request)
#     rclpy.spin_until_future_complete(self, future, timeout_sec=ANSWER_S)
#     if not future.done():
#         raise NoAnswer(f'{client.srv_name} gave no answer within {ANSWER_S:g} s.')
#     return ...
# ```
# </details>
#
# Build, as a stranger would, and show it: your node drives in the simulator, the demonstration talks to it from a process of its own.

# %% tags=["nbval-ignore-output"]
# Not compared: colcon says how long it took.
# !cd ../.. && colcon build --packages-select ros2_robot_controller

# %% tags=["nbval-ignore-output"]
# Not compared: how the drive goes depends on the machine, for this once time is real.
import os

os.environ["RCUTILS_CONSOLE_OUTPUT_FORMAT"] = "[{severity}] {message}"  # without times
with run_node(world="open_field") as run:
    live = run.live().start()
    # !python3 scripts/demo.py; echo "exit status: $?"
    live.pause()
    recording = run.recording

# %%
from sim.views import map_view

map_view(recording, title="the demonstration")

# %% [markdown]
# ### Test results
#
# `test_results.xml` tells what your tests said when *you* ran them, in a form that every build server reads.
# Nobody writes it by hand; a command makes it, after the last change.

# %% tags=["nbval-ignore-output"]
# Not compared: pytest says how long it took.
# !python3 -m pytest -q --tb=no --junit-xml=test_results.xml test

# %% tags=["nbval-ignore-output"]
# Not compared: everybody has another number of tests.
import xml.etree.ElementTree as ET

suite = ET.parse("test_results.xml").getroot()[0]
print({name: suite.get(name) for name in ("tests", "failures", "errors", "skipped")})

# %% [markdown]
# A test that is in the package and not in that file was written after the run, or never run at all: the grader compares the two.
#
# ## A README that is true
#
# A README is the only part of your package that everybody reads.
# It answers five questions, in this order: what is it, how do I build it, how do I run it, how do I test it, what does it connect to?
# The last one is a table of topics, services and actions, and of all documentation it is the first to become wrong: somebody renames a topic, and nobody thinks of the table.
#
# So do not write it from memory.
# The graph knows.
#
#     ros2 node info /robot_controller
#
# prints what the running node really has, and so does `get_topic_names_and_types` in Python.
# Here for a node that is made on the spot.
# **Which lines are not from this cell?**

# %%
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan

node = rclpy.create_node("mower", enable_rosout=False)
node.create_publisher(Twist, "cmd_vel", 10)
node.create_subscription(LaserScan, "scan", print, 10)
node.create_service(Trigger, "come_home", print)
# !ros2 node info /mower
node.destroy_node()

# %% [markdown]
# Seven services come with every node, six of them for its parameters, and `parameter_events` beside them; leave these out of a README.
# What is left is the table: name, type, direction.
#
# Q5 reads your table in any reasonable form and compares it with the running nodes.
# A row for something that is not there counts as wrong, too.

# %% tags=["exercise"]
# %%writefile README.md
# ros2_robot_controller

TODO 1: what it does, in three sentences for somebody who meets it today. What does it *not* do?

## Build, run, test

TODO 2: the commands, to copy and paste. Try each one in a new terminal.

## Interfaces

TODO 3: every subscription, publisher, service and action of both nodes.

| node | kind | name | type |
|---|---|---|---|

TODO 4: the parameters, with defaults and units.

## Decisions

TODO 5: what you decided where the contract leaves it open, and why.

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# The class docstrings of your two nodes hold the table already, in other words.
# The contract's table in the handout has the same rows; check them against *your* graph.
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# One row for each: `subscribes`, `publishes`, `service` or `action`, the name without a leading `/`, the type in full, such as `sensor_msgs/msg/LaserScan`.
# The commands that Q5 looks for are `colcon build`, `ros2 launch` or `ros2 run`, and `pytest` or `colcon test`.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```markdown
# | node | kind | name | type |
# |---|---|---|---|
# | `robot_controller` | subscribes | `scan` | `sensor_msgs/msg/LaserScan` |
# | `robot_controller` | service | `set_speed` | `ros2_robot_controller/srv/SetSpeed` |
# ...                       and nine more
# ```
# </details>
#
# Your `package.xml` names a licence; its text belongs beside it.
# This is the Apache License 2.0, word for word; nothing to learn here, run it and scroll on.

# %% tags=["given"]
# %%writefile LICENSE

                                 Apache License
                           Version 2.0, January 2004
                        http://www.apache.org/licenses/

   TERMS AND CONDITIONS FOR USE, REPRODUCTION, AND DISTRIBUTION

   1. Definitions.

      "License" shall mean the terms and conditions for use, reproduction,
      and distribution as defined by Sections 1 through 9 of this document.

      "Licensor" shall mean the copyright owner or entity authorized by
      the copyright owner that is granting the License.

      "Legal Entity" shall mean the union of the acting entity and all
      other entities that control, are controlled by, or are under common
      control with that entity. For the purposes of this definition,
      "control" means (i) the power, direct or indirect, to cause the
      direction or management of such entity, whether by contract or
      otherwise, or (ii) ownership of fifty percent (50%) or more of the
      outstanding shares, or (iii) beneficial ownership of such entity.

      "You" (or "Your") shall mean an individual or Legal Entity
      exercising permissions granted by this License.

      "Source" form shall mean the preferred form for making modifications,
      including but not limited to software source code, documentation
      source, and configuration files.

      "Object" form shall mean any form resulting from mechanical
      transformation or translation of a Source form, including but
      not limited to compiled object code, generated documentation,
      and conversions to other media types.

      "Work" shall mean the work of authorship, whether in Source or
      Object form, made available under the License, as indicated by a
      copyright notice that is included in or attached to the work
      (an example is provided in the Appendix below).

      "Derivative Works" shall mean any work, whether in Source or Object
      form, that is based on (or derived from) the Work and for which the
      editorial revisions, annotations, elaborations, or other modifications
      represent, as a whole, an original work of authorship. For the purposes
      of this License, Derivative Works shall not include works that remain
      separable from, or merely link (or bind by name) to the interfaces of,
      the Work and Derivative Works thereof.

      "Contribution" shall mean any work of authorship, including
      the original version of the Work and any modifications or additions
      to that Work or Derivative Works thereof, that is intentionally
      submitted to Licensor for inclusion in the Work by the copyright owner
      or by an individual or Legal Entity authorized to submit on behalf of
      the copyright owner. For the purposes of this definition, "submitted"
      means any form of electronic, verbal, or written communication sent
      to the Licensor or its representatives, including but not limited to
      communication on electronic mailing lists, source code control systems,
      and issue tracking systems that are managed by, or on behalf of, the
      Licensor for the purpose of discussing and improving the Work, but
      excluding communication that is conspicuously marked or otherwise
      designated in writing by the copyright owner as "Not a Contribution."

      "Contributor" shall mean Licensor and any individual or Legal Entity
      on behalf of whom a Contribution has been received by Licensor and
      subsequently incorporated within the Work.

   2. Grant of Copyright License. Subject to the terms and conditions of
      this License, each Contributor hereby grants to You a perpetual,
      worldwide, non-exclusive, no-charge, royalty-free, irrevocable
      copyright license to reproduce, prepare Derivative Works of,
      publicly display, publicly perform, sublicense, and distribute the
      Work and such Derivative Works in Source or Object form.

   3. Grant of Patent License. Subject to the terms and conditions of
      this License, each Contributor hereby grants to You a perpetual,
      worldwide, non-exclusive, no-charge, royalty-free, irrevocable
      (except as stated in this section) patent license to make, have made,
      use, offer to sell, sell, import, and otherwise transfer the Work,
      where such license applies only to those patent claims licensable
      by such Contributor that are necessarily infringed by their
      Contribution(s) alone or by combination of their Contribution(s)
      with the Work to which such Contribution(s) was submitted. If You
      institute patent litigation against any entity (including a
      cross-claim or counterclaim in a lawsuit) alleging that the Work
      or a Contribution incorporated within the Work constitutes direct
      or contributory patent infringement, then any patent licenses
      granted to You under this License for that Work shall terminate
      as of the date such litigation is filed.

   4. Redistribution. You may reproduce and distribute copies of the
      Work or Derivative Works thereof in any medium, with or without
      modifications, and in Source or Object form, provided that You
      meet the following conditions:

      (a) You must give any other recipients of the Work or
          Derivative Works a copy of this License; and

      (b) You must cause any modified files to carry prominent notices
          stating that You changed the files; and

      (c) You must retain, in the Source form of any Derivative Works
          that You distribute, all copyright, patent, trademark, and
          attribution notices from the Source form of the Work,
          excluding those notices that do not pertain to any part of
          the Derivative Works; and

      (d) If the Work includes a "NOTICE" text file as part of its
          distribution, then any Derivative Works that You distribute must
          include a readable copy of the attribution notices contained
          within such NOTICE file, excluding those notices that do not
          pertain to any part of the Derivative Works, in at least one
          of the following places: within a NOTICE text file distributed
          as part of the Derivative Works; within the Source form or
          documentation, if provided along with the Derivative Works; or,
          within a display generated by the Derivative Works, if and
          wherever such third-party notices normally appear. The contents
          of the NOTICE file are for informational purposes only and
          do not modify the License. You may add Your own attribution
          notices within Derivative Works that You distribute, alongside
          or as an addendum to the NOTICE text from the Work, provided
          that such additional attribution notices cannot be construed
          as modifying the License.

      You may add Your own copyright statement to Your modifications and
      may provide additional or different license terms and conditions
      for use, reproduction, or distribution of Your modifications, or
      for any such Derivative Works as a whole, provided Your use,
      reproduction, and distribution of the Work otherwise complies with
      the conditions stated in this License.

   5. Submission of Contributions. Unless You explicitly state otherwise,
      any Contribution intentionally submitted for inclusion in the Work
      by You to the Licensor shall be under the terms and conditions of
      this License, without any additional terms or conditions.
      Notwithstanding the above, nothing herein shall supersede or modify
      the terms of any separate license agreement you may have executed
      with Licensor regarding such Contributions.

   6. Trademarks. This License does not grant permission to use the trade
      names, trademarks, service marks, or product names of the Licensor,
      except as required for reasonable and customary use in describing the
      origin of the Work and reproducing the content of the NOTICE file.

   7. Disclaimer of Warranty. Unless required by applicable law or
      agreed to in writing, Licensor provides the Work (and each
      Contributor provides its Contributions) on an "AS IS" BASIS,
      WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or
      implied, including, without limitation, any warranties or conditions
      of TITLE, NON-INFRINGEMENT, MERCHANTABILITY, or FITNESS FOR A
      PARTICULAR PURPOSE. You are solely responsible for determining the
      appropriateness of using or redistributing the Work and assume any
      risks associated with Your exercise of permissions under this License.

   8. Limitation of Liability. In no event and under no legal theory,
      whether in tort (including negligence), contract, or otherwise,
      unless required by applicable law (such as deliberate and grossly
      negligent acts) or agreed to in writing, shall any Contributor be
      liable to You for damages, including any direct, indirect, special,
      incidental, or consequential damages of any character arising as a
      result of this License or out of the use or inability to use the
      Work (including but not limited to damages for loss of goodwill,
      work stoppage, computer failure or malfunction, or any and all
      other commercial damages or losses), even if such Contributor
      has been advised of the possibility of such damages.

   9. Accepting Warranty or Additional Liability. While redistributing
      the Work or Derivative Works thereof, You may choose to offer,
      and charge a fee for, acceptance of support, warranty, indemnity,
      or other liability obligations and/or rights consistent with this
      License. However, in accepting such obligations, You may act only
      on Your own behalf and on Your sole responsibility, not on behalf
      of any other Contributor, and only if You agree to indemnify,
      defend, and hold each Contributor harmless for any liability
      incurred by, or claims asserted against, such Contributor by reason
      of your accepting any such warranty or additional liability.

   END OF TERMS AND CONDITIONS

   APPENDIX: How to apply the Apache License to your work.

      To apply the Apache License to your work, attach the following
      boilerplate notice, with the fields enclosed by brackets "[]"
      replaced with your own identifying information. (Don't include
      the brackets!)  The text should be enclosed in the appropriate
      comment syntax for the file format. We also recommend that a
      file or class name and description of purpose be included on the
      same "printed page" as the copyright notice for easier
      identification within third-party archives.

   Copyright [yyyy] [name of copyright owner]

   Licensed under the Apache License, Version 2.0 (the "License");
   you may not use this file except in compliance with the License.
   You may obtain a copy of the License at

       http://www.apache.org/licenses/LICENSE-2.0

   Unless required by applicable law or agreed to in writing, software
   distributed under the License is distributed on an "AS IS" BASIS,
   WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
   See the License for the specific language governing permissions and
   limitations under the License.

# %% [markdown]
# ## It works on my machine
#
# The most expensive sentence in software.
# Here is how it comes about, in two lines: a script that reads its settings.

# %%
# %%writefile ../../settings_reader.py
import pathlib

print(pathlib.Path("limits.yaml").read_text().strip())

# %% [markdown]
# You try it where you wrote it, and it works.
# **What will it do one folder further?**

# %% tags=["nbval-ignore-output"]
# Not compared: Python words its tracebacks otherwise in other versions.
# !cd ../.. && echo "max_linear_speed: 0.5" > limits.yaml
# !cd ../.. && python3 settings_reader.py
# !cd ../../src && python3 ../settings_reader.py 2>&1 | tail -n 1

# %% [markdown]
# The path was meant "beside this script" and says "wherever somebody stands".
# The cure is to ask for the place instead of knowing it: `Path(__file__).parent` in a script, `get_package_share_directory` for what is installed, `FindPackageShare` in a launch file.
#
# These are the usual ways in which a package works only at home:
#
# | it works at home because | elsewhere | how to notice |
# |---|---|---|
# | you stand in the right folder | no such file | run it from `/` |
# | the file lies in `src/` | it was never installed | I1: look into `install/` |
# | you installed that package once, by hand | `ModuleNotFoundError` | I2: every import is in `package.xml` |
# | an old `build/` still holds it | it is gone | delete `build/ install/ log/`, build again |
# | a path begins with your home folder | it is not there | search for it: `grep -rn "/home/" .` |
# | your clock, your cores, your network | tests flicker | T1: no sleeps, a bench |
#
# The grader builds what you hand in, and nothing else, in an empty room: no network, no home, no old build.
# You have been using that room all along; each `check` ran in it.
#
# ## Read it like an instructor
#
# Now look at your package as a stranger who has thirty of them to grade.
# Three requirements were waiting for today: Q3 (everything in its place), Q5 and Q6.

# %% tags=["check"]
check("Q3", "Q5", "Q6")

# %% [markdown]
# A report has the same three lines for each loss, and they answer an instructor's three questions.
#
# - **seen**: what happened? Never "wrong", always something observed, with a number or a line.
# - **expected**: by which rule? The words of the contract, so that nobody can argue about taste.
# - **try**: what would I say if the student stood here? A direction, not the solution.
#
# When several things are lost, an instructor looks for the *first cause*.
# "Not reached, because the package does not build" nine times is one fault, not nine.
# So mend in this order: what keeps it from building (I1), what keeps a node from starting, what the robot does, then the rest by points.
# How would you order these?

# %%
lost = {"Q2": "2 of 5", "F8": "0 of 6", "I3": "2 of 4", "F9": "0 of 2", "F10": "0 of 2", "T2": "4.1 of 5"}
for name in lost:
    requirement = rubric.requirement(name)
    print(f"{name:4} {lost[name]:>9}   {requirement.title}")

# %% [markdown]
# I3 first: with a wrong type of the action nobody can send a goal, and F8, F9 and F10 are nothing but its echo.
# Twelve points hang on one wrong field in one file.
#
# The full report is made by one command in a terminal, and takes some minutes:
#
#     grader grade ws/src/ros2_robot_controller --out out/mine
#
# `out/mine/report.html` is what your instructor will see, with a picture of each trial.
# Speeds, places and obstacles are drawn anew from a seed, and your instructor's seed is another one.
# So a package that was tuned to the public trials shows it: `--seed 7` is a cheap way to find out.
#
# ## Hand in
#
# `grader submit` packs the package: sources, tests, README, results, without `build/`, caches and hidden files.
# Then it opens the archive as the grader will, and tells what it finds.
# Files that `start_at` laid out are named there, as the course's and not yours.
#
# With `--no-check` it only packs and looks; leave that away, in a terminal, and it runs all public checks on the archive, which takes some minutes.

# %% tags=["nbval-ignore-output"]
# Not compared: sizes are those of one's own files.
# !grader submit --no-check

# %% [markdown]
# Before you let go of it, three last things, each of which has cost somebody a night:
#
# - Unpack the archive in an empty folder and look: is everything there, and nothing that should not be seen, such as a password or somebody else's name?
# - Follow your own README there, word for word, in a new terminal.
# - Make `test_results.xml` again if anything has changed since.
#
# > **On a real TurtleBot 4**
# >
# > - The demonstration drives half a metre wherever the robot stands. Look where it is pointing, and let nobody's feet be there.
# > - On the robot `cmd_vel` is a `TwistStamped` in Jazzy, on the course's robot a `Twist`. A README says such things in its first lines, under "needs".
# > - A base that has heard no command for 0.5 s stops by itself. It saves you when your node dies; it is no reason to leave out the last zero.
# > - Bags are part of a demonstration: `ros2 bag record -a` while it runs, and you can show it again when the battery is empty.
#
# ## Go further
#
# - Put `grader check` into a CI job of your own repository, and let each push be judged.
# - Write the README's interface table by a script, from the running graph. Then it cannot become wrong.
# - Give the package to somebody who was not in the course. Say nothing. Watch where they stop.
#
# ## Recall
#
# <details><summary>Why does each wait in a demonstration need a time-out?</summary>
#
# A request to a service that nobody offers is no error.
# The future is simply never done, and the script stands there without a word.
# </details>
#
# <details><summary>How does a build server know that your demonstration went well?</summary>
#
# By its exit status: 0, or something else.
# What it printed is for people.
# </details>
#
# <details><summary>A package builds in your workspace and nowhere else. What do you try first?</summary>
#
# Delete `build/`, `install/` and `log/`, and build again from what would be handed in.
# Then look for undeclared packages and for paths of your own.
# </details>
#
# <details><summary>A report says "not reached" for F8, F9 and F10. How many faults are that?</summary>
#
# Probably one: something that all three need.
# Read what they are "not reached" because of.
# </details>
#
# **What comes next**
#
# That was the last notebook.
# You began with a robot that somebody else drove, and end with a package that builds, drives, sees, answers, arrives, is configured, tested, documented and handed in.
# It has grown file by file, and you know why each is as it is.
#
# From here the road goes on in three directions: to the real robot (the boxes along the way say what changes), to Nav2, which does what your `navigator.py` does with a map and a planner, and to C++, where the same four ideas, nodes, topics, services and actions, have the same names.
