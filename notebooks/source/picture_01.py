"""The picture at the top of notebook 01: the files of the package, and where the build puts each of them."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

YOURS, GIVEN, LATER = "#0072B2", "#555555", "#9aa0a6"
IMPORT, RUN, LAUNCH, INDEX = "#0072B2", "#D55E00", "#009E73", "#5D3A9B"

# row -> (indent, text, color of the text); rows are counted from the top
SOURCES = [
    (0, "src/ros2_robot_controller/", GIVEN),
    (1, "package.xml", YOURS),
    (1, "CMakeLists.txt", YOURS),
    (1, "ros2_robot_controller/", GIVEN),
    (2, "robot_controller.py", GIVEN),
    (2, "sensor_processor.py", GIVEN),
    (2, "utils/", GIVEN),
    (1, "scripts/", GIVEN),
    (2, "robot_controller", YOURS),
    (2, "sensor_processor", GIVEN),
    (1, "launch/  config/   (notebook 08)", LATER),
]
# (row, height in rows, title, what finds it, color, rows of the sources that go there)
TARGETS = [
    (0.0, 2.0, "share/…/package.xml", "colcon, ros2 pkg", INDEX, (1, 1)),
    (2.9, 2.0, "lib/python3.x/site-packages/…", "import ros2_robot_controller", IMPORT, (3, 6)),
    (5.8, 2.0, "lib/ros2_robot_controller/", "ros2 run", RUN, (7, 9)),
    (8.7, 2.0, "share/…/launch, config", "ros2 launch", LAUNCH, (10, 10)),
]
STEP = 0.44


def draw() -> Figure:
    """Return the source tree at the left, the install tree at the right, and what goes where."""
    figure = Figure(figsize=(12.0, 5.4), layout="constrained")
    axes = figure.add_subplot()
    for row, (indent, text, color) in enumerate(SOURCES):
        weight = "bold" if color == YOURS else "normal"
        axes.text(
            0.3 * indent, -STEP * row, text, color=color, fontsize=12, va="center", family="monospace", weight=weight
        )
    for row, height, title, finder, color, (first, last) in TARGETS:
        _brace(axes, first, last, color)
        _target(axes, row, height, title, finder, color)
        axes.annotate(
            "", (6.05, -STEP * (row + height / 2 - 0.1)), (4.35, -STEP * (first + last) / 2),
            arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip
    axes.text(4.35, 0.55, "colcon build", fontsize=12, ha="center", va="center", family="monospace")
    axes.text(0.0, 0.55, "what you write", fontsize=12, weight="bold", va="center")
    axes.text(6.1, 0.55, "install/ros2_robot_controller/", fontsize=12, family="monospace", va="center")
    axes.text(10.5, 0.55, "who finds it there", fontsize=12, weight="bold", va="center")
    axes.text(0.0, -STEP * 11.4, "bold blue: you write it today", fontsize=10.5, color=YOURS)
    axes.set_xlim(-0.1, 13.0)
    axes.set_ylim(-STEP * 11.9, 0.95)
    axes.axis("off")
    return figure


def _brace(axes: Axes, first: int, last: int, color: str) -> None:
    """Draw a bar beside the rows that go to one place."""
    axes.plot([4.25, 4.25], [-STEP * (first - 0.35), -STEP * (last + 0.35)], color=color, linewidth=3.0)


def _target(axes: Axes, row: float, height: float, title: str, finder: str, color: str) -> None:
    """Draw a place in the install tree, and beside it who looks there."""
    axes.add_patch(
        FancyBboxPatch(
            (6.15, -STEP * (row + height - 0.35)), 4.0, STEP * (height - 0.5), boxstyle="round,pad=0.06",
            facecolor="white", edgecolor=color, linewidth=2.0,
        )
    )  # fmt: skip
    middle = -STEP * (row + height / 2 - 0.1)
    axes.text(6.3, middle, title, fontsize=12, va="center", family="monospace")
    axes.text(10.5, middle, finder, fontsize=12, va="center", family="monospace", color=color, weight="bold")
