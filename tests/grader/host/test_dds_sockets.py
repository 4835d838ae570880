"""A node's last message is heard although its publisher is gone by then."""

from pathlib import Path

import pytest
from helpers.node_runs import run_with_node

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

LEAVER = """
import sys, time, rclpy
from std_msgs.msg import Int32
rclpy.init(domain_id=3)
node = rclpy.create_node("leaver")
publisher = node.create_publisher(Int32, "last", 10)
while publisher.get_subscription_count() == 0:
    time.sleep(0.01)
print("matched", flush=True)
sys.stdin.readline()
publisher.publish(Int32(data=7))
node.destroy_publisher(publisher)
print("gone", flush=True)
sys.stdin.readline()
rclpy.shutdown()
"""
OBSERVER = """
import json, subprocess, sys, time
import rclpy
from std_msgs.msg import Int32
from grader.host import dds_sockets
leaver = subprocess.Popen([sys.executable, sys.argv[1]], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
rclpy.init(domain_id=3)
node = rclpy.create_node("observer")
heard = []
subscription = node.create_subscription(Int32, "last", lambda message: heard.append(message.data), 10)

def spin(until):
    deadline = time.monotonic() + 30.0
    while not until() and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)

def tell():
    leaver.stdin.write("\\n")
    leaver.stdin.flush()

leaver.stdout.readline()
spin(lambda: node.count_publishers("last") == 1)
with dds_sockets.deaf_to_the_graph():
    tell()
    leaver.stdout.readline()
    spin(lambda: heard)
    known = node.count_publishers("last")
tell()
spin(lambda: node.count_publishers("last") == 0)
print(json.dumps({"heard": heard, "known": known, "after": node.count_publishers("last")}))
"""


def test_messages_are_heard_and_who_leaves_is_not_until_the_block_ends(tmp_path: Path):
    (tmp_path / "leaver.py").write_text(LEAVER)
    (tmp_path / "observer.py").write_text(OBSERVER)
    found = run_with_node(tmp_path / "observer.py", tmp_path / "leaver.py")
    assert found == {"heard": [7], "known": 1, "after": 0}
