"""The reference package on the simulator's TurtleBot 4, by docs/turtlebot4: names, types and lidar as on a real one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.course import COURSE
from helpers.node_runs import run_with_node

from grader import KIT, building

FILES = KIT / "docs" / "turtlebot4"

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

# The adapter is asked like the controller whether it is done with a tick.
HOST = """
import json, os, subprocess, sys
from pathlib import Path
from grader.host import ros_env

install, home = Path(sys.argv[1]), Path(sys.argv[2])
world, robot, *launch = sys.argv[3:]
env = {**ros_env.environment(install, home=home), "ROS_DOMAIN_ID": "3", "ROS2_COURSE_KIT_OWN": "1"}
if "ROS2_COURSE_KIT_OWN" not in os.environ:  # the package's types need its library path from the start
    os.execve(sys.executable, [sys.executable, *sys.argv], env)

from geometry_msgs.msg import Twist
from rcl_interfaces.srv import GetParameterTypes
from ros2_robot_controller.msg import SensorFusionData
from ros2_robot_controller.srv import SetSpeed
from sim import TB4, Simulator, load_world
from sim.bridge import Bridge, Topics

log = (home / "log.txt").open("w")
process = subprocess.Popen([sys.executable, *launch], env=env, stdout=log, stderr=subprocess.STDOUT)
topics = Topics(
    scan=f"{robot}/scan", odom=f"{robot}/odom", imu=f"{robot}/imu", battery=f"{robot}/battery_state",
    command=f"{robot}/cmd_vel", answer=f"{robot}/course/cmd_vel",
)
simulator = Simulator(load_world(world), TB4, seed=3)
bridge = Bridge(
    simulator, topics, "robot_controller", domain_id=3, alive=lambda: process.poll() is None,
    namespace=f"{robot}/course".strip("/"), reliable=False, stamped=TB4.stamped_cmd_vel,
)
bridge.watch_answers(Twist)
adapter = bridge.node.create_client(GetParameterTypes, f"{robot}/course/turtlebot4_adapter/get_parameter_types")
heard, fastest, scans = [], 0.0, []
bridge.on_command = lambda t, twist: heard.append(twist.linear.x)
counted = lambda: bridge.node.count_publishers(topics.command) > 0 and adapter.service_is_ready()
ready = bridge.await_node(counted, 60.0) and bridge.spin_until(counted, 60.0)

def relayed():
    # Two calls: the second is served only when the messages that had come before the first have been.
    for _ in range(2):
        assert bridge.spin_until(adapter.call_async(GetParameterTypes.Request()).done, 30.0)

def drive(ticks):
    global fastest
    for _ in range(ticks):
        bridge.tick()
        relayed()
        bridge.settle()
        relayed()
        fastest = max(fastest, simulator.twist.v)

found = {"ready": ready, "log": (home / "log.txt").read_text()}
if ready:
    fused = []
    fusion = f"{robot}/course/sensor_fusion_data"
    bridge.node.create_subscription(SensorFusionData, fusion, fused.append, 10)
    service = bridge.node.create_client(SetSpeed, f"{robot}/course/set_speed")
    assert bridge.spin_until(service.service_is_ready, 30.0)
    assert bridge.spin_until(lambda: bridge.node.count_publishers(fusion) > 0, 30.0)
    drive(10)
    answers = []
    for speed in (0.5, 0.3):
        call = service.call_async(SetSpeed.Request(speed=speed))
        assert bridge.spin_until(call.done, 30.0)
        answers.append(call.result().success)
    drive(200)
    bridge.spin_until(lambda: bool(fused), 30.0)
    types = dict(bridge.node.get_topic_names_and_types())
    services = [name for name, _ in bridge.node.get_service_names_and_types() if name.endswith("_action/send_goal")]
    found |= {
        "answers": answers, "x": simulator.pose.x, "v": simulator.twist.v, "fastest": fastest,
        "clearance": simulator.clearance(), "heard": max(heard, default=0.0), "last": heard[-1:],
        "contacts": len(simulator.contacts), "types": {name: types.get(name) for name in sorted(types)},
        "actions": services, "battery": [message.battery_level for message in fused[-1:]],
    }
process.terminate()
process.wait(20)
found["log"] = (home / "log.txt").read_text()
bridge.close()
print(json.dumps(found))
"""


def drive(tmp_path: Path, reference: Path, world: str, robot: str, *arguments: str) -> dict[str, Any]:
    """Launch the reference beside a robot in a namespace of a world, set a speed, and return what happened."""
    install = building.build([reference], building.cache_folder(), COURSE).install
    (tmp_path / "host.py").write_text(HOST)
    command = [str(KIT / "grader" / "ros2"), "launch", str(FILES / "turtlebot4_launch.py"), "use_sim_time:=true"]
    found = run_with_node(tmp_path / "host.py", str(install), str(tmp_path), world, robot, *command, *arguments)
    assert found["ready"], found["log"]
    return found


@pytest.mark.slow  # a build and a launch
def test_the_reference_stops_before_a_wall_on_a_turtlebot_4(tmp_path: Path, reference: Path):
    """Its lidar is turned by 90 degrees, its topics are in a namespace, and it takes only TwistStamped."""
    found = drive(tmp_path, reference, "wall_ahead", "/robot1", "namespace:=/robot1")
    assert found["answers"] == [False, True], found["log"]  # 0.5 m/s is more than the base drives
    assert found["x"] > 1.0, found["log"]
    assert 0.28 < found["fastest"] <= 0.306
    assert found["contacts"] == 0
    assert found["clearance"] > 0.15
    assert (found["v"], found["last"]) == (0.0, [0.0])
    assert found["types"]["/robot1/cmd_vel"] == ["geometry_msgs/msg/TwistStamped"]
    assert found["types"]["/robot1/course/cmd_vel"] == ["geometry_msgs/msg/Twist"]
    assert found["actions"] == ["/robot1/course/navigate_to_position/_action/send_goal"]  # not the base's name
    assert found["battery"][0] > 90.0


@pytest.mark.slow  # the launch file twice more, 11 CPU seconds each
@pytest.mark.parametrize(("turn", "contact"), [("1.5708", False), ("0.0", True)], ids=["turned", "as it is"])
def test_a_post_ahead_is_seen_only_where_the_lidars_turn_is_known(
    turn: str, contact: bool, tmp_path: Path, reference: Path
):
    """A lidar that is turned to the left takes what is ahead for something at the side."""
    post = tmp_path / "post.yaml"
    post.write_text("circles:\n  - {name: post, center: [1.5, 0.0], radius: 0.05}\n")
    found = drive(tmp_path, reference, str(post), "", f"laser_yaw:={turn}", "emergency_stop_distance:=0.0")
    assert bool(found["contacts"]) is contact, found
