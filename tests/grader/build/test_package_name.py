"""Where a package's name stands, in files in which the same word is also a node, a module and an executable."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.build.package_name import places

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
