"""The build trees that submissions with the same interfaces share: what is in them, and what they save."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.archives import write
from helpers.course import COURSE

from grader import KIT, building, sandbox
from grader.building import colcon

PACKAGE_XML = """<?xml version="1.0"?>
<package format="3">
  <name>p</name>
  <version>1.0.0</version>
  <description>A package</description>
  <maintainer email="ann@example.com">Ann</maintainer>
  <license>MIT</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
"""
REFERENCE = (KIT / "solution_pkg" / "ros2_robot_controller" / "CMakeLists.txt").read_text()


def built(folder: Path, cmake: str, **files: str) -> colcon.Built:
    """Build a package with an interface, which this CMakeLists.txt need not generate, and other files."""
    texts = {
        "package.xml": PACKAGE_XML,
        "msg/Word.msg": "string word\n",
        "CMakeLists.txt": f"cmake_minimum_required(VERSION 3.20)\nproject(p)\nfind_package(ament_cmake REQUIRED)\n"
        f"{cmake}\nament_package()\n",
    }
    return building.build([write(folder / "p", texts | files)], folder.parent / "cache", COURSE, main="p")


@pytest.mark.slow  # two builds
@pytest.mark.sandbox
def test_a_package_leaves_no_mark_in_the_tree_from_which_another_is_built(tmp_path: Path):
    """The command that runs its file is put together from variables, and the other package has it, too."""
    cmake = (
        'set(extra_file "CO")\nset(open_file "(")\n'
        'install(${extra_file}DE "include${open_file}${CMAKE_CURRENT_SOURCE_DIR}/doc/notes.txt OPTIONAL)")'
    )
    notes = """
        file(WRITE /ws/install/share/p/ran.txt "")
        file(APPEND /ws/build/p/cmake_install.cmake "file(WRITE /ws/install/share/p/mark.txt marked)\n")
    """
    first = built(tmp_path / "first", cmake, **{"doc/notes.txt": notes})
    second = built(tmp_path / "second", cmake, **{"doc/notes.txt": "# nothing"})
    assert "ran.txt" in first.facts.shared_files, first.facts.log_tail
    assert second.facts.ok
    assert "mark.txt" not in second.facts.shared_files


@pytest.mark.slow  # six builds
@pytest.mark.sandbox
@pytest.mark.parametrize(
    "cmake",
    [
        "if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/launch)\n  install(DIRECTORY launch DESTINATION share/p)\nendif()",
        "file(GLOB found launch/*)\ninstall(FILES ${found} DESTINATION share/p/launch)",
        "install(DIRECTORY launch DESTINATION share/p OPTIONAL)",
    ],
)
def test_what_a_build_looks_for_it_finds_whatever_was_built_before(tmp_path: Path, cmake: str):
    """A package whose launch files were installed if they existed was built like an earlier one that had none."""
    without = built(tmp_path / "first", cmake)
    assert without.facts.ok, without.facts.log_tail
    assert "launch/demo.py" in built(tmp_path / "second", cmake, **{"launch/demo.py": ""}).facts.shared_files


@pytest.mark.slow  # three builds
@pytest.mark.sandbox
def test_interfaces_are_compiled_once_for_packages_that_differ_in_other_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    outputs = []
    run = sandbox.run

    def note(command: list[str], *others: object) -> sandbox.RunResult:
        result = run(command, *others)  # type: ignore[arg-type]
        outputs.append(result.output)
        return result

    monkeypatch.setattr(sandbox, "run", note)
    cmake = (
        "add_custom_command(OUTPUT word DEPENDS msg/Word.msg COMMAND ${CMAKE_COMMAND} -E echo compiled it\n"
        "  COMMAND ${CMAKE_COMMAND} -E touch word)\nadd_custom_target(words ALL DEPENDS word)"
    )
    texts = {"first": "string word\n", "second": "string word\n", "third": "string other\n"}
    compiled = {}
    for name, text in texts.items():
        built(tmp_path / name, cmake, **{"scripts/node": f"# {name}", "msg/Word.msg": text})
        compiled[name] = sum("\ncompiled it" in output for output in outputs)
    assert compiled == {"first": 1, "second": 1, "third": 2}


@pytest.mark.parametrize(
    ("cmake", "looks"),
    [
        (REFERENCE, False),
        ("set(CMAKE_CXX_STANDARD 17)\nlist(APPEND files a)\nforeach(f ${files})\nendforeach()", False),
        ("if(CMAKE_COMPILER_IS_GNUCXX)\n  add_compile_options(-Wall -Wextra -Wpedantic)\nendif()", False),
        ("  # file(GLOB found *)", False),
        ("if (EXISTS launch)\nendif()", True),
        ("if(IS_DIRECTORY launch)\nendif()", True),
        ("if(BUILD_TESTING OR EXISTS launch)\nendif()", True),
        ("file(GLOB found *)", True),
        ("FILE (READ text text)", True),
        ("configure_file(a b)", True),
        ("include(more.cmake)", True),
        ("execute_process(COMMAND python3 make.py)", True),
        ("ament_python_install_package(nodes)", True),
    ],
)  # fmt: skip
def test_a_build_that_looks_for_files_is_configured_again(cmake: str, looks: bool):
    assert colcon._looks_at_files(cmake) is looks


def test_a_word_of_any_length_is_read_in_one_go():
    """Twenty days for ten megabytes, when a pattern starts over at each letter."""
    assert not colcon._looks_at_files(f'message("{"a" * 1_000_000}{" " * 1_000_000}")')
