"""Bags: other programs can read them, custom message types included."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sim import Recording

pytest.importorskip("rosbags")

from sim.bag import BagMessage, write_bag

FUSION_TYPE = "ros2_robot_controller/msg/SensorFusionData"
FUSION = """\
std_msgs/Header header
float32 closest_obstacle_distance
float32 battery_level
geometry_msgs/Vector3 linear_acceleration
geometry_msgs/Vector3 angular_velocity
"""


@pytest.fixture(scope="module")
def bag(touched: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run, and one message of the contract's type."""
    path = tmp_path_factory.mktemp("bags") / "bag"
    fields = {"battery_level": 85.5, "linear_acceleration": {"z": 9.81}}
    fused = BagMessage("/sensor_fusion_data", FUSION_TYPE, 0.5, fields)
    write_bag(touched, path, types={FUSION_TYPE: FUSION}, messages=[fused])
    return path


def test_an_independent_reader_opens_the_bag(touched: Recording, bag: Path) -> None:
    from rosbags.highlevel import AnyReader

    with AnyReader([bag]) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        read: dict[str, Any] = {c.topic: reader.deserialize(data, c.msgtype) for c, _, data in reader.messages()}
        stamps = [stamp for _, stamp, _ in reader.messages()]
    assert counts["/scan"] == 30
    assert counts["/odom"] == counts["/cmd_vel"] == counts["/tf"] == 61
    assert stamps == sorted(stamps)
    assert read["/scan"].ranges.tolist() == touched.scan_ranges[-1].astype(np.float32).tolist()
    assert read["/odom"].pose.pose.position.x == touched.odom_x[-1]
    assert read["/ground_truth/contacts"].data.startswith("touched wall at (1.000")
    assert read["/sensor_fusion_data"].battery_level == 85.5
    assert read["/sensor_fusion_data"].linear_acceleration.z == 9.81


def test_foxgloves_own_reader_decodes_the_bag_by_the_types_in_it(touched: Recording, bag: Path) -> None:
    """That reader knows no types, so the file must define all of them."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    (path,) = bag.glob("*.mcap")
    with path.open("rb") as stream:
        messages = list(make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    read = {channel.topic: (schema.name, message) for schema, channel, _, message in messages}
    assert read["/scan"][0] == "sensor_msgs/msg/LaserScan"
    assert list(read["/scan"][1].ranges) == touched.scan_ranges[-1].astype(np.float32).tolist()
    assert read["/odom"][1].pose.pose.position.x == touched.odom_x[-1]
    assert read["/sensor_fusion_data"][0] == FUSION_TYPE
    assert read["/sensor_fusion_data"][1].battery_level == 85.5
    assert read["/sensor_fusion_data"][1].linear_acceleration.z == 9.81


def test_the_error_for_an_unknown_field_names_it(touched: Recording, tmp_path: Path) -> None:
    typo = BagMessage("/x", "std_msgs/msg/String", 0.0, {"text": "a"})
    with pytest.raises(KeyError, match="no field 'text'"):
        write_bag(touched, tmp_path / "bag", messages=[typo])
