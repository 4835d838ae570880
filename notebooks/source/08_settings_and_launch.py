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
# # 08 Settings and launch
#
# ![One launch file starts four nodes in two namespaces; two robots with different settings drive through the slalom](pictures/08.png)
#
# Your robot drives, sees, answers and reaches its goals.
# Three things still make it hard to use.
# Its settings are in your code.
# You need two terminals to start it.
# And if there is a second robot, both listen to the same `cmd_vel`.
# Today you solve all three problems.

# %% [markdown] tags=["whole"]
# **You will be able to**
#
# - read and change a running node's parameters from outside, and say where a value came from;
# - write a parameter file that its node reads, and notice one that no node reads;
# - refuse values that make no sense, at the start and later;
# - make a changed value take effect, also in objects that were made from the old one;
# - start both nodes with one command, and two robots with another.
#
# **Time:** 60 to 95 minutes for parameters (part 1), and 45 to 95 for launch files (part 2).
# After a break, *Run, Run All Above Selected Cell* brings back what the notebook had.
#
# **Your package so far**, and what comes today:
#
#     ros2_robot_controller/
#     ├── CMakeLists.txt  package.xml  setup.py  setup.cfg
#     ├── msg/  srv/  action/  scripts/
#     ├── config/
#     │   ├── robot_params.yaml                    ← today
#     │   └── sensor_params.yaml                   ← today
#     ├── launch/
#     │   ├── robot_controller_launch.py           ← today
#     │   └── sensor_processor_launch.py           ← today
#     └── ros2_robot_controller/
#         ├── driver.py  speed_server.py  navigator.py
#         ├── robot_controller.py                  ← today, the last layer
#         ├── sensor_processor.py                  ← today, a second look
#         └── utils/
#             ├── conversions.py  motion.py  running.py  scans.py  steering.py
#             └── settings.py                      ← today, it learns to refuse

# %%
from grader.notebook import begin, check, run_node, start_at, tries

begin("08")
# !mkdir -p config launch ros2_robot_controller/utils

# %% [markdown]
# The last line makes the folders for today; existing ones stay as they are.
# If files are missing and you would rather start here, run `start_at("08")` in a cell of its own.

# %% [markdown] tags=["whole"]
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 05: why does <code>_limits()</code> read the parameters in each step, and not once in <code>__init__</code>?</summary>
#
# So that a change takes effect at once. A copied value stays as it was.
# </details>
# <details><summary>Notebook 07: a goal runs, and the client cancels. Which two things must your node do?</summary>
#
# Accept the cancel (`cancel_callback`), and end the goal itself with `handle.canceled()`.
# </details>
# <details><summary>Notebook 04: why is the topic called <code>raw_scan</code> in your code, and not <code>/raw_scan</code>?</summary>
#
# A relative name can be moved: into a namespace, or to another name.
# </details>

# %% [markdown]
# ## Ask a running node
#
# We begin with a cart that only publishes how fast it would like to go.
# Its file is in the workspace, beside `src/`; it is not part of your package.

# %%
# %%writefile ../../cart.py
from geometry_msgs.msg import Twist, Vector3
import rclpy
from rclpy.node import Node


class Cart(Node):
    def __init__(self, **options):
        super().__init__('cart', **options)
        self.declare_parameter('max_linear_speed', 0.5)
        self.declare_parameter('rate', 10.0)
        self.publisher = self.create_publisher(Twist, 'cmd_vel', 10)
        self.timer = self.create_timer(1.0 / self.get_parameter('rate').value, self.go)

# %% [markdown]
# `-a` appends to the file. This part says what the timer does, and makes the file a program.

# %%
# %%writefile -a ../../cart.py

    def go(self):
        speed = self.get_parameter('max_linear_speed').value
        self.publisher.publish(Twist(linear=Vector3(x=speed)))


if __name__ == '__main__':
    rclpy.init()
    try:
        rclpy.spin(Cart())
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass

# %% [markdown]
# `declare_parameter` gives a parameter its name, its default and, through the default, its type.
# Start the cart as a separate process, as in a second terminal, and ask for its parameters.
#
# **Predict:** what will it list? The code declares two.

# %%
import subprocess

cart = subprocess.Popen(["python3", "../../cart.py"])
# !ros2 param list /cart

# %% [markdown]
# Four: every node has `use_sim_time`, with which it takes its time from `/clock`, and `start_type_description_service`, which you can ignore.
#
# Change the speed while the cart runs, and look at what it publishes.

# %%
# !ros2 param set /cart max_linear_speed 0.25
# !ros2 topic echo --once --field linear.x /cmd_vel
# !ros2 param dump /cart

# %% [markdown]
# You did not change the code or restart anything.
# `dump` prints the settings as a YAML file, with which you can start a node. You will write such a file.
#
# **Predict:** what happens with a speed of -1.0?
# What happens with `1`, a whole number?

# %%
# !ros2 param set /cart max_linear_speed -1.0
# !ros2 param set /cart max_linear_speed 1
# !ros2 param get /cart max_linear_speed
cart.terminate()

# %% [markdown]
# The node refuses the whole number: a parameter keeps its type, and `1` is an integer.
# It accepts the *negative* speed.
# ROS knows only the types; you know which values make sense.

# %% [markdown] tags=["whole"]
# ## Four places a value comes from
#
# A parameter can get its value from four places.
# You have seen the first and the last: the default in the code, and `ros2 param set`.
# The other two are the parameter file and the command line, which the node reads when it starts.
#
# A new process for each try is slow, so we make the carts here in the notebook; `cli_args` are the words of the command line.

# %% tags=["whole"]
import rclpy
from rclpy.parameter import Parameter

# %run -n ../../cart.py
if not rclpy.ok():
    rclpy.init()


def speed_of_cart(*words, namespace=""):
    """Return the max_linear_speed of a cart that is started with these words on its command line."""
    cart = Cart(namespace=namespace, cli_args=["--ros-args", *words])
    value = cart.get_parameter("max_linear_speed").value
    cart.destroy_node()
    return value

# %% [markdown] tags=["whole"]
# **Who wins**, the file with 0.3 or `-p` with 0.2?

# %% tags=["whole"]
from pathlib import Path


def write_settings(key, line="max_linear_speed: 0.3"):
    """Write the parameter file cart.yaml beside cart.py."""
    Path("../../cart.yaml").write_text(f"{key}:\n  ros__parameters:\n    {line}\n")


write_settings("cart")
file, word = ["--params-file", "../../cart.yaml"], ["-p", "max_linear_speed:=0.2"]
print("nothing        ", speed_of_cart())
print("file           ", speed_of_cart(*file))
print("file, then -p  ", speed_of_cart(*file, *word))
print("-p, then file  ", speed_of_cart(*word, *file))

