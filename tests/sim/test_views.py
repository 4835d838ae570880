"""Pictures. Their looks are judged by eye; the tests cover their contents."""

import io
import sys
from dataclasses import replace
from typing import Any

import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from PIL import Image

from sim import Pose, Recorder, Recording, Simulator, Twist, World, drive, load_world
from sim.recording import THRESHOLDS_NOTE
from sim.views import COLORS, THRESHOLDS, compare_view, map_view, png, run_view, thresholds_of


def labels(figure: Figure) -> set[str]:
    return {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label}


def test_a_picture_has_a_frame_so_that_white_looks_meant_on_a_dark_page() -> None:
    with Image.open(io.BytesIO(png(Figure(figsize=(1, 1))))) as picture:
        corner, middle = picture.getpixel((0, 0)), picture.getpixel((picture.width // 2, picture.height // 2))
    assert corner != middle == (255, 255, 255, 255)


def test_the_map_has_equal_aspect_and_units(crash: Recording) -> None:
    figure = map_view(crash)
    (axes,) = figure.axes
    assert axes.get_aspect() == 1.0
    assert labels(figure) == {"x (m)", "y (m)"}


def test_the_map_shows_path_scan_and_contact_each_in_its_colour(crash: Recording) -> None:
    (axes,) = map_view(crash).axes
    drawn = {line.get_label(): to_hex(line.get_color()) for line in axes.get_lines()}
    for thing in ("path", "scan", "contact"):
        assert drawn[thing].lower() == COLORS[thing].lower()


def test_the_map_shows_a_cart_at_its_position_at_that_time(cart: Recording) -> None:
    def middle(at: float) -> float:
        (axes,) = map_view(cart, at=at).axes
        boxes = [
            p.get_path().vertices.mean(axis=0)
            for p in axes.patches
            if to_hex(p.get_facecolor()) == COLORS["mover"].lower()
        ]
        return float(boxes[0][1])

    assert middle(0.0) < middle(2.0) < middle(4.0)


def boxes(figure: Figure, color: str) -> list[tuple[float, float | None]]:
    """Return the centre's x and the opacity of each box of a colour."""
    found = [p for axes in figure.axes for p in axes.patches if to_hex(p.get_facecolor()) == COLORS[color].lower()]
    return [(round(float(p.get_path().vertices[:-1].mean(axis=0)[0]), 3), p.get_alpha()) for p in found]


def test_the_map_shows_a_dragged_obstacle_once_at_its_position_at_that_time(dragged: Recording) -> None:
    for view, x in ((map_view(dragged, at=0.5), 2.0), (map_view(dragged, at=1.5), 3.0), (run_view(dragged), 3.0)):
        assert boxes(view, "obstacle") == [(x, 1.0)]
        assert [x for x, _ in boxes(view, "mover")] == [x]
    assert boxes(compare_view(dragged, dragged), "obstacle") == [(3.0, 1.0)]


def test_the_old_path_of_a_dragged_cart_is_not_drawn(dragged: Recording) -> None:
    def dotted(at: float) -> int:
        return sum(line.get_linestyle() == ":" for line in map_view(dragged, at=at).axes[0].get_lines())

    assert (dotted(0.5), dotted(1.5)) == (1, 0)


def test_time_lines_have_units_and_thresholds(crash: Recording) -> None:
    figure = run_view(crash, {"my_threshold": 0.4})
    assert labels(figure) == {"x (m)", "y (m)", "simulated time (s)", "v (m/s)", "omega (rad/s)", "distance (m)"}
    assert any(line.get_ydata()[0] == 0.4 for line in figure.axes[-1].get_lines())
    assert any("my_threshold 0.4 m" in text.get_text() for text in figure.axes[-1].texts)


def test_a_recording_with_thresholds_of_its_own_is_drawn_with_these(crash: Recording) -> None:
    """A node of another course stops elsewhere than ours."""
    own = replace(crash, notes={**crash.notes, THRESHOLDS_NOTE: {"stop": 0.75}})
    assert thresholds_of(own) == {"stop": 0.75}
    assert thresholds_of(replace(crash, notes={})) == THRESHOLDS


def test_the_names_of_thresholds_stand_where_no_line_crosses_them(crash: Recording) -> None:
    """The robot of this recording ends close to a wall, so they stand at the start."""
    names: Any = run_view(crash, {"my_threshold": 0.4}).axes[-1].texts
    assert [name.xy[0] for name in names] == [crash.t[0]]


@pytest.mark.parametrize(("omega", "world", "panels"), [
    (0.0, World("nothing anywhere"), {"v (m/s)"}),
    (0.5, World("nothing anywhere"), {"v (m/s)", "omega (rad/s)"}),
    (0.0, load_world("wall_ahead"), {"v (m/s)", "distance (m)"}),
    (0.5, load_world("wall_ahead"), {"v (m/s)", "omega (rad/s)", "distance (m)"}),
])  # fmt: skip
def test_a_panel_in_which_nothing_happens_is_not_drawn(omega: float, world: World, panels: set[str]) -> None:
    run = drive(Simulator(world), lambda _: Twist(0.2, omega), 1.0)
    rest = {"x (m)", "y (m)", "simulated time (s)"}
    assert labels(run_view(run)) == rest | panels
    assert labels(compare_view(run, run)) == rest | {name.replace("distance", "closest reading") for name in panels}


def test_a_goal_is_drawn_above_the_robot_that_stands_on_it() -> None:
    run = drive(Simulator(World("there", goals=(Pose(0.1, 0.0),))), lambda _: Twist(0.2, 0.0), 1.0)
    (axes,) = map_view(run).axes
    (goal,) = [line for line in axes.get_lines() if line.get_marker() == "*"]
    assert goal.get_zorder() > max(patch.get_zorder() for patch in axes.patches)


@pytest.mark.parametrize(
    "view",
    [
        map_view,
        run_view,
        lambda r: compare_view(r, r),
        lambda r: compare_view(r, replace(r, unrepeatable="")),
    ],
)
def test_every_view_of_an_unrepeatable_run_says_why(view: Any, crash: Recording) -> None:
    unrepeatable = replace(crash, unrepeatable="Not repeatable: the wind blew.")
    figure = view(unrepeatable)
    figure.canvas.draw()
    assert figure.get_supxlabel() == "Not repeatable: the wind blew."
    assert figure._repr_png_()[1]["alt"].endswith(". Not repeatable: the wind blew.")
    assert view(crash).get_supxlabel() == ""


def test_a_comparison_names_the_time_when_two_runs_diverge(crash: Recording) -> None:
    other = drive(Simulator(crash.world), lambda seen: Twist(0.4, 0.0 if seen.time < 2 else 0.5), 5.0)
    assert "apart by more than 1 cm from " in compare_view(crash, other).get_suptitle()
    assert "the same path" in compare_view(crash, crash).get_suptitle()


def test_a_world_a_simulator_and_a_run_in_the_open_can_be_drawn(crash: Recording) -> None:
    simulator = Simulator(World())
    recorder = Recorder(simulator)
    for figure in (
        map_view(load_world("office")),
        map_view(simulator),
        run_view(recorder.recording()),
        run_view(crash),
    ):
        figure.canvas.draw()


def test_a_figure_is_shown_once_and_leaves_no_global_state(crash: Recording) -> None:
    figure = map_view(crash)
    picture, metadata = figure._repr_png_()
    assert picture.startswith(b"\x89PNG")
    assert metadata["alt"] == "crash: 5.0 s simulated, 1.34 m driven"
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
