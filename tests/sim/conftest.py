"""Recordings that the tests of views and command line share."""

import pytest

from sim import Box, Recorder, Recording, Simulator, Tourist, Twist, Wall, World, drive, load_world
from sim.obstacles import Path as Way


@pytest.fixture(scope="module")
def crash() -> Recording:
    world = World(name="crash", obstacles=(Wall((1.5, -1.0), (1.5, 1.0), name="wall"),))
    return drive(Simulator(world), lambda _: Twist(0.4, 0.05), 5.0)


@pytest.fixture(scope="module")
def touched() -> Recording:
    """The robot drives straight into a wall at x = 1 m, recorded for 3 s."""
    simulator = Simulator(World(name="crash", obstacles=(Wall((1.0, -1.0), (1.0, 1.0), name="wall"),)))
    recorder = Recorder(simulator)
    simulator.command(0.5, 0.0)
    for _ in range(60):
        recorder.take(simulator.step(0.05))
    return recorder.recording()


@pytest.fixture(scope="module")
def cart() -> Recording:
    simulator = Simulator(load_world("moving_cart"))
    return drive(simulator, Tourist(simulator), 6.0)


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
