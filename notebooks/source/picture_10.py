"""The picture at the head of notebook 10: a drive to three goals, and the hundred points in boxes, by requirement."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from grader.scoring.rubric import RUBRIC, Rubric, load
from sim import Simulator, Tourist, drive, load_world
from sim.views import COLORS, View, draw_run

COLOURS = (COLORS["path"], COLORS["other"], "#3a9d6a", "#b5651d")  # one for each criterion
SECONDS = 62.0


def draw() -> Figure:
    """Return the end of a drive through the office, and a bar of points for each criterion."""
    figure = View(figsize=(13.0, 4.4), layout="constrained")
    plan, bars = figure.subplots(1, 2, width_ratios=[1.0, 1.5])
    simulator = Simulator(load_world("office"))
    draw_run(plan, drive(simulator, Tourist(simulator), SECONDS))
    plan.set(xlabel="x (m)", ylabel="y (m)", title="a drive to three goals")
    plan.set_aspect("equal")
    _draw_points(bars, load(RUBRIC))
    return figure


def _draw_points(axes: Axes, rubric: Rubric) -> None:
    for row, (criterion, colour) in enumerate(zip(rubric.criteria, COLOURS, strict=True)):
        left = 0.0
        for requirement in criterion.requirements:
            axes.barh(-row, requirement.points, left=left, height=0.62, color=colour, edgecolor="white", linewidth=1.5)
            axes.text(
                left + requirement.points / 2,
                -row,
                requirement.id,
                ha="center",
                va="center",
                fontsize=8,
                rotation=0 if requirement.points > 1 else 90,
                color="w",
            )
            left += requirement.points
        axes.text(left + 0.5, -row, f"{left:g}", va="center", fontsize=11, color=colour)
    axes.set_yticks([-row for row in range(len(rubric.criteria))], [c.title for c in rubric.criteria])
    axes.set(xlabel="points", xlim=(0, 44), title="100 points, a box for each requirement")
    axes.spines[["top", "right"]].set_visible(False)
