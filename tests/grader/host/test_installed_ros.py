"""--ros: submissions are built and run with a ROS 2 that is installed, and what observes them with the kit's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from grader import KIT
from grader.authoring import package_edits
from grader.errors import UsageError
from grader.host import provenance, ros_env
from grader.trials.request import node_environment

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
# Which rclpy a node has imported, and all libraries of ROS that are in its memory.
_SAYS_WHICH = """
import re as _re
import rclpy as _rclpy
_maps = _re.findall(r'\\S*/lib(?:rcl|rmw|std_msgs__rosidl_generator_c)\\.so', open('/proc/self/maps').read())
print('USES', _rclpy.__file__, sorted(set(_maps)))
"""
_NOT_OF_ROS = (".dist-info", "__pycache__", "ros_wheels_bootstrapper")  # what only wheels have


def lay_out(prefix: Path) -> Path:
    """Fill the folder `prefix` with everything that the wheels of ROS hold, and return it."""
    for distribution in metadata.distributions():
        if distribution.metadata["Name"].startswith("ros-"):
            for file in distribution.files or ():
                _place(Path(os.path.normpath(str(distribution.locate_file(file)))), prefix)
    return prefix


def _place(source: Path, prefix: Path) -> None:
    name = source.relative_to(sys.prefix)
    if not source.is_file() or any(part in str(name) for part in _NOT_OF_ROS):
        return
    if source.parent.name.endswith(".libs"):  # libraries of the distribution that ROS is installed on
        name = Path("lib", source.name)
    target = prefix / name
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        target.hardlink_to(source)
    except OSError:  # on another disk
        target.write_bytes(source.read_bytes())
        target.chmod(source.stat().st_mode)


def small(prefix: Path, version: str = "7.1.6", python: Path = ros_env.SITE_IN_PREFIX) -> Path:
    """Return a prefix with nothing but a name and a version of rclpy."""
    (prefix / python / "rclpy").mkdir(parents=True)
    (prefix / "share" / "rclpy").mkdir(parents=True)
    (prefix / "share" / "rclpy" / "package.xml").write_text(f"<package><version>{version}</version></package>")
    return prefix


@pytest.fixture(autouse=True)
def nothing_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ros_env.VARIABLE, "")


def test_processes_of_a_submission_get_the_installed_ros_and_the_kits_own_the_wheels(tmp_path: Path):
    before = ros_env.environment(home=tmp_path)
    ros_env.choose(small(tmp_path / "jazzy"))
    theirs, ours = (ros_env.environment(Path("/ws/install"), home=tmp_path, wheels=own) for own in (False, True))
    assert theirs["AMENT_PREFIX_PATH"] == theirs["CMAKE_PREFIX_PATH"] == f"/ws/install:{tmp_path}/jazzy"
    assert theirs["PATH"].startswith(f"{tmp_path}/jazzy/bin:")
    assert theirs["PYTHONPATH"].endswith(f":{tmp_path}/jazzy/{ros_env.SITE_IN_PREFIX}")
    assert theirs["LD_LIBRARY_PATH"] == f"/ws/install/lib:{tmp_path}/jazzy/lib"
    assert str(tmp_path / "jazzy") not in " ".join(ours.values())
    assert ros_env.environment(home=tmp_path, wheels=True) == before
    # Nodes ran with the wheels where a module had been imported before the choice was made.
    assert node_environment()["AMENT_PREFIX_PATH"].endswith(f":{tmp_path}/jazzy")


def test_a_grade_says_which_ros_it_was_made_with(tmp_path: Path):
    assert provenance.environment()["ros"] == "the kit's wheels"
    ros_env.choose(small(tmp_path / "jazzy"))
    assert provenance.environment()["ros"] == f"{tmp_path}/jazzy, rclpy 7.1.6"


@pytest.mark.parametrize(
    ("version", "python", "says"),
    [
        ("9.0.0", str(ros_env.SITE_IN_PREFIX), "rclpy 9.0.0, which is not of ROS 2 Jazzy"),
        ("7.1.6", "lib/python3.7/site-packages", "make setup PYTHON=python3.7"),
        ("7.1.6", "elsewhere", "Name the folder that has ROS's setup.bash"),
    ],
    ids=["another ROS", "for another Python", "no ROS"],
)
def test_a_ros_that_cannot_be_used_is_refused_with_what_to_do(tmp_path: Path, version: str, python: str, says: str):
    with pytest.raises(UsageError, match=says):
        ros_env.choose(small(tmp_path, version, Path(python)))
    assert ros_env.installed() is None


def test_a_ros_that_was_sourced_is_found_below_workspaces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    prefix = small(tmp_path / "jazzy")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/ws/install:{prefix}")
    assert ros_env.sourced() == prefix
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/ws/install:{ros_env.PREFIX}")
    assert ros_env.sourced() is None


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a build without any cache, and trials
def test_a_package_is_built_and_run_with_the_installed_ros(tmp_path: Path):
    """Nodes, launched ones and tests load no library of the wheels."""
    prefix = lay_out(tmp_path / "jazzy")
    package = package_edits.copy(REFERENCE, tmp_path)
    with (package / "ros2_robot_controller" / "driver.py").open("a") as module:
        module.write(_SAYS_WHICH)
    command = [sys.executable, "-m", "grader.cli", "grade", str(package), "--out", str(tmp_path / "out")]
    command += ["--ros", str(prefix), "--cache", str(tmp_path / "cache")]
    ended = subprocess.run(command, cwd=KIT, capture_output=True, text=True, check=False, timeout=1800)
    assert ended.returncode == 0, ended.stderr
    said = json.loads((tmp_path / "out" / "report.json").read_text())
    lost = {each["id"]: each["seen"] for each in said["requirements"] if each["points"] < each["max"]}
    assert set(lost) <= {"Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "T1", "T2", "T3"}, lost  # the edit is bad style
    assert said["environment"]["ros"].startswith(f"{prefix}, rclpy 7.")
    assert f"Built and run with an installed ROS 2: {said['environment']['ros']}." in said["notes"]
    shown = [
        line
        for file in (tmp_path / "out" / "evidence" / "trials").glob("*.json")
        for line in json.loads(file.read_text())["process"]["output_tail"].splitlines()
        if line.startswith("USES")
    ]
    assert shown
    assert all(str(prefix) in line and os.fspath(ros_env.PREFIX) not in line for line in shown)