# %% [markdown] tags=["whole"]
# That depends on the order: **the last one wins**.
# Launch files use this: first comes the file with all settings, and then the one that is different today.

# %% [markdown]
# ## A file that nobody reads
#
# A parameter file looks like this:
#
#     cart:
#       ros__parameters:
#         max_linear_speed: 0.3
#
# The first line is a key, and it says *which node* is meant.
# Suppose it says `kart`.
#
# **Predict:** what will the node say?

# %% tags=["whole"]
write_settings("kart")
print(speed_of_cart(*file))

# %% [markdown]
# It says nothing at all, and uses the default, 0.5.
# One file may hold the settings of many nodes, so a key that matches no node is not an error.
# This is the most common reason for "my parameter does not work".
#
# There is another trap.
# Several robots have namespaces: `/left/cart` is the cart of the robot called `left`.

# %% [markdown] tags=["whole"]
# **Predict:** which of these keys reach which of the three carts?
# Write down your table before you run the cell.

# %% tags=["whole"]
spaces = ("", "/left", "/left/front")
print("key         ", *(f"{space}/cart".rjust(16) for space in spaces))
for key in ("cart", "/left/cart", "/left/**", "/**/cart", "/**"):
    write_settings(key)
    reached = [speed_of_cart(*file, namespace=space) == 0.3 for space in spaces]
    print(f"{key:12}", *(("yes" if hit else "no").rjust(16) for hit in reached))

# %% [markdown]
# The plain name reaches the node only if it has no namespace.
# `**` stands for any number of namespaces, also none. So `/**/cart` means "a cart in any namespace", and `/**` means every node.
# In a package write `/**/cart`, because its users choose the namespace, and you cannot know it.

# %% [markdown] tags=["whole"]
# Here are two more mistakes. One of them stops the node.
# **Which one?**

# %% tags=["whole"]
for line in ("max_linear_sped: 0.3", "max_linear_speed: 1"):
    write_settings("/**/cart", line)
    try:
        print(f"{line:22} ->  {speed_of_cart(*file)}")
    except Exception as error:
        print(f"{line:22} ->  {type(error).__name__}: {error}")

# %% [markdown] tags=["whole"]
# A misspelt name causes no message: ROS ignores parameters that no node declares.
# A whole number for a float ends the node.
# Write `1.0`, and after every change ask the running node, with `ros2 param get` or `dump`.
#
# **Change one thing:** add a key of your own to the table above, such as `/*/cart`, and run it again.

# %% [markdown] tags=["whole"]
# ## Parameters that take effect
#
# How much can one setting change?
# Below, three robots drive at a wall. They differ in one number, the distance at which they stop.
# This cell does not use ROS, only a driver with a parameter.

# %% tags=["whole"]
import matplotlib.pyplot as plt
import numpy as np

from sim import Simulator, Twist, drive, load_world


def approach(threshold):
    """Return the recording of a robot that stops when something is nearer than `threshold` metres."""
    robot = Simulator(load_world("wall_ahead"))
    return drive(robot, lambda seen: Twist(0.4 if np.nanmin(seen.scan.ranges) > threshold else 0.0), 6.0)

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for threshold in (0.3, 0.5, 1.0):
    run = approach(threshold)
    axes.plot(run.t, 2.0 - run.x, label=f"threshold {threshold} m")
axes.axhline(0.171, color="0.5", linestyle=":")
axes.annotate("the hull touches the wall", (0.1, 0.2), color="0.4", fontsize=9)
axes.set(xlabel="simulated time (s)", ylabel="distance to the wall (m)", ylim=(0, 2.1))
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown] tags=["whole"]
# One number makes three different robots.
# So people *will* change it, and that has to work at any time.
# There are two common mistakes.
#
# ### Made once, kept for ever
#
# The cart reads `max_linear_speed` each time it publishes.
# It read its `rate` once, to make the timer.
#
# **Predict:** what is the timer's period after the rate was set to 50 Hz?

# %% tags=["whole"]
cart = Cart()
cart.set_parameters([Parameter("rate", value=50.0)])
print("rate        ", cart.get_parameter("rate").value, "Hz")
print("timer every ", cart.timer.timer_period_ns / 1e6, "ms")
cart.destroy_node()

# %% [markdown] tags=["whole"]
# The timer still runs at 10 Hz, but the parameter and `ros2 param get` say 50.
# A timer keeps the period with which it was made.
# The same holds for every value that you copied: `self.limit = self.get_parameter(...).value` in a constructor never follows a change.
#
# There are two cures:
#
# - **Read it where you use it.** It costs a few microseconds. Your `driver.py` does so with `_limits()`.
# - **Ask to be called.** After `add_post_set_parameters_callback(f)`, ROS calls `f(parameters)` after every accepted change, with the list of changed parameters. There you make a new timer.
#
# Here is a cart with such a callback.
# `destroy_timer` ends the old timer; without it, both timers would fire.

# %% tags=["whole"]
class ToldCart(Cart):
    def __init__(self, **options):
        super().__init__(**options)
        self.add_post_set_parameters_callback(self.on_changed)

    def on_changed(self, parameters):
        if "rate" in {parameter.name for parameter in parameters}:
            self.destroy_timer(self.timer)
            self.timer = self.create_timer(1.0 / self.get_parameter("rate").value, self.go)


cart = ToldCart()
cart.set_parameters([Parameter("rate", value=50.0)])
print("timer every", cart.timer.timer_period_ns / 1e6, "ms")
cart.destroy_node()

# %% [markdown] tags=["whole"]
# The `if` matters, because a new timer begins a new period. Without the `if`, a node whose speed limit changes twenty times a second would never publish.
#
# ### Refused too late
#
# ROS calls the function that you give to `add_on_set_parameters_callback` *before* a change, and its answer decides.
# Here are two carts with the same callback.
# They differ only in the place of one line.

# %% tags=["whole"]
from rcl_interfaces.msg import SetParametersResult


def refuse_negative(parameters):
    """Accept the change unless a number in it is below zero."""
    bad = [p.name for p in parameters if isinstance(p.value, float) and p.value < 0.0]
    reason = f"{', '.join(bad)} must not be negative" if bad else ""
    return SetParametersResult(successful=not bad, reason=reason)

# %% tags=["whole"]
class LateCart(Node):
    def __init__(self, **options):
        super().__init__("cart", **options)
        self.declare_parameter("max_linear_speed", 0.5)
        self.add_on_set_parameters_callback(refuse_negative)


class EarlyCart(Node):
    def __init__(self, **options):
        super().__init__("cart", **options)
        self.add_on_set_parameters_callback(refuse_negative)
        self.declare_parameter("max_linear_speed", 0.5)

