"""The fixture that the tests of the live view share."""

import math
from collections.abc import Iterator

import pytest
from helpers.live_view import ROOM, ahead

from sim import Simulator
from sim.live import Live


@pytest.fixture
def live() -> Iterator[Live]:
    live = Live(Simulator(ROOM), ahead, rate=math.inf)
    yield live
    live.stop()
