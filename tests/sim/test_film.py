"""The film: a PNG that moves, small enough for a notebook."""

import io

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from sim import Box, Recording, Simulator, Tourist, Twist, World, drive, load_world
from sim.film import FRAME_S, LONGEST_S, Film
from sim.views import COLORS


def frames(recording: Recording) -> list[NDArray[np.uint8]]:
    """Return the pixels of a film's frames, after the picture that is shown where no film plays."""
    picture = Image.open(io.BytesIO(Film(recording).png()))
    return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(picture)]


def places(pixels: NDArray[np.uint8], color: str) -> NDArray[np.int64]:
    """Return the columns of a picture's pixels of a colour."""
    apart = np.abs(pixels - np.array(to_rgb(COLORS[color])) * 255).max(axis=2)
    return np.nonzero(apart < 8)[1]


def test_it_shows_the_robot_on_its_way_and_is_the_whole_way_where_it_does_not_play(crash: Recording) -> None:
    shown = frames(crash)
    still, early, middle, end = (int(places(shown[n], "path").max()) for n in (0, 8, len(shown) // 2, -1))
    assert early < middle < end == still
    assert len(shown) == round(crash.duration / FRAME_S) + 2  # the still picture, and a frame at either end


def test_a_box_appears_and_vanishes_in_it() -> None:
    box = Box((1.0, 1.0), (0.3, 0.3), name="box", appears=1.0, vanishes=2.0)
    shown = frames(drive(Simulator(World(obstacles=(box,))), lambda _: Twist(0.1, 0.0), 3.0))
    at = [places(shown[1 + round(t / FRAME_S)], "obstacle").size > 500 for t in (0.5, 1.5, 2.5)]
    assert at == [False, True, False]


@pytest.mark.slow  # draws a minute of film
def test_a_drive_of_a_minute_is_played_faster_and_stays_small() -> None:
    office = Simulator(load_world("office"))
    film = Film(drive(office, Tourist(office), 60.0))
    png, metadata = film._repr_png_()
    assert film.speed == 60.0 / LONGEST_S
    assert len(png) < 400_000
    assert metadata["alt"].startswith("A film of 60.0 s in 'office': from (0.6, 0.7) to (9.2, 0.7), 17.2 m driven")


@pytest.mark.slow  # draws a hundred pictures
def test_white_stays_white(crash: Recording) -> None:
    assert (frames(crash)[5][4, 4] == 255).all()  # inside the frame, which has a colour of its own


def test_a_robot_that_stands_still_has_a_film() -> None:
    assert len(frames(drive(Simulator(World()), lambda _: Twist(0.0, 0.0), 1.0))) > 1