# %% tags=["whole"]
late = LateCart()
[answer] = late.set_parameters([Parameter("max_linear_speed", value=-1.0)])
print("set while it runs:", answer.successful, "-", answer.reason)
late.destroy_node()

# %% [markdown] tags=["whole"]
# At run time both callbacks refuse.
# Now give -1.0 *at the start*, as a parameter file would.
# **Predict:** what will each cart do?

# %% tags=["whole"]
senseless = ["--ros-args", "-p", "max_linear_speed:=-1.0"]
for kind in (LateCart, EarlyCart):
    try:
        cart = kind(cli_args=senseless)
        print(f"{kind.__name__:10} drives at {cart.get_parameter('max_linear_speed').value} m/s at most")
        cart.destroy_node()
    except Exception as error:
        print(f"{kind.__name__:10} {type(error).__name__}: {error}")

# %% [markdown] tags=["whole"]
# The late one accepts it.
# Values from files and from the command line are set *while* a parameter is declared, so a callback that is registered afterwards never sees them.
# So register the callback first, and then declare the parameters.
#
# `refuse_negative` also has a mistake that you know from notebook 03.
# **Predict:** what does it say to NaN?

# %% tags=["whole"]
print(refuse_negative([Parameter("max_linear_speed", value=float("nan"))]).successful)

# %% [markdown] tags=["whole"]
# `nan < 0.0` is False, so the callback accepts NaN.
# Ask "is it good?", never "is it bad?".
#
# ### Your settings
#
# The file `utils/settings.py`, given in notebook 04, declares parameters but refuses nothing.
# Now it learns to refuse, in three pieces.
# The names that the rest of your package uses stay the same.
#
# A `Setting` holds a default, a test that is True for sensible values, and the rule in words.
# `at_least_zero` is finished: it asks "is it good?".
# The other four accept any value, `first_refusal` finds nothing, and `declare` registers, too late, a callback that accepts everything.

# %% tags=["skeleton", "whole"]
# %%writefile ros2_robot_controller/utils/settings.py
"""Declare parameters that refuse values which make no sense."""

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

MAX_RATE_HZ = 1000.0  # a Python node that tries to go faster does nothing else


@dataclass(frozen=True)
class Setting:
    """A parameter: its default, and what its values must be, as a test and in words."""

    default: Any
    is_sensible: Callable[[Any], bool]
    must_be: str


def at_least_zero(default: float) -> Setting:
    """Return a setting for a size that may be zero: a distance, a speed limit."""
    return Setting(default, lambda value: 0.0 <= value < math.inf, 'finite and not negative')


def above_zero(default: float) -> Setting:
    """Accept everything so far (piece 1)."""
    return Setting(default, lambda value: True, 'anything')


def rate(default: float) -> Setting:
    """Accept everything so far (piece 1)."""
    return Setting(default, lambda value: True, 'anything')


def percentage(default: float) -> Setting:
    """Accept everything so far (piece 1)."""
    return Setting(default, lambda value: True, 'anything')


def name(default: str) -> Setting:
    """Accept everything so far (piece 1)."""
    return Setting(default, lambda value: True, 'anything')


def first_refusal(settings: dict[str, Setting], parameters: list[Parameter]) -> str:
    """Refuse nothing so far (piece 2)."""
    return ''


def declare(node: Node, settings: dict[str, Setting]) -> None:
    """Declare, and refuse nothing so far (piece 3)."""
    for parameter, setting in settings.items():
        node.declare_parameter(parameter, setting.default)
    node.add_on_set_parameters_callback(lambda _: SetParametersResult(successful=True))

# %% [markdown] tags=["whole"]
# #### Piece 1: four rules
#
# | made by | must be | why |
# |---|---|---|
# | `above_zero` | finite, above 0 | with an acceleration of 0 the robot would never start |
# | `rate` | above 0, at most `MAX_RATE_HZ` | one divided by it is a period |
# | `percentage` | 0 to 100, both included | |
# | `name` | a text that is not empty | a text of blanks counts as empty |
#
# Each takes one line, as `at_least_zero` does.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/settings.py
def above_zero(default: float) -> Setting:
    """Return a setting for a size that must not be zero: an acceleration."""
    return Setting(default, lambda value: True, 'anything')  # TODO: the test, and the words


def rate(default: float) -> Setting:
    """Return a setting for a rate in Hz."""
    return Setting(default, lambda value: True, 'anything')  # TODO


def percentage(default: float) -> Setting:
    """Return a setting for a share in percent."""
    return Setting(default, lambda value: True, 'anything')  # TODO


def name(default: str) -> Setting:
    """Return a setting for a name."""
    return Setting(default, lambda value: True, 'anything')  # TODO

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# Look at `at_least_zero`. Then ask for each end of each range: does it belong to the range?
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# `0.0 < value <= MAX_RATE_HZ` is False for NaN, for infinity and for negative numbers, all at once.
# `text.strip()` is the text without blanks at its ends; `bool('')` is False.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def above_zero(default: float) -> Setting:
#     return Setting(default, lambda value: 0.0 < value < math.inf, 'finite and above 0')
#
# def rate(default: float) -> Setting:
#     return Setting(default, lambda value: 0.0 < value <= MAX_RATE_HZ,
#                    f'above 0 and at most {MAX_RATE_HZ:g} Hz')
#
# def percentage(default: float) -> Setting:
#     return Setting(default, lambda value: 0.0 <= value <= 100.0, 'from 0 to 100')
#
# def name(default: str) -> Setting:
#     return ...               # bool(value.strip()), and words such as 'a text that is not empty'
# ```
# </details>

# %% tags=["whole"]
# %run ros2_robot_controller/utils/settings.py
nan = math.nan
tries({
    "above_zero(1.0).is_sensible(0.01)": True,
    "above_zero(1.0).is_sensible(0.0)": False,
    "above_zero(1.0).is_sensible(nan)": False,
    "above_zero(1.0).is_sensible(math.inf)": False,
    "rate(10.0).is_sensible(1000.0)": True,
    "rate(10.0).is_sensible(1000.1)": False,
    "rate(10.0).is_sensible(0.0)": False,
    "rate(10.0).is_sensible(nan)": False,
    "percentage(20.0).is_sensible(0.0)": True,
    "percentage(20.0).is_sensible(100.0)": True,
    "percentage(20.0).is_sensible(-0.1)": False,
    "percentage(20.0).is_sensible(100.1)": False,
    "name('anna').is_sensible('bob')": True,
    "name('anna').is_sensible('  ')": False,
})

