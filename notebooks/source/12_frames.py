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
# # 12 Frames
#
# ![A robot in a room with the axes of its four frames, and the tree that they form](pictures/12.png)
#
# "There is something at 2.04 m."
# Seen from where, in which direction, and at what time?
# A robot that gets one of the three wrong makes a map in which every wall appears twice.
#
# This notebook gives no points, and does not change your package.
#
# **You will be able to**
#
# - say what the frames `map`, `odom`, `base_link` and `laser` are for, and who publishes each transform;
# - compose, invert and interpolate transforms, and find the way through a tree of them;
# - say what tf2 answers, why it sometimes refuses to, and which time to ask for;
# - write the adapter that lets a package drive a robot with other frames, types and names;
# - recognise by a picture that a lidar's angle is wrong, that a time is wrong, or that odometry has drifted.
#
# **Time:** 95 to 210 minutes, in three parts.
# Part 1: 40 to 90 minutes.
# Part 2, from "From any frame to any other": 30 to 65 minutes.
# Part 3, from "An adapter": 25 to 55 minutes.
#
# The tree, with each frame's place in the one above it:
#
#     map                    the room: it never moves
#     └── odom               where the drive began, as far as the wheels can tell
#         └── base_link      the robot's centre, x ahead, y to the left
#             └── laser      the lidar, bolted to the robot

# %%
import math
from bisect import bisect_left, bisect_right

from grader.notebook import begin, tries
from grader.notebook.frames import ExtrapolationException, check, place, seconds, transform
from grader.notebook.sliders import slide

begin("12")

# %% [markdown]
# (You can ignore a message about missing files: this notebook needs none of them.)
#
# ## Three questions first
#
# Answer them aloud, then unfold.
#
# <details><summary>Notebook 04: which beam of a TurtleBot 4's lidar looks ahead?</summary>
#
# The one at -90°: angles are counted from the lidar's own x axis, and the lidar is turned by 90° to the left.
# </details>
# <details><summary>Notebook 03: what lies half-way between the headings 179° and -179°?</summary>
#
# 180°. The mean of the two numbers, 0°, points the other way: the difference has to be normalized first.
# </details>
# <details><summary>Notebook 05: a scan waited in a queue for 0.3 s. Which time tells you how old it is?</summary>
#
# `header.stamp`, the time at which it was measured. The time at which it arrived says nothing about the world.
# </details>
#
# ## A place in a frame
#
# A **frame** is an origin and two axes.
# A **transform** says where one frame is in another, here by x, y and the yaw.
# ROS sends it as a `TransformStamped`, on the topics `/tf` (what moves) and `/tf_static` (what is bolted on).
#
# Here is the transform of a TurtleBot 4's lidar: 4 cm behind the centre, turned by 90° to the left.

# %%
mounted = transform("base_link", "laser", 0.0, (-0.04, 0.0, math.pi / 2))
print(mounted.header.frame_id, "->", mounted.child_frame_id, "at", seconds(mounted), "s")
print(mounted.transform.translation)
print(mounted.transform.rotation)
print("x, y, yaw:", place(mounted))

# %% [markdown]
# `frame_id` is the **parent**, `child_frame_id` the **child**, and the numbers are the child's place in the parent.
# `transform` and `place` come with the kit; they turn three numbers into the message, and the message into three numbers.
#
# Why do we need a tree, and not just one list of places in the room?
# Each program knows only one step: a drawing of the robot shows where the lidar is, the wheels measure the way since the start, and only the localisation knows the room.
#
# **By hand.** The robot is at (2, 1) in `odom` and faces along +y (its yaw is 90°).
# Where in `odom` is its lidar, and where does the lidar's x axis point?
#
# - 4 cm *behind* the centre: the robot faces along +y, so behind is -y: **(2, 0.96)**
# - 90° to the left of +y: **180°**, along -x
#
# ## Compose and invert
#
# Now the same with a formula.
# Let `a` be B's place in A, and `b` be C's place in B.
# Turn b's shift by a's yaw, add a's shift, add the yaws:
#
# $$ x = x_a + x_b\cos\psi_a - y_b\sin\psi_a \qquad y = y_a + x_b\sin\psi_a + y_b\cos\psi_a \qquad \psi = \psi_a + \psi_b $$
#
# The **inverse** answers the question the other way round: where is A, seen from B?
# Composed with `a`, the inverse gives (0, 0, 0).
#
# **Predict:** the robot is at (2, 1, 90°) in `odom`. Where is the origin of `odom`, seen from the robot: ahead, behind, left or right?
#
# **Exercise TF1.** A place is a tuple `(x, y, yaw)`. Write both functions.

# %% tags=["function"]
def compose(a, b):
    """Return c's place in A, where a is B's place in A, and b is c's place in B."""
    return 0.0, 0.0, 0.0  # TODO


