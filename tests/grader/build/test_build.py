"""Building: what is built once, what is built anew, and what a build may leave behind for others."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from submissions.edits import apply

from grader import build, pipeline
from grader.build import cache, cmake_allowlist, colcon
from grader.contract import spec


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return apply(None, tmp_path)


@pytest.mark.sandbox
def test_the_reference_builds_with_the_contracts_hashes(package: Path, settings: pipeline.Settings):
    built = build.build([package], settings.cache)
    assert built.facts.ok, built.facts.log_tail
    assert built.facts.type_hashes == build.build_contract(settings.cache).facts.type_hashes
    assert set(spec.INTERFACES) == set(built.facts.type_hashes)
    assert {"robot_controller", "sensor_processor"} <= set(built.facts.executables)
    assert "launch/robot_controller_launch.py" in built.facts.shared_files


@pytest.mark.sandbox
def test_the_same_content_is_built_once_wherever_it_lies(package: Path, tmp_path: Path, settings: pipeline.Settings):
    first = build.build([package], settings.cache)
    elsewhere = tmp_path / "elsewhere" / package.name
    shutil.copytree(package, elsewhere)
    second = build.build([elsewhere], settings.cache)
    assert second.facts.cached
    assert second.install == first.install


@pytest.mark.sandbox
def test_a_damaged_cache_entry_is_built_again(package: Path, settings: pipeline.Settings):
    (package / "ros2_robot_controller" / "extra.py").write_text("DAMAGED = 'on purpose'\n")
    first = build.build([package], settings.cache)
    (first.install.parent / "build.json").write_text("{")
    again = build.build([package], settings.cache)
    assert not again.facts.cached
    assert again.facts.ok


def test_a_changed_module_changes_the_key_and_keeps_the_tree(package: Path, tmp_path: Path):
    key, tree = cache.build_key([package]), cache.build_tree_folder(package.parent, tmp_path)
    (package / "ros2_robot_controller" / "robot_controller.py").write_text("# another one\n")
    assert cache.build_key([package]) != key
    assert cache.build_tree_folder(package.parent, tmp_path) == tree


def test_a_changed_interface_changes_the_tree(package: Path, tmp_path: Path):
    tree = cache.build_tree_folder(package.parent, tmp_path)
    with (package / "srv" / "SetSpeed.srv").open("a") as stream:
        stream.write("bool more\n")
    assert cache.build_tree_folder(package.parent, tmp_path) != tree


@pytest.mark.parametrize(
    "line",
    [
        "execute_process(COMMAND python3 evil.py)",
        "include(evil.cmake)",
        "install(CODE \"message(hello)\")",
        "add_custom_target(evil ALL COMMAND evil)",
        "set(CMAKE_PROJECT_INCLUDE evil.txt)",
        "set(x \"\n#\" ) execute_process(COMMAND evil)",
        "ament_package(CONFIG_EXTRAS evil.in)",
        "set_property(GLOBAL PROPERTY RULE_LAUNCH_COMPILE evil)",
        "file(WRITE x y)",
        "cmake_language(EVAL CODE evil)",
        "set(P CM)\nset(${P}AKE_C_COMPILER_LAUNCHER ${PROJECT_SOURCE_DIR}/scripts/cc)",
        "set(std_msgs_DIR ${PROJECT_SOURCE_DIR}/scripts)",
        "set(rosidl_generator_py_files evil.py)",
        "find_package(evil PATHS ${PROJECT_SOURCE_DIR})",
        "add_compile_options(-wrapper ./evil)",
        "add_compile_options(-Wall -fplugin=evil.so)",
    ],
)  # fmt: skip
def test_a_build_that_can_run_something_shares_no_tree(package: Path, tmp_path: Path, line: str):
    """Or one submission could leave its mark in the tree that another one's build goes on from."""
    assert cache.build_tree_folder(package.parent, tmp_path) is not None
    with (package / "CMakeLists.txt").open("a") as stream:
        stream.write(line + "\n")
    assert cache.build_tree_folder(package.parent, tmp_path) is None


@pytest.mark.parametrize(
    "line",
    [
        "set(CMAKE_CXX_STANDARD 17)",
        "set(msg_files msg/SensorFusionData.msg)",
        "set(SRVS srv/SetSpeed.srv)",
        "if(CMAKE_COMPILER_IS_GNUCXX)\n  add_compile_options(-Wall -Wextra -Wpedantic)\nendif()",
    ],
)
def test_what_ros2_pkg_create_and_tutorials_write_shares_one(package: Path, tmp_path: Path, line: str):
    with (package / "CMakeLists.txt").open("a") as stream:
        stream.write(line + "\n")
    assert cache.build_tree_folder(package.parent, tmp_path) is not None


def test_a_word_of_any_length_is_read_in_one_go():
    """Twenty days for ten megabytes, when a pattern starts over at each letter."""
    assert cmake_allowlist.only_declares(f'message("{"a" * 1_000_000}")')


@pytest.mark.parametrize("name", ["colcon.pkg", "evil.cmake"])
def test_a_file_that_steers_the_build_shares_no_tree(package: Path, tmp_path: Path, name: str):
    (package / name).write_text("{}")
    assert cache.build_tree_folder(package.parent, tmp_path) is None


def test_a_log_names_no_place_of_this_machine():
    from grader.host import ros_env

    log = f"CMake Error at {ros_env.PREFIX}/share/x.cmake:1"
    assert colcon._without_host_paths(log) == "CMake Error at <ros>/share/x.cmake:1"