# %% [markdown] tags=["whole"]
# #### Piece 2: the first that makes no sense
#
# ROS passes you a list of parameters, and needs a reason in words if you refuse one of them.
# Go through the list; look each one up in `settings` by its `.name`; return a sentence for the first whose `.value` is not sensible, such as `'pace must be above 0 and at most 1000 Hz, not -2.0'`.
# An empty text means that all are accepted.
#
# `use_sim_time` also comes here, and is not in `settings`: accept parameters that you do not know.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/settings.py
def first_refusal(settings: dict[str, Setting], parameters: list[Parameter]) -> str:
    """Return why these values are not accepted, empty if they are; others' parameters pass."""
    return ''  # TODO

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# A `for` loop over `parameters` with one `if` in it; the words are in the setting.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `settings.get(parameter.name)` gives the setting, or None for a parameter that is not in `settings`.
# The sentence: `f'{parameter.name} must be {setting.must_be}, not {parameter.value}'`
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
#     for parameter in parameters:
#         setting = settings.get(parameter.name)
#         if setting is not None and not setting.is_sensible(parameter.value):
#             return ...       # the sentence
#     return ''
# ```
# </details>

# %% tags=["whole"]
# %run ros2_robot_controller/utils/settings.py
known = {"depth": at_least_zero(1.0), "pace": rate(5.0)}
deep, slow = Parameter("depth", value=2.5), Parameter("pace", value=-2.0)
clock = Parameter("use_sim_time", value=True)
tries({
    "first_refusal(known, [deep])": "",
    "first_refusal(known, [slow])": "pace must be above 0 and at most 1000 Hz, not -2.0",
    "first_refusal(known, [deep, slow])": "pace must be above 0 and at most 1000 Hz, not -2.0",
    "first_refusal(known, [clock])": "",
    "first_refusal({}, [slow])": "",
})

# %% [markdown] tags=["whole"]
# (The words in the middle of the sentence are yours, so they may differ from the table's.)
#
# #### Piece 3: refuse, at the start and later
#
# `declare` needs a callback that asks `first_refusal` and turns its answer into a `SetParametersResult`.
# Register the callback early enough.

# %% tags=["piece", "whole"]
# %%into ros2_robot_controller/utils/settings.py
def declare(node: Node, settings: dict[str, Setting]) -> None:
    """Declare the parameters on the node, and refuse senseless values from then on."""
    def check(parameters: list[Parameter]) -> SetParametersResult:
        return SetParametersResult(successful=True)  # TODO 1: ask first_refusal

    for parameter, setting in settings.items():
        node.declare_parameter(parameter, setting.default)
    node.add_on_set_parameters_callback(check)  # TODO 2: is this the place?

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# `refuse_negative` shows the callback, `EarlyCart` its place.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `SetParametersResult(successful=..., reason=...)`: successful when the reason is empty.
# `check` is defined inside `declare`, so it can use `settings`.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
#     def check(parameters: list[Parameter]) -> SetParametersResult:
#         reason = first_refusal(settings, parameters)
#         return SetParametersResult(successful=not reason, reason=reason)
#
#     node.add_on_set_parameters_callback(check)
#     ...                       # and now, not before, the loop that declares
# ```
# </details>
#
# Try it on a node with two settings: a start with sensible values, one without, and both at run time.

# %% tags=["whole"]
# %run ros2_robot_controller/utils/settings.py
def accepted(pace, at_the_start=True):
    """Return whether a node with these settings takes this pace."""
    words = ["--ros-args", "-p", f"pace:={pace}"] if at_the_start else []
    node = Node("walker", cli_args=words, enable_rosout=False)
    try:
        declare(node, known)
        return at_the_start or node.set_parameters([Parameter("pace", value=pace)])[0].successful
    except rclpy.exceptions.InvalidParameterValueException:
        return False
    finally:
        node.destroy_node()


tries({
    "accepted(7.0)": True,
    "accepted(-2.0)": False,
    "accepted(7.0, at_the_start=False)": True,
    "accepted(-2.0, at_the_start=False)": False,
})

# %% [markdown] tags=["whole"]
# ### The last layer
#
# So far `robot_controller.py` has only had a `main`, which starts the newest layer.
# Now it becomes the last layer itself, with a callback for changed parameters.
#
# Your node made three things from a parameter, or checked them against one, only *once*:
#
# | what | from | after a change |
# |---|---|---|
# | the control timer, `self._control_timer`, which calls `self._control` | `laser_processing_rate` | make a new one |
# | the feedback timer, `self._feedback_timer`, which calls `self._give_feedback` | `fusion_rate` | make a new one |
# | the speed in force, `self._speed` | was within `max_linear_speed` when it was set | keep it within the new limit |
#
# The constructor is done, and so is a first try at the speed.

# %% tags=["skeleton", "whole"]
# %%writefile ros2_robot_controller/robot_controller.py
"""
The node that drives the robot, whole: four layers, each with one thing more.

Driver drives safely, SpeedServer takes a speed, Navigator drives to goals, and RobotController
lets parameters change meanwhile. Callbacks move data; utils.motion and utils.steering decide.
"""

from typing import Any, Optional

from rclpy.parameter import Parameter
from ros2_robot_controller.navigator import Navigator
from ros2_robot_controller.utils.conversions import clamp
from ros2_robot_controller.utils.running import run


class RobotController(Navigator):
    """
    Drive at a set speed or to a goal, and never into anything.

    Parameters: all of them may change while the node runs.
    """

    def __init__(self, **node_options: Any) -> None:
        super().__init__(**node_options)
        self.add_post_set_parameters_callback(self._on_parameters_changed)
        self.get_logger().info(f"{self._value('robot_name')} is ready")

    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        limit = self._value('max_linear_speed')
        self._speed = clamp(self._speed, 0.0, limit)  # a first try


def main(args: Optional[list[str]] = None) -> int:
    """Run the node until Ctrl-C; return the exit code."""
    return run(RobotController, args)

# %% [markdown] tags=["whole"]
# **Your own design.** The table says what must be true after a change; you decide how to do it.
# What does the first try do to a robot that drives *backwards*, at -0.4 m/s?
# And what must not happen to the timer whose rate has *not* changed?
# There is no third hint. The two drives below and `check("I6")` accept any design. After the drives come two designs to compare.

# %% tags=["piece", "design", "whole"]
# %%into ros2_robot_controller/robot_controller.py
class RobotController:
    def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
        limit = self._value('max_linear_speed')
        self._speed = clamp(self._speed, 0.0, limit)  # a first try

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# `ToldCart` above does it for one timer.
# The table has the names; `driver.py` and `navigator.py` show how the timers were made.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `clamp(value, low, high)`, with a low end that is negative.
# `self.destroy_timer(timer)`, then `self.create_timer(self._period('laser_processing_rate'), self._control)`.
# </details>
#
# Now watch your own robot.
# It drives at 0.4 m/s. After two seconds the limit falls to 0.2 m/s, and then a client asks for a limit of -1.

