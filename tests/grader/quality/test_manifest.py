"""I2: package.xml compared with what the package has and uses."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.quality_examples import CONTROLLER, DRIVER, REFERENCE, Judged, judged, reference, with_manifest_of

from grader.checks import check_package_xml as checks
from grader.course.packages import is_declared
from grader.quality.source import analyse_package

XML = (REFERENCE / "package.xml").read_text()
ADDRESS = "course@example.com"
MAINTAINER = f'<maintainer email="{ADDRESS}">ROS 2 course kit</maintainer>'


def with_xml(tmp_path: Path, xml: str | None, check, files: dict[str, str | bytes | None] | None = None) -> Judged:
    return judged(check, with_manifest_of(reference(tmp_path, files={"package.xml": xml, **(files or {})})))


# -- format, maintainer -----------------------------------------------------------------------------------------------


@pytest.mark.slow  # the linters
@pytest.mark.parametrize(
    "check", [checks.test_package_xml_is_valid_format_3, checks.test_every_package_used_is_declared]
)
def test_a_missing_package_xml_is_reported(tmp_path: Path, check):
    assert "there is no package.xml" in with_xml(tmp_path, None, check).seen


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<version>1.0.0</version>", "", "version"),
        ("<version>1.0.0</version>", "<version>1.0</version>", "version"),
        ("</package>", "", "is not XML"),
        ("<exec_depend>rclpy</exec_depend>", "<run_depend>rclpy</run_depend>", "run_depend"),
        ("<name>ros2_robot_controller</name>", "<name>Ros2 Robot</name>", "name"),
        (MAINTAINER, "", "maintainer"),
        ('<package format="3">', '<!DOCTYPE x [<!ENTITY a "b">]><package format="3">', "DOCTYPE"),
    ],
)  # fmt: skip
def test_what_ros_rejects_is_not_valid(tmp_path: Path, old: str, new: str, said: str):
    """Colcon or rosdep rejects it."""
    assert old in XML
    result = with_xml(tmp_path, XML.replace(old, new), checks.test_package_xml_is_valid_format_3)
    assert result.share == 0.0
    assert said in result.seen


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<package format="3">', '<package format="2">'),
        ('email="course@example.com">ROS 2 course kit<', 'email="root@todo.todo">root<'),
        (">ROS 2 course kit<", ">TODO<"),
    ],
    ids=["format 2", "what ros2 pkg create leaves", "TODO"],
)
def test_an_old_format_or_a_placeholder_costs_half(tmp_path: Path, old: str, new: str):
    xml = XML.replace(old, new)
    if "format" in new:
        xml = xml.replace("<member_of_group>rosidl_interface_packages</member_of_group>", "")
    assert with_xml(tmp_path, xml, checks.test_package_xml_is_valid_format_3).share == 0.5


REACHED = (
    "e.rootham@exampleton.org", "a.b@gmail.com", "user@gmail.com", "root@my-robot.org", "max.todo@uni-stuttgart.de",
    "12345+name@users.noreply.github.com", "todor@stud.fh-x.de", "student.a3@example.org", "course@example.com",
)  # fmt: skip
NOT_REACHED = (
    "user@todo.todo", "todo@todo", "root@root", "max@localhost", "your_email@gmail.com", "you@example.com",
    "Name@mail.example.org", "x@lab.test",
)  # fmt: skip


@pytest.mark.parametrize("address", [*REACHED, *NOT_REACHED])
def test_an_address_that_no_mail_reaches_is_a_placeholder(tmp_path: Path, address: str):
    result = with_xml(tmp_path, XML.replace(ADDRESS, address), checks.test_package_xml_is_valid_format_3)
    assert (result.share == 1.0) is (address in REACHED)
    if address in NOT_REACHED:
        assert result.share <= 0.5
        assert "the maintainer is a placeholder: " in result.seen
        assert address in result.seen


# -- licence ----------------------------------------------------------------------------------------------------------


SPDX = ("MIT", "BSD-3-Clause", "Apache-2.0", "GPL-3.0-or-later", "apache-2.0", "MIT OR Apache-2.0")
NOT_SPDX = ("TODO: License declaration", "Apache License 2.0", "BSD", "Free", "none", "")


@pytest.mark.parametrize("licence", [*SPDX, *NOT_SPDX])
def test_a_licence_needs_its_spdx_name(tmp_path: Path, licence: str):
    xml = XML.replace("<license>Apache-2.0</license>", f"<license>{licence}</license>")
    result = with_xml(tmp_path, xml, checks.test_licence_has_its_spdx_name)
    assert result.share == float(licence in SPDX)
    assert licence in SPDX or "spdx" in result.try_ or "Apache-2.0" in result.try_


# -- build type -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("build_type", "files", "share"),
    [("ament_python", {}, 0.0), ("cmake", {}, 0.0), ("", {}, 0.0), ("ament_python", {"CMakeLists.txt": None}, 1.0)],
)
def test_a_build_type_that_does_not_match_gets_nothing(tmp_path: Path, build_type: str, files, share: float):
    """Without CMake it is ament_python: its interfaces may be in a package of their own."""
    old = "<build_type>ament_cmake</build_type>"
    xml = XML.replace(old, old.replace("ament_cmake", build_type) if build_type else "")
    result = with_xml(tmp_path, xml, checks.test_build_type_matches_the_package, files)
    assert result.share == share
    assert share or "there is a CMakeLists.txt" in result.seen


# -- dependencies -----------------------------------------------------------------------------------------------------

DEPENDENCIES = checks.test_every_package_used_is_declared


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("rclpy", ":"),
        ("nav_msgs", f"{DRIVER}:"),
        ("rcl_interfaces", "settings.py:"),
        ("launch", "launch/"),
        ("launch_ros", "launch/"),
        ("ament_index_python", "launch/"),
        ("action_msgs", "demo.py:"),
        ("geometry_msgs", ":"),
        ("rosidl_default_generators", "CMakeLists.txt:"),
        ("rosidl_default_runtime", "interfaces"),
    ],
)
def test_each_undeclared_dependency_costs_a_fifth(tmp_path: Path, name: str, place: str):
    """53 % of the real packages lack at least one."""
    lines = [line for line in XML.splitlines() if f"depend>{name}<" not in line]
    result = with_xml(tmp_path, "\n".join(lines), DEPENDENCIES)
    assert result.share == 0.8
    assert f"{name} (used in " in result.seen
    assert place in result.seen


def test_a_dependency_for_tests_only_is_missing_for_nodes(tmp_path: Path):
    xml = XML.replace("<exec_depend>nav_msgs</exec_depend>", "<test_depend>nav_msgs</test_depend>")
    result = with_xml(tmp_path, xml, DEPENDENCIES)
    assert result.share == pytest.approx(0.8)
    assert "driver.py" in result.seen
    assert "declared for tests only" in result.seen


@pytest.mark.parametrize(
    "line",
    [
        "import numpy",
        "from tf2_ros import Buffer",
        "def f():\n    import yaml\n",
        "x = Node(package='rviz2', executable='rviz2')",
        "x = get_package_share_directory('slam_toolbox')",
        "x = FindPackageShare(package='nav2_bringup')",
    ],
)
def test_every_way_to_use_a_package_is_seen(tmp_path: Path, line: str):
    text = (REFERENCE / "launch/sensor_processor_launch.py").read_text() + f"\n{line}\n"
    result = with_xml(tmp_path, XML, DEPENDENCIES, {"launch/sensor_processor_launch.py": text})
    assert result.share == 0.8, result.seen


@pytest.mark.parametrize(
    "line",
    [
        "import math, os, dataclasses, __future__",
        "from . import utils",
        "from ros2_robot_controller.utils import scans",
        "try:\n    import numpy\nexcept ImportError:\n    numpy = None",
        "from conftest import Bench",
        "import scans",
        "x = Node(executable='a', package=name)",
        "x = Node('set_speed')",
    ],
)
def test_own_optional_and_standard_modules_need_no_declaration(tmp_path: Path, line: str):
    text = (REFERENCE / CONTROLLER).read_text() + f"\n{line}\n"
    result = with_xml(tmp_path, XML, DEPENDENCIES, {CONTROLLER: text})
    assert result.share == 1.0, result.seen


def test_a_package_of_another_name_need_not_depend_on_itself(tmp_path: Path):
    """Its launch files name it."""
    line = "\nnode = Node(package='team7_controller', executable='robot_controller')\n"
    text = (REFERENCE / CONTROLLER).read_text() + line
    named = XML.replace("<name>ros2_robot_controller</name>", "<name>team7_controller</name>")
    assert named != XML
    (tmp_path / "named").mkdir()
    assert with_xml(tmp_path / "named", named, DEPENDENCIES, {CONTROLLER: text}).share == 1.0
    (tmp_path / "other").mkdir()
    assert "team7_controller (used in " in with_xml(tmp_path / "other", XML, DEPENDENCIES, {CONTROLLER: text}).seen


@pytest.mark.parametrize(
    "files",
    [
        {f"old_pkg/{name}": text for name, text in (
            ("package.xml", "<package format='3'><name>old_pkg</name></package>"),
            ("old_pkg/__init__.py", ""),
            ("old_pkg/node.py", "import pandas, scipy, matplotlib, torch, gymnasium\n"))},
        {"tools/plot.py": "import pandas, scipy, matplotlib, torch, gymnasium\n"},
        {"plot.py": "import pandas, scipy, matplotlib, torch, gymnasium\n"},
        {"ros2_robot_controller/lib/steps.py": "x = 1\n", "ros2_robot_controller/use.py": "from lib import steps\n"},
    ],
    ids=["a package inside", "a loose script in a folder", "a loose script", "a folder without __init__.py"],
)  # fmt: skip
def test_packages_inside_and_loose_scripts_need_no_declaration(tmp_path: Path, files: dict[str, str | bytes | None]):
    """They once took all points for the dependencies."""
    result = with_xml(tmp_path, XML, DEPENDENCIES, files)
    assert result.share == 1.0, result.seen


CMAKE = (REFERENCE / "CMakeLists.txt").read_text()
INSTALLS = "install(PROGRAMS tools/plot.py DESTINATION lib/x)\n"
FIELDS = "sensor_msgs/LaserScan[] scans  # tf2_msgs/No\nshape_msgs/Mesh<=3 x\n"


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({"tools/plot.py": "import pandas\n", "CMakeLists.txt": CMAKE.replace("install(D", f"{INSTALLS}install(D", 1)},
         "pandas (used in tools/plot.py:1)"),
        ({"msg/More.msg": FIELDS}, "shape_msgs (used in msg/More.msg:2)"),
    ],
    ids=["a script that is installed", "the type of a field"],
)  # fmt: skip
def test_what_is_installed_needs_its_declarations(tmp_path: Path, files: dict[str, str | bytes | None], said: str):
    assert said in with_xml(tmp_path, XML, DEPENDENCIES, files).seen


@pytest.mark.parametrize(
    ("module", "key"),
    [
        ("numpy", "python3-numpy"), ("yaml", "python3-yaml"), ("cv2", "python3-opencv"), ("cv2", "cv_bridge"),
        ("transforms3d", "python3-transforms3d-pip"), ("serial", "python3-serial"), ("pytest", "python3-pytest"),
        ("tf_transformations", "tf_transformations"), ("ament_pep257", "ament_lint_common"), ("PIL", "python3-pil"),
        ("launch", "ros2launch"), ("launch_ros", "ros2launch"),
    ],
)  # fmt: skip
def test_rosdep_keys_declare_modules(module: str, key: str):
    assert is_declared(module, [key])
    assert not is_declared(module, ["rclpy", "python3-something"])


@pytest.mark.slow  # a start of Python that imports all of the grader
def test_package_xml_is_read_without_linters(tmp_path: Path):
    """`grader check I2` does not wait for linters; only their findings are left out."""
    xml = XML.replace("<exec_depend>rclpy</exec_depend>", "")
    package = reference(tmp_path, files={"package.xml": xml, "launch/a.py": "import  os\n"})
    whole, quick = analyse_package(package, COURSE), analyse_package(package, COURSE, lint=False)
    assert whole.style
    assert not quick.style
    assert quick.manifest == whole.manifest
    assert [thing.name for thing in quick.definitions] == [thing.name for thing in whole.definitions]
