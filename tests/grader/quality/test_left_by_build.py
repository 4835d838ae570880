"""What a build leaves is read as the package's own: launchers cost nothing, and code counts wherever it came from."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.judging import ask, evidence_with, find
from helpers.quality_examples import REFERENCE, reference, written

from grader.host import ros_env
from grader.quality import analyse, source_files
from grader.quality.left_by_build import left_by_build, may_leave_code, with_installed

pytestmark = pytest.mark.slow  # each builds and lints

SITE = str(ros_env.SITE_IN_PREFIX)
LAUNCHER = "#!/usr/bin/env python3\nfrom ros2_robot_controller.{node} import main\n\nraise SystemExit(main())\n"
SLOPPY = "def mess( a ):\n  return a\n"
STYLE = find("check_style::test_ament_flake8_finds_nothing")


def installed(package: Path, **files: str) -> Path:
    """Return an install tree with the modules of a package, and these files."""
    modules = {
        f"{SITE}/{path.relative_to(package)}": path.read_text() for path in (package / package.name).rglob("*.py")
    }
    return written(package.parent / "install", modules | files)


def left(package: Path, **files: str) -> dict[str, bool]:
    """Return the paths of what the build has left, and whether it only starts something."""
    return {
        each.path: each.starts
        for each in left_by_build(source_files.find(package, COURSE), installed(package, **files), COURSE.nodes)
    }


def test_launchers_that_the_build_writes_cost_nothing(tmp_path: Path):
    package = reference(tmp_path, files={"scripts/robot_controller": None, "scripts/sensor_processor": None})
    nodes = ("robot_controller", "sensor_processor")
    programs = {f"lib/{package.name}/{node}": LAUNCHER.format(node=node) for node in nodes}
    assert left(package, **programs) == dict.fromkeys(programs, True)
    quality = analyse.analyse_package(package, COURSE, None, tmp_path / "install")
    assert set(quality.reached.nodes) == set(nodes)
    for check in (
        "check_style::test_ament_flake8_finds_nothing", "check_docstrings::test_public_things_have_docstrings",
        "check_docstrings::test_docstrings_follow_ament_pep257", "check_structure::test_no_block_is_repeated",
    ):  # fmt: skip
        assert ask(find(check), evidence_with(quality=quality)).share == 1


def test_code_that_the_build_writes_is_linted_where_it_is_installed(tmp_path: Path):
    package = reference(tmp_path)
    install = installed(package, **{f"{SITE}/{package.name}/mess.py": SLOPPY})
    quality = analyse.analyse_package(package, COURSE, None, install)
    assert {finding.path for finding in quality.style} == {f"{package.name}/mess.py"}
    assert ask(STYLE, evidence_with(quality=quality)).share < 1


def test_what_is_installed_over_a_module_is_read_in_its_place(tmp_path: Path):
    package = reference(tmp_path)
    path = f"{package.name}/driver.py"
    install = installed(package, **{f"{SITE}/{path}": SLOPPY})
    read = {
        source.path: source.data for source in with_installed(source_files.find(package, COURSE), install, COURSE.nodes)
    }
    assert read[path] == SLOPPY.encode()


def test_a_text_that_was_handed_in_elsewhere_is_read_as_the_module_that_it_becomes(tmp_path: Path):
    """Else a tidy module that is installed nowhere would be read in place of what runs."""
    package = reference(tmp_path, files={"src/real.py": SLOPPY})
    path = f"{package.name}/driver.py"
    install = installed(package, **{f"{SITE}/{path}": SLOPPY})
    read = {
        source.path: source.data for source in with_installed(source_files.find(package, COURSE), install, COURSE.nodes)
    }
    assert read[path] == SLOPPY.encode()
    assert "src/real.py" not in read, "it would count twice"


@pytest.mark.parametrize("text", ["", '"""The package."""\n', "VERSION: tuple[int, int] = (1, 2)\nSHARE = 'share/p'\n"])
def test_a_module_with_nothing_but_constants_is_not_looked_at(tmp_path: Path, text: str):
    """CMake writes such a file with the package's version."""
    assert left(reference(tmp_path), **{f"{SITE}/ros2_robot_controller/version.py": text}) == {}


@pytest.mark.parametrize("text", ["X = open('x').read()\n", "import os\n", "x: exec(open('x').read()) = 0\n"])
def test_an_annotation_may_be_code(tmp_path: Path, text: str):
    assert left(reference(tmp_path), **{f"{SITE}/ros2_robot_controller/version.py": text})


def test_a_template_is_read_as_what_cmake_makes_of_it(tmp_path: Path):
    program = "#!/usr/bin/env python3\nfrom @PROJECT_NAME@.@node@ import main\n\nmain()\n"
    cmake = "\nconfigure_file(scripts/node.in bin/node @ONLY)\n"
    package = reference(tmp_path, files={"scripts/node.in": program})
    (package / "CMakeLists.txt").write_text((package / "CMakeLists.txt").read_text() + cmake)
    assert "scripts/node.in" not in [source.path for source in source_files.find(package, COURSE)]


def test_a_build_is_needed_only_where_it_may_leave_other_code(tmp_path: Path):
    assert not may_leave_code([REFERENCE], COURSE.nodes)
    package = reference(tmp_path)
    text = (package / "CMakeLists.txt").read_text()
    for command in (
        "file(WRITE x.py y)", "configure_file(a b)", "install(PROGRAMS a DESTINATION b RENAME c)",
        "add_executable(robot_controller a.cpp)",
    ):  # fmt: skip
        (package / "CMakeLists.txt").write_text(f"{text}\n{command}\n")
        assert may_leave_code([package], COURSE.nodes), command
    (package / "CMakeLists.txt").write_text(f"{text}\nfile(GLOB found *.py)\n")
    assert not may_leave_code([package], COURSE.nodes)


@pytest.mark.parametrize(
    ("path", "content"),
    [("scripts/tool", b"\x7fELF\0"), ("x/lib.zip", b"PK\0"), ("scripts/robot_controller", b"#!/bin/sh\nexec x\n")],
)
def test_a_build_is_needed_where_something_handed_in_is_no_python_to_read(tmp_path: Path, path: str, content: bytes):
    """A check of style by itself gave such a package full points, a grading none."""
    package = reference(tmp_path)
    (package / path).parent.mkdir(exist_ok=True)
    (package / path).write_bytes(content)
    assert may_leave_code([package], COURSE.nodes)
