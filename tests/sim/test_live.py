"""The live view: messages to the browser, commands from it, pacing, start and end."""

import _thread
import base64
import contextlib
import itertools
import json
import math
import os
import shutil
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest
from helpers.node_runs import run_with_node

from grader import KIT
from sim import Box, Circle, Path, Recorder, Seen, Simulator, Tourist, Twist, Wall, World, drive, load_world
from sim.live import Live
from sim.live.audience import HIDDEN_LOST_S, LOST_S
from sim.live.engine import Pacer
from sim.live.protocol import NO_RANGE, Feed, Message

ROOT = KIT
BOX = Box((2.0, 1.0), (0.4, 0.4), name="crate")
ROOM = World(name="room", obstacles=(Wall((3.0, -2.0), (3.0, 2.0), name="wall"), BOX))


def ahead(_: Seen) -> Twist:
    return Twist(0.4, 0.0)


def wait_for(condition: Callable[[], object], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "timed out"
        time.sleep(0.005)


class Browser:
    """A stand-in for a browser's view: it applies the messages as view.js does."""

    def __init__(self, live: Live, view: str = "a") -> None:
        self.live, self.view = live, view
        self.messages: list[Message] = []
        self.scans: list[bytes] = []
        self.obstacles: dict[str, Any] = {}
        self.path: list[float] = []
        live._audience.channel = self
        live.receive({"kind": "hello", "view": view})

    def send(self, content: Message, buffers: list[bytes]) -> None:
        self.messages.append(content)
        self.scans.append(buffers[0])
        if "scene" in content:
            self.obstacles, self.path = {}, []
        self.obstacles |= {o["name"]: o for o in content.get("new", ())}
        for name, at in content.get("moved", {}).items():
            self.obstacles[name]["at"] = at
        for name in content.get("gone", ()):
            del self.obstacles[name]
        if "path" in content:
            begin, *points = content["path"]
            self.path[2 * begin :] = points

    def order(self, kind: str, **values: object) -> None:
        self.live.receive({"kind": kind, **values})

    @property
    def last(self) -> Message:
        return self.messages[-1]


class Desk:
    """A live view without its thread, with a clock that the test advances."""

    def __init__(self, live: Live) -> None:
        self.live, self.now = live, 1000.0
        self.browser = Browser(live)

    def go(self, seconds: float) -> None:
        """Let wall time pass as the thread would, sleeping exactly until the next step is due."""
        end = self.now + seconds
        while self.now <= end + 1e-9:
            wait = self.live.cycle(self.now)
            if wait is None or self.now + wait > end + 1e-9:
                break
            self.now += max(wait, 1e-4)  # a step takes some time
        self.now = end


def desk(world: World = ROOM, **options: Any) -> Desk:
    options.setdefault("driver", ahead)
    return Desk(Live(Simulator(world, noise=False), **options))


@pytest.fixture
def live() -> Iterator[Live]:
    live = Live(Simulator(ROOM), ahead, rate=math.inf)
    yield live
    live.stop()


# ---------------------------------------------------------------------------------------- messages to the browser


def test_the_first_message_contains_the_scene_and_the_next_only_changes() -> None:
    d = desk()
    d.go(0.5)
    first, second = d.browser.messages[:2]
    assert first["scene"]["world"] == "room"
    assert {o["name"]: o["at"] for o in first["new"]} == {"wall": [3.0, 0.0], "crate": [2.0, 1.0]}
    assert "scene" not in second
    assert "new" not in second


def test_a_view_that_applies_the_changes_has_the_robots_true_path_and_position() -> None:
    d = desk()
    d.go(3.0)
    d.browser.order("pause")
    d.go(0.1)
    sim = d.live.simulator
    assert d.browser.last["pose"] == [round(sim.pose.x, 3), 0.0, 0.0]
    x, y = d.browser.path[::2], d.browser.path[1::2]
    assert x[0] == 0.0
    assert sim.pose.x - x[-1] <= 0.02
    assert set(y) == {0.0}
    assert all(0.0 < b - a <= 0.04 for a, b in itertools.pairwise(x))


def test_the_scan_is_in_centimetres_with_invalid_readings_marked() -> None:
    message, scan = Feed(Simulator(ROOM, noise=False)).message()
    ranges = np.frombuffer(scan, "<u2")
    angles = message["scene"]["angle_min"] + message["scene"]["increment"] * np.arange(ranges.size)
    assert ranges.size == 180
    assert ranges[np.argmin(np.abs(angles))] == 300  # the wall 3 m ahead
    assert ranges[0] == NO_RANGE  # nothing behind


def test_for_a_moving_obstacle_only_its_position_is_sent() -> None:
    cart = Box((2.0, -1.0), (0.3, 0.3), name="cart", motion=Path(((2.0, 1.0),), speed=0.5))
    d = desk(World(obstacles=(cart, BOX)), driver=lambda _: Twist())
    d.go(2.0)
    assert d.browser.last["moved"].keys() == {"cart"}
    assert d.browser.obstacles["cart"]["at"] == [2.0, pytest.approx(-1.0 + 0.5 * d.browser.last["t"], abs=1e-3)]


def test_obstacles_that_appear_and_vanish_come_and_go_in_the_view() -> None:
    ghost = Circle((2.0, 2.0), 0.2, name="ghost", appears=0.5, vanishes=1.0)
    d = desk(World(obstacles=(ghost,)), driver=lambda _: Twist())
    seen = []
    for _ in range(3):
        d.go(0.45)
        seen.append("ghost" in d.browser.obstacles)
    assert seen == [False, True, False]


def test_contacts_are_sent_once() -> None:
    d = desk(World(obstacles=(Wall((0.5, -1.0), (0.5, 1.0), name="wall"),)))
    d.go(3.0)
    contacts = [c for m in d.browser.messages for c in m.get("contacts", ())]
    assert [c[3] for c in contacts] == ["wall"]
    assert d.browser.last["touching"]


def test_the_corners_of_a_rotated_obstacle_are_rotated() -> None:
    message, _ = Feed(Simulator(World(obstacles=(Box((3.0, 0.0), (2.0, 0.2), yaw=math.pi / 2, name="b"),)))).message()
    (part,) = message["new"][0]["parts"]
    assert (max(part[::2]), max(part[1::2])) == (0.1, 1.0)


def test_a_long_path_is_thinned_and_sent_again() -> None:
    simulator = Simulator(World(), noise=False)
    feed, path = Feed(simulator), []
    for i in range(4200):
        simulator.place_robot(type(simulator.pose)(0.03 * i, 0.0, 0.0))
        feed.follow()
        if i % 100 == 0:
            begin, *points = feed.message()[0]["path"]
            path[2 * begin :] = points
    assert len(feed.path) < 2500
    assert path[0] == 0.0
    assert path[-2] == pytest.approx(0.03 * 4100)
    assert (np.diff(path[::2]) > 0).all()


# --------------------------------------------------------------------------------------------------------- pacing


@pytest.mark.parametrize(("rate", "simulated"), [(0.25, 0.5), (1.0, 2.0), (5.0, 10.0)])
def test_simulated_time_advances_at_the_chosen_rate(rate: float, simulated: float) -> None:
    d = desk(World(), rate=rate)
    d.go(2.0)
    assert d.live.simulator.time == pytest.approx(simulated, abs=0.03 * max(1.0, rate))


def test_an_infinite_rate_never_waits() -> None:
    pacer = Pacer(math.inf)
    pacer.stepped(1.0, now=5.0)
    assert pacer.wait(5.0) == 0.0


def test_the_time_lost_in_a_stall_is_not_caught_up() -> None:
    pacer = Pacer(1.0)
    pacer.stepped(0.05, now=0.0)
    pacer.stepped(0.05, now=60.0)  # the machine slept
    assert pacer.wait(60.0) == pytest.approx(0.05)


def test_the_time_lost_in_a_busy_moment_is_caught_up() -> None:
    pacer = Pacer(1.0)
    for now in (0.0, 0.05, 0.13, 0.16):
        pacer.stepped(0.05, now)
    assert pacer.wait(0.16) == pytest.approx(0.04)


def test_there_are_at_least_twenty_frames_a_second_and_at_most_fps() -> None:
    d = desk(World())
    d.go(4.0)
    assert 20 * 4 <= len(d.browser.messages) <= 30 * 4 + 2


def test_at_a_bridges_tick_every_tick_is_a_frame() -> None:
    """20 ticks per simulated second make 20 frames; none is lost to a beat between 20 and 30 Hz."""
    simulator = Simulator(World(), noise=False)
    d = Desk(Live(simulator, step=simulator.step))
    d.go(5.0)
    assert [round(m["t"] * 20) for m in d.browser.messages] == list(range(1, len(d.browser.messages) + 1))
    assert len(d.browser.messages) >= 100


def test_at_full_speed_the_frame_rate_stays_the_same() -> None:
    d = desk(World(), rate=math.inf)
    d.go(1.0)
    assert d.live.simulator.time > 100.0
    assert len(d.browser.messages) <= 32


def deliver_in_thread(browser: Browser, **content: object) -> None:
    """Deliver a message as JupyterLab does, in a thread that no cell keeps busy."""
    thread = threading.Thread(target=browser.live.receive, args=({"view": browser.view, **content},))
    thread.start()
    thread.join()


@pytest.mark.parametrize(("hidden", "patience"), [(False, LOST_S), (True, HIDDEN_LOST_S)])
def test_a_silent_view_counts_as_closed(hidden: bool, patience: float) -> None:
    d = desk(World())
    deliver_in_thread(d.browser, kind="alive", hidden=hidden)
    d.go(patience + 5.0)
    stood = d.live.simulator.time
    assert stood == pytest.approx(patience, abs=0.1)
    assert d.live.cycle(d.now) is None
    deliver_in_thread(d.browser, kind="alive", hidden=False)  # the view was only slow
    d.go(1.0)
    assert d.live.simulator.time == pytest.approx(stood + 1.0, abs=0.1)
    assert any("scene" in m for m in d.browser.messages[-45:])


def test_a_view_that_a_busy_cell_may_silence_is_given_more_time() -> None:
    d = desk(World())
    d.go(HIDDEN_LOST_S + 5.0)
    assert d.live.simulator.time == pytest.approx(HIDDEN_LOST_S + 5.0, abs=0.1)


# ------------------------------------------------------------------------------------------------------- commands


def test_pause_step_and_run_control_simulated_time() -> None:
    d = desk()
    d.go(1.0)
    d.browser.order("pause")
    d.go(1.0)
    stood = d.live.simulator.time
    assert stood == pytest.approx(1.0, abs=0.03)
    assert d.browser.last["status"] == "paused"
    d.browser.order("step")
    d.go(1.0)
    assert d.live.simulator.time == pytest.approx(stood + 0.1)
    assert d.browser.last["t"] == pytest.approx(stood + 0.1)
    d.browser.order("run")
    d.go(1.0)
    assert d.live.simulator.time == pytest.approx(stood + 1.1, abs=0.05)


def test_nothing_is_sent_while_paused() -> None:
    d = desk()
    d.browser.order("pause")
    d.go(1.0)
    before = len(d.browser.messages)
    assert d.live.cycle(d.now) is None
    d.go(100.0)
    assert len(d.browser.messages) == before


def test_reset_restores_robot_obstacles_path_and_driver() -> None:
    calls = []
    d = desk(on_reset=lambda: calls.append("reset"))
    d.go(2.0)
    d.browser.order("move", name="crate", x=1.0, y=-1.0)
    d.go(0.1)
    assert d.browser.obstacles["crate"]["at"] == [1.0, -1.0]
    d.browser.order("pause")
    d.browser.order("reset")
    d.go(0.1)
    assert calls == ["reset"]
    assert d.browser.last["t"] == 0.0
    assert d.browser.obstacles["crate"]["at"] == [2.0, 1.0]
    assert d.browser.path == [0.0, 0.0]
    d.browser.order("run")
    d.go(1.0)
    assert d.browser.last["pose"][0] > 0.3


def test_after_a_reset_from_a_cell_the_scene_is_sent_again() -> None:
    d = desk()
    d.go(1.0)
    with d.live.hold() as simulator:
        simulator.reset()
    d.live.cycle(d.now)
    assert "scene" in d.browser.last


def test_a_click_calls_on_goal_with_metres_and_shows_its_result() -> None:
    goals = []

    def on_goal(x: float, y: float) -> str:
        goals.append((x, y))
        return "on my way"

    d = desk(on_goal=on_goal)
    d.browser.order("goal", x=1.5, y=-0.25)
    d.go(0.2)
    assert goals == [(1.5, -0.25)]
    assert d.browser.last["goal"] == [1.5, -0.25]
    assert d.browser.last["note"][1] == "on my way"


def test_the_built_in_driver_goes_to_the_clicked_place() -> None:
    d = Desk(Live(Simulator(World(), noise=False), rate=10.0))
    d.browser.order("goal", x=1.0, y=1.0)
    d.go(0.1)
    assert d.browser.last["note"][1] == "driving to (1.00, 1.00) m"
    d.go(1.5)
    assert d.live.simulator.pose.distance_to(type(d.live.simulator.pose)(1.0, 1.0)) < 0.1
    assert d.browser.last["note"][1] == "arrived at (1.00, 1.00) m"


def test_a_click_that_does_nothing_says_how_to_change_that() -> None:
    d = desk()
    d.browser.order("goal", x=1.0, y=1.0)
    d.go(0.1)
    assert "on_goal" in d.browser.last["note"][1]
    assert d.browser.last["goal"] is None


def test_the_lidar_measures_a_dragged_obstacle_at_its_new_position() -> None:
    d = desk(World(obstacles=(BOX,)), driver=lambda _: Twist())
    d.browser.order("move", name="crate", x=1.0, y=0.0)
    d.go(0.1)
    assert d.live.simulator.true_ranges().min() == pytest.approx(0.8)


def test_an_obstacle_cannot_be_dragged_onto_the_robot() -> None:
    d = desk(World(obstacles=(BOX,)), driver=lambda _: Twist())
    d.browser.order("move", name="crate", x=0.3, y=0.0)
    d.go(0.1)
    assert d.browser.obstacles["crate"]["at"] == [2.0, 1.0]
    assert d.live.simulator.contacts == ()
    assert "crate cannot be put" in d.browser.last["note"][1]


def test_of_several_moves_between_two_steps_only_the_last_is_made() -> None:
    d = desk(World(obstacles=(BOX,)), driver=lambda _: Twist())
    for i in range(50):
        d.browser.order("move", name="crate", x=1.0 + 0.01 * i, y=1.0)
    d.go(0.1)
    assert [(e.kind, e.subject) for e in d.live.simulator.events] == [("moved", "crate")]
    assert d.browser.obstacles["crate"]["at"] == [1.49, 1.0]


def test_a_dragged_obstacle_is_one_obstacle_in_the_recording() -> None:
    d = desk(World(obstacles=(BOX,)), driver=lambda _: Twist())
    recorder = Recorder(d.live.simulator)
    for x in (1.0, 1.2, 1.4):
        d.browser.order("move", name="crate", x=x, y=1.0)
        d.go(0.1)
        recorder.take([])
    (presence,) = recorder.recording().presences
    assert presence.until == math.inf
    assert recorder.recording().movers["crate"][-1].tolist() == pytest.approx([1.4, 1.0])


def test_walls_cannot_be_dragged() -> None:
    d = desk()
    d.browser.order("move", name="wall", x=0.0, y=0.0)
    d.browser.order("move", name="unknown", x=0.0, y=0.0)
    d.go(0.1)
    assert d.browser.obstacles["wall"]["at"] == [3.0, 0.0]
    assert not d.browser.obstacles["wall"]["drag"]


@pytest.mark.parametrize(
    "content",
    [
        None,
        "pause",
        {},
        {"kind": "explode"},
        {"kind": "rate", "value": 0},
        {"kind": "rate", "value": "fast"},
        {"kind": "rate", "value": math.nan},
        {"kind": "goal", "x": math.inf, "y": 0.0},
        {"kind": "goal", "x": True, "y": 0.0},
        {"kind": "goal", "x": 1.0},
        {"kind": "move", "name": 3, "x": 1.0, "y": 1.0},
        {"kind": "hello"},
    ],
)
def test_an_invalid_command_is_ignored(content: object) -> None:
    d = desk()
    d.live.receive(content)
    d.go(0.2)
    assert d.live.error is None
    assert d.live.simulator.time > 0.1


def test_an_exception_in_the_driver_stops_the_robot_and_the_view_shows_its_line() -> None:
    def driver(seen: Seen) -> Twist:
        return Twist(1.0 / (seen.time - 0.5), 0.0) if seen.time > 0.45 else Twist()

    d = desk(driver=driver)
    d.go(2.0)
    assert d.live.simulator.time == pytest.approx(0.5)
    assert d.browser.last["status"] == "failed"
    assert "ZeroDivisionError" in d.browser.last["note"][1]
    assert "of driver)" in d.browser.last["note"][1]


# ------------------------------------------------------------------------------------------ start, end, no browser


def test_it_runs_until_the_last_view_is_closed() -> None:
    d = desk()
    d.live.receive({"kind": "hello", "view": "b"})
    d.go(0.5)
    d.browser.order("bye", view="a")
    d.go(0.5)
    watched = d.live.simulator.time
    assert watched == pytest.approx(1.0, abs=0.03)
    d.browser.order("bye", view="b")
    d.go(5.0)
    assert d.live.simulator.time == pytest.approx(watched, abs=0.03)
    assert d.live.cycle(d.now) is None


def test_a_run_without_a_browser_ignores_the_rate_and_equals_drive(live: Live) -> None:
    began = time.monotonic()
    live.set_rate(0.01)
    live.run(20.0)
    assert time.monotonic() - began < 100.0  # at that rate it would take 2000 s
    expected = Simulator(ROOM)
    drive(expected, ahead, 20.0)
    assert live.simulator.time == 20.0
    assert live.simulator.pose == expected.pose
    assert not live.is_running


def test_after_a_fast_run_the_next_step_is_due_at_once(live: Live) -> None:
    live.set_rate(1.0)
    live.run(1000.0)
    live.start()
    wait_for(lambda: live.simulator.time > 1000.1)


def test_the_built_in_driver_drives_the_same_tour_as_without_the_view() -> None:
    world = load_world("office")
    with Live(Simulator(world)) as live:
        live.run(30.0)
    expected = Simulator(world)
    drive(expected, Tourist(expected), 30.0)
    assert live.simulator.pose == expected.pose


def test_a_run_can_end_early_and_be_continued(live: Live) -> None:
    live.run(20.0, until=lambda: live.simulator.time >= 1.0)
    assert live.simulator.time == pytest.approx(1.0)
    live.run(1.0)
    assert live.simulator.time == pytest.approx(2.0)


def test_a_run_raises_the_drivers_exception() -> None:
    def driver(_: Seen) -> Twist:
        raise LookupError("no way")

    with Live(Simulator(ROOM), driver) as live, pytest.raises(LookupError, match="no way"):
        live.run(5.0)


def test_a_run_raises_its_conditions_exception(live: Live) -> None:
    def until() -> bool:
        raise LookupError("no idea")

    with pytest.raises(LookupError, match="no idea"):
        live.run(5.0, until=until)


def test_an_interrupt_pauses_the_run(live: Live) -> None:
    interrupted = threading.Event()

    def until() -> None:
        if not interrupted.is_set():
            interrupted.set()
            _thread.interrupt_main()

    with pytest.raises(KeyboardInterrupt):
        live.run(1e6, until)
    assert interrupted.is_set()
    assert not live.is_running


def test_a_cell_can_change_the_simulator_while_it_runs_at_full_speed(live: Live) -> None:
    live.start()
    wait_for(lambda: live.simulator.time > 1.0)
    for _ in range(20):
        with live.hold() as simulator:
            before = simulator.time
            simulator.reset()
            assert simulator.time == 0.0 < before
        wait_for(lambda: live.simulator.time > 0.0)


def test_commands_from_many_threads_all_arrive(live: Live) -> None:
    goals: list[float] = []
    live._on_goal = lambda x, _y: goals.append(x)
    live.start()

    def click(first: int) -> None:
        for i in range(100):
            live.receive({"kind": "goal", "x": first + i, "y": 0})

    threads = [threading.Thread(target=click, args=(1000 * n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    wait_for(lambda: len(goals) == 400)
    assert sorted(goals) == [1000 * n + i for n in range(4) for i in range(100)]


def test_stop_ends_the_thread_and_can_be_called_twice(live: Live) -> None:
    live.start()
    thread = live._thread
    assert thread is not None
    live.stop()
    live.stop()
    assert not thread.is_alive()
    assert live.is_stopped
    with pytest.raises(RuntimeError, match="make a new one"):
        live.start()


def test_a_callback_can_stop_the_view(live: Live) -> None:
    live._on_goal = lambda _x, _y: live.stop()
    live.start()
    live.receive({"kind": "goal", "x": 1, "y": 1})
    wait_for(lambda: not live._thread.is_alive())  # type: ignore[union-attr]


def test_the_output_is_a_picture_of_the_current_state_and_a_text_that_never_changes(live: Live) -> None:
    before, _ = live._repr_mimebundle_()
    live.run(2.0)
    after, metadata = live._repr_mimebundle_()
    assert before.keys() == {"text/plain", "image/png"}
    assert base64.b64decode(after["image/png"]).startswith(b"\x89PNG")
    assert before["text/plain"] == after["text/plain"] == "Live view of 'room'"
    assert metadata["image/png"]["alt"] == "room at 2.00 s"


def test_invalid_arguments_are_refused() -> None:
    simulator = Simulator(ROOM)
    with pytest.raises(ValueError, match="not both"):
        Live(simulator, ahead, step=simulator.step)
    with pytest.raises(ValueError, match="above 0"):
        Live(simulator, rate=0.0)
    with Live(simulator) as live, pytest.raises(ValueError, match="finite number above 0"):
        live.run(math.inf)


@pytest.mark.slow
def test_a_notebook_without_a_front_end_runs_and_stores_a_picture_of_the_end(tmp_path: FilePath) -> None:
    """As nbconvert and nbval run it: no exception, no output, no widget in the stored notebook."""
    pytest.importorskip("nbval", reason="no nbval: pip install -e '.[dev]' to run notebooks")
    nbformat = pytest.importorskip("nbformat", reason="no nbformat: pip install -e '.[dev]' to run notebooks")
    sources = [
        "from sim import Simulator, load_world\nfrom sim.live import Live\n"
        "live = Live(Simulator(load_world('office')))",
        "live",
        "live.run(20.0)\nprint(live.simulator.time)",
        "live.stop()",
    ]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(s) for s in sources])
    nbformat.write(notebook, tmp_path / "live.ipynb")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "IPYTHONDIR": str(tmp_path), "JUPYTER_NO_CONFIG": "1"}
    execute = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", "--inplace", "live.ipynb"]
    subprocess.run(execute, cwd=tmp_path, env=environment, capture_output=True, check=True, timeout=300)
    done = nbformat.read(tmp_path / "live.ipynb", as_version=4)
    assert [[o.output_type for o in cell.outputs] for cell in done.cells] == [[], ["display_data"], ["stream"], []]
    (shown,) = done.cells[1].outputs
    assert shown.data.keys() == {"image/png", "text/plain"}
    assert shown.metadata["image/png"]["alt"] == "office at 20.00 s"
    assert done.cells[2].outputs[0].text == "20.0\n"
    validate = [
        sys.executable,
        "-m",
        "pytest",
        "--nbval",
        "-q",
        "-p",
        "no:cacheprovider",
        "-c",
        os.devnull,
        "live.ipynb",
    ]
    judged = subprocess.run(validate, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300)
    assert "4 passed" in judged.stdout, judged.stdout


# ------------------------------------------------------------------------------------------------- with a real node

NODE = """
import rclpy
from geometry_msgs.msg import PointStamped, Twist
from sensor_msgs.msg import LaserScan
rclpy.init()
node = rclpy.create_node("robot_controller", parameter_overrides=[rclpy.Parameter("use_sim_time", value=True)])
publisher, heard, goals = node.create_publisher(Twist, "cmd_vel", 10), [], []
node.create_subscription(LaserScan, "scan", heard.append, 10)
node.create_subscription(PointStamped, "goal", goals.append, 10)
def control():
    twist = Twist()
    twist.linear.x, twist.angular.z = 0.1 * len(goals), float(len(heard))
    publisher.publish(twist)
node.create_timer(0.1, control)
rclpy.spin(node)
"""

HOST = """
import json, math, os, subprocess, sys
from geometry_msgs.msg import PointStamped
from sim import Simulator, load_world
from sim.bridge import CONTROLLER, Bridge
from sim.live import Live
node = subprocess.Popen([sys.executable, "node.py"], env={**os.environ, "ROS_DOMAIN_ID": "3"})
simulator = Simulator(load_world("open_field"), seed=1)
bridge = Bridge(simulator, CONTROLLER, "robot_controller", domain_id=3, alive=lambda: node.poll() is None)
goals, frames, commands = bridge.node.create_publisher(PointStamped, "goal", 10), [], []
bridge.on_command = lambda t, m: commands.append([round(t, 6), m.linear.x, m.angular.z])
assert bridge.await_node(lambda: goals.get_subscription_count() > 0)
if sys.argv[1] == "ticks":
    for _ in range(40):
        bridge.tick()
else:
    class Channel:
        def send(self, content, buffers):
            frames.append(content["t"])
    live = Live(simulator, step=bridge.tick, on_goal=lambda x, y: goals.publish(PointStamped()), rate=math.inf)
    live._audience.channel = Channel()
    live.receive({"kind": "hello", "view": "a"})
    live.run(2.0)
    if sys.argv[1] == "goal":
        live.receive({"kind": "goal", "x": 1.0, "y": 0.0})
        live.run(2.0)
    live.stop()
print(json.dumps({"commands": commands, "frames": frames, "t": simulator.time}))
node.kill()
node.wait()
bridge.close()
"""


def with_a_node(folder: FilePath, kind: str) -> dict[str, Any]:
    (folder / "node.py").write_text(NODE)
    (folder / "host.py").write_text(HOST)
    return run_with_node(folder / "host.py", kind)


@pytest.mark.ros
@pytest.mark.sandbox
def test_a_node_in_lockstep_does_the_same_with_and_without_a_view(tmp_path: FilePath) -> None:
    alone, watched = (with_a_node(tmp_path, kind) for kind in ("ticks", "live"))
    assert watched["frames"]
    assert watched["t"] == alone["t"] == 2.0
    assert [c for c in watched["commands"] if c[0] > 0.15] == [c for c in alone["commands"] if c[0] > 0.15]


@pytest.mark.ros
@pytest.mark.sandbox
def test_a_click_reaches_the_node_through_on_goal(tmp_path: FilePath) -> None:
    speeds = [v for _, v, _ in with_a_node(tmp_path, "goal")["commands"]]
    assert (speeds[0], speeds[-1]) == (0.0, 0.1)


# ----------------------------------------------------------------------------------------------- in a real browser

SETUP = """
from sim import Box, Path, Simulator, Tourist, World, room
from sim.live import Live

crate = Box((2.0, 0.0), (0.5, 0.5), name="crate")
cart = Box((4.0, -1.0), (0.4, 0.4), name="cart", motion=Path(((4.0, 1.0),), 0.4, "back_and_forth"))
world = World("yard", (*room((-1.0, -2.0), (5.0, 2.0)), crate, cart), title="a crate and a cart")
simulator = Simulator(world)
driver, goals = Tourist(simulator), []


def on_goal(x, y):
    goals.append((x, y))
    driver.go_to(x, y)


live = Live(simulator, driver, on_goal=on_goal)
"""
BOUNDS = (-1.4, -2.4, 5.4, 2.4)  # the room and a margin of 0.4 m
PANEL = "[...(window.jupyterapp?.shell.widgets('main') ?? [])].find(w => w.sessionContext)"


class Page:
    """A page of a headless Chromium, through its debugging protocol (websocket-client comes with Jupyter)."""

    def __init__(self, port: int) -> None:
        import websocket

        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=10) as answer:
            pages = json.load(answer)
        target = next(p for p in pages if p["type"] == "page")
        self._socket = websocket.create_connection(target["webSocketDebuggerUrl"], timeout=60, suppress_origin=True)
        self._count = 0

    def close(self) -> None:
        self._socket.close()

    def call(self, method: str, **params: object) -> Any:
        self._count += 1
        self._socket.send(json.dumps({"id": self._count, "method": method, "params": params}))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]

    def ask(self, script: str) -> Any:
        """Return the value of an expression in the page; a promise is awaited."""
        got = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in got, got["exceptionDetails"]
        return got["result"].get("value")

    def wait(self, script: str, seconds: float = 240.0) -> Any:
        """Return the value of an expression as soon as it is true."""
        deadline = time.monotonic() + seconds
        while not (value := self.ask(script)):
            assert time.monotonic() < deadline, f"timed out waiting for {script}\n{self.ask('document.body.innerText')}"
            time.sleep(0.05)
        return value

    def view(self, key: str) -> Any:
        return self.ask(f"document.querySelector('.lv').dataset.{key}")

    def mouse(self, kind: str, x: float, y: float, down: bool = True) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=int(down), clickCount=1)

    def click(self, x: float, y: float) -> None:
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y, down=False)

    def press_button(self, name: str) -> None:
        x, y = self.ask(
            f"(() => {{ const b = [...document.querySelectorAll('.lv button')].find(b => b.textContent === '{name}')"
            ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2] })()"
        )
        self.click(x, y)

    def on_map(self, x: float, y: float, bounds: tuple[float, float, float, float]) -> tuple[float, float]:
        """Return the pixel of a position on the map (m); the map is centred and fills one direction."""
        box = self.ask("document.querySelector('.lv-map').getBoundingClientRect().toJSON()")
        x0, y0, x1, y1 = bounds
        scale = min(box["width"] / (x1 - x0), box["height"] / (y1 - y0))
        return (
            box["x"] + box["width"] / 2 + scale * (x - (x0 + x1) / 2),
            box["y"] + box["height"] / 2 - scale * (y - (y0 + y1) / 2),
        )

    def key(self, key: str) -> None:
        code = {" ": 32, "Enter": 13, "ArrowRight": 39, "ArrowUp": 38, "m": 77}[key]
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def picture(self, path: FilePath) -> None:
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))

    def kernel(self, code: str, wait: bool = True) -> str:
        """Run code in the notebook's kernel and return its output, which is also stored in `window.said`."""
        answer = self.ask(
            f"""(() => {{
              const kernel = ({PANEL}).sessionContext.session.kernel;
              const future = kernel.requestExecute({{code: {json.dumps(code)}, store_history: false}});
              let said = "";
              window.said = "";
              future.onIOPub = m => {{ said += m.content.text ?? m.content.evalue ?? ""; }};
              const done = future.done.then(() => window.said = said.trim());
              return {"done" if wait else "null"};
            }})()"""
        )
        return answer or ""


