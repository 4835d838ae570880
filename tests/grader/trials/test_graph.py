"""What a node shows on the graph for a moment only, or without rclpy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

pytestmark = [pytest.mark.ros]


def test_a_topic_whose_name_rclpy_rejects_hides_no_other_topic():
    from rclpy.qos import QoSReliabilityPolicy

    from grader.trials import graph

    def info(topic: str) -> list[Any]:
        if " " in topic:
            raise ValueError("topic name is invalid")
        reliable = SimpleNamespace(reliability=QoSReliabilityPolicy.RELIABLE)
        return [SimpleNamespace(node_name="odd", topic_type="t", topic_type_hash="h", qos_profile=reliable)]

    observer: Any = SimpleNamespace(
        get_topic_names_and_types=lambda: [("/odd name!", ["t"]), ("/cmd_vel", ["t"])],
        get_publishers_info_by_topic=info,
        get_subscriptions_info_by_topic=lambda topic: info(topic)[:0],
    )
    assert [endpoint.topic for endpoint in graph.endpoints(observer, "odd")] == ["cmd_vel"]


def test_a_node_that_published_the_clock_for_a_moment_stays_on_record():
    from grader.trials import graph

    publishers = [SimpleNamespace(node_name="simulator"), SimpleNamespace(node_name="false")]
    observer: Any = SimpleNamespace(
        get_name=lambda: "simulator", get_publishers_info_by_topic=lambda _topic: publishers
    )
    first = graph.foreign_publishers(observer, ["/clock"])
    assert first == ["/clock by false"]
    del publishers[1]
    assert graph.foreign_publishers(observer, ["/clock"]) == []
    assert graph.foreign_publishers(observer, ["/clock"], first) == first


def test_a_second_publisher_under_the_observers_own_name_is_foreign():
    from grader.trials import graph

    twice = [SimpleNamespace(node_name="simulator"), SimpleNamespace(node_name="simulator")]
    observer: Any = SimpleNamespace(get_name=lambda: "simulator", get_publishers_info_by_topic=lambda _topic: twice)
    assert graph.foreign_publishers(observer, ["/clock"]) == ["/clock by simulator"]


def test_readings_at_both_ends_of_the_range_are_valid_and_those_beyond_are_not():
    import numpy as np

    from grader.trials.recorder import _summary
    from sim.sensors import ScanReading

    def anywhere(*ranges: float) -> float:
        return _summary(ScanReading(0.0, 0.0, 0.1, 0.15, 12.0, np.array(ranges)), 0.5).anywhere

    assert anywhere(0.15, 3.0) == 0.15
    assert anywhere(0.149, 12.0) == 12.0
    assert anywhere(12.001, float("nan"), float("inf")) == float("inf")


@pytest.mark.parametrize(("degrees", "ahead", "behind"), [(15, 2.0, 5.0), (60, 1.0, 4.0), (90, 1.0, 3.0)])
def test_what_is_ahead_and_behind_goes_as_far_to_either_side_as_the_contract_says(degrees, ahead, behind):
    import numpy as np

    from grader.trials.recorder import _summary
    from sim.sensors import ScanReading

    quarter = np.array([2.0, 1.0, 3.0, 4.0, 5.0, 4.0, 3.0, 6.0])  # every 45 degrees, counter-clockwise from ahead
    seen = _summary(ScanReading(0.0, 0.0, np.pi / 4, 0.15, 12.0, quarter), float(np.cos(np.radians(degrees))))
    assert (seen.ahead, seen.behind) == (ahead, behind)
