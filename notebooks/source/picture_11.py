"""The picture at the top of notebook 11: from a complaint by way of a tool to a line."""

from __future__ import annotations

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

CASES = (
    ("nothing changes", "__file__"),
    ("it stands still", "ros2 topic info -v"),
    ("the file says 0.2", "ros2 param dump"),
    ("a node is not there", "ros2 node list"),
    ("it hears the other", "ros2 node info"),
    ("it jerks", "a plot, pdb"),
    ("it turns and turns", "a table of angles"),
    ("the display freezes", "prun"),
    ("a goal is lost", "the log"),
    ("it gets busier", "counting"),
)


def draw() -> Figure:
    """Return the complaints, each joined to the tool that shows its cause."""
    figure, axes = plt.subplots(figsize=(9.0, 3.6), layout="constrained")
    axes.axis("off")
    axes.set(xlim=(0, 4), ylim=(-5.0, 0.7))
    for number, (complaint, tool) in enumerate(CASES):
        x, y = 2.05 * (number // 5), -(number % 5)
        axes.annotate(
            "", (x + 1.08, y), (x + 0.88, y), arrowprops={"arrowstyle": "->", "color": "0.4", "linewidth": 1.4}
        )
        axes.text(x, y, f"C{number + 1}", va="center", weight="bold", color="#0072B2")
        axes.text(x + 0.2, y, complaint, va="center", color="0.15")
        axes.text(x + 1.12, y, tool, va="center", family="monospace", fontsize=9, color="#8A4B00")
    axes.text(0.0, 0.6, "complaint", color="0.5", fontsize=9)
    axes.text(1.12, 0.6, "what to look with", color="0.5", fontsize=9)
    return figure
