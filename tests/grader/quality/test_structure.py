"""Q3: layout, complexity, conversions, duplicated blocks."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.quality_examples import (
    CONTROLLER,
    CONVERSIONS,
    MOTION,
    PROCESSOR,
    REFERENCE,
    facts,
    judged,
    reference,
    with_flake8,
    written,
)

from grader.checks.check_structure import test_conversions_are_in_utils_and_used as conversions
from grader.checks.check_structure import test_layout_matches_the_contract as layout
from grader.checks.check_structure import test_no_block_is_repeated as copies
from grader.checks.check_structure import test_no_function_is_too_complex as complexity
from grader.quality.duplicates import duplicated_blocks
from grader.quality.parsed_module import parse

# -- layout -----------------------------------------------------------------------------------------------------------


def test_a_missing_path_costs_a_share(tmp_path: Path):
    """Subtle: one of 22."""
    result = judged(layout, facts(reference(tmp_path, files={"test_results.xml": None})))
    assert result.share == pytest.approx(21 / 22)
    assert result.seen == "missing: test_results.xml"


def test_files_elsewhere_under_their_name_are_pointed_out(tmp_path: Path):
    """Blatant: everything in one folder."""
    names = ["package.xml", "CMakeLists.txt", "robot_controller.py", "sensor_processor.py", "SetSpeed.srv"]
    result = judged(layout, facts(written(tmp_path, dict.fromkeys(names, "# text\n"))))
    assert result.share < 0.15
    assert "perhaps meant: robot_controller.py" in result.seen


def test_launch_files_with_the_other_common_ending_are_pointed_out(tmp_path: Path):
    package = reference(tmp_path)
    (package / "launch" / "robot_controller_launch.py").rename(package / "launch" / "robot_controller.launch.py")
    result = judged(layout, facts(package))
    assert "perhaps meant: launch/robot_controller.launch.py" in result.seen


def test_interfaces_may_be_in_a_package_of_their_own(tmp_path: Path):
    package = reference(tmp_path)
    beside = tmp_path / "ros2_robot_controller_interfaces"
    for folder in ("msg", "srv", "action"):
        beside.mkdir(exist_ok=True)
        (package / folder).rename(beside / folder)
    assert judged(layout, facts(package)).share < 1
    assert judged(layout, facts(package, beside)).share == 1.0


def test_additional_files_are_allowed(tmp_path: Path):
    extra = {"docs/notes.md": "x", "test/test_more.py": "def test(): assert 1\n", "rviz/robot.rviz": "x"}
    assert judged(layout, facts(reference(tmp_path, files=extra))).share == 1.0


# -- complexity -------------------------------------------------------------------------------------------------------


def branches(number: int) -> str:
    """Return a function with `number` branches, which has a complexity of number + 1."""
    return (
        "def decide(x):\n"
        + "".join(f"    if x == {n}:\n        return {n}\n" for n in range(number))
        + "    return x\n"
    )


def test_a_complexity_of_10_is_allowed(tmp_path: Path):
    result = judged(complexity, with_flake8(written(tmp_path, {"m/a.py": branches(9)})))
    assert result.share == 1.0


def test_a_complexity_of_11_costs_a_quarter(tmp_path: Path):
    """Subtle."""
    result = judged(complexity, with_flake8(written(tmp_path, {"m/a.py": branches(10)})))
    assert result.share == 0.75
    assert "m/a.py:1" in result.seen
    assert "'decide' is too complex (11)" in result.seen


def test_four_too_complex_functions_lose_everything(tmp_path: Path):
    """Blatant."""
    files: dict[str, str | bytes | None] = {f"m/{name}.py": branches(30) for name in "abcd"}
    assert judged(complexity, with_flake8(written(tmp_path, files))).share == 0.0


def test_a_noqa_does_not_hide_complexity(tmp_path: Path):
    text = branches(10).replace("def decide(x):", "def decide(x):  # noqa: C901")
    assert judged(complexity, with_flake8(written(tmp_path, {"m/a.py": text}))).share < 1.0


# -- conversions ------------------------------------------------------------------------------------------------------

OWN_YAW = (
    "\n\ndef heading(q):\n    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y ** 2 + q.z ** 2))\n"
)
OWN_WRAP = "\n\ndef wrap(a):\n    while a > math.pi:\n        a -= 2.0 * math.pi\n    return a\n"
OWN_WRAP_BY_ARCTAN = "\n\ndef wrap(a):\n    return math.atan2(math.sin(a), math.cos(a))\n"
OWN_SHORT_YAW = "\n\ndef heading(pose):\n    return 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)\n"


def test_a_package_without_conversions_gets_nothing(tmp_path: Path):
    """Blatant."""
    result = judged(conversions, facts(reference(tmp_path, files={CONVERSIONS: None})))
    assert result.share == 0.0
    assert "does not define yaw_from_quaternion" in result.seen


def test_unused_conversions_lose_half(tmp_path: Path):
    """Blatant: written only for the layout."""
    node = "import math\n\n\nclass RobotController:\n    def turn(self):\n        return math.pi\n"
    files = {CONTROLLER: node, PROCESSOR: node, MOTION: "X = 1\n", "ros2_robot_controller/utils/scans.py": "X = 1\n"}
    result = judged(conversions, facts(reference(tmp_path, files=files)))
    assert result.share == 0.5
    assert "no node calls" in result.seen


def test_imported_but_never_called_is_not_used(tmp_path: Path):
    node = "from ros2_robot_controller.utils.conversions import clamp\n\nLIMIT = 1.0\n"
    files = {CONTROLLER: node, PROCESSOR: node, MOTION: None, "ros2_robot_controller/utils/scans.py": None}
    assert judged(conversions, facts(reference(tmp_path, files=files))).share == 0.5


@pytest.mark.parametrize(
    "own", [OWN_YAW, OWN_SHORT_YAW, OWN_WRAP, OWN_WRAP_BY_ARCTAN], ids=["yaw", "short", "while", "atan2"]
)
def test_a_conversion_made_by_hand_in_a_node_costs_a_quarter(tmp_path: Path, own: str):
    """Subtle: the helpers exist and are used, except in one place."""
    text = (REFERENCE / CONTROLLER).read_text() + own
    result = judged(conversions, facts(reference(tmp_path, files={CONTROLLER: text})))
    assert result.share == 0.75
    assert f"{CONTROLLER}:" in result.seen
    assert "by hand" in result.seen


def test_a_second_clamp_in_a_node_costs_a_quarter(tmp_path: Path):
    """Subtle."""
    text = (
        REFERENCE / PROCESSOR
    ).read_text() + "\n\ndef _clamp(value, low, high):\n    return max(low, min(high, value))\n"
    result = judged(conversions, facts(reference(tmp_path, files={PROCESSOR: text})))
    assert result.share == 0.75
    assert "`_clamp` is defined here" in result.seen


def test_a_conversion_under_another_name_costs_an_eighth(tmp_path: Path):
    """Subtle."""
    text = (REFERENCE / CONVERSIONS).read_text().replace("def quaternion_from_yaw", "def yaw_to_quaternion")
    result = judged(conversions, facts(reference(tmp_path, files={CONVERSIONS: text})))
    assert result.share == 0.875
    assert "quaternion_from_yaw" in result.seen


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


def test_a_bearing_is_not_a_conversion(tmp_path: Path):
    """Navigation needs atan2 of two differences."""
    text = (
        REFERENCE / CONTROLLER
    ).read_text() + "\n\ndef bearing(a, b):\n    return math.atan2(b.y - a.y, b.x - a.x)\n"
    assert judged(conversions, facts(reference(tmp_path, files={CONTROLLER: text}))).share == 1.0


# -- duplicates -------------------------------------------------------------------------------------------------------

BLOCK = """\
def measure(scan):
    good = []
    for distance in scan.ranges:
        if scan.range_min <= distance <= scan.range_max:
            good.append(distance)
    nearest = min(good)
    scan.nearest = nearest
    return nearest
