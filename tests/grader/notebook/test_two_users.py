"""Two users of one hub, each with a simulated robot in a notebook: neither hears the other's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.node_runs import run_with_node

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # two kernels, each with nodes

# A user's kernel: it opens its workspace as a notebook's first cell does, and tells robots apart by their places.
# SUBNET is the wider range; with LOCALHOST, which a machine with a network gets, nothing is heard in a namespace.
USER = """
import json, os, select, sys
home, y, forced = sys.argv[1:]
os.environ |= {"HOME": home, "ROS2_COURSE_WS": f"{home}/ws"}
from grader.notebook import workspace
domain = int(forced) or workspace.open_workspace("05").domain_id
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
from nav_msgs.msg import Odometry
from sim import Pose, Simulator, World
from sim.bridge import CONTROLLER, Bridge
bridge = Bridge(Simulator(World(start=Pose(0.0, float(y), 0.0)), noise=False), CONTROLLER, "nobody", domain_id=domain)
heard = {}
def note(odom):
    place = round(odom.pose.pose.position.y)
    heard[place] = heard.get(place, 0) + 1
bridge.node.create_subscription(Odometry, "odom", note, 10)
while len(heard) < (2 if int(forced) else 1):
    bridge.tick_by_wall()
print("up", flush=True)
while not select.select([sys.stdin], [], [], 0)[0]:
    bridge.tick_by_wall()
for _ in range(60):
    bridge.tick_by_wall()
print(json.dumps({"domain": domain, "heard": heard}), flush=True)
while True:  # the other may still listen
    bridge.tick_by_wall()
"""

HUB = """
import json, subprocess, sys
program, folder, forced = sys.argv[1:]
users = [
    subprocess.Popen(
        [sys.executable, "-c", open(program).read(), f"{folder}/{name}", y, forced],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )
    for name, y in (("anna", "1.0"), ("bela", "-1.0"))
]
for user in users:
    assert user.stdout.readline() == "up\\n"
for user in users:  # both robots are there from now on
    user.stdin.write("\\n"); user.stdin.flush()
print(json.dumps([json.loads(user.stdout.readline()) for user in users]))
for user in users:
    user.kill()
"""


def hub(tmp_path: Path, forced: int) -> list[dict[str, Any]]:
    """Return what two users heard; `forced` is a domain for both, 0 for those that their notebooks choose."""
    for name in ("anna", "bela"):
        (tmp_path / name).mkdir()
    (tmp_path / "user.py").write_text(USER)
    (tmp_path / "hub.py").write_text(HUB)
    return run_with_node(tmp_path / "hub.py", tmp_path / "user.py", tmp_path, str(forced))  # type: ignore[return-value]


def test_two_users_of_a_hub_hear_only_their_own_robots(tmp_path: Path):
    anna, bela = hub(tmp_path, 0)
    assert anna["domain"] != bela["domain"]
    assert (list(anna["heard"]), list(bela["heard"])) == (["1"], ["-1"])
    assert anna["heard"]["1"] > 50


def test_in_one_domain_the_two_would_hear_each_other(tmp_path: Path):
    """What the test above is worth: the same two kernels, in one domain, hear both robots."""
    for user in hub(tmp_path, 7):
        assert set(user["heard"]) == {"1", "-1"}
