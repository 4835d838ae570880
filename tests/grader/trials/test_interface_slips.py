"""A slip in an interface costs what it costs, and is graded to its end: every field with every plausible mistake."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers.course import CONTRACT
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from submissions import slips
from submissions.slips import FILES, NEEDS, Slip

from grader import pipeline
from grader.course import definition
from grader.scoring.scorecard import Outcome
from grader.trials.wire_layout import reader

CONTRACTS_TYPE = SimpleNamespace(
    get_fields_and_field_types=lambda: {
        "header": "std_msgs/Header", "closest_obstacle_distance": "float", "battery_level": "float",
        "linear_acceleration": "geometry_msgs/Vector3", "angular_velocity": "geometry_msgs/Vector3",
    }
)  # fmt: skip
IN_TEXT = [slip for slip in slips.table() if slip.kind != "another type"]


def by_name(slip: Slip) -> str:
    return slip.name


def test_every_field_of_every_interface_has_every_slip():
    kinds = {"widened", "narrowed", "renamed", "a list", "one more", "one less"}
    fields = {(slip.interface, slip.field) for slip in IN_TEXT}
    assert len(fields) == 3 + 4 + 5 + 5
    assert {(slip.interface, slip.field, slip.kind) for slip in IN_TEXT} >= {
        (*f, kind) for f in fields for kind in kinds
    }
    assert {slip.interface for slip in slips.table() if slip.kind in ("swapped", "another type")} == set(FILES)


@pytest.mark.parametrize("slip", IN_TEXT, ids=by_name)
def test_a_slip_is_named_with_its_field(slip: Slip):
    path = FILES[slip.interface]
    found = definition.differences(path.partition("/")[0], slip.text, (CONTRACT / path).read_text())
    words = " ".join(said for _, said in found)
    assert slip.field in words or "count" in words


@pytest.mark.parametrize("slip", [s for s in IN_TEXT if s.interface == "SensorFusionData"], ids=by_name)
def test_a_message_with_a_slip_is_read_by_its_own_fields_or_not_at_all(slip: Slip):
    """Exchanged fields and numbers of another size are read; what has other fields is left to the contract's type."""
    read = reader(slip.text, CONTRACTS_TYPE)
    number = slip.kind in ("widened", "narrowed") and slip.field in ("closest_obstacle_distance", "battery_level")
    assert (read is not None) is (slip.kind == "swapped" or number)
    if read is None:
        return
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(slip.text, "own/msg/Own"))
    time, vector = store.types["builtin_interfaces/msg/Time"], store.types["geometry_msgs/msg/Vector3"]
    header = store.types["std_msgs/msg/Header"](stamp=time(sec=7, nanosec=500), frame_id="base_link")
    said = store.types["own/msg/Own"](
        header=header, closest_obstacle_distance=2, battery_level=75,
        linear_acceleration=vector(1.0, 2.0, 3.0), angular_velocity=vector(4.0, 5.0, 6.0),
    )  # fmt: skip
    found = read(bytes(store.serialize_cdr(said, "own/msg/Own")))
    assert found is not None
    assert (found["closest_obstacle_distance"], found["battery_level"]) == (2, 75)
    assert (found["linear_acceleration"]["z"], found["angular_velocity"]["x"]) == (3.0, 4.0)
    assert found["header"] == {"stamp": {"sec": 7, "nanosec": 500}, "frame_id": "base_link"}


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a build and a grading for each slip
@pytest.mark.parametrize("slip", slips.representatives(), ids=by_name)
def test_a_slip_is_graded_to_its_end(slip: Slip, settings: pipeline.Settings, tmp_path: Path):
    """`float64 speed` for `float32 speed` ended the grading: "killed from outside, as when memory runs out"."""
    package = slip.apply(tmp_path)
    grading = pipeline.grade(package, tmp_path / "out", replace(settings, requirements=NEEDS[slip.interface]))
    assert grading.evidence.build.ok
    judged = {score.requirement.id: score for score in grading.scorecard.requirements}
    assert [name for name in NEEDS[slip.interface] if judged[name].outcome is Outcome.ERROR] == []
    assert judged["I3"].points < judged["I3"].max