"""
RESTYLED = """\
def measure( scan ):
    \"\"\"Return the nearest.\"\"\"
    good = []   # all of them

    for distance in scan.ranges:
        # in range?
        if (scan.range_min <= distance
                <= scan.range_max):
            good.append(
                distance)
    nearest = min(good)
    scan.nearest = nearest
    return nearest
"""
MAIN = """\
def main(args=None):
    rclpy.init(args=args)
    node = Node('x')
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
"""
MESSAGE = """\
def tell(self):
    message = Twist()
    message.linear.x = 1.0
    message.angular.z = 0.0
    self.publisher.publish(message)
"""
LAUNCH = """\
def generate_launch_description():
    return LaunchDescription([
        Node(
            package='ros2_robot_controller',
            executable='sensor_processor',
            name='sensor_processor',
            output='screen',
            parameters=['a.yaml'],
            remappings=[('a', 'b')],
        ),
    ])
"""


def found(**texts: str) -> list[int]:
    """Return the lengths of the copies in modules of the package, by name."""
    parsed = [parse(f"ros2_robot_controller/{name}.py", text.encode()) for name, text in texts.items()]
    return [copy.lines for copy in duplicated_blocks(parsed)]


def test_a_block_in_two_modules_is_found():
    assert found(a=BLOCK, b="import math\n\n\n" + BLOCK) == [8]


def test_spaces_comments_docstrings_and_line_breaks_do_not_hide_a_copy():
    assert found(a=BLOCK, b=RESTYLED) == [8]


def test_a_block_twice_in_one_module_is_found():
    assert found(a=BLOCK + "\n\nX = 1\n\n\n" + BLOCK.replace("def measure", "def again")) == [7]


def test_a_copy_under_another_name_is_found():
    assert found(a=BLOCK, b=BLOCK.replace("def measure(scan)", "def nearest(self, scan)")) == [7]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (MAIN, "every ROS node ends like this"),
        (MESSAGE, "five statements fill a message"),
        (LAUNCH, "a launch file's table is one statement"),
        ('"""' + "Words.\n" * 20 + '"""\n', "docstrings are not code"),
        ("import a\nimport b\nimport c\nimport d\nimport e\nimport f\nfrom g import h\n", "imports are not code"),
        ("# one\n# two\n# three\n# four\n# five\n# six\nX = 1\n", "comments are not code"),
    ],
)
def test_some_text_may_be_repeated(text: str, why: str):
    assert found(a=text, b=text) == [], why


def test_tests_may_repeat_themselves():
    parsed = [parse(f"test/test_{name}.py", BLOCK.encode()) for name in "ab"]
    assert duplicated_blocks(parsed) == []


def test_three_places_are_one_copy():
    assert found(a=BLOCK, b=BLOCK, c=BLOCK) == [8]


def test_3000_equal_lines_are_found_in_finite_time():
    assert len(found(a="x.append(1)\n" * 3000)) >= 1


def test_a_block_copied_into_the_second_node_costs_a_quarter(tmp_path: Path):
    """Blatant."""
    scans = (REFERENCE / "ros2_robot_controller/utils/scans.py").read_text()
    text = (REFERENCE / PROCESSOR).read_text() + "\n\n" + scans[scans.index("def measure_proximity") :]
    result = judged(copies, facts(reference(tmp_path, files={PROCESSOR: text})))
    assert result.share == 0.75
    assert "utils/scans.py:" in result.seen
    assert f"{PROCESSOR}:" in result.seen


def test_six_lines_are_the_shortest_copy(tmp_path: Path):
    """Subtle."""
    block = "    a = x + 1\n    b = a * 2\n    c = b - x\n    d = c / 3\n    e = d + a\n"
    one = f"def one(x):\n{block}    return e * 7\n"
    for text, share in (
        (one + f"\n\ndef two(x):\n{block}    return e * 7\n", 0.75),
        (one + f"\n\ndef two(x):\n{block}    return e\n", 1.0),
    ):
        folder = tmp_path / str(share)
        assert (
            judged(copies, facts(reference(folder, files={"ros2_robot_controller/utils/more.py": text}))).share == share
        )