def written(folder: FilePath, pattern: str, end: str) -> FilePath:
    """Return the file as soon as it exists and contains `end`."""
    wait_for(lambda: any(end in f.read_text() for f in folder.glob(pattern)), 300)
    return next(folder.glob(pattern))


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Return a browser's page with the notebook open in a running JupyterLab, nothing executed yet."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium: install it (apt install chromium) to test the live view in a browser")
    for module in ("jupyterlab", "anywidget", "websocket"):
        pytest.importorskip(module, reason=f"no {module}: pip install -e '.[notebooks]' to test the live view")
    folder = tmp_path_factory.mktemp("lab")
    cells = [
        {"cell_type": "code", "id": f"cell{i}", "source": s, "metadata": {}, "outputs": [], "execution_count": None}
        for i, s in enumerate((SETUP.strip(), "live"))
    ]
    kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"cells": cells, "metadata": {"kernelspec": kernelspec}, "nbformat": 4, "nbformat_minor": 5}
    (folder / "live.ipynb").write_text(json.dumps(notebook))
    home = {key: str(folder / "home") for key in ("HOME", "IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR")}
    environment = {**os.environ, **home, "PYTHONPATH": str(ROOT), "JUPYTER_RUNTIME_DIR": str(folder / "runtime")}
    server = [sys.executable, "-m", "jupyterlab", "--no-browser", "--ip=127.0.0.1", "--allow-root"]
    server += ["--IdentityProvider.token=", "--ServerApp.port=0", "--LabApp.expose_app_in_browser=True"]
    server.append(f"--ServerApp.root_dir={folder}")
    settings = folder / "home/lab/user-settings/@jupyterlab/apputils-extension/notification.jupyterlab-settings"
    settings.parent.mkdir(parents=True)
    settings.write_text('{"fetchNews": "false", "checkForUpdates": false}')
    chromium = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
    chromium += [f"--user-data-dir={folder / 'chromium'}", "--window-size=1100,1000", "--no-first-run", "about:blank"]
    with contextlib.ExitStack() as stack:
        for name, command in (("server", server), ("chromium", chromium)):
            log = stack.enter_context((folder / f"{name}.log").open("w"))
            process = subprocess.Popen(command, stdout=log, stderr=log, env=environment, cwd=folder)
            stack.callback(process.wait, 30)
            stack.callback(process.terminate)
        server_file = written(folder / "runtime", "jpserver-*.json", "}")
        port_file = written(folder / "chromium", "DevToolsActivePort", "/devtools/")
        url = json.loads(server_file.read_text())["url"]
        page = Page(int(port_file.read_text().split()[0]))
        stack.callback(page.close)
        page.call("Page.navigate", url=f"{url}lab/tree/live.ipynb")
        page.wait(f"({PANEL})?.sessionContext.session?.kernel?.status === 'idle'")
        page.ask(f"jupyterapp.shell.activateById(({PANEL}).id)")
        page.ask("jupyterapp.commands.execute('application:toggle-left-area')")
        yield page


