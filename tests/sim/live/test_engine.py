"""The live view's engine: pacing, commands, start and end of a run, and a real node as the driver."""

import _thread
import math
import threading
import time
from pathlib import Path as FilePath
from typing import Any

import pytest
from helpers import beside, until
from helpers.live_view import BOX, ROOM, Browser, Desk, ahead, desk
from helpers.node_runs import run_with_node

from sim import Seen, Simulator, Tourist, Twist, World, drive, load_world
from sim.live import Live
from sim.live.audience import HIDDEN_LOST_S, LOST_S
from sim.live.engine import Pacer

TEXTS = beside(__file__)

# --------------------------------------------------------------------------------------------------------- pacing


@pytest.mark.parametrize(("rate", "simulated"), [(0.25, 0.5), (1.0, 2.0), (5.0, 10.0)])
def test_simulated_time_advances_at_the_chosen_rate(rate: float, simulated: float) -> None:
    d = desk(World(), rate=rate)
    d.go(2.0)
    assert d.live.simulator.time == pytest.approx(simulated, abs=0.03 * max(1.0, rate))


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


def deliver_in_thread(browser: Browser, **content: object) -> None:
    """Deliver a message as JupyterLab does, in a thread that no cell keeps busy."""
    thread = threading.Thread(target=browser.live.receive, args=({"view": browser.view, **content},))
    thread.start()
    thread.join()


@pytest.mark.slow  # at the pace of a browser
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


@pytest.mark.slow  # at the pace of a browser
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


def test_before_a_shut_gate_the_view_says_that_the_robot_waits_and_not_that_it_drives() -> None:
    d = Desk(Live(Simulator(load_world("gate"), noise=False), rate=10.0))
    d.browser.order("goal", x=3.0, y=0.0)
    d.go(2.0)
    assert d.browser.last["note"][1] == "waiting before an obstacle, on the way to (3.00, 0.00) m"
    with d.live.hold() as simulator:
        simulator.trigger("open gate")
    d.go(0.2)
    assert d.browser.last["note"][1] == "driving to (3.00, 0.00) m"
    d.go(2.0)
    assert d.browser.last["note"][1] == "arrived at (3.00, 0.00) m"


def test_a_click_that_does_nothing_says_how_to_change_that() -> None:
    d = desk()
    d.browser.order("goal", x=1.0, y=1.0)
    d.go(0.1)
    assert "on_goal" in d.browser.last["note"][1]
    assert d.browser.last["goal"] is None


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


def test_walls_cannot_be_dragged() -> None:
    d = desk()
    d.browser.order("move", name="wall", x=0.0, y=0.0)
    d.browser.order("move", name="unknown", x=0.0, y=0.0)
    d.go(0.1)
    assert d.browser.obstacles["wall"]["at"] == [3.0, 0.0]
    assert not d.browser.obstacles["wall"]["drag"]


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


def test_a_change_that_comes_as_the_thread_is_about_to_wait_is_not_missed(live: Live, monkeypatch: pytest.MonkeyPatch):
    """`start` right after `run` once did nothing: the thread had just decided to wait for ever."""
    cycle, started = live.cycle, threading.Event()

    def ends_with_a_start(now: float) -> float | None:
        wait = cycle(now)
        if wait is None and not started.is_set():
            started.set()
            another = threading.Thread(target=live.start)
            another.start()
            another.join()
        return wait

    monkeypatch.setattr(live, "cycle", ends_with_a_start)
    live.run(1.0)
    until(lambda: live.simulator.time > 1.1, 20.0)


@pytest.mark.slow  # ten simulated minutes
def test_after_a_fast_run_the_next_step_is_due_at_once(live: Live) -> None:
    live.set_rate(1.0)
    live.run(1000.0)
    live.start()
    until(lambda: live.simulator.time > 1000.1)


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
    until(lambda: live.simulator.time > 1.0)
    for _ in range(20):
        with live.hold() as simulator:
            before = simulator.time
            simulator.reset()
            assert simulator.time == 0.0 < before
        until(lambda: live.simulator.time > 0.0)


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
    until(lambda: len(goals) == 400)
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
    until(lambda: not live._thread.is_alive())  # type: ignore[union-attr]


def test_invalid_arguments_are_refused() -> None:
    simulator = Simulator(ROOM)
    with pytest.raises(ValueError, match="not both"):
        Live(simulator, ahead, step=simulator.step)
    with pytest.raises(ValueError, match="above 0"):
        Live(simulator, rate=0.0)
    with Live(simulator) as live, pytest.raises(ValueError, match="finite number above 0"):
        live.run(math.inf)


# ------------------------------------------------------------------------------------------------- with a real node


def with_a_node(folder: FilePath, kind: str) -> dict[str, Any]:
    (folder / "node.py").write_text(TEXTS["NODE"])
    (folder / "host.py").write_text(TEXTS["HOST"])
    return run_with_node(folder / "host.py", kind)


@pytest.mark.slow  # two runs of a node
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_node_in_lockstep_does_the_same_with_and_without_a_view(tmp_path: FilePath) -> None:
    alone, watched = (with_a_node(tmp_path, kind) for kind in ("ticks", "live"))
    assert watched["frames"]
    assert watched["t"] == alone["t"] == 2.0
    assert [c for c in watched["commands"] if c[0] > 0.15] == [c for c in alone["commands"] if c[0] > 0.15]
