"""Q3: conversions in utils/, and their use by the nodes."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.quality_examples import (
    CONTROLLER,
    CONVERSIONS,
    PROCESSOR,
    REFERENCE,
    Judged,
    as_it_is,
    facts,
    judged,
    reference,
    written,
)

from grader.courses.robot_controller.checks.check_structure import test_conversions_are_in_utils_and_used as conversions
from grader.evidence import Ran, Trial

OWN_YAW = (
    "\n\ndef heading(q):\n    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y ** 2 + q.z ** 2))\n"
)
OWN_WRAP = "\n\ndef wrap(a):\n    while a > math.pi:\n        a -= 2.0 * math.pi\n    return a\n"
OWN_WRAP_BY_ARCTAN = "\n\ndef wrap(a):\n    return math.atan2(math.sin(a), math.cos(a))\n"
OWN_SHORT_YAW = "\n\ndef heading(pose):\n    return 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)\n"


BEARING = "\n\ndef bearing(a, b):\n    return math.atan2(b.y - a.y, b.x - a.x)\n"
RENAMED = (REFERENCE / CONVERSIONS).read_text().replace("def quaternion_from_yaw", "def yaw_to_quaternion")


def test_unused_conversions_lose_half(tmp_path: Path):
    """They are written only for the layout."""
    node = "import math\n\n\nclass RobotController:\n    def turn(self):\n        return math.pi\n"
    result = only_nodes_ran(reference(tmp_path, files={CONTROLLER: node, PROCESSOR: node}))
    assert result.share == 0.5
    assert "no node calls" in result.seen


def only_nodes_ran(package: Path) -> Judged:
    """Return what is said where nothing of the package ran but the nodes' modules."""
    nodes = {"robot_controller": CONTROLLER, "sensor_processor": PROCESSOR}
    trials = {
        node: Trial(node, node, "lone_post", 0, True, "lockstep", None, ran=Ran({path: [1]}))
        for node, path in nodes.items()
    }
    return as_it_is(conversions, facts(package), trials=trials)


@pytest.mark.parametrize(
    ("own", "share"),
    [(OWN_YAW, 0.75), (OWN_SHORT_YAW, 0.75), (OWN_WRAP, 0.75), (OWN_WRAP_BY_ARCTAN, 0.75), (BEARING, 1.0)],
    ids=["yaw", "short", "while", "atan2", "a bearing is none"],
)
def test_a_conversion_made_by_hand_in_a_node_costs_a_quarter(tmp_path: Path, own: str, share: float):
    """The helpers exist and are used, except in one place. Navigation needs atan2 of two differences."""
    text = (REFERENCE / CONTROLLER).read_text() + own
    result = judged(conversions, facts(reference(tmp_path, files={CONTROLLER: text})))
    assert result.share == share
    assert share == 1.0 or (f"{CONTROLLER}:" in result.seen and "by hand" in result.seen)


@pytest.mark.parametrize(
    ("text", "share", "said"),
    [
        (None, 0.0, "does not define yaw_from_quaternion"),
        (RENAMED, 0.875, "quaternion_from_yaw"),
    ],
    ids=["not there", "under another name"],
)
def test_a_conversion_that_is_not_there_costs_an_eighth(tmp_path: Path, text: str | None, share: float, said: str):
    result = judged(conversions, facts(reference(tmp_path, files={CONVERSIONS: text})))
    assert result.share == share
    assert said in result.seen


_FOUR = ("yaw_from_quaternion", "quaternion_from_yaw", "normalize_angle", "clamp")
HOME = "".join(f"def {name}(x, *more):\n    return x\n" for name in _FOUR)


@pytest.mark.parametrize(
    "use",
    [
        "from ros2_robot_controller.utils.conversions import clamp\nX = clamp(1, 2, 3)\n",
        "from ros2_robot_controller.utils.conversions import clamp as limit\nX = limit(1, 2, 3)\n",
        "from .utils.conversions import clamp\nX = clamp(1, 2, 3)\n",
        "from .utils import conversions\nX = conversions.clamp(1, 2, 3)\n",
        "from ros2_robot_controller.utils import conversions as c\nX = c.clamp(1, 2, 3)\n",
        "import ros2_robot_controller.utils.conversions\nX = ros2_robot_controller.utils.conversions.clamp(1, 2, 3)\n",
        "import ros2_robot_controller.utils.conversions as c\nX = c.clamp(1, 2, 3)\n",
        "from .utils.conversions import *\nX = clamp(1, 2, 3)\n",
        "from .utils import clamp\nX = clamp(1, 2, 3)\n",
        "from .helper import helped\nX = helped()\n",
    ],
)
def test_every_way_to_import_conversions_is_a_use(tmp_path: Path, use: str):
    files: dict[str, str | bytes | None] = {
        CONTROLLER: use,
        CONVERSIONS: HOME,
        "ros2_robot_controller/utils/__init__.py": "from .conversions import clamp\n",
        "ros2_robot_controller/helper.py": "from .utils.conversions import clamp\ndef helped():\n    return clamp(1)\n",
        "ros2_robot_controller/__init__.py": "",
    }
    assert judged(conversions, facts(written(tmp_path, files))).share == 1.0
