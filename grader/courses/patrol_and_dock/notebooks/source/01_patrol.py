# %% [markdown]
# # 01 · Patrol and dock
# Your package gets one node more, `patrol`; the handout says what it has to do.
# This notebook holds no code for it. It shows the building, lets you watch your node, and measures.
#
# `ws/src/ros2_robot_controller` is your package from the eleven notebooks: copy it there.

# %%
import math

from grader.notebook import begin, check, run_node
from grader.course import find
from sim import load_world
from sim.views import map_view, run_view

begin("01")

# %% [markdown]
# ## Look
# One building of the kind that your robot meets: its dock is where it starts, and the goals are the places.

# %%
ward = load_world(find().world("ward"))
orders = {
    "places": [value for place in ward.goals for value in (place.x, place.y)],
    "dock": [ward.start.x, ward.start.y, ward.start.yaw],
}
map_view(ward)

# %%
with run_node("patrol", ward, parameters=orders) as run:
    recording = run.drive(70.0)
run_view(recording)

# %% tags=["check"]
check("P1", "P2")

# %% [markdown]
# ## Close the corridor
# `trigger` lets something appear. `until` ends the drive.

# %%
def near(run, place):
    """Return whether the robot has come to a place."""
    return math.hypot(run.simulator.pose.x - place.x, run.simulator.pose.y - place.y) < 0.3


with run_node("patrol", ward, parameters=orders) as run:
    run.drive(60.0, until=lambda: near(run, ward.goals[1]))
    run.simulator.trigger("east")
    recording = run.drive(100.0, until=lambda: near(run, ward.goals[4]))
run_view(recording)

# %% tags=["check"]
check("P3")

# %% [markdown]
# ## Let the battery run low

# %%
with run_node("patrol", ward, parameters=orders) as run:
    run.drive(20.0)
    run.simulator.set_battery(0.15)
    recording = run.drive(60.0)
    end, dock = run.simulator.pose, ward.start
print(f"{math.hypot(end.x - dock.x, end.y - dock.y):.3f} m from the dock")
print(f"{math.degrees(math.remainder(end.yaw - dock.yaw, math.tau)):.1f} degrees off its heading")
run_view(recording)

# %% tags=["check"]
check("D1", "D2")

# %% [markdown]
# ## Measure
# The league counts time, clearance and distance.

# %%
with run_node("patrol", ward, parameters=orders) as run:
    for place in ward.goals:
        run.drive(60.0, until=lambda: near(run, place))
        print(f"({place.x:.1f}, {place.y:.1f}) at {run.t:.1f} s")
    recording = run.recording
print(f"{recording.distance:.1f} m, nearest to something: {recording.clearance.min():.2f} m")

# %% tags=["check"]
check("S1", "S2", "S3")

# %% [markdown]
# ## Hand in
# `make submit` packs the package, and shows what the grader will see.