# %% tags=["whole"]
with run_node(world="open_field") as run:
    run.drive(0.5)
    run.set_speed(0.4)
    run.drive(2.0)
    print("limit 0.2: ", run.set_parameter("max_linear_speed", 0.2))
    run.drive(2.0)
    print("limit -1.0:", run.set_parameter("max_linear_speed", -1.0))
    recording = run.drive(1.0)

# %% tags=["whole"]
figure, axes = plt.subplots(figsize=(8, 2.6), layout="constrained")
axes.plot(recording.t, recording.v)
axes.axvline(2.5, color="0.5", linestyle=":")
axes.set_title("your robot: the limit falls to 0.2 m/s at 2.5 s")
axes.set(xlabel="simulated time (s)", ylabel="v (m/s)", ylim=(-0.05, 0.5))
axes.grid(alpha=0.3)

# %% [markdown] tags=["whole"]
# You should see a step down at the dotted line, and two answers: `(True, '')`, and `(False, ...)` with your sentence.

# %% tags=["whole"]
with run_node(world="open_field") as run:
    run.drive(0.5)
    run.set_speed(-0.4)
    run.set_parameter("max_linear_speed", 0.2)
    backwards = run.drive(2.0).v[-1]
    before = len(run.messages("cmd_vel"))
    run.set_parameter("laser_processing_rate", 5.0)
    run.drive(2.0)
    commands = len(run.messages("cmd_vel")) - before
print(f"backwards, with a limit of 0.2: {backwards:.2f} m/s, wanted -0.20")
print(f"in 2 s at 5 Hz: {commands} commands, wanted 10 (or 9, or 11)")

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for the last layer, once yours obeys</summary>
#
# **Replace what has changed.** The course's: an `if` for each timer.
#
# ```python
# changed = {parameter.name for parameter in parameters}
# limit = self._value('max_linear_speed')
# self._speed = clamp(self._speed, -limit, limit)
# if 'laser_processing_rate' in changed:
#     self.destroy_timer(self._control_timer)
#     self._control_timer = self.create_timer(self._period('laser_processing_rate'), self._control)
# ...  # the same for 'fusion_rate'
# ```
#
# **Never store what may change.** The timers get the new period, and the limit is applied where the speed is used.
#
# ```python
# for rate, timer in (('laser_processing_rate', self._control_timer), ('fusion_rate', self._feedback_timer)):
#     period = round(self._period(rate) * 1e9)
#     if timer.timer_period_ns != period:
#         timer.timer_period_ns = period
# ```
#
# The second one needs no list of what has changed: it compares each period with the right one, and so also corrects what another callback has forgotten.
# But the new period counts from the last call, so try what happens when it gets shorter. And `get_status` would report a speed above the limit.
# </details>
#
# ### A second look at the other node
#
# `sensor_processor` also has a timer, made from `fusion_frequency` in notebook 04. Is there a method `_on_parameters_changed` in that file? Now you can understand it.
# **Predict:** does your timer follow a change? The parameter goes from 20 to 5 Hz; the cell counts the messages of one second.

# %% tags=["whole"]
with run_node("sensor_processor", world="open_field") as run:
    run.drive(1.0)
    run.set_parameter("fusion_frequency", 5.0)
    before = len(run.messages("obstacle_distance"))
    run.drive(1.0)
    print(len(run.messages("obstacle_distance")) - before, "messages in a second, wanted 5 (or 4, or 6)")

# %% [markdown] tags=["whole"]
# If it prints five, go on.
# If it prints about 20, your node has the mistake from above: the parameter says 5, but the timer still runs at 20 Hz.
# Open `ros2_robot_controller/sensor_processor.py` in JupyterLab (a double click in the file browser, below `ws/src`), and correct it as you have corrected the controller, then run the cell again:
#
# - at the end of `__init__`: `self.add_post_set_parameters_callback(self._on_parameters_changed)`;
# - a method `_on_parameters_changed(self, parameters)` that makes a new timer when `fusion_frequency` has changed.
#
# <details><summary>The method, all but the last line</summary>
#
# ```python
#     def _on_parameters_changed(self, parameters: list[Parameter]) -> None:
#         if any(parameter.name == 'fusion_frequency' for parameter in parameters):
#             self.destroy_timer(self._timer)
#             ...               # self._timer, made anew as in __init__
# ```
#
# `Parameter` is imported from `rclpy.parameter`.
# If your timer has no name yet, give it one in `__init__`: `self._timer = self.create_timer(...)`.
# </details>

# %% [markdown]
# ### The parameter files
#
# Two files have every parameter of a node, with its unit in a comment.
# They contain the defaults.
# That looks useless, but people look here to find out what they can set.
#
# Begin with the smaller file; names and defaults are in `SETTINGS`, in `sensor_processor.py`.

# %% tags=["exercise"]
# %%writefile config/sensor_params.yaml
# Parameters of sensor_processor.
# TODO 1: a key that reaches the node in any namespace. Which nodes does this one reach?
# TODO 2: the three parameters of the contract, with their units.
sensors:
  ros__parameters:
    fusion_frequency: 20.0

# %% [markdown] tags=["whole"]
# Now write the file with the ten parameters of the other node.

