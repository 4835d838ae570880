"""The picture at the top of notebook 00: a drive through three offices, and the finished system as a graph."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, FancyBboxPatch

from sim import Simulator, Tourist, drive, load_world
from sim.views import COLORS, draw_run

NODE, TOPIC, ASKED = "#0072B2", "#E69F00", "#009E73"

# name -> place; nodes are ovals, topics boxes, services and the action boxes with a dashed rim
NODES = {"simulated_robot": (0.9, 2.5), "robot_controller": (4.7, 3.75), "sensor_processor": (4.7, 1.1)}
TOPICS = {
    "scan": (2.75, 4.35), "odom": (2.75, 3.75), "cmd_vel": (2.75, 3.0),
    "raw_scan": (2.75, 1.85), "imu/data": (2.75, 1.25), "battery/state": (2.75, 0.65),
    "sensor_fusion_data": (7.0, 1.45), "obstacle_distance": (7.0, 0.75),
}  # fmt: skip
ASKS = {"set_speed": (7.0, 4.45), "get_status": (7.0, 3.75), "navigate_to_position": (7.0, 3.05)}
LINKS = [
    ("simulated_robot", "scan"), ("simulated_robot", "odom"), ("cmd_vel", "simulated_robot"),
    ("simulated_robot", "raw_scan"), ("simulated_robot", "imu/data"), ("simulated_robot", "battery/state"),
    ("scan", "robot_controller"), ("odom", "robot_controller"), ("robot_controller", "cmd_vel"),
    ("raw_scan", "sensor_processor"), ("imu/data", "sensor_processor"), ("battery/state", "sensor_processor"),
    ("sensor_processor", "sensor_fusion_data"), ("sensor_processor", "obstacle_distance"),
    ("set_speed", "robot_controller"), ("get_status", "robot_controller"), ("navigate_to_position", "robot_controller"),
]  # fmt: skip


def draw() -> Figure:
    """Return the map with a drive at the left, and the graph of nodes, topics and services at the right."""
    simulator = Simulator(load_world("office"))
    driver = Tourist(simulator)
    recording = drive(simulator, driver, 90.0, until=driver.has_arrived)
    figure = Figure(figsize=(14.0, 5.0), layout="constrained")
    plan, graph = figure.subplots(1, 2, width_ratios=[1.0, 1.15])
    draw_run(plan, recording, at=28.0)
    plan.set_aspect("equal")
    plan.set_xlabel("x (m)")
    plan.set_ylabel("y (m)")
    plan.set_title("Where it drives", fontsize=12)
    draw_graph(graph)
    graph.set_title("Who talks to whom", fontsize=12)
    return figure


def draw_graph(axes: Axes) -> None:
    """Draw the finished system: nodes, the topics between them, and what can be asked for."""
    places = NODES | TOPICS | ASKS
    for start, end in LINKS:
        asked = start in ASKS
        axes.annotate(
            "", _rim(end, places[start], places), _rim(start, places[end], places),
            arrowprops={
                "arrowstyle": "<|-|>" if asked else "-|>", "color": ASKED if asked else "#555555", "linewidth": 1.2,
                "shrinkA": 0, "shrinkB": 0,
            },
        )  # fmt: skip
    for name, (x, y) in NODES.items():
        color = COLORS["command"] if name == "simulated_robot" else NODE
        axes.add_patch(Ellipse((x, y), 1.95, 0.72, facecolor=color, edgecolor="none", zorder=3))
        axes.text(x, y, name, color="white", ha="center", va="center", fontsize=10, weight="bold", zorder=4)
    for names, color in ((TOPICS, TOPIC), (ASKS, ASKED)):
        for name, (x, y) in names.items():
            half = _half(name)
            axes.add_patch(
                FancyBboxPatch(
                    (x - half + 0.06, y - 0.14), 2 * half - 0.12, 0.28, boxstyle="round,pad=0.06", facecolor="white",
                    edgecolor=color, linewidth=1.6, linestyle="--" if color == ASKED else "-", zorder=3,
                )
            )  # fmt: skip
            axes.text(x, y, name, ha="center", va="center", fontsize=10, zorder=4)
    for x, text, color in (
        (0.9, "node", COLORS["command"]), (2.75, "topic", TOPIC), (4.7, "node that you write", NODE),
        (7.0, "service or action", ASKED),
    ):  # fmt: skip
        axes.text(x, 0.02, text, color=color, fontsize=11, weight="bold", ha="center")
    axes.set_xlim(-0.15, 8.25)
    axes.set_ylim(-0.15, 4.8)
    axes.axis("off")


def _half(name: str) -> float:
    """Return half the width of a topic's box."""
    return 0.16 + 0.052 * len(name)


def _rim(name: str, toward: tuple[float, float], places: dict[str, tuple[float, float]]) -> tuple[float, float]:
    """Return where the line from `name` to the place `toward` leaves its oval or box, at the side that faces it."""
    x, y = places[name]
    side = 1.0 if toward[0] > x else -1.0
    if name in NODES:
        # Spread the ends along the oval, so that arrows to different heights do not meet in one point.
        lift = max(-0.25, min(0.25, 0.22 * (toward[1] - y)))
        return x + side * 0.975 * (1 - (lift / 0.36) ** 2) ** 0.5, y + lift
    return x + side * (_half(name) + 0.02), y
