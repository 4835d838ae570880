"""Pictures and the command line. Their looks are judged by eye; the tests cover their contents."""

import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from grader import KIT
from sim import Box, Recorder, Recording, Simulator, Tourist, Twist, Wall, World, drive, load_world
from sim.__main__ import main, summary
from sim.obstacles import Path as Way
from sim.replay import Replay
from sim.views import COLORS, compare_view, map_view, run_view


@pytest.fixture(scope="module")
def crash() -> Recording:
    world = World(name="crash", obstacles=(Wall((1.5, -1.0), (1.5, 1.0), name="wall"),))
    return drive(Simulator(world), lambda _: Twist(0.4, 0.05), 5.0)


@pytest.fixture(scope="module")
def cart() -> Recording:
    simulator = Simulator(load_world("moving_cart"))
    return drive(simulator, Tourist(simulator), 6.0)


def labels(figure: Figure) -> set[str]:
    return {label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label}


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


@pytest.fixture(scope="module")
def dragged() -> Recording:
    """A crate is dragged from x = 2 m to 3 m at 1 s, and so is a cart with its path."""
    cart = Box((2.0, -2.0), (0.2, 0.2), name="cart", motion=Way(((2.0, -1.0),), 0.1))
    simulator = Simulator(World(obstacles=(Box((2.0, 1.0), (0.4, 0.4), name="crate"), cart)))
    recorder = Recorder(simulator)
    for i in range(40):
        recorder.take(simulator.step(0.05))
        if i == 19:
            simulator.move_obstacle("crate", 3.0, 1.0)
            simulator.move_obstacle("cart", 3.0, -2.0)
    return recorder.recording()


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


def test_in_the_replay_a_dragged_obstacle_is_one_shape_with_a_track(dragged: Recording) -> None:
    page = Replay(dragged).html()
    assert page.count("<title>crate</title>") == 1
    (data,) = re.findall(r"^const D = (.*);$", page, re.MULTILINE)
    crate = json.loads(data)["obstacles"][0]
    assert (crate["since"], crate["until"]) == (0.0, None)
    assert (crate["track"][0][0], crate["track"][0][-1]) == (2.0, 3.0)


def test_time_lines_have_units_and_thresholds(crash: Recording) -> None:
    figure = run_view(crash, {"my_threshold": 0.4})
    assert labels(figure) == {"x (m)", "y (m)", "simulated time (s)", "v (m/s)", "omega (rad/s)", "distance (m)"}
    assert any(line.get_ydata()[0] == 0.4 for line in figure.axes[2].get_lines())
    assert any("my_threshold 0.4 m" in text.get_text() for text in figure.axes[2].texts)


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
    doubtful = replace(crash, unrepeatable="Not repeatable: the wind blew.")
    figure = view(doubtful)
    figure.canvas.draw()
    assert figure.get_supxlabel() == "Not repeatable: the wind blew."
    assert figure._repr_png_()[1]["alt"].endswith(". Not repeatable: the wind blew.")
    assert view(crash).get_supxlabel() == ""


def test_the_replay_and_the_summary_of_an_unrepeatable_run_say_why(crash: Recording) -> None:
    doubtful = replace(crash, unrepeatable="Not repeatable: <wind> blew.")
    assert summary(doubtful).splitlines()[-1] == "Not repeatable: <wind> blew."
    assert '<p class="note">Not repeatable: &lt;wind&gt; blew.</p>' in Replay(doubtful).html()
    assert 'class="note"' not in Replay(crash).html()


def test_a_comparison_names_the_time_when_two_runs_diverge(crash: Recording) -> None:
    other = drive(Simulator(crash.world), lambda seen: Twist(0.4, 0.0 if seen.time < 2 else 0.5), 5.0)
    assert "apart by more than 1 cm from " in compare_view(crash, other).get_suptitle()
    assert "the same path" in compare_view(crash, crash).get_suptitle()


def test_a_world_a_simulator_and_a_run_in_the_open_can_be_drawn(crash: Recording) -> None:
    simulator = Simulator(World())
    recorder = Recorder(simulator)
    for figure in (
        map_view(load_world("warehouse")),
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
    assert "matplotlib.pyplot" not in sys.modules or not matplotlib.pyplot.get_fignums()


# ------------------------------------------------------------------------------------------------------- the replay


def test_the_replay_is_self_contained_and_makes_no_network_request(cart: Recording) -> None:
    page = Replay(cart).html()
    assert set(re.findall(r"https?://[^\"' <]+", page)) == {"http://www.w3.org/2000/svg"}
    assert not re.search(r"<link|<img|src=|import\(|fetch\(|\{\{", page)
    assert len(page) < 200_000


def test_the_replay_escapes_names() -> None:
    nasty = "</script><script>alert(1)</script>"
    simulator = Simulator(World(name=nasty, obstacles=(Box((2.0, 0.0), (0.2, 0.2), name=nasty),)))
    page = Replay(drive(simulator, lambda _: Twist(0.5, 0.0), 5.0)).html()
    assert "alert(1)</script>" not in page
    assert page.count("<script>") == 1


def test_in_a_notebook_the_replay_is_in_an_iframe(cart: Recording) -> None:
    output = Replay(cart)._repr_html_()
    assert output.startswith('<iframe sandbox="allow-scripts"')
    assert "<script>" not in output


@pytest.mark.slow
def test_the_replay_plays_in_a_browser(cart: Recording, tmp_path: Path) -> None:
    """Opened at 4 s, the page shows robot and cart at their positions then."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium: install it to test the page in a browser")
    Replay(cart).save(tmp_path / "page.html")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path}", "--dump-dom"]
    url = (tmp_path / "page.html").as_uri() + "#4"
    page = subprocess.run([*command, url], capture_output=True, text=True, timeout=120, check=True).stdout
    assert "4.00 s" in re.search(r"<output[^>]*>([^<]*)", page)[1]
    index = round(4.0 / 0.05)
    assert f"translate({cart.x[index]:.3f}".rstrip("0") in page
    assert re.search(r'<g id="o\d+" transform="translate\(0,1\.\d+\)"', page)


# -------------------------------------------------------------------------------------------------- the command line


def test_the_command_line_drives_and_writes_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run.png"
    assert main(["wall_behind", "--seconds", "3", "--seed", "5", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "3.0 s simulated" in said
    assert "seed 5" in said
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("suffix", ["npz", "html"])
def test_the_command_line_writes_recordings_and_replays(suffix: str, tmp_path: Path) -> None:
    out = tmp_path / f"run.{suffix}"
    assert main(["gate", "--seconds", "1", "--profile", "tb4", "--no-noise", "--out", str(out)]) == 0
    assert out.stat().st_size > 1000


def test_an_unknown_world_is_reported_on_stderr_with_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["nowhere"]) == 1
    assert "no world named 'nowhere'" in capsys.readouterr().err


def test_without_a_world_the_worlds_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "office " in capsys.readouterr().out


def test_the_simulator_needs_neither_ros_nor_matplotlib_nor_the_grader() -> None:
    code = "import sim, sys; print([m for m in ('rclpy', 'matplotlib', 'grader', 'rosbags') if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], cwd=KIT, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"
