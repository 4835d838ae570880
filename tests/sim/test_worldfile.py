"""World files: what they can contain, and the errors for mistakes in them."""

import contextlib
from pathlib import Path as FilePath

import pytest
from helpers import beside
from hypothesis import given, settings
from hypothesis import strategies as st

from sim import Box, Circle, Path, Polygon, Pose, Simulator, Wall, World, WorldError, load_world, world_names

TEXTS = beside(__file__)


def write(folder: FilePath, text: str) -> FilePath:
    path = folder / "some.yaml"
    path.write_text(text)
    return path


def test_a_file_can_contain_all_this(tmp_path: FilePath) -> None:
    world = load_world(write(tmp_path, TEXTS["EVERYTHING"]))
    assert (world.name, world.seed, world.start, world.goals) == ("some", 42, Pose(1.0, 2.0, 0.5), (Pose(3.0, 0.0),))
    named = {o.name: o for o in world.obstacles}
    assert list(named)[:4] == ["hall south wall", "hall east wall", "hall north wall", "hall west wall"]
    assert named["desk"] == Box((3, 3), (1.0, 0.5), 0.3, name="desk", appears=2.0, vanishes="tidy up")
    path = Path(((-3, 2), (-1, 2)), 0.4, "loop", "go", 2, 0.5)
    assert named["cart"] == Circle((-3, 0), 0.3, name="cart", motion=path)
    assert isinstance(named["polygon 1"], Polygon)
    assert named["wall 1"] == Wall((0, 0), (1, 0), 0.1, name="wall 1")


def test_a_world_is_the_same_after_a_round_trip_through_plain_data(tmp_path: FilePath) -> None:
    for world in (load_world(write(tmp_path, TEXTS["EVERYTHING"])), *map(load_world, world_names())):
        again = World.from_dict(world.to_dict())
        assert {o.name: o for o in again.obstacles} == {o.name: o for o in world.obstacles}
        assert (again.name, again.start, again.goals, again.seed) == (world.name, world.start, world.goals, world.seed)


CIRCLE = "circles:\n  - {center: [1, 2], radius: 1"
MISTAKES = [
    ("boxes:\n  - {center: [1, 2], size: [1]}", "boxes[0].size", "`size: [0.4, 0.3]`"),
    ("boxes:\n  - {center: [1, 2], size: [1, -1]}", "boxes[0].size", "above 0"),
    ("boxes:\n  - {size: [1, 1]}", "boxes[0].center: is missing", "`center: [1.0, 2.0]`"),
    ("circles:\n  - {center: [1, 2], raduis: 1}", "circles[0].radius: is missing, but there is 'raduis'", "'radius'"),
    ("boxes:\n  - {centre: [1, 2], size: [1, 1]}", "boxes[0].center: is missing, but there is 'centre'", "'center'"),
    ("circles:\n  - {center: [1, 2], radius: 1, colour: red}", "circles[0].colour: unknown key", "keys here are"),
    ("boxs:\n  - {center: [1, 2], size: [1, 1]}", "boxs: unknown key", "write 'boxes'"),
    ("circles:\n  - {center: [1, .nan], radius: 1}", "circles[0].center", "two numbers"),
    ("circles: {center: [1, 2], radius: 1}", "circles: expected a list", "`- `"),
    ("circles:\n  - {center: [1, 2], radius: big}", "circles[0].radius", "above 0"),
    ("walls:\n  - {start: [1, 2], end: [1, 2]}", "walls[0].end", "two different points"),
    ("polygons:\n  - {points: [[0, 0], [1, 1], [2, 2]]}", "polygons[0].points", "enclose no area"),
    ("polygons:\n  - {points: [[0, 0], [1, 1], [1, 0], [0, 2]]}", "polygons[0].points", "in order around the outline"),
    ("rooms:\n  - {min: [0, 0], max: [-1, 1]}", "rooms[0].max", "right of and above min"),
    ("start: {x: 1}", "start.y: is missing", "`y: 1.57`"),
    ("start: [1, 2]", "start: expected keys", "`key: value`"),
    ("seed: -3", "seed", "0 or more"),
    ("seed: 1.5", "seed", "whole number"),
    ("goals:\n  - {x: 1, y: 2}\n  - {x: 1, z: 2}", "goals[1].y: is missing", "add a number"),
    (f"{CIRCLE}, motion: {{speed: 1}}}}", "circles[0].motion.waypoints: is missing", "list of points"),
    (f"{CIRCLE}, motion: {{speed: 0, waypoints: [[1, 1]]}}}}", "circles[0].motion.speed", "above 0"),
    (f"{CIRCLE}, motion: {{speed: 1, waypoints: [[1, 1]], repeat: ever}}}}", "circles[0].motion.repeat", "once, loop"),
    (f"{CIRCLE}, appears: -1}}", "circles[0].appears", "name of an event"),
    (f"{CIRCLE}, name: a}}\n  - {{name: a, center: [1, 2], radius: 1}}", "named 'a'", "its own name"),
    ("title: [1]", "title: expected a text", "a few words"),
    ("- 1", "the file: expected keys", "`key: value`"),
    ("walls:\n - {start: [1, 2}", "line 2", "brackets"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "place", "fix"), MISTAKES, ids=[m[1] for m in MISTAKES])
def test_an_error_names_file_key_and_fix(tmp_path: FilePath, text: str, place: str, fix: str) -> None:
    with pytest.raises(WorldError) as caught:
        load_world(write(tmp_path, text))
    message = str(caught.value)
    assert "some.yaml" in message
    assert place in message
    assert fix in message


values = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats() | st.sampled_from(["", "a", "once", "m.yaml"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["x", "y", "yaw", "center", "size", "radius", "points", "motion", "speed", "kind"]),
            inner,
            max_size=4,
        )
    ),
    max_leaves=6,
)
keys = st.sampled_from(
    ["name", "title", "seed", "start", "goals", "rooms", "walls", "boxes", "circles", "polygons", "other"]
)


@settings(max_examples=150, derandomize=True, database=None)
@given(st.dictionaries(keys, values | st.lists(values, max_size=2), max_size=3))
def test_any_content_gives_a_world_or_a_world_error(document: object) -> None:
    with contextlib.suppress(WorldError):
        Simulator(World.from_dict(document, where="some.yaml"))


def test_the_complete_message_of_an_error() -> None:
    with pytest.raises(WorldError) as caught:
        World.from_dict({"boxes": [{"center": [1, 2], "size": [1]}]}, where="office.yaml")
    assert str(caught.value) == (
        "office.yaml: boxes[0].size: expected two numbers above 0, in metres, got [1]. "
        "Fix: write for example `size: [0.4, 0.3]`."
    )


def test_the_error_for_an_unknown_name_lists_the_known_names() -> None:
    with pytest.raises(WorldError, match=r"no world named 'ofice'.*corridor, .*office"):
        load_world("ofice")


def test_the_error_for_a_missing_file_names_it(tmp_path: FilePath) -> None:
    with pytest.raises(WorldError, match=r"nowhere\.yaml: cannot be read"):
        load_world(tmp_path / "nowhere.yaml")


def test_an_empty_file_is_an_open_field(tmp_path: FilePath) -> None:
    assert load_world(write(tmp_path, "")).obstacles == ()
