"""The picture at the top of notebook 02: a topic, a service and an action as conversations over time."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

TOPIC, SERVICE, ACTION, LINE = "#E69F00", "#009E73", "#5D3A9B", "#333333"

LEFT, RIGHT = 0.0, 3.0  # the two lifelines


def draw() -> Figure:
    """Return three conversations side by side: who sends what to whom, time running down."""
    figure = Figure(figsize=(13.5, 5.0), layout="constrained")
    topic, service, action = figure.subplots(1, 3)

    _lives(topic, "a topic: SensorFusionData", "sensor_processor", "whoever listens", TOPIC)
    for row in range(5):
        y = -0.75 - 0.62 * row
        _says(topic, y, "", TOPIC)
        topic.text(1.5, y + 0.04, "distance, battery, …", ha="center", va="bottom", fontsize=10.5)
    _note(topic, "again and again; nobody answers")

    _lives(service, "a service: SetSpeed", "a client", "robot_controller", SERVICE)
    _says(service, -0.95, "request:  speed", SERVICE)
    _says(service, -1.65, "response:  success, message", SERVICE, back=True)
    _note(service, "one question, one answer, at once")

    _lives(action, "an action: NavigateToPosition", "a client", "robot_controller", ACTION)
    _says(action, -0.7, "goal:  target_pose, tolerance", ACTION)
    _says(action, -1.2, "accepted", ACTION, back=True)
    for row in range(3):
        _says(action, -1.75 - 0.42 * row, "feedback:  distance_remaining", ACTION, back=True, dashed=True)
    _says(action, -3.15, "result:  success, final_pose", ACTION, back=True)
    _note(action, "takes a while; can be cancelled")
    return figure


def _lives(axes: Axes, title: str, left: str, right: str, color: str) -> None:
    """Draw the two who talk, with their lines down."""
    for x, name in ((LEFT, left), (RIGHT, right)):
        axes.plot([x, x], [-0.2, -3.45], color="#999999", linewidth=1.2, zorder=1)
        box = {"boxstyle": "round,pad=0.4", "facecolor": "white", "edgecolor": LINE}
        axes.text(x, 0.0, name, ha="center", va="center", fontsize=11, bbox=box, zorder=3)
    axes.set_title(title, fontsize=13, color=color, weight="bold")
    axes.set_xlim(-0.95, 3.95)
    axes.set_ylim(-4.0, 0.35)
    axes.axis("off")


def _says(axes: Axes, y: float, text: str, color: str, *, back: bool = False, dashed: bool = False) -> None:
    """Draw an arrow from the left one to the right one, or back, with its words above."""
    start, end = (RIGHT, LEFT) if back else (LEFT, RIGHT)
    axes.annotate(
        "", (end, y), (start, y),
        arrowprops={
            "arrowstyle": "-|>", "color": color, "linewidth": 2.0, "linestyle": "--" if dashed else "-",
            "shrinkA": 0, "shrinkB": 0,
        },
    )  # fmt: skip
    axes.text(1.5, y + 0.04, text, ha="center", va="bottom", fontsize=10.5)


def _note(axes: Axes, text: str) -> None:
    axes.text(1.5, -3.8, text, ha="center", va="center", fontsize=11, style="italic", color=LINE)