@pytest.mark.slow
def test_in_jupyterlab_the_robot_drives_and_obeys(page: Page, tmp_path: FilePath) -> None:
    """One visit: driving, buttons, a click, a drag, the dark theme."""
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("Number(document.querySelector('.lv')?.dataset.frames) > 5")
    page.ask("document.querySelector('.lv').scrollIntoView()")

    began = [float(page.view(k)) for k in ("time", "frames", "drawn")]
    page.wait(f"Number(document.querySelector('.lv').dataset.time) > {began[0]} + 5")
    ended = [float(page.view(k)) for k in ("time", "frames", "drawn")]
    simulated, frames, drawn = (b - a for a, b in zip(began, ended, strict=True))
    print(f"{frames / simulated:.1f} messages, {drawn / simulated:.1f} pictures per simulated second")
    assert frames / simulated >= 20
    page.picture(tmp_path / "running.png")

    page.press_button("Pause")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    stood = float(page.view("time"))
    page.press_button("Step")
    page.wait(f"Number(document.querySelector('.lv').dataset.time) > {stood}")
    assert float(page.view("time")) == pytest.approx(stood + 0.1)

    page.press_button("Reset")
    page.wait("Number(document.querySelector('.lv').dataset.time) === 0")
    assert page.view("pose") == "0 0 0"

    page.click(*page.on_map(1.0, 1.0, BOUNDS))
    page.wait("document.querySelector('.lv').dataset.goal !== ''")
    x, y = (float(v) for v in page.kernel("print(*goals[-1])").split())
    assert math.hypot(x - 1.0, y - 1.0) < 0.02
    page.press_button("Run")
    page.wait(
        "(() => { const [x, y] = document.querySelector('.lv').dataset.pose.split(' ');"
        " return Math.hypot(x - 1.0, y - 1.0) < 0.1 })()"
    )

    page.mouse("mousePressed", *page.on_map(2.1, 0.0, BOUNDS))
    for i in range(1, 11):
        page.mouse("mouseMoved", *page.on_map(2.1 + 0.1 * i, -0.1 * i, BOUNDS))
        time.sleep(0.03)
    page.picture(tmp_path / "dragging.png")
    page.mouse("mouseReleased", *page.on_map(3.1, -1.0, BOUNDS), down=False)
    where = "print(*next(p for o, p in live.simulator.obstacles if o.name == 'crate'))"
    wait_for(lambda: [float(v) for v in page.kernel(where).split()] == pytest.approx([3.0, -1.0], abs=0.02))

    page.ask("jupyterapp.commands.execute('apputils:change-theme', {theme: 'JupyterLab Dark'})")
    page.wait("document.body.dataset.jpThemeLight === 'false'")
    time.sleep(0.5)
    page.picture(tmp_path / "dark.png")