def inverse(a):
    """Return A's place in B, where a is B's place in A."""
    return 0.0, 0.0, 0.0  # TODO: which place, composed with a, gives (0, 0, 0)?

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# `compose` is the formula above. For `inverse`, set x and y of the result to 0 and solve for b; begin with its yaw.
# </details>
# <details><summary>Hint 2: the formulas</summary>
#
# `x, y, yaw = a` takes a tuple apart. The inverse first undoes the shift, (-x, -y), and then turns the result by -yaw. cos(-yaw) is cos(yaw), sin(-yaw) is -sin(yaw).
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# def inverse(a):
#     x, y, yaw = a
#     cos, sin = math.cos(yaw), math.sin(yaw)
#     return -cos * x - sin * y, ..., -yaw  # the second one has sin * x in it, and -cos * y
# ```
# </details>

# %%
right = math.pi / 2
tries({
    "compose((2.0, 1.0, right), (-0.04, 0.0, right))": (2.0, 0.96, math.pi),
    "compose((0.0, 0.0, 0.0), (0.3, 0.4, 0.5))": (0.3, 0.4, 0.5),
    "compose((1.0, 0.0, math.pi), (0.5, 1.0, 0.0))": (0.5, -1.0, math.pi),
    "inverse((2.0, 1.0, right))": (-1.0, 2.0, -right),  # behind, and to the left
    "compose(inverse((2.0, 1.0, right)), (2.0, 1.0, right))": (0.0, 0.0, 0.0),
})

# %% tags=["check"]
check("TF1", compose, inverse)

# %% [markdown]
# ## Ninety degrees
#
# A TurtleBot 4 stands in a room, at (1, 1), and faces along x.
# The cells draw its scan into the room's plan: each reading is a place in `laser`, `laser` has a place in `base_link`, and so on up to `map`.

# %%
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

from sim import COURSE, TB4, Box, Circle, Pose, Simulator, Twist, World, drive, room
from sim.views import draw_obstacles, draw_robot

THINGS = (*room((0.0, 0.0), (6.0, 4.0)), Box((3.0, 2.0), (1.2, 0.5)), Box((0.25, 2.2), (0.5, 0.8)))
ROOM = World("a room", (*THINGS, Circle((4.2, 2.2), 0.2)), start=Pose(1.0, 1.0, 0.0))


def points(ranges, angles, laser):
    """Return x and y of a scan's readings, in the frame in which the lidar's place is `laser`."""
    x, y, yaw = laser
    ranges = np.where(np.isfinite(ranges), ranges, np.nan)  # inf has no place
    return x + ranges * np.cos(angles + yaw), y + ranges * np.sin(angles + yaw)

# %% [markdown]
# **Predict:** a program takes the lidar's axes for the robot's. How will the points lie in the plan?
#
# **Move the slider** until they lie on the walls.

# %% tags=["nbval-ignore-output"]
# A slider has another name in each run, so the output is not compared.
scan = Simulator(ROOM, TB4, seed=2).scan()


def first_scan(turned_by):
    laser = compose((1.0, 1.0, 0.0), (-0.04, 0.0, math.radians(turned_by)))
    _, axes = plt.subplots(figsize=(6.5, 6.0), layout="constrained")
    draw_obstacles(axes, ROOM.obstacles)
    draw_robot(axes, ROOM.start, TB4.radius)
    axes.plot(*points(scan.ranges, scan.angles, laser), ".", color="#E69F00", markersize=4)
    axes.set(xlim=(-1.6, 6.6), ylim=(-4.3, 4.5), aspect="equal", xlabel="x in map (m)", ylabel="y in map (m)")
    axes.set_title(f"the lidar's yaw in base_link: {turned_by:.0f}°")
    return f"A scan over the room's plan, with a lidar that is thought to be turned by {turned_by:.0f}°"


slide(first_scan, turned_by=(0.0, 100.0, 0.0))

# %% [markdown]
# At 90° every point lies on a wall, a box or the post (the circle).
# At 0° the room is drawn turned to the right, as if it were a different room.
# The scan holds the same 360 numbers each time; only one number of one transform was wrong.
# (Until your `compose` works, all points lie around the origin, whatever the slider says.)
#
# **What would a robot do** if it took angle 0 for straight ahead and drove at the wall 5 m in front of it?
# It would look to its left, where everything stays at least 0.7 m away, and drive into the wall.

# %% [markdown]
# ## A transform has a time
#
# The lidar does not move on the robot, but the robot moves in the room.
# So the question "where is `laser` in `map`?" has an answer only for a certain time.
#
# Let the robot drive around four corners for 100 s, using only its odometry.
# (It has the accurate wheels of the course's robot. Worse ones come later.)

# %%
CORNERS = [(4.0, 0.0), (4.0, 2.0), (0.0, 2.0), (0.0, 0.0)] * 3  # in odom, which begins at the robot


def along_corners(seen):
    x, y = seen.odometry.pose.point_from_parent(CORNERS[0])
    if math.hypot(x, y) < 0.08:
        CORNERS.pop(0)
    bearing = math.atan2(y, x)
    return Twist(0.3 if abs(bearing) < 0.3 else 0.0, max(-1.0, min(1.0, 1.5 * bearing)))

