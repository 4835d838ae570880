"""What a build may leave behind, and which type hashes are believed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from helpers.course import COURSE

from grader.building import install_tree
from grader.host import ros_env


@pytest.fixture
def install(tmp_path: Path) -> Path:
    (tmp_path / "install" / "share" / "pkg").mkdir(parents=True)
    (tmp_path / "install" / "share" / "pkg" / "file").write_text("x")
    return tmp_path / "install"


def kinds(flags) -> list[str]:
    return [flag.kind for flag in flags]


@pytest.mark.parametrize("target", ["/etc", "/ws/installer", "../../../..", "/ws/install/../../etc", "share/pkg/up/x"])
def test_a_link_out_of_the_tree_is_taken_away_and_flagged(install: Path, target: str):
    (install / "share" / "pkg" / "up").symlink_to("/")
    link = install / "link"
    link.symlink_to(target)
    flags = install_tree.remove_unsafe_entries(install, "/ws/install")
    assert not link.is_symlink()
    assert set(kinds(flags)) == {"link out"}


@pytest.mark.parametrize("target", ["/ws/install/share/pkg/file", "share/pkg/file", "share/../share/pkg"])
def test_a_link_within_the_tree_stays(install: Path, target: str):
    (install / "link").symlink_to(target)
    assert install_tree.remove_unsafe_entries(install, "/ws/install") == []
    assert (install / "link").is_symlink()
    assert (install / "link").exists(), "it leads to the same place outside of the sandbox"


@pytest.mark.parametrize("target", ["start", "/ws/install/lib/pkg/start"])
def test_a_program_may_be_a_link(install: Path, target: str):
    """`ros2 run` follows it."""
    home = install / "lib" / "pkg"
    home.mkdir(parents=True)
    (home / "start").write_text("#!/usr/bin/env python3\n")
    (home / "start").chmod(0o755)
    (home / "robot_controller").symlink_to(target)
    install_tree.remove_unsafe_entries(install, "/ws/install")
    assert install_tree.programs(home) == ["robot_controller", "start"]


def test_a_pipe_is_taken_away_before_anybody_waits_at_it(install: Path):
    os.mkfifo(install / "share" / "pkg" / "SetSpeed.json")
    assert kinds(install_tree.remove_unsafe_entries(install, "/ws/install")) == ["special file"]
    assert not (install / "share" / "pkg" / "SetSpeed.json").exists()


def test_folders_that_nobody_may_enter_are_opened(install: Path):
    (install / "share" / "pkg").chmod(0)
    install_tree.remove_unsafe_entries(install, "/ws/install")
    assert (install / "share" / "pkg" / "file").read_text() == "x"


def test_set_user_id_bits_are_taken_away(install: Path):
    file = install / "share" / "pkg" / "file"
    file.chmod(0o6755)
    install_tree.remove_unsafe_entries(install, "/ws/install")
    assert file.stat().st_mode & 0o7777 == 0o755


@pytest.mark.parametrize(
    ("name", "text", "kind"),
    [
        ("sitecustomize.py", "", "python start-up"),
        ("usercustomize.py", "", "python start-up"),
        ("evil.pth", "import os", "python start-up"),
        ("evil.dist-info/entry_points.txt", "[pytest11]\nevil = evil\n", "entry point"),
        ("rclpy/__init__.py", "", "module shadowing"),
        ("numpy.py", "", "module shadowing"),
        ("json.py", "", "module shadowing"),
    ],
)
def test_what_changes_other_programs_is_flagged(install: Path, name: str, text: str, kind: str):
    path = install / ros_env.SITE_IN_PREFIX / name
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert kinds(install_tree.tampering_flags(install)) == [kind]


def program(install: Path, name: str) -> Path:
    path = install / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_nodes_that_are_installed_elsewhere_are_found_and_linked_to_where_ros2_run_looks(install: Path):
    program(install, "bin/robot_controller")
    program(install, "bin/helper")
    program(install, "lib/other/sensor_processor")
    found = install_tree.misplaced_nodes(install, "pkg", COURSE)
    assert found == {"robot_controller": "bin", "sensor_processor": "lib/other"}
    install_tree.link_misplaced(install, "pkg", found.values())
    for name in ("robot_controller", "sensor_processor", "helper"):
        assert (install / "lib" / "pkg" / name).read_text() == "#!/bin/sh\n"
    assert not (install / "lib" / "pkg" / "robot_controller").readlink().is_absolute()


def test_nodes_in_their_place_are_not_looked_for_elsewhere(install: Path):
    for name in ("robot_controller", "sensor_processor"):
        program(install, f"lib/pkg/{name}")
        program(install, f"bin/{name}")
    assert install_tree.misplaced_nodes(install, "pkg", COURSE) == {}


def interface(install: Path, package: str) -> None:
    path = install / "share" / package / "srv" / "SetSpeed.json"
    path.parent.mkdir(parents=True)
    path.write_text(f'{{"type_hashes": [{{"type_name": "{package}/srv/SetSpeed", "hash_string": "RIHS01_00"}}]}}')
    (install / "share" / package / "package.xml").write_text("<package/>")


@pytest.mark.parametrize(
    ("installed", "wanted", "name"),
    [
        (["team07"], "team07", "team07"),
        (["team07", "ros2_robot_controller"], "team07", "ros2_robot_controller"),
        (["from_setup_py"], "from_package_xml", "from_setup_py"),
        ([], "team07", ""),
    ],
)
def test_a_package_is_found_under_the_name_that_it_has(install: Path, installed: list[str], wanted: str, name: str):
    if installed:
        interface(install, "team07_interfaces")
    for each in installed:
        (install / "share" / each).mkdir()
        (install / "share" / each / "package.xml").write_text("<package/>")
    assert install_tree.main_package(install, wanted, COURSE) == name


@pytest.mark.parametrize("types", ["team07", "team07_interfaces", "robot_msgs"])
def test_the_types_are_found_under_the_name_that_they_have(install: Path, types: str):
    interface(install, types)
    assert install_tree.interfaces_package(install, "team07", COURSE) == types


@pytest.mark.parametrize("types", ["std_msgs", "rclpy", "json", "test", "install", "not-a-name"])
def test_types_under_a_name_of_ros_python_or_cmake_are_not_looked_at(install: Path, types: str):
    """The observer builds the contract's types under the same name."""
    interface(install, types)
    assert install_tree.interfaces_package(install, types, COURSE) == "ros2_robot_controller"


def test_an_ordinary_package_raises_no_flag(install: Path):
    site = install / ros_env.SITE_IN_PREFIX
    for name in ("ros2_robot_controller/__init__.py", "ros2_robot_controller-0.1.0-py3.11.egg-info/PKG-INFO"):
        (site / name).parent.mkdir(parents=True)
        (site / name).write_text("")
    (site / "ros2_robot_controller-0.1.0-py3.11.egg-info" / "entry_points.txt").write_text("[console_scripts]\nx = y\n")
    assert install_tree.tampering_flags(install) == []
