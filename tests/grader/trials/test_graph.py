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