# %%
good = replace(TB4, odometry=replace(COURSE.odometry, starts_at_zero=True))
trip = drive(Simulator(ROOM, good, seed=2), along_corners, 100.0)
by_wheels = zip(trip.odom_x, trip.odom_y, trip.odom_yaw)
driven = [transform("odom", "base_link", t, where) for t, where in zip(trip.t, by_wheels)]
print(f"{len(driven)} transforms, one every {trip.t[1] - trip.t[0]:.2f} s; {len(trip.scan_t)} scans")
print("stamps of transforms:", [f"{seconds(message):.3f}" for message in driven[200:204]])
print("stamps of scans:     ", [f"{t:.3f}" for t in trip.scan_t[56:59]])

# %% [markdown]
# None of these scans has the stamp of a transform, because two devices measure them, each at its own rate.
# So the place at a scan's time has to be **interpolated** between the transforms around it.
#
# By hand: the robot is at x = 1.000 m at 10.00 s and at x = 1.015 m at 10.05 s. At 10.02 s, two fifths of the way, it is at 1.000 + 0.4 · 0.015 = **1.006 m**.
#
# **Predict:** its yaw is 3.1 at 10.00 s and -3.1 at 10.05 s. What is it at 10.025 s? (One of the three questions at the top.)
#
# **Exercise TF2.** `at` gets the messages of one child in the order of their stamps, and a time:
#
# - before the first or after the last message: `raise ExtrapolationException(...)` with a message that names both times. tf2 has an exception of that name, for the same case;
# - at the time of a message: its place; between two: x and y along the straight line, the yaw the short way round.
#
# As it is now, it returns the latest place, whatever the time. Most programs begin with that mistake.

# %% tags=["function"]
def at(messages, time):
    """Return the place of the messages' child in its parent at `time` (s).

    `messages` are in the order of their stamps. A time outside of them raises an ExtrapolationException.
    """
    return place(messages[-1])  # TODO: refuse; find the messages around the time; go `share` of the way

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# Write first the two refusals, then the index in the list, and then the arithmetic. `share` is 0 at the message before and 1 at the one after. By how much does the yaw change, the short way round?
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `bisect_left(messages, time, key=seconds)`, imported above, returns the index of the first message whose stamp is not below `time`. `math.remainder(difference, math.tau)` returns the difference of two angles the short way round.
# </details>
# <details><summary>Hint 3: all but the last line</summary>
#
# ```python
# after = bisect_left(messages, time, key=seconds)
# if seconds(messages[after]) == time:
#     return place(messages[after])
# start, end = place(messages[after - 1]), place(messages[after])
# share = (time - seconds(messages[after - 1])) / (seconds(messages[after]) - seconds(messages[after - 1]))
# turn = math.remainder(end[2] - start[2], math.tau)
# return ...  # x, y, yaw: each is its start, and `share` of what it changes by
# ```
# </details>

# %%
two = [transform("odom", "base_link", 10.0, (1.0, 2.0, 3.1)), transform("odom", "base_link", 10.5, (2.0, 2.0, -3.1))]


def refuses(time):
    """Return whether `at` raises the exception for the two messages."""
    try:
        return f"no, it says {at(two, time)}"
    except ExtrapolationException:
        return True

# %%
tries({
    "at(two, 10.0)": (1.0, 2.0, 3.1),
    "at(two, 10.1)[:2]": (1.2, 2.0),
    "math.cos(at(two, 10.25)[2])": -1.0,  # 180 degrees, not 0
    "refuses(10.51)": True,
    "refuses(9.99)": True,
})

# %% tags=["check"]
check("TF2", at)

# %% [markdown]
# ## From any frame to any other
#
# tf2 keeps the transforms of the last ten seconds in a **buffer**, and never forgets the static ones.
# This small one forgets nothing: `parent` holds each frame's parent, and `placed` says where a frame is in its parent.

# %%
class Buffer:
    """The transforms of a robot."""

    def __init__(self):
        self.parent, self.moving, self.static = {}, {}, {}

    def add(self, message, static=False):
        child = message.child_frame_id
        self.parent[child] = message.header.frame_id
        if static:
            self.static[child] = message
        else:
            self.moving.setdefault(child, []).append(message)

    def placed(self, child, time):
        """Return where `child` is in its parent at `time` (s)."""
        return place(self.static[child]) if child in self.static else at(self.moving[child], time)

# %%
buffer = Buffer()
buffer.add(mounted, static=True)
buffer.add(transform("map", "odom", 0.0, (1.0, 1.0, 0.0)), static=True)  # for now: where the drive began
for message in driven:
    buffer.add(message)
print(buffer.parent)
print("base_link in odom at 20.0 s:", [round(value, 2) for value in buffer.placed("base_link", 20.0)])