# %% tags=["exercise", "whole"]
# %%writefile config/robot_params.yaml
# Parameters of robot_controller, in SI units (REP 103).
# TODO 1: the key.
# TODO 2: all ten parameters of the contract, with their units.
robot:
  ros__parameters:
    robot_name: turtlebot4

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# The section "A file that nobody reads"; `SETTINGS` in `driver.py` and `sensor_processor.py` for names and defaults.
# </details>
#
# <details><summary>Hint 2: the form</summary>
#
# The key is `/**/` and the name that the node gives itself. (`/**:` alone reaches every node; the check takes both, and a reader prefers the name.)
# Floats need a point: `1.0`.
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```yaml
# /**/sensor_processor:              # or `/**:`, for every node
#   ros__parameters:
#     fusion_frequency: 20.0            # Hz
#     battery_low_threshold: 20.0       # percent, a warning below
#     ...
# ```
# </details>

# %% [markdown] tags=["whole"]
# Which nodes do the files reach, and with how many values?
# A node that declares every parameter that it is given will show it.

# %% tags=["whole"]
def reached(file, name, namespace=""):
    """Return how many parameters of a file reach a node of this name."""
    words = ["--ros-args", "--params-file", f"config/{file}"]
    given = rclpy.create_node(
        name, namespace=namespace, cli_args=words, automatically_declare_parameters_from_overrides=True
    )
    names = {parameter.name for parameter in given.get_parameters_by_prefix("").values()}
    given.destroy_node()
    return len(names - {"use_sim_time", "start_type_description_service"})


tries({
    "reached('sensor_params.yaml', 'sensor_processor')": 3,
    "reached('sensor_params.yaml', 'sensor_processor', '/left')": 3,
    "reached('robot_params.yaml', 'robot_controller')": 10,
    "reached('robot_params.yaml', 'robot_controller', '/left')": 10,
    "reached('robot_params.yaml', 'sensor_processor')": 0,
})

# %% tags=["check"]
check("I6")

# %% [markdown] tags=["whole"]
# The check also changes `fusion_frequency` on your running node.
# If such a change is accepted and has no effect, the answer says so. No points are lost: the contract covers start-up values only.
#
# This is the end of part 1, and a good place for a break.

# %% [markdown]
# ## Start it all with one command
#
# A launch file is a Python function that returns a list of what to start.
# The shortest useful list has one entry: a `Node`, which says which program to run.

# %%
# %%writefile ../../cart_launch.py
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([
        Node(executable='python3', arguments=['cart.py']),
    ])

# %% [markdown]
# In a terminal you would type `ros2 launch cart_launch.py` and see a line for each process.
# Here it has to run in the background while you look at the graph. So `launched` starts it, and presses Ctrl-C at the end.

# %% [markdown] tags=["whole"]
# Ctrl-C there sends every process SIGINT, the same signal that Ctrl-C sends to a single node.
# A process that has not ended 5 s later gets SIGTERM, and 5 s after that SIGKILL, which no process can ignore; then there is no last zero.
#
# (In this kit `ros2 launch` and the `launch` package are its own, written for ROS from wheels. They read the same launch files; [docs/launch.md](../docs/launch.md) lists the differences.)

# %%
import signal
from contextlib import contextmanager


@contextmanager
def launched(*words):
    """Run `ros2 launch` in the background, and press Ctrl-C at the end."""
    command = ["ros2", "launch", *words]
    launch = subprocess.Popen(command, cwd="../..", stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield
    finally:
        launch.send_signal(signal.SIGINT)
        output = launch.communicate()[0]
    if launch.returncode:
        print(*output.splitlines()[-3:], sep="\n")

# %%
with launched("cart_launch.py"):
    # !ros2 topic echo --once --field linear.x /cmd_vel

# %% [markdown]
# The cart runs with its default speed, as if you had started it yourself.

# %% [markdown] tags=["whole"]
# ### Two of them
#
# Two robots, called `left` and `right`, need two carts that do not share their topics.
# Three more arguments of `Node` set its names and its parameters:
#
# | argument | what it does |
# |---|---|
# | `namespace='left'` | puts this before every relative name of the node |
# | `parameters=['cart.yaml']` | reads this file when the node starts, as `--params-file` does |
# | `remappings=[('cmd_vel', 'wheels/cmd_vel')]` | gives one topic or service another name |
#
# (`**cart` passes the items of a dictionary as named arguments: `Node(**cart, namespace='left')` is `Node(executable='python3', ..., namespace='left')`.)
#
# **Predict:** what will the names of the two command topics be?

# %% tags=["whole"]
# %%writefile ../../two_carts_launch.py
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    cart = {'executable': 'python3', 'arguments': ['cart.py'], 'parameters': ['cart.yaml']}
    return LaunchDescription([
        Node(**cart, namespace='left'),
        Node(**cart, namespace='right', remappings=[('cmd_vel', 'wheels/cmd_vel')]),
    ])

# %% tags=["nbval-ignore-output", "whole"]
# On a busy machine a list may still lack a name that has just come up, so the lists are not compared.
from grader.notebook.graph_view import graph_view

write_settings("/**/cart")
with launched("two_carts_launch.py"):
    # !ros2 topic echo --once --field linear.x /right/wheels/cmd_vel
    # !ros2 node list --spin-time 5
    carts = graph_view(nodes=2)
carts

# %% [markdown] tags=["whole"]
# Read the result line by line, and find each line in the picture.
#
# - The **file** reached both, because its key is `/**/cart`: 0.3.
# - The **namespace** came before every name of a node: `/left/cart`, `/left/cmd_vel`. Two robots run the same code.
# - The **remapping** renamed a single topic: `/right/wheels/cmd_vel`.
#
# ### An argument
#
# The right cart has to be slower, but only today.
# You should not have to edit a file for that, but say it when you start the robot.
# This needs two parts. `DeclareLaunchArgument` allows an argument `speed` for `ros2 launch`, and `LaunchConfiguration('speed')` is a placeholder for its value.
#
# **Which speed will each cart have** if `cart.yaml` says 0.3 and you give no argument?
# Which speeds will they have with `speed:=0.1`?

# %% tags=["whole"]
# %%writefile ../../two_carts_launch.py
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    cart = {'executable': 'python3', 'arguments': ['cart.py']}
    today = {'max_linear_speed': LaunchConfiguration('speed')}
    return LaunchDescription([
        DeclareLaunchArgument('speed', default_value='0.2', description='of the right cart, m/s'),
        Node(**cart, namespace='left', parameters=['cart.yaml']),
        Node(**cart, namespace='right', parameters=['cart.yaml', today]),
    ])

# %% tags=["whole"]
# !cd ../.. && ros2 launch -s two_carts_launch.py
with launched("two_carts_launch.py", "speed:=0.1"):
    # !ros2 topic echo --once --field linear.x /left/cmd_vel
    # !ros2 topic echo --once --field linear.x /right/cmd_vel

# %% [markdown] tags=["whole"]
# `ros2 launch -s` lists the arguments of a launch file, and starts nothing.
# The left cart has 0.3 from the file.
# For the right one the argument came after the file in the list, and the last one wins: 0.1, and 0.2 if nothing is given.
#
# A `LaunchConfiguration` is a placeholder because your function runs before the value is known.
# The function returns a description, and `launch` fills in the values when it starts the node.
# So `f'speed is {LaunchConfiguration("speed")}'` does not contain the speed.
#
# ### Names that cannot be moved
#
# All of this works because the cart says `cmd_vel` and not `/cmd_vel`.
# **Predict:** what is each of these names in the namespace `left`?

# %% tags=["whole"]
from std_msgs.msg import String

node = rclpy.create_node("cart", namespace="left", enable_rosout=False)
for name in ("cmd_vel", "/cmd_vel", "~/cmd_vel"):
    print(f"{name:10} -> ", node.create_publisher(String, name, 10).topic_name)
node.destroy_node()

