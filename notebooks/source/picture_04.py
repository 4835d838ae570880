"""The picture at the head of notebook 04: a scan on the map, and the fused closest reading beside the true distance."""

from dataclasses import replace

from matplotlib.figure import Figure

from sim import Simulator, Twist, drive, load_world
from sim.views import COLORS, View, draw_run

FORTH_S, SECONDS = 7.0, 12.0
SHOWN_S = 4.6


def draw() -> Figure:
    """Return a robot that meets a moving cart: its scan on the map, and the nearest thing over time."""
    simulator = Simulator(replace(load_world("moving_cart"), goals=()))
    recording = drive(simulator, lambda seen: Twist(0.25 if seen.time < FORTH_S else -0.25), SECONDS)
    figure = View(figsize=(12.0, 3.8), layout="constrained")
    plan, line = figure.subplots(1, 2, width_ratios=[1, 1.15])
    draw_run(plan, recording, SHOWN_S)
    plan.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title=f"what the lidar sees at {SHOWN_S:g} s")
    plan.grid(alpha=0.3)
    line.plot(
        recording.t, recording.clearance + recording.radius, color=COLORS["clearance"], label="true distance",
    )  # fmt: skip
    line.plot(recording.t, recording.closest, ".", markersize=4, color=COLORS["closest"], label="closest valid reading")
    line.axvline(SHOWN_S, color=COLORS["command"], linewidth=1.0, linestyle=":", label="the moment at the left")
    line.set(xlabel="simulated time (s)", ylabel="nearest thing (m)", ylim=(0, None), title="how near it is")
    line.legend(loc="lower left", fontsize=9)
    line.grid(alpha=0.3)
    return figure