# %% [markdown]
# It lacks tf2's main function, `lookup_transform(target, source, time)`: where is the frame `source`, seen from `target`?
# With it, you can answer every question in one line: a scan needs `lookup(buffer, "map", "laser", t)`.
#
# **Exercise TF3.** Write `lookup`, for any tree. There is no skeleton: how to find the way is up to you. Your function is accepted if
#
# - up, down and across all work: `lookup(buffer, "laser", "map", t)` and, with a camera beside the lidar, `lookup(buffer, "laser", "camera", t)`;
# - it asks `placed` only for what it needs: two things that are bolted to the robot stay in the same place relative to each other, even at a time for which there is no odometry;
# - it raises an exception for two frames that are not in one tree.
#
# First draw the tree on paper, with a camera in it, and move a finger from `camera` to `laser`. Where does the finger stop climbing and go down?

# %% tags=["function", "design"]
def lookup(buffer, target, source, time):
    """Return the place of the frame `source` in the frame `target` at `time` (s)."""
    return 0.0, 0.0, 0.0

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# One step up is `compose(buffer.placed(frame, time), ...)`, one step down is `inverse(...)` of the same. The finger stops climbing at the first frame that is above both (or is one of the two).
# </details>
# <details><summary>Hint 2: what to ask first</summary>
#
# A list of a frame's ancestors needs no `placed`, only `buffer.parent`. With two such lists, or with two depths, you know which of the two frames has to climb.
# </details>

# %%
def rounded(target, source, time):
    return tuple(round(value, 3) for value in lookup(buffer, target, source, time))


tries({
    "rounded('base_link', 'laser', 20.0)": (-0.04, 0.0, 1.571),
    "rounded('laser', 'base_link', 20.0)": (0.0, -0.04, -1.571),
    "rounded('map', 'laser', 0.0)": (0.96, 1.0, 1.571),
    "rounded('base_link', 'laser', 1e6)": (-0.04, 0.0, 1.571),  # bolted on, so at any time
})

# %% tags=["check"]
check("TF3", lookup)

# %% [markdown]
# <details><summary>Two designs, to compare with yours</summary>
#
# *Two lists.* Write down each frame's ancestors, find the first common one, compose both ways up to it, and join them:
#
# ```python
# def ancestors(buffer, frame):
#     return [frame, *ancestors(buffer, buffer.parent[frame])] if frame in buffer.parent else [frame]
#
# def lookup(buffer, target, source, time):
#     down, up = ancestors(buffer, target), ancestors(buffer, source)
#     common = next(frame for frame in up if frame in down)  # StopIteration if there is none
#     def below(frames):
#         found = (0.0, 0.0, 0.0)
#         for frame in frames[: frames.index(common)]:
#             found = compose(buffer.placed(frame, time), found)
#         return found
#     return compose(inverse(below(down)), below(up))
# ```
#
# *The deeper one climbs.* It goes up one step, and then asks the same question again:
#
# ```python
# if source == target:
#     return 0.0, 0.0, 0.0
# if depth(source) >= depth(target):
#     return compose(lookup(buffer, target, buffer.parent[source], time), buffer.placed(source, time))
# return compose(inverse(buffer.placed(target, time)), lookup(buffer, buffer.parent[target], source, time))
# ```
#
# The first has parts that you can read and try one by one; the second is shorter, but counts depths again in every step.
# Both ask only for what lies on the way.
# A third design, "everything up to `map`, then compare", is the simplest, but it refuses whenever the localisation is late, even for two things that are bolted to the robot.
# </details>
#
# ## The same post in four frames
#
# The post in the room (the circle) never moves, but each frame has its own numbers for its place.
# Here `odom` is shifted and turned in `map`, as it is after a robot has been started somewhere in the room.
# A frame's x axis is red and its y axis green, as in RViz.
# Your `compose`, `inverse` and `lookup` compute all of it; until they work, the axes lie in a corner.
#
# **Predict:** the robot moves and turns. In which of the four frames do the post's numbers change?
#
# **Move the robot** with the sliders, turn it, and find out:
#
# - Where can the robot stand if the post is to be at (1, 0) in `base_link`?
# - Set the yaw to 30°. In which direction does the robot have to go so that only the post's x in `base_link` changes?

# %%
def seen_from(frame, axes, tree):
    """Draw a frame, and return in words where the post is, seen from it."""
    for tip, color in (((0.5, 0.0, 0.0), "#C0392B"), ((0.0, 0.5, 0.0), "#27864A")):
        (x, y, _), end = lookup(tree, "map", frame, 0.0), compose(lookup(tree, "map", frame, 0.0), tip)
        axes.annotate("", end[:2], (x, y), arrowprops={"arrowstyle": "->", "color": color, "lw": 2})
    axes.text(x - 0.2, y + (0.6 if frame == "laser" else -0.35), frame, family="monospace")
    x, y, _ = lookup(tree, frame, "post", 0.0)
    return f"{frame:9s} ({x:5.2f}, {y:5.2f})"