# %% [markdown] tags=["whole"]
# A leading `/` makes a name **absolute**: a namespace does not change it.
# Two robots with `/cmd_vel` obey the same commands.
# A leading `~` stands for the node's own name, for things that belong only to that node.
# Use relative names in a package for others. The contract does so, and the grader also runs your nodes in a namespace.

# %% [markdown]
# ### Where is the parameter file?
#
# A launch file that says `cart.yaml` finds it only in the right folder.
# An *installed* launch file has to find the *installed* parameter file in any folder.
# Every installed package has a share folder, and `get_package_share_directory` returns its path.

# %%
import os

from ament_index_python.packages import get_package_share_directory

share = get_package_share_directory("geometry_msgs")
print(os.path.relpath(share, os.path.dirname(os.path.dirname(share))))
print(sorted(os.listdir(share))[:3], "...")

# %% [markdown] tags=["whole"]
# (Launch files may also use `FindPackageShare('...')` and `PathJoinSubstitution([...])`: they do the same as placeholders, when the node is started.)

# %% [markdown]
# Your `CMakeLists.txt` installs the folders `launch` and `config` there (its fourth part), so the file is `os.path.join(share, 'config', 'sensor_params.yaml')`.
#
# ### The launch files
#
# The contract asks for two launch files.
# `robot_controller_launch.py` starts both nodes, and `sensor_processor_launch.py` starts only the second.
# Each declares the argument `use_sim_time` and passes it to its nodes, and each takes the parameters from the installed file.
# `LaunchConfiguration('use_sim_time')` is a placeholder for the argument's value; put it into a dictionary of parameters: `{'use_sim_time': ...}`.
#
# Begin with the single node.

# %% tags=["exercise"]
# %%writefile launch/sensor_processor_launch.py
"""Start sensor_processor alone."""

from launch import LaunchDescription


def generate_launch_description() -> LaunchDescription:
    """Return the node with its parameter file."""
    # TODO 1: the argument use_sim_time, 'false' by default.
    # TODO 2: the node: package, executable, name, and output='screen'.
    # TODO 3: its parameters: the file in the share folder, then use_sim_time in a dictionary.
    return LaunchDescription([])

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# The cart's launch file has the form; the place of the parameter file is in the cell above.
# `package=` is the package's name, and `executable=` is what you installed into `lib/` in notebook 01.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# `DeclareLaunchArgument('use_sim_time', default_value='false')` and `LaunchConfiguration('use_sim_time')`.
# `Node(package=..., executable=..., name=..., output='screen', parameters=[file, {'use_sim_time': ...}])`
# </details>
#
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
#     share = get_package_share_directory('ros2_robot_controller')
#     node = Node(
#         package='ros2_robot_controller',
#         executable='sensor_processor',
#         name='sensor_processor',
#         output='screen',
#         parameters=[
#             os.path.join(share, 'config', 'sensor_params.yaml'),
#             {'use_sim_time': LaunchConfiguration('use_sim_time')},
#         ],
#     )
#     ...                       # a LaunchDescription of the argument, and of the node
# ```
# </details>
#
# The node is started from the installed package, so build first.
# Then `ros2 launch -s` shows whether the argument is there.

# %% tags=["nbval-ignore-output"]
# Not compared: colcon says how long it took.
# !cd ../.. && colcon build --packages-select ros2_robot_controller 2>&1 | cat

# %% tags=["nbval-ignore-output"]
# On a busy machine the list may still lack a name that has just come up.
# !ros2 launch -s launch/sensor_processor_launch.py
with launched("src/ros2_robot_controller/launch/sensor_processor_launch.py"):
    # !ros2 param get /sensor_processor battery_low_threshold
    # !ros2 node list --spin-time 5

# %% [markdown]
# You should see `Double value is: 20.0`, and one node.

# %% [markdown] tags=["whole"]
# **Your own design.** Write the file that starts the whole robot, without a skeleton.
# It must follow these rules:
#
# - `launch/robot_controller_launch.py` starts `robot_controller` and `sensor_processor`, each under its own name;
# - each node has the parameters of its own installed file, wherever the package is installed;
# - there is one argument `use_sim_time`, `'false'` by default, and both nodes get its value, because two nodes on two clocks are hard to debug;
# - the output of both is on the screen.
#
# There is no third hint. The cell below and `check("I5")` accept any design; after them come two to compare.

# %% tags=["exercise", "design", "whole"]
# %%writefile launch/robot_controller_launch.py
"""Start the whole robot: robot_controller and sensor_processor."""

# TODO: generate_launch_description

# %% [markdown] tags=["whole"]
# <details><summary>Hint 1: where to look</summary>
#
# Your file for the single node has all the parts.
# What happens to your second file when somebody changes the first? A launch file can also include another one.
# </details>
#
# <details><summary>Hint 2: the API</summary>
#
# A `LaunchDescription` takes as many actions as you like; both nodes can have the same `LaunchConfiguration`.
# To include: `IncludeLaunchDescription(PythonLaunchDescriptionSource(path), launch_arguments={'use_sim_time': ...}.items())`, from `launch.actions` and `launch.launch_description_sources`.
# </details>

# %% tags=["nbval-ignore-output", "whole"]
# Not compared: colcon says how long it took.
# !cd ../.. && colcon build --packages-select ros2_robot_controller 2>&1 | cat

# %% tags=["nbval-ignore-output"]
# On a busy machine the list may still lack a name that has just come up.
from grader.notebook.graph_view import graph_view

with launched("src/ros2_robot_controller/launch/robot_controller_launch.py"):
    # !ros2 param get /robot_controller max_linear_speed
    # !ros2 node list --spin-time 5
    yours = graph_view(nodes=2)
yours

# %% [markdown]
# `robot_controller_launch.py` starts both nodes, so this is your package on the graph: what each of your two nodes publishes and subscribes.
# Compare it with the contract's table in the [handout](../docs/handout.md); I4 asks for these names and types.
#
# New folders must be installed too, or ROS cannot find them after `colcon build`. That is the third point of I1.
# Then `ros2 launch ros2_robot_controller robot_controller_launch.py`, with the package's name, works in any folder.

# %% tags=["check"]
check("I1", "I5")

