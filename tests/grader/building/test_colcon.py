"""Building a package: what is built once, and what is built again."""

from __future__ import annotations

import importlib.util
import marshal
import os
import shutil
from pathlib import Path
from typing import Any

import pytest
from helpers import course as spec
from helpers.course import COURSE
from submissions.edits import apply
from variants import VARIANTS, make

from grader import building, pipeline, sandbox
from grader.building import colcon
from grader.errors import GraderError
from grader.host import ros_env


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return apply(None, tmp_path)


@pytest.mark.sandbox
def test_the_reference_builds_with_the_contracts_hashes(package: Path, settings: pipeline.Settings):
    contract = building.build_contract(settings.cache, COURSE)  # first, as in a grading: it fills the compiler cache
    built = building.build([package], settings.cache, COURSE)
    assert built.facts.ok, built.facts.log_tail
    assert built.facts.type_hashes == contract.facts.type_hashes
    assert set(spec.INTERFACES) == set(built.facts.type_hashes)
    assert {"robot_controller", "sensor_processor"} <= set(built.facts.executables)
    assert "launch/robot_controller_launch.py" in built.facts.shared_files


@pytest.mark.slow  # a build more
@pytest.mark.sandbox
def test_a_grader_whose_files_are_private_builds_too(package: Path, settings: pipeline.Settings):
    """As root's with the mask 077: submissions run as another user, who must read what root has written."""
    (package / "ros2_robot_controller" / "extra.py").write_text(f"NEVER_BUILT = '{package} {os.getpid()}'\n")
    before = os.umask(0o077)
    try:
        built = building.build([package], settings.cache, COURSE)
        assert os.umask(0o077) == 0o077
    finally:
        os.umask(before)
    assert built.facts.ok, built.facts.log_tail
    assert (built.install / "share").stat().st_mode & 0o777 == 0o755


@pytest.mark.sandbox
def test_the_same_content_is_built_once_wherever_it_lies(package: Path, tmp_path: Path, settings: pipeline.Settings):
    first = building.build([package], settings.cache, COURSE)
    elsewhere = tmp_path / "elsewhere" / package.name
    shutil.copytree(package, elsewhere)
    second = building.build([elsewhere], settings.cache, COURSE)
    assert second.facts.cached
    assert second.install == first.install


@pytest.mark.slow  # builds with colcon
@pytest.mark.sandbox
@pytest.mark.parametrize("name", VARIANTS)
def test_all_that_an_honest_package_installs_is_known(name: str, tmp_path: Path, settings: pipeline.Settings):
    """By CMake and by setuptools, with modules as executables, scripts of entry points, and packages split in two."""
    packages = sorted(path.parent for path in make(VARIANTS[name], tmp_path).glob("*/package.xml"))
    facts = building.build(packages, settings.cache, COURSE).facts
    assert facts.ok, facts.log_tail
    assert facts.flags == []


@pytest.mark.slow  # builds with colcon
@pytest.mark.sandbox
def test_a_version_that_cmake_writes_is_known(package: Path, settings: pipeline.Settings):
    (package / "version.py.in").write_text('"""The version."""\n\n__version__ = "@PROJECT_VERSION@"\n')
    cmake = package / "CMakeLists.txt"
    cmake.write_text(
        cmake.read_text().replace(
            "\nament_package()",
            "\nset(PROJECT_VERSION 1.0.0)\nconfigure_file(version.py.in version.py @ONLY)\n"
            "install(FILES ${CMAKE_CURRENT_BINARY_DIR}/version.py DESTINATION ${PYTHON_INSTALL_DIR}/${PROJECT_NAME})\n"
            "ament_package()",
        )
    )
    built = building.build([package], settings.cache, COURSE)
    assert built.facts.ok, built.facts.log_tail
    assert len(list(built.install.rglob("version.py"))) == 1
    assert built.facts.flags == []


@pytest.mark.sandbox
def test_the_byte_code_of_an_install_tree_is_that_of_its_text(package: Path, settings: pipeline.Settings):
    """And Python compares it with the text by content, not by its time. rosidl's own CMake compiles, too."""
    site = building.build([package], settings.cache, COURSE).install / ros_env.SITE_IN_PREFIX
    modules = sorted(site.rglob("*.py"))
    assert len(modules) > 10
    assert sorted(site.rglob("*.pyc")) == sorted(Path(importlib.util.cache_from_source(str(path))) for path in modules)
    for path in modules:
        data = Path(importlib.util.cache_from_source(str(path))).read_bytes()
        assert data[4:16] == (0b11).to_bytes(4, "little") + importlib.util.source_hash(path.read_bytes())
        assert marshal.loads(data[16:]) == compile(path.read_bytes(), str(path), "exec", dont_inherit=True)


def test_a_log_names_no_place_of_this_machine():
    from grader.host import ros_env

    log = f"CMake Error at {ros_env.PREFIX}/share/x.cmake:1"
    assert colcon._without_host_paths(log) == "CMake Error at <ros>/share/x.cmake:1"


@pytest.mark.slow  # two builds
@pytest.mark.sandbox
def test_interfaces_of_the_kit_that_do_not_build_are_tried_again(tmp_path: Path):
    """They fail for the machine's sake, such as a broken colcon, and that may be repaired."""
    package = tmp_path / "interfaces"
    package.mkdir()
    (package / "package.xml").write_text("<package format='3'><name>interfaces</name></package>")
    (package / "CMakeLists.txt").write_text("message(FATAL_ERROR broken)")
    for _ in range(2):
        built = building.build([package], tmp_path / "cache", COURSE, trusted=True, main="interfaces")
        assert (built.facts.ok, built.facts.cached) == (False, False)


@pytest.mark.sandbox
def test_a_colcon_that_does_not_run_is_charged_to_nobody(package: Path, tmp_path: Path, monkeypatch):
    """Its exit status is that of a failed build, and it was kept as one: 41 packages "did not build"."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "colcon").write_text("#!/bin/sh\necho ModuleNotFoundError: colcon_core\nexit 1\n")
    (tmp_path / "bin" / "colcon").chmod(0o755)
    monkeypatch.setattr(ros_env, "_PATH", f"/broken:{ros_env._PATH}")
    real = sandbox.Sandbox

    def with_broken_colcon(**options: Any) -> sandbox.Sandbox:
        options["read_only"] = {**options.get("read_only", {}), tmp_path / "bin": "/broken"}
        return real(**options)

    tmp_path.chmod(0o755)
    monkeypatch.setattr(sandbox, "Sandbox", with_broken_colcon)
    with pytest.raises(GraderError, match="colcon does not run on this machine: ModuleNotFoundError"):
        building.build([package], tmp_path / "cache", COURSE)


@pytest.mark.parametrize(
    ("log", "far"),
    [
        ("-- Configuring done\n", ""),
        ("[1/43] Generating C code for ROS interfaces\n", "generating code: 1 of 43"),
        ("[20/43] Linking C x.so\n[21/43] Building CXX object y.cpp.o\nwarning\n", "compiling C++: 21 of 43"),
        ("[2/43] Building C object a.o\n[3/4", "compiling C: 2 of 43"),
        ("[43/43] Running utility command\n", "43 of 43"),
    ],
)  # fmt: skip
def test_a_log_says_how_far_the_build_is(log: str, far: str):
    assert colcon.how_far(log) == far