# %% tags=["nbval-ignore-output"]
# A slider has another name in each run, so the output is not compared.
def four_frames(x, y, yaw):
    odom, robot = (0.8, 0.6, 0.4), (x, y, math.radians(yaw))
    places = [("map", "odom", odom), ("odom", "base_link", compose(inverse(odom), robot))]
    places += [("base_link", "laser", place(mounted)), ("map", "post", (4.2, 2.2, 0.0))]
    tree = Buffer()
    for parent, child, where in places:
        tree.add(transform(parent, child, 0.0, where), static=True)
    _, axes = plt.subplots(figsize=(7.5, 5.9), layout="constrained")
    draw_obstacles(axes, ROOM.obstacles, alpha=0.4)
    draw_robot(axes, Pose(*robot), TB4.radius)
    said = [seen_from(frame, axes, tree) for frame in ("map", "odom", "base_link", "laser")]
    axes.set(xlim=(-0.6, 6.4), ylim=(-0.6, 4.4), aspect="equal", xlabel="x in map (m)", ylabel="y in map (m)")
    axes.set_title("\n".join(["the post in", *said]), family="monospace", loc="left")
    return f"The axes of four frames in a room, and the place of the post in each: {' '.join(' '.join(said).split())}"


slide(four_frames, x=(0.0, 6.0, 2.0), y=(0.0, 4.0, 1.0), yaw=(-150.0, 150.0, 0.0))

# %% [markdown]
# In `map` and in `odom` the post's numbers stay the same: neither frame moves with the robot.
# In `base_link` and in `laser` they change with every move, although the post has not moved.
# The post is at (1, 0) in `base_link` wherever the robot stands 1 m away from it and faces it: anywhere on a circle, with one yaw for each place.
# And with a yaw of 30° it has to go along the red axis of `base_link`, which points 30° to the left of the x axis of `map`: a direction belongs to a frame, just as a place does.
#
# ## Ask at the right time
#
# The next cell draws every third scan of the first 50 s in `map`.
# A program that asks for the robot's place only when it *handles* a scan gets the place of a later moment.
#
# **Predict:** what does the picture look like if each place is that of 0.2 s later? Where is it worst: on the straights, or in the corners?

# %% tags=["nbval-ignore-output"]
# A slider has another name in each run, so the output is not compared.
def sharpness(late):
    _, axes = plt.subplots(figsize=(7.5, 4.8), layout="constrained")
    draw_obstacles(axes, ROOM.obstacles, alpha=0.4)
    for t, ranges in zip(trip.scan_t[:280:3], trip.scan_ranges[:280:3]):
        x, y = points(ranges, trip.scan_angles, lookup(buffer, "map", "laser", t + late))
        axes.plot(x, y, ".", color="#E69F00", markersize=1)
    axes.set(xlim=(-0.8, 6.8), ylim=(-0.8, 4.8), aspect="equal", xlabel="x in map (m)", ylabel="y in map (m)")
    axes.set_title(f"each scan drawn from where the lidar was {late:.2f} s later")
    return f"Scans of 50 s in the map, each drawn where the lidar was {late:.2f} s after it was measured"


slide(sharpness, late=(0.0, 0.5, 0.2))

# %% [markdown]
# On a straight the place is wrong by 0.3 m/s · 0.2 s = 6 cm.
# In a corner the robot turns at up to 1 rad/s, so its yaw is wrong by up to 0.2 rad: at a distance of 4 m that is 0.8 m.
# So the double walls come from the corners.
# With the slider at 0 the walls are only as thick as the lidar's noise.
#
# The right time is `scan.header.stamp`.
# **Predict:** a node gets a scan, and asks at once where the lidar was at the scan's stamp. Which is the latest transform that the node can have? What does your `at` say?

# %%
def answered(wait):
    """Return for how many scans there is an answer `wait` seconds after they were measured."""
    count = 0
    for t in trip.scan_t[:280]:
        known = driven[: bisect_right(driven, t + wait, key=seconds)]
        try:
            at(known, t)
            count += 1
        except ExtrapolationException as error:
            last_words = error
    return f"{count} of 280" + (f"; the last refusal: {last_words}" if count < 280 else "")


for wait in (0.0, 0.02, 0.05):
    print(f"{wait:.2f} s after the scan: {answered(wait)}")

# %% [markdown]
# At the time of the scan there is no transform *after* it yet, and without that one tf2 could only guess the place.
# (About one scan in ten happens to have the same stamp as a transform.)
# tf2 does not guess, but refuses with these words:
#
#     Lookup would require extrapolation into the future.  Requested time 27.312000 but the latest data is at time
#     27.300000, when looking up transform from frame [laser] to frame [map]
#
# The next transform comes at most 50 ms later, and then each scan has its answer.
#
# | you ask for | tf2 answers | right for |
# |---|---|---|
# | the stamp, at once | often: extrapolation into the future | nothing |
# | the stamp, with a `timeout` of 0.1 s | the place, after a few hundredths of a second | scans, images: whatever was measured |
# | time 0 | the latest time for which *every* step on the way is known | "where am I, roughly": displays |
# | the clock's now | nearly always: extrapolation into the future | nothing |
# | a stamp from a minute ago | extrapolation *into the past*: the buffer has ten seconds | nothing; transform while it is fresh |
#
# In Python the timeout sleeps in the callback. With only one thread, the transform that it waits for cannot arrive (as with the service in notebook 06 that waits for its own node).
# So write `await buffer.lookup_transform_async(...)`, or spin with a `MultiThreadedExecutor`, or keep the scan and ask when the next odometry comes.
#
# ## Odometry drifts
#
# Odometry only counts the turns of the wheels.
# Suppose that one wheel is a small `share` larger than the program believes. Then in each metre the robot turns by `share` / 0.233 rad without noticing (0.233 m is the distance between the wheels).
#
# By hand, for 1 %: 0.01 / 0.233 m = 0.043 rad/m. After 10 m that is 0.43 rad, **25°**.
#
# **Predict:** how far off is the odometry after 100 s, nearly two laps, if one wheel is half a percent larger? (For comparison: the robot's radius is 17 cm.)

