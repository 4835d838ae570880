"""Recordings: their contents, and repeatability."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from grader import KIT
from sim import Box, Circle, Recorder, Recording, Simulator, Tourist, Wall, World, drive, load_world


@pytest.fixture(scope="module")
def crossing() -> Recording:
    simulator = Simulator(load_world("crossing"))
    return drive(simulator, Tourist(simulator), 8.0)


def test_samples_are_on_a_grid_of_50_ms(crossing: Recording) -> None:
    assert crossing.t == pytest.approx(np.arange(161) * 0.05)
    assert crossing.duration == pytest.approx(8.0)


def test_steps_that_do_not_divide_the_period_do_not_stretch_it() -> None:
    simulator = Simulator(World())
    recorder = Recorder(simulator, period=0.05)
    for _ in range(100):
        recorder.take(simulator.step(0.02))
    assert len(recorder.recording()) == 41


def test_a_recording_contains_the_ground_truth(touched: Recording) -> None:
    assert touched.x[-1] == pytest.approx(1.0 - 0.171, abs=1e-6)
    assert touched.v.max() == 0.5
    assert touched.v[-1] == 0.0
    assert touched.cmd_v[-1] == 0.5
    assert touched.clearance[0] == pytest.approx(0.829)
    assert touched.clearance[-1] == pytest.approx(0.0, abs=1e-6)
    assert touched.closest[-1] == pytest.approx(0.171, rel=0.03)
    assert touched.distance == pytest.approx(0.829, abs=1e-3)
    assert [c.obstacle for c in touched.contacts] == ["wall"]
    assert [e.kind for e in touched.events] == ["contact"]


def test_each_scan_belongs_to_the_sample_of_its_time(crossing: Recording) -> None:
    assert crossing.scan_t == pytest.approx(np.arange(1, 81) * 0.1)
    assert crossing.t[crossing.scan_index] == pytest.approx(crossing.scan_t)
    assert crossing.scan_ranges.shape == (80, 360)


def test_moving_obstacles_leave_their_track(crossing: Recording) -> None:
    track = crossing.movers["walker"]
    assert track[0] == pytest.approx([3.0, 1.4])
    assert track[-1, 1] < 0.0


def test_a_reset_clears_the_reason_why_a_run_is_unrepeatable() -> None:
    simulator = Simulator(World())
    simulator.unrepeatable = "Not repeatable: the wind blew."
    assert Recorder(simulator).recording().unrepeatable == "Not repeatable: the wind blew."
    simulator.reset()
    assert Recorder(simulator).recording().unrepeatable == ""


def test_an_obstacle_added_and_removed_at_run_time_was_present_in_between() -> None:
    simulator = Simulator(World())
    recorder = Recorder(simulator)
    name = simulator.add_obstacle(Wall((1.0, 0.0), (2.0, 0.0), 0.1))
    recorder.take(simulator.step(0.5))
    simulator.remove_obstacle(name)
    (presence,) = recorder.recording().presences
    assert presence.obstacle == Wall((1.0, 0.0), (2.0, 0.0), 0.1, name="wall 1")
    assert (presence.since, presence.until) == (0.0, 0.5)


# ------------------------------------------------------------------------------------------- obstacles put elsewhere


@pytest.fixture
def dragged() -> Recording:
    """A crate at x = 2 m is moved to 3 m at 0.5 s and removed at 1 s. A post stays."""
    simulator = Simulator(World(obstacles=(Box((2.0, 1.0), (0.4, 0.4), name="crate"), Circle((5.0, 5.0), 0.1))))
    recorder = Recorder(simulator)
    for act in (lambda: simulator.move_obstacle("crate", 3.0, 1.0), lambda: simulator.remove_obstacle("crate")):
        for _ in range(10):
            recorder.take(simulator.step(0.05))
        act()
    recorder.take(simulator.step(0.05))
    return recorder.recording()


def test_a_dragged_obstacle_is_one_obstacle_with_a_path(dragged: Recording) -> None:
    assert [p.obstacle.name for p in dragged.presences] == ["crate", "circle 1"]
    assert list(dragged.movers) == ["crate"]
    x = dragged.movers["crate"][:, 0]
    assert x[:11].tolist() == [2.0] * 11
    assert x[11:21].tolist() == [3.0] * 10
    assert np.isnan(x[21])


def test_a_track_gives_each_position_and_the_last_one_after_removal(dragged: Recording) -> None:
    crate, post = dragged.presences
    track = dragged.track(crate)
    assert track is not None
    assert track[[0, 10, 11, 21], 0].tolist() == [2.0, 2.0, 3.0, 3.0]
    assert dragged.track(post) is None


def test_a_second_obstacle_of_the_same_name_has_its_own_track() -> None:
    simulator = Simulator(World(obstacles=(Box((2.0, 1.0), (0.4, 0.4), name="crate"),)))
    recorder = Recorder(simulator)
    recorder.take(simulator.step(0.05))
    simulator.remove_obstacle("crate")
    recorder.take(simulator.step(0.05))
    simulator.add_obstacle(Box((4.0, 1.0), (0.4, 0.4), name="crate"))
    recorder.take(simulator.step(0.05))
    simulator.move_obstacle("crate", 5.0, 1.0)
    recorder.take(simulator.step(0.05))
    recording = recorder.recording()
    tracks = [recording.track(presence) for presence in recording.presences]
    assert [track[:, 0].tolist() for track in tracks if track is not None] == [[2.0] * 5, [4.0] * 4 + [5.0]]


def test_the_digest_tells_every_fact_of_a_run(dragged: Recording) -> None:
    others = (
        replace(dragged, samples={**dragged.samples, "x": dragged.x + 1e-12}),
        replace(dragged, movers={"crate": dragged.movers["crate"] + 1e-12}),
        replace(dragged, notes={"who": "test"}),
        replace(dragged, seed=dragged.seed + 1),
    )
    assert len({dragged.digest(), *(other.digest() for other in others)}) == 5
    assert replace(dragged).digest() == dragged.digest()


# ----------------------------------------------------------------------------------------------------- repeatability

RUN = """
from sim import Simulator, Tourist, drive, load_world, TB4
for profile in ({}, {"profile": TB4}):
    simulator = Simulator(load_world("moving_cart"), seed=%d, **profile)
    print(drive(simulator, Tourist(simulator), 6.0).digest())
"""


def digests(seed: int, hash_seed: str) -> list[str]:
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
    command = [sys.executable, "-c", RUN % seed]
    return subprocess.run(command, cwd=KIT, env=environment, capture_output=True, text=True, check=True).stdout.split()


def test_recordings_are_bit_equal_in_different_processes() -> None:
    """The same seed with another hash seed gives the same bits, another seed different ones."""
    first = digests(5, "1")
    assert len(set(first)) == 2
    assert digests(5, "4321") == first
    assert digests(6, "1") != first


def test_after_a_reset_the_run_repeats() -> None:
    simulator = Simulator(load_world("forest"))
    first = drive(simulator, Tourist(simulator), 3.0)
    simulator.reset()
    assert drive(simulator, Tourist(simulator), 3.0).digest() == first.digest()
    simulator.reset(seed=77)
    assert drive(simulator, Tourist(simulator), 3.0).digest() != first.digest()