# %% [markdown] tags=["whole"]
# <details><summary>Two designs for the whole robot, once yours starts</summary>
#
# **Written out.** The course's: two nodes side by side, and what they share has a name.
#
# ```python
# config = [FindPackageShare('ros2_robot_controller'), 'config']
# use_sim_time = {'use_sim_time': LaunchConfiguration('use_sim_time')}
# return LaunchDescription([
#     DeclareLaunchArgument('use_sim_time', default_value='false'),
#     Node(..., parameters=[PathJoinSubstitution([*config, 'robot_params.yaml']), use_sim_time]),
#     Node(..., parameters=[PathJoinSubstitution([*config, 'sensor_params.yaml']), use_sim_time]),
# ])
# ```
#
# **Included.** The second node comes from its own launch file.
#
# ```python
# share = get_package_share_directory('ros2_robot_controller')
# clock = LaunchConfiguration('use_sim_time')
# sensors = PythonLaunchDescriptionSource(os.path.join(share, 'launch', 'sensor_processor_launch.py'))
# return LaunchDescription([
#     DeclareLaunchArgument('use_sim_time', default_value='false'),
#     Node(..., parameters=[os.path.join(share, 'config', 'robot_params.yaml'), {'use_sim_time': clock}]),
#     IncludeLaunchDescription(sensors, launch_arguments={'use_sim_time': clock}.items()),
# ])
# ```
#
# The second has everything about `sensor_processor` in one place, so you add a new argument or file only once.
# You can read the first without opening another file, which helps when something does not start.
# Robots with twenty nodes use the second way, part by part.
# </details>

# %% [markdown] tags=["whole"]
# ### See what you have launched
#
# With `launch=`, `run_node` starts your *installed* launch file beside a simulated robot: both nodes, each with its parameter file.
# In Jupyter the next cell is a live view.
# The robot stands, because it has no speed yet. Click on the map to send a goal; you can also drag the box.
# (On a web page you see only a picture. The film below shows the drive.)

# %% tags=["whole"]
from sim import Box, World, room
from sim.film import Film

walls = room((-0.7, -1.2), (3.0, 1.2))
floor = World("a box in the way", obstacles=(*walls, Box((2.0, 0.0), (0.2, 0.6), name="box")))
run = run_node(launch="robot_controller_launch.py", world=floor)
run.drive(0.5)
live = run.live()
live

# %% [markdown] tags=["whole"]
# Now give it a speed, and let it drive for seven seconds.
#
# **Predict:** how far from the box will it stop, and which line of which file says so?

# %% tags=["whole"]
run.set_speed(0.4)
live.run(7.0)
# !ros2 param get /robot_controller obstacle_detection_threshold

# %% [markdown] tags=["whole"]
# It stops at half a metre, as `config/robot_params.yaml` says.
# (The view's *clearance* counts from the hull, so it shows 0.171 m less.)
#
# **Predict:** what will the robot do when you change that value now?

# %% tags=["whole"]
# !ros2 param set /robot_controller obstacle_detection_threshold 0.3
live.run(4.0)

# %% [markdown] tags=["whole"]
# It drives on at once, to 0.3 m, because your node reads the threshold where it uses it.
#
# Press *Run* in the view, and try more.
# Drag the box away and back, set `max_linear_speed` to 0.1, or ask for a threshold of -1.
# **Change one thing:** write another threshold into `config/robot_params.yaml`, and run the three cells again; `run_node` installs the file before it starts.
#
# Here is the whole drive as a film.

# %% tags=["whole"]
recording = run.recording
run.close()
Film(recording)

# %% [markdown] tags=["whole"]
# `sensor_processor` ran beside it and heard no scan, because nobody publishes `raw_scan` here; the first item of *Go further* changes that.
#
# ### Windows that others use
#
# On a desktop with ROS from apt, people watch a running robot in graphical tools. This kit does not have them, but it has a replacement for each:
#
# | window | what it shows | here |
# |---|---|---|
# | `rviz2` | scans, maps, transforms and goals in three dimensions, from topics alone | the live view and its clicks, `map_view`, `Film` |
# | Foxglove | the same in a browser, and bags | a bag from `ros2 bag record` can be opened there |
# | `rqt_graph` | nodes and topics | `graph_view` |
# | `rqt_plot` | a number over time | `run.messages(...)` and a plot |
# | `rqt_console` | the log of all nodes, by level | `ros2 topic echo /rosout` |
# | `rqt_reconfigure` | sliders for declared ranges | `ros2 param set` |
#
# RViz is the first tool that you will open on a real robot.
# Its [guide](https://docs.ros.org/en/jazzy/Tutorials/Intermediate/RViz/RViz-User-Guide/RViz-User-Guide.html) has pictures of the window: the three-dimensional view in the middle, and to its left a list of displays, one for each topic that is drawn.
# It shows what the *topics* say, not what is true: set its *Fixed Frame* to `odom`, and a scan in a frame that no transform mentions is simply not drawn (notebook 12).
#
# If I1 and I5 passed, try two of *your* robots, each in a namespace.
# Write a launch file like `two_carts_launch.py` with `package='ros2_robot_controller'`, start it with `launched`, and count the nodes.
#
# > **On a real TurtleBot 4:** with `use_sim_time:=true` no timer ever fires, because there is no `/clock`; [docs/turtlebot4.md](../docs/turtlebot4.md) lists all that differs.
#
# ## Go further
#
# Not needed for the next notebook.
#
# - If your launch files have no argument `raw_scan` yet, add one, and use it in a remapping of `sensor_processor`. Then a real robot needs only `raw_scan:=scan`, and with `run_node(launch="robot_controller_launch.py raw_scan:=scan")` both nodes get scans.
# - A parameter can describe itself: pass a `ParameterDescriptor` with a `FloatingPointRange` after the default. `ros2 param describe` shows it, and ROS refuses values outside before it calls your callback. How does it treat NaN?
# - `ros2 param load /robot_controller file.yaml` sets a whole file at run time. Which of its lines are refused, and are the others set?

# %% [markdown]
# ## Recall
#
# <details><summary>Your parameter file has no effect, and there is no message. Name two reasons.</summary>
#
# Its key matches no node (another name, or a namespace), or a parameter's name is misspelt.
# A third: you changed it in `src/` but did not install it again, so the launch file reads the old one.
# </details>
#
# <details><summary>Why is <code>/scan</code> in a node's code a fault, though it works?</summary>
#
# It works for one robot.
# An absolute name stays where it is when the node is put into a namespace, so the second robot would use the first one's lidar.
# </details>

# %% [markdown] tags=["whole"]
# <details><summary>Where must the callback that refuses values be registered, and why?</summary>
#
# Before the first `declare_parameter`.
# Values from files and the command line are set while a parameter is declared.
# </details>
#
# <details><summary><code>ros2 param get</code> says 5 Hz, <code>ros2 topic hz</code> says 10. What happened?</summary>
#
# The node made its timer with the old rate, and did not replace it.
# </details>

# %% [markdown]
# **Next:** [09 Tests that notice](09_tests_that_notice.ipynb). You will often change such numbers. How do you notice when a change breaks something?

# %%
from grader.notebook import progress

progress()