# %%
def odometry(percent):
    """Return x, y, yaw in odom at each sample, as seen by wheels that differ by so many percent."""
    step = np.hypot(np.diff(trip.x), np.diff(trip.y))
    yaw = np.unwrap(trip.yaw) - np.cumsum([0.0, *step]) * percent / 100 / 0.233
    way = (yaw[1:] + yaw[:-1]) / 2
    return np.cumsum([0.0, *step * np.cos(way)]), np.cumsum([0.0, *step * np.sin(way)]), yaw

# %% tags=["nbval-ignore-output"]
# A slider has another name in each run, so the output is not compared.
def drifted(percent):
    x, y, _ = odometry(percent)
    x, y = x + 1.0, y + 1.0  # the place of odom in map
    off = math.hypot(x[-1] - trip.x[-1], y[-1] - trip.y[-1])
    _, axes = plt.subplots(figsize=(7.5, 4.4), layout="constrained")
    draw_obstacles(axes, ROOM.obstacles)
    axes.plot(trip.x, trip.y, color="#0072B2", label="where it was")
    axes.plot(x, y, "--", color="#D55E00", label="where its wheels say it was")
    axes.set(aspect="equal", xlabel="x in map (m)", ylabel="y in map (m)", title=f"{off:.2f} m off at the end")
    axes.legend(loc="lower right")
    return f"Two paths over the room's plan: with {percent:.2f} % the odometry is {off:.2f} m off at the end"


slide(drifted, percent=(0.0, 2.0, 0.5))

# %% [markdown]
# Each step is almost right, but the errors add up, and their sum grows without limit.
# No filter for the wheels' numbers can help, because the odometry does not see the room.
#
# **Localisation** does see the room: a node compares scans with a map, and finds where `base_link` is in `map`.
#
# **Predict:** why can it not publish a transform from `map` to `base_link` in a tree? Which transform does it publish instead, so that the way from `map` to `base_link` gives what it has found?
#
# <details><summary>Answer</summary>
#
# A frame has one parent, and `base_link` has one already: `odom`.
# So it publishes `map` to `odom`, a correction that makes the composition right:
# found = compose(correction, odometry), and therefore correction = compose(found, inverse(odometry)).
# This transform does not say where the robot is, but *how wrong the odometry is by now*.
# </details>
#
# The simulator knows the truth, so it can stand in for the localisation.
# It gives a correction every 10 s, for wheels that differ by a quarter of a percent.

# %%
by_wheels = zip(*odometry(0.25))
drifting = [transform("odom", "base_link", t, where) for t, where in zip(trip.t, by_wheels)]
found = list(zip(trip.x, trip.y, trip.yaw))
corrections = [compose(found[i], inverse(place(drifting[i]))) for i in range(0, len(drifting), 200)]
for number, (x, y, yaw) in list(enumerate(corrections))[::3]:
    turned = math.degrees(math.remainder(yaw, math.tau))
    print(f"at {10 * number:2d} s odom is in map at ({x:.2f}, {y:.2f}) m, turned by {turned:.1f}°")

# %% [markdown]
# The next cell draws the scans of the 100 s twice: with the first correction only, and with the latest correction at each time.
# **Predict:** in which of the two pictures are the walls double?
# The figure after that shows the disadvantage: the robot's y around the correction at 60 s, in both frames.

# %%
figure, plots = plt.subplots(1, 2, figsize=(11, 4), sharey=True, layout="constrained")
for axes, title in zip(plots, ("by odometry alone", "with a correction every 10 s")):
    for t, ranges in zip(trip.scan_t[:-3:5], trip.scan_ranges[:-3:5]):
        odom = corrections[0] if axes is plots[0] else corrections[int(t / 10.0)]
        laser = compose(compose(odom, at(drifting, t)), place(mounted))
        x, y = points(ranges, trip.scan_angles, laser)
        axes.plot(x, y, ".", color="#E69F00", markersize=1)
    axes.set(xlim=(-0.8, 6.8), ylim=(-0.8, 4.8), aspect="equal", xlabel="x in map (m)", title=title)
    draw_obstacles(axes, ROOM.obstacles, alpha=0.4)
plots[0].set_ylabel("y in map (m)");

