"""Where a package's name stands, in files in which the same word is also a node, a module and an executable."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE

from grader import building, pipeline
from grader.building.package_name import places

FILES = {
    "package.xml": """<package>
  <name>robot_controller</name>
  <description>robot_controller</description>
""",
    "CMakeLists.txt": """project(robot_controller)
install(PROGRAMS scripts/robot_controller DESTINATION lib/${PROJECT_NAME})
""",
    "setup.py": """NAME = 'robot_controller'
setup(
    name='robot_controller',
    entry_points='x = robot_controller.a.b:main',
""",
    "setup.cfg": """[install]
install_scripts=$base/lib/robot_controller
""",
    "launch/all_launch.py": """Node(
    package='robot_controller',
    executable='robot_controller',
    name='robot_controller',
""",
    "robot_controller/robot_controller.py": """from robot_controller.srv import SetSpeed

Node('robot_controller')
""",
    "scripts/robot_controller": """#!/usr/bin/env python3
from robot_controller.robot_controller import main
""",
    "README.md": "robot_controller/srv/SetSpeed",
    "test_results.xml": "<testcase classname='x'>lib/robot_controller</testcase>",
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def test_only_the_places_where_it_is_the_packages_name_are_listed(package: Path):
    assert places(package, "robot_controller") == [
        "package.xml:2", "CMakeLists.txt:1", "setup.py:1", "setup.py:3", "setup.py:4", "setup.cfg:2",
        "robot_controller/", "launch/all_launch.py:2", "robot_controller/robot_controller.py:1",
        "scripts/robot_controller:2",
    ]  # fmt: skip


def test_another_packages_name_stands_nowhere(package: Path):
    assert places(package, "controller") == []


# What `ros2 pkg create --build-type ament_python lab5_31` writes, with a node, its launch file and a picture of it.
LAB = {
    "package.xml": """<package format="3">
  <name>lab5_31</name>
  <version>0.0.0</version>
  <description>lab5_31</description>
  <maintainer email="a@b.org">A</maintainer>
  <license>MIT</license>
  <exec_depend>rclpy</exec_depend>
  <export><build_type>ament_python</build_type></export>
</package>
""",
    "setup.py": """from setuptools import find_packages, setup

package_name = 'lab5_31'

setup(
    name=package_name,
    version='0.0.0',
    packages=['lab5_31'],
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
        ('share/lab5_31/launch', ['launch/all.launch.xml']),
    ],
    entry_points={'console_scripts': ['robot_controller = lab5_31.robot_controller:main']},
)
""",
    "setup.cfg": """[develop]
script_dir=$base/lib/lab5_31
[install]
install_scripts=$base/lib/lab5_31
""",
    "resource/lab5_31": "",
    "lab5_31/__init__.py": "",
    "lab5_31/helper.py": "",
    "lab5_31/robot_controller.py": """from lab5_31 import helper


def main():
    helper
""",
    "launch/all.launch.xml": """<launch><node pkg="lab5_31" exec="robot_controller"/></launch>
""",
}


def renamed_as_told(package: Path, name: str, new: str) -> Path:
    """Return the package with the new name in the lines, folders and files that are listed, and nowhere else."""
    for place in places(package, name):
        file, _, line = place.partition(":")
        if line:
            lines = (package / file).read_text().splitlines(keepends=True)
            lines[int(line) - 1] = lines[int(line) - 1].replace(name, new)
            (package / file).write_text("".join(lines))
    for place in (place for place in places(package, name) if ":" not in place):
        (package / place).rename((package / place).with_name(new))
    return package.rename(package.with_name(new))


@pytest.mark.slow  # a build
@pytest.mark.sandbox
def test_a_package_that_is_renamed_as_told_builds_under_its_new_name(tmp_path: Path, settings: pipeline.Settings):
    """`resource/<name>` was not listed, and without it colcon cannot build an ament_python package."""
    package = tmp_path / "lab5_31"
    for file, text in LAB.items():
        (package / file).parent.mkdir(parents=True, exist_ok=True)
        (package / file).write_text(text)
    assert "resource/lab5_31" in places(package, "lab5_31")
    renamed = renamed_as_told(package, "lab5_31", "ros2_robot_controller")
    assert [path for path in renamed.rglob("*") if "lab5_31" in path.name] == []
    left = [path.name for path in renamed.rglob("*") if path.is_file() and "lab5_31" in path.read_text()]
    assert left == ["package.xml"], "in its description only"
    built = building.build([renamed], settings.cache, COURSE)
    assert built.facts.ok, built.facts.log_tail
    assert (built.facts.package, built.facts.executables) == ("ros2_robot_controller", ["robot_controller"])
