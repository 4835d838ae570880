"""The picture of the running nodes and topics."""

from __future__ import annotations

import io
from collections.abc import Iterator

import pytest
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from PIL import Image
from rclpy.context import Context
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

from grader.courses.robot_controller.lessons.graph_view import GraphView, Link, graph_view

pytestmark = pytest.mark.ros


@pytest.fixture(scope="module")
def graph() -> Iterator[GraphView]:
    """A lidar, a controller that asks for another quality and sends another type than the base takes, and two twins."""
    here, elsewhere = Context(), Context()  # a process may not have two types on one topic in one context
    rclpy.init(context=here)
    rclpy.init(context=elsewhere)
    lidar, controller, *_ = (rclpy.create_node(name, context=here) for name in ("lidar", "controller", "twin", "twin"))
    base = rclpy.create_node("base", namespace="left", context=elsewhere)
    lidar.create_publisher(LaserScan, "scan", qos_profile_sensor_data)
    controller.create_subscription(LaserScan, "scan", print, 10)
    controller.create_publisher(Twist, "cmd_vel", 10)
    controller.create_publisher(String, "map_name", 1)
    base.create_subscription(TwistStamped, "/cmd_vel", print, 10)
    base.create_subscription(
        String, "/map_name", print, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    )
    base.create_publisher(Odometry, "odom", 10)
    lidar.create_subscription(Odometry, "/left/odom", print, qos_profile_sensor_data)
    yield graph_view(nodes=5)
    rclpy.try_shutdown(context=here)
    rclpy.try_shutdown(context=elsewhere)


def test_ends_that_fit_are_connected(graph: GraphView):
    odom = [link for link in graph.links if link.topic == "/left/odom"]
    assert odom == [
        Link("/left/base", "/left/odom", "nav_msgs/msg/Odometry", publishes=True),
        Link("/lidar", "/left/odom", "nav_msgs/msg/Odometry", publishes=False),
    ]


@pytest.mark.parametrize(
    ("topic", "trouble"),
    [
        ("/scan", "QoS: best_effort offered, reliable asked"),
        ("/map_name", "QoS: volatile offered, transient_local asked"),
        ("/cmd_vel", "types differ: geometry_msgs/msg/Twist and geometry_msgs/msg/TwistStamped"),
    ],
)
def test_ends_that_do_not_fit_say_why(graph: GraphView, topic: str, trouble: str):
    assert [link.trouble for link in graph.links if link.topic == topic] == [trouble, trouble]


def test_two_nodes_of_one_name_are_counted_and_what_every_node_has_is_left_out(graph: GraphView):
    assert graph.nodes == ["/controller", "/left/base", "/lidar", "/twin", "/twin"]
    assert {link.topic for link in graph.links} == {"/scan", "/map_name", "/cmd_vel", "/left/odom"}


def test_the_picture_says_the_same_in_words(graph: GraphView):
    png, metadata = graph._repr_png_()
    assert Image.open(io.BytesIO(png)).width > 500
    assert "/lidar -> /scan  [sensor_msgs/msg/LaserScan]  QoS: best_effort offered" in metadata["alt"]
    assert metadata["alt"].endswith("/twin")


def test_where_nothing_runs_it_says_so():
    assert repr(GraphView([], [])) == "no nodes"
    assert GraphView([], [])._repr_png_()[0].startswith(b"\x89PNG")