# %%
around = slice(1150, 1251)
figure, axes = plt.subplots(figsize=(8, 2.6), layout="constrained")
in_map = [compose(corrections[i // 200], place(drifting[i]))[1] for i in range(1150, 1251)]
in_first = [compose(corrections[0], place(message))[1] for message in drifting[around]]
axes.plot(trip.t[around], in_first, color="#D55E00", label="by odom: smooth, and wrong")
axes.plot(trip.t[around], in_map, color="#0072B2", label="by map: right, and it jumps")
axes.plot(trip.t[around], trip.y[around], ":", color="0.4", label="the truth")
axes.set(xlabel="simulated time (s)", ylabel="y (m)")
axes.grid(alpha=0.3)
axes.legend();

# %% [markdown]
# That is why there are two frames, and not one:
#
# | | `odom` | `map` |
# |---|---|---|
# | within a second | right, and without a jump | jumps by a few centimetres when a correction comes |
# | after an hour | wrong by metres | right |
# | so use it to | steer, brake, follow a path | remember a place: a goal, a door, a charger |
# | which node says where the frame is | the localisation | none: it is the root |
#
# The contract's goals are in `odom` (notebook 07), because the course's robot drives for a minute and has no map.
# A navigator that drives all day takes its goal in `map`, and in each control step asks tf2 where that is in `odom`.
#
# ## An adapter
#
# Part 3: 25 to 55 minutes.
#
# Your package drives a robot whose lidar faces ahead and whose `cmd_vel` takes a `Twist`.
# A TurtleBot 4 differs in both, and if there are several of them, each has a **namespace** of its own.
# You could change your package, but then it would no longer drive the course's robot.
# An **adapter** is a small node between package and robot, so that neither has to change.
#
# Before you write one, you need a recording of the other robot, which ROS calls a **bag**.
# No TurtleBot 4 was available for this course, so the bag comes from the simulator with its TurtleBot profile: a lidar that is turned and behind the centre, stamped commands, slower wheels.
# In an empty room, the robot drives straight ahead and stops before the wall at x = 6.

# %%
import copy

from geometry_msgs.msg import TwistStamped

from grader.notebook.frames import read_bag
from sim.bag import write_bag

BAG = "../../turtlebot4_bag"
# !rm -rf {BAG}
aisle = Simulator(World("an empty room", room((0.0, 0.0), (6.0, 4.0)), start=Pose(1.0, 2.0, 0.0)), TB4, seed=4)
write_bag(drive(aisle, lambda seen: Twist(0.3 if aisle.pose.x < 5.2 else 0.0, 0.0), 16.0), BAG)
# !ros2 bag info {BAG} | grep -o "Topic: .*Type: [^ ]*"

# %% [markdown]
# Look at the type of `/cmd_vel`, and at the frame of a scan:

# %%
scans, commands = read_bag(BAG, "/scan"), read_bag(BAG, "/cmd_vel")
print(type(commands[0]).__name__, "and", type(scans[0]).__name__, "in", scans[0].header.frame_id)
print(f"angles from {scans[0].angle_min:.2f} to {scans[0].angle_max:.2f} rad")

# %% [markdown]
# **Predict:** a package that knows nothing of frames takes angle 0 for straight ahead. While the robot drives towards the wall, how does the closest reading within 15° of angle 0 change?
#
# **Exercise TF4.** Write the three functions that such a node needs:
#
# - `stamped(command, now)` returns a `TwistStamped` with the command, the stamp `now`, and the frame `base_link`;
# - `turned(scan, yaw)` returns a scan whose angles are counted from the robot's x axis, for a lidar that is turned by `yaw` on the robot. Its frame is `base_link`; its stamp and its readings are those of `scan`. Leave `scan` itself as it is: other parts of the program may still use it;
# - `names(namespace)` returns a dictionary: for each topic of your package, its full name on a robot in that namespace (`""` or `"/robot1"`). `scan`, `cmd_vel` and `odom` have the same names there; `imu/data` and `battery/state` are called `imu` and `battery_state`.

# %% tags=["function"]
def stamped(command, now):
    """Return the command (Twist) as a TwistStamped of the time `now` (a Time message)."""
    return command  # TODO


def turned(scan, yaw):
    """Return a scan with its angles from the robot's x axis, for a lidar turned to the left by `yaw` (rad)."""
    return scan  # TODO: a copy with other angles


def names(namespace):
    """Return the robot's full name for each topic of the package."""
    return {}  # TODO

# %% [markdown]
# <details><summary>Hint 1: where to look</summary>
#
# A lidar is turned to the left by yaw. What it sees at its angle 0 is at the angle yaw for the robot. So is yaw added or subtracted? Two fields of the scan change; the step between beams does not.
# </details>
# <details><summary>Hint 2: the API</summary>
#
# `TwistStamped(twist=command)`, then set its header. `copy.deepcopy(scan)` returns a copy that you may change. A full name begins with a slash: `f"{namespace}/scan"`.
# </details>
# <details><summary>Hint 3: <code>turned</code>, all but one line</summary>
#
# ```python
# result = copy.deepcopy(scan)
# result.angle_min += yaw
# ...                       # the same for the other end
# result.header.frame_id = "base_link"
# return result
# ```
# </details>

# %%
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Twist as TwistMessage


def ahead(scan):
    """Return the closest reading within 15° of angle 0."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    return float(np.asarray(scan.ranges)[np.abs(angles) < math.radians(15)].min())


sent = TwistMessage()
sent.linear.x = 0.2
tries({
    "stamped(sent, Time(sec=7)).header.stamp.sec": 7,
    "stamped(sent, Time(sec=7)).twist.linear.x": 0.2,
    "round(ahead(turned(scans[0], math.pi / 2)), 1)": 5.0,
    "round(ahead(turned(scans[-1], math.pi / 2)), 1)": 0.8,
    "names('/robot1').get('imu/data')": "/robot1/imu",
    "names('').get('scan')": "/scan",
})

# %%
figure, axes = plt.subplots(figsize=(8, 2.8), layout="constrained")
when = [scan.header.stamp.sec + scan.header.stamp.nanosec * 1e-9 for scan in scans]
axes.plot(when, [ahead(scan) for scan in scans], color="#D55E00", label="as it comes from the lidar")
axes.plot(when, [ahead(turned(scan, math.pi / 2)) for scan in scans], color="#0072B2", label="from the adapter")
axes.set(xlabel="simulated time (s)", ylabel="closest reading ahead (m)", ylim=(0, None))
axes.grid(alpha=0.3)
axes.legend();

# %% tags=["check"]
check("TF4", stamped, turned, names)

# %% [markdown]
# Without the adapter, the package looks at the wall to the robot's left, at y = 4, and so does not stop.
#
# The rest of the node is two subscriptions and two publishers. The whole node is [docs/turtlebot4/adapter.py](../docs/turtlebot4/adapter.py), and the launch file next to it does the work of `names` with remappings. Compare them with yours.
#
# One difference stays: the lidar is 4 cm behind the robot's centre, so each distance ahead is 4 cm too long. **Is that error on the safe side?** No: the robot would stop too late, so the launch file raises `emergency_stop_distance`.
#
# > **On a real TurtleBot 4**
# >
# > - `ros2 run tf2_ros tf2_echo base_link rplidar_link` prints the ninety degrees, `ros2 run tf2_tools view_frames` draws the tree, and RViz shows it moving (*Add, TF*). The lidar's frame is called `rplidar_link` there.
# > - In a node: `buffer = tf2_ros.Buffer()`, `listener = tf2_ros.TransformListener(buffer, node)`, then `buffer.lookup_transform("odom", "rplidar_link", scan.header.stamp)`. There are no Python wheels of tf2, so this kit cannot run that.
# > - "Extrapolation into the future" by *seconds*, not hundredths: the clocks of two computers differ. `chrony` on both is the cure, not a longer timeout.
# > - Within one scan: a revolution of this lidar takes 0.1 to 0.18 s, so in a corner, at 1 rad/s, the robot turns by 6° to 10° between the first beam and the last. `laser_geometry` can correct that, with two lookups for each scan.
# > - [docs/turtlebot4.md](../docs/turtlebot4.md) says how to run your package on one, with the adapter.

# %% [markdown]
# ## Go further
#
# - Let `Buffer.add` forget what is older than ten seconds, and let `at` say, in tf2's words, which of the two refusals it is.
# - `add` trusts the order in which messages arrive. Over a radio link they may not arrive in the order of their stamps: where does `bisect.insort` belong?
# - Time 0 in tf2 means "the latest for which all is known". Write `latest(buffer, target, source)`: the smallest of the last stamps on the way.
# - A goal at (3, 1) in `map`, 60 s into the drive: where is it in `odom`, by the first correction and by the one at 60 s?
#
# ## Recall
#
# <details><summary>In a map every wall appears twice, and the two copies are at an angle to each other. Which transform do you suspect? And what if the walls are smeared only where the robot turned?</summary>
#
# Two walls at an angle: the odometry has drifted, so `map` to `odom` is missing or old. Smeared where the robot turned: the transform is right, but its time is wrong.
# </details>
# <details><summary>tf2 says "extrapolation into the future" by 0.012 s. What do you change?</summary>
#
# Ask later, but for the same stamp: wait for the next transform (with a timeout, or `lookup_transform_async`). If you ask for "the latest" instead, the answer is a little wrong, and there is no warning.
# </details>
# <details><summary>Who publishes <code>odom</code> to <code>base_link</code>, and who <code>map</code> to <code>odom</code>? Which of the two may jump?</summary>
#
# The odometry publishes the first, which is smooth; the localisation publishes the second, which jumps with each correction.
# </details>
# <details><summary>Where is the lidar's frame on a TurtleBot 4, and what happens to a program that takes it for the robot's?</summary>
#
# 4 cm behind the centre, turned by 90° to the left. To the program, what is ahead seems to be on the right, so the robot drives into an obstacle that the program does not expect ahead.
# </details>

# %%
from grader.notebook import progress

progress()
