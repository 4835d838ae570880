"""The cache of builds: its keys, which build trees are shared, and damaged entries."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from submissions.edits import apply

from grader import build, evidence, pipeline, sandbox
from grader.build import cache, cmake_allowlist, type_hashes
from grader.contract import spec
from grader.errors import GraderError
from grader.host import ros_env


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return apply(None, tmp_path)


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


@pytest.fixture
def entry(tmp_path: Path) -> Path:
    """A build in the cache."""
    folder = tmp_path / "builds" / "abc"
    (folder / "install" / "lib").mkdir(parents=True)
    (folder / "install" / "lib" / "node").write_text("#!/bin/sh\n")
    (folder / "install" / "link").symlink_to("lib/node")
    (folder / "build.json").write_text(evidence.to_json(evidence.Build(True, False, 1.0, 0, False, "")))
    cache.write_checksum(folder / "install", folder / "install")
    return folder


def test_an_intact_entry_is_used(entry: Path):
    assert cache.load(entry) is not None
    (entry / "install" / "__pycache__").mkdir()
    (entry / "install" / "__pycache__" / "x.pyc").write_bytes(b"a cache of Python")
    assert cache.load(entry) is not None


DAMAGES: dict[str, Callable[[Path], object]] = {
    "facts cut short": lambda e: (e / "build.json").write_text("{"),
    "facts of another kind": lambda e: (e / "build.json").write_text("[1]"),
    "no facts": lambda e: (e / "build.json").unlink(),
    "facts that are not text": lambda e: (e / "build.json").write_bytes(b"\xff\xfe"),
    "a folder for the facts": lambda e: ((e / "build.json").unlink(), (e / "build.json").mkdir()),
    "a file cut short": lambda e: (e / "install" / "lib" / "node").write_text(""),
    "a file changed": lambda e: (e / "install" / "lib" / "node").write_text("#!/bin/no\n"),
    "a file gone": lambda e: (e / "install" / "lib" / "node").unlink(),
    "a file more": lambda e: (e / "install" / "more").write_text(""),
    "a file that cannot be run": lambda e: (e / "install" / "lib" / "node").chmod(0o755),
    "a link turned": lambda e: ((e / "install" / "link").unlink(), (e / "install" / "link").symlink_to("lib")),
    "no checksum": lambda e: (e / "install.sha256").unlink(),
    "no install tree": lambda e: shutil.rmtree(e / "install"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_not_used(entry: Path, damage: str):
    DAMAGES[damage](entry)
    assert cache.load(entry) is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"hashes": {"srv/SetSpeed": "RIHS01_forged"}, "checksum": "x"}'])
def test_damaged_type_hashes_are_not_used(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str):
    def answers(*_: object) -> sandbox.RunResult:
        raise GraderError("computed again")

    monkeypatch.setattr(sandbox, "run", answers)
    monkeypatch.setattr(Path, "read_text", lambda *_: text)
    with pytest.raises(GraderError, match="computed again"):
        type_hashes.compute({"srv/SetSpeed.srv": "---"}, "p", tmp_path)


@pytest.mark.slow  # builds with colcon twice
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_damaged_cache_is_built_again(reference: Path, tmp_path: Path, settings: pipeline.Settings):
    """Truncate the modules of a build in the cache: the next grading builds the package again."""
    package = shutil.copytree(reference, tmp_path / reference.name)
    (package / "NOTES.md").write_text(f"Not the package that is built already: {tmp_path}\n")
    first = build.build([package], settings.cache)
    for path in (first.install / ros_env.SITE_IN_PREFIX / spec.PACKAGE).glob("*.py"):
        path.write_text("")
    tree = cache.build_tree_folder(package.parent, settings.cache)
    assert tree is None or tree.is_dir()
    second = build.build([package], settings.cache)
    assert not second.facts.cached
    assert second.facts.ok
    assert all(path.read_text() for path in second.install.rglob("robot_controller.py"))
