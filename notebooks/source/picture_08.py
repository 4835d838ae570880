"""The picture at the head of notebook 08: one launch file, two robots in namespaces, each with its own limit."""

from dataclasses import replace

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

from sim import Recording, Seen, Simulator, Tourist, Twist, drive, load_world
from sim.views import COLORS, View, draw_obstacles, draw_robot

ROBOTS = (("left", 0.4, COLORS["path"]), ("right", 0.2, COLORS["other"]))  # namespace, max_linear_speed in m/s, colour
SECONDS = 16.0


def draw() -> Figure:
    """Return the graph that one command starts, two drives with different limits on one map, and their speeds."""
    figure = View(figsize=(13.0, 4.2), layout="constrained")
    graph, plan, speed = figure.subplots(1, 3, width_ratios=[1.25, 1.3, 1.0])
    _draw_graph(graph)
    runs = [(name, limit, color, _drive(limit)) for name, limit, color in ROBOTS]
    draw_obstacles(plan, [presence.obstacle for presence in runs[0][3].presences])
    for name, limit, color, run in runs:
        plan.plot(run.x, run.y, color=color, linewidth=2.0)
        here = run.pose_at(len(run) - 1)
        draw_robot(plan, here, 0.171)
        above = here.y > 0  # the side away from the row of obstacles
        offset = (0, 16 if above else -24)
        plan.annotate(f"/{name}", (here.x, here.y), offset, textcoords="offset points", ha="center", color=color)
        speed.plot(run.t, run.v, color=color, label=f"/{name}, limit {limit:g} m/s")
    plan.set(xlabel="x (m)", ylabel="y (m)", title=f"where they are after {SECONDS:g} s")
    plan.set_aspect("equal", adjustable="datalim")
    speed.set(xlabel="simulated time (s)", ylabel="v (m/s)", ylim=(0.0, 0.55), title="the same code, another setting")
    speed.legend(loc="upper right", fontsize=9)
    for axes in (plan, speed):
        axes.grid(alpha=0.3)
    return figure


def _drive(limit: float) -> Recording:
    simulator = Simulator(load_world("slalom"))
    tourist = Tourist(simulator)

    def driver(seen: Seen) -> Twist:
        wanted = tourist(seen)
        return replace(wanted, v=min(wanted.v, limit))

    return drive(simulator, driver, SECONDS)


def _draw_graph(axes: Axes) -> None:
    """Draw the launch file, the nodes in their namespaces, and the topics that they would fight over without."""
    axes.set(xlim=(0, 10), ylim=(0, 10), title="one launch file")
    axes.axis("off")
    for (name, limit, color), x in zip(ROBOTS, (0.2, 5.2), strict=True):
        _box(axes, (x, 0.6), (4.6, 7.0), color, f"namespace /{name}", 7.0, filled=False)
        _box(axes, (x + 0.4, 4.6), (3.8, 1.5), color, "robot_controller", 5.35)
        _box(axes, (x + 0.4, 2.4), (3.8, 1.5), color, "sensor_processor", 3.15)
        axes.text(x + 2.3, 1.5, f"/{name}/cmd_vel  /{name}/scan", ha="center", va="center", fontsize=8)
        axes.text(x + 2.3, 6.4, f"max_linear_speed: {limit:g}", ha="center", va="center", fontsize=8, color=color)
        axes.add_patch(
            FancyArrowPatch(
                (5.0, 8.9), (x + 2.3, 7.65), arrowstyle="-|>", mutation_scale=14, color="0.4", linewidth=1.2
            )
        )
    axes.text(5.0, 9.3, "one command", ha="center", va="center", fontsize=11)


def _box(
    axes: Axes, corner: tuple[float, float], size: tuple[float, float], color: str, text: str, at: float,
    filled: bool = True,
) -> None:  # fmt: skip
    axes.add_patch(
        FancyBboxPatch(
            corner, *size, boxstyle="round,pad=0,rounding_size=0.25", edgecolor=color, linewidth=1.4,
            facecolor=(*_rgb(color), 0.12) if filled else "none",
        )
    )  # fmt: skip
    axes.text(corner[0] + size[0] / 2, at, text, ha="center", va="center", fontsize=10)


def _rgb(color: str) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    return to_rgb(color)
