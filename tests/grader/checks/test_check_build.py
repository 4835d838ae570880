"""I1 in its words: a package of another name, and executables in another folder."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.course import LAYOUT, PACKAGE
from helpers.judging import ask, evidence_with, find

from grader.evidence import Build, Manifest, Quality

BUILDS = find("check_build::test_colcon_build_succeeds")
EXECUTABLES = find("check_build::test_executables_are_installed")
BUILT = Build(ok=True, package=PACKAGE, types_package=PACKAGE, exit_code=0)
BOTH = {"robot_controller": "bin", "sensor_processor": "bin"}


def test_a_package_of_another_name_is_told_first_that_it_builds_and_then_where_its_name_stands():
    said = ask(BUILDS, evidence_with(build=replace(BUILT, package="team07")))
    assert said.share == 0
    assert said.seen == "It builds, as team07; the assignment asks for ros2_robot_controller."
    assert "rename it all at once: in package.xml" in said.try_
    assert ask(BUILDS, evidence_with(build=BUILT)).share == 1


def test_launch_files_in_the_root_of_the_share_folder_count_where_they_are():
    """Tutorials install them there, and `ros2 launch` finds them; it cost them I1, I5 and a part of I6."""
    check = find("check_build::test_shared_files_are_installed")
    found = ["package.xml", "robot_controller_launch.py", "config/robot_params.yaml", "settings/sensor_params.yaml"]
    text = Quality(Manifest(found=True, has_cmake=True), paths=list(LAYOUT))
    said = ask(check, evidence_with(build=replace(BUILT, shared_files=found), quality=text))
    assert said.share == 0.75
    assert said.seen == (
        "not installed: launch/sensor_processor_launch.py; "
        "installed: robot_controller_launch.py, config/robot_params.yaml, settings/sensor_params.yaml"
    )
    assert said.try_.startswith("install(DIRECTORY launch config")


def test_a_file_that_is_not_in_the_package_is_not_said_to_be_uninstalled():
    check = find("check_build::test_shared_files_are_installed")
    paths = [path for path in LAYOUT if path != "config/sensor_params.yaml"]
    said = ask(check, evidence_with(build=BUILT, quality=Quality(Manifest(found=True, has_cmake=True), paths=paths)))
    assert "not in the package: config/sensor_params.yaml" in said.seen
    assert said.try_.startswith("write these files")


@pytest.mark.parametrize(
    ("folders", "share"), [(BOTH, 0.0), ({"sensor_processor": "lib/other"}, 0.5)], ids=["both", "one"]
)
def test_executables_in_another_folder_cost_their_part_and_the_folder_is_named(folders: dict[str, str], share: float):
    found = [name for name in BOTH if name not in folders]
    said = ask(EXECUTABLES, evidence_with(build=replace(BUILT, executables=found, misplaced=folders)))
    assert said.share == share
    assert f"{folders['sensor_processor']}/sensor_processor: `ros2 run` looks in lib/ros2_robot_controller" in said.seen
