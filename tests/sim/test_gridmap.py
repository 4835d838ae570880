"""Maps of map_server: how they are read, and the errors for bad ones."""

from pathlib import Path

import numpy as np
import pytest

from sim import Pose, Simulator, World, WorldError, load_world
from sim.gridmap import merge, read_pgm


def grid(folder: Path, rows: str, **meta: object) -> World:
    lines = rows.split()
    text = " ".join({"#": "0", ".": "254", "?": "205"}[c] for line in lines for c in line)
    (folder / "m.pgm").write_text(f"P2\n# by hand\n{len(lines[0])} {len(lines)}\n255\n{text}\n")
    values = {
        "image": "m.pgm",
        "resolution": 0.5,
        "origin": [0.0, 0.0, 0.0],
        "occupied_thresh": 0.65,
        "negate": 0,
    } | meta
    (folder / "m.yaml").write_text("".join(f"{k}: {v}\n" for k, v in values.items()))
    path = folder / "some.yaml"
    path.write_text("maps:\n  - {name: map, file: m.yaml}")
    return load_world(path)


def test_occupied_cells_become_few_rectangles_and_the_first_row_is_at_the_top(tmp_path: Path) -> None:
    world = grid(tmp_path, "##.. ##.. ...?")
    assert world.obstacles[0].rectangles == ((0.0, 0.5, 1.0, 1.5),)


def test_a_maps_origin_and_resolution_determine_its_position(tmp_path: Path) -> None:
    world = grid(tmp_path, "..# ... ...", origin=[-1.0, -1.0, 0.0])
    simulator = Simulator(world, noise=False)
    simulator.place_robot(Pose(-0.75, 0.25, 0.0))
    assert simulator.true_ranges()[180] == pytest.approx(0.75)


def test_a_binary_map_reads_like_a_text_map() -> None:
    text, binary = b"P2\n3 2\n255\n0 100 255\n5 6 7\n", b"P5 3 2 255\n" + bytes([0, 100, 255, 5, 6, 7])
    assert read_pgm(text).tolist() == read_pgm(binary).tolist() == [[0, 100, 255], [5, 6, 7]]


def test_rectangles_cover_exactly_the_occupied_cells() -> None:
    occupied = np.random.default_rng(3).random((30, 40)) < 0.5
    covered = np.zeros_like(occupied, dtype=int)
    for x0, y0, x1, y1 in merge(occupied, 1.0):
        covered[int(y0) : int(y1), int(x0) : int(x1)] += 1
    assert (covered == occupied).all()


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        ({"image": "gone.pgm"}, "cannot be read"),
        ({"resolution": 0}, "resolution"),
        ({"resolution": "fine"}, "could not convert"),
        ({"origin": [1, 2]}, "not enough values"),
    ],
)
def test_the_error_for_a_bad_map_says_why(tmp_path: Path, spoil: dict[str, object], problem: str) -> None:
    with pytest.raises(WorldError, match=rf"maps\[0\]\.file: m\.yaml.*{problem}"):
        grid(tmp_path, "#. ..", **spoil)


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a", b"P2\n2 2\n255\n1 2 3", b"P5\n9999 9999\n255\n", b"P2\n1 1\n65535\n7"]
)
def test_an_image_that_is_not_a_map_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"image (is|has|holds)"):
        read_pgm(data)