@pytest.mark.slow
def test_in_jupyterlab_it_can_be_used_without_a_mouse(page: Page) -> None:
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.ask("document.querySelector('.lv-map').focus()")
    page.key(" ")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    x, y, _ = (float(v) for v in page.view("pose").split())
    for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Enter"):
        page.key(key)
    page.wait("document.querySelector('.lv').dataset.goal !== ''")
    assert [float(v) for v in page.view("goal").split()] == pytest.approx([x + 0.5, y + 0.25], abs=2e-3)
    assert page.ask("document.querySelectorAll('.jp-Cell').length") == 2  # no shortcut of the notebook was triggered
    unnamed = (
        "[...document.querySelectorAll('.lv button, .lv select, .lv canvas')].filter(e => !e.textContent.trim() && "
    )
    assert page.ask(unnamed + "!e.getAttribute('aria-label')).length") == 0


@pytest.mark.slow
def test_in_jupyterlab_it_runs_beside_a_busy_cell_and_ends_in_a_picture(page: Page) -> None:
    """A student's node may block the kernel; a cell run again replaces its view; stop leaves a picture."""
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.kernel("older = live")
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    wait_for(
        lambda: page.kernel("print(older.is_stopped, older._thread.is_alive(), live.is_running)") == "True False True"
    )
    assert page.ask("document.querySelectorAll('.lv').length") == 1

    before = int(page.view("frames"))
    page.kernel("while live.is_running: pass\nprint('paused')", wait=False)
    page.wait(f"Number(document.querySelector('.lv').dataset.frames) >= {before} + 40")
    page.press_button("Pause")
    page.wait("document.querySelector('.lv').dataset.status === 'paused'")
    assert page.wait("window.said") == "paused"

    page.kernel("live.stop()")
    page.wait("!document.querySelector('.lv') && document.images.length === 1")
    data = page.ask(f"Object.keys(({PANEL}).content.widgets[1].model.outputs.get(0).data).sort()")
    assert data == ["image/png", "text/plain"]
    assert page.kernel("import threading; print([t.name for t in threading.enumerate()].count('live view'))") == "0"


@pytest.mark.slow
def test_in_jupyterlab_closing_the_notebook_stops_the_robot(page: Page) -> None:
    page.ask("jupyterapp.commands.execute('notebook:run-all-cells')")
    page.wait("document.querySelector('.lv')?.dataset.status === 'running'")
    page.ask(f"({PANEL}).context.save()")
    page.ask(f"window.kernel = ({PANEL}).sessionContext.session.kernel.clone(); ({PANEL}).close()")
    page.wait(f"!({PANEL})")
    assert not page.ask("[...document.querySelectorAll('.lv')].length")
    ask = """(async () => {
        const future = window.kernel.requestExecute({code: "print(live.is_running)"});
        let said = "";
        future.onIOPub = m => { said += m.content.text ?? ""; };
        await future.done;
        return said.trim() })()"""
    wait_for(lambda: page.ask(ask) == "False", 60)
