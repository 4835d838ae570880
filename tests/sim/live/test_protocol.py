"""The live view's messages: what is sent to the browser, and which commands are accepted from it."""

import itertools
import math

import numpy as np
import pytest
from helpers.live_view import BOX, ROOM, desk

from sim import Box, Circle, Path, Simulator, Twist, Wall, World
from sim.live import protocol
from sim.live.protocol import NO_RANGE, Feed


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


def test_a_long_path_is_thinned_and_sent_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "MAX_PATH", 40)
    simulator = Simulator(World(), noise=False)
    feed, path = Feed(simulator), []
    simulator.command(0.5, 0.0)
    for i in range(84):
        simulator.step(0.1)
        feed.follow()
        if i % 10 == 0:
            begin, *points = feed.message()[0]["path"]
            path[2 * begin :] = points
    assert len(feed.path) < 40
    assert path[0] < 0.1
    assert path[-2] == pytest.approx(0.05 * 81, abs=0.05)
    assert (np.diff(path[::2]) > 0).all()


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
