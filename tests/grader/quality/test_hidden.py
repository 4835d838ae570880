"""Q1 to Q4 look at all code that can run: no place, name, size or comment hides bad code."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE
from helpers.judging import Check, find
from helpers.quality_examples import (
    CONTROLLER,
    Judged,
    facts,
    judged,
    reference,
    untouched,
    with_linters,
    written,
)

from grader.checks import check_docstrings, check_habits, check_structure, check_style
from grader.course import role
from grader.evidence import Finding, Quality, SourceFile, reading_limits
from grader.quality import source_files
from grader.quality.parsed_module import parse

pytestmark = pytest.mark.slow  # the linters, for each of many packages

STYLE = check_style.test_ament_flake8_finds_nothing
DOCSTRINGS = check_docstrings.test_public_things_have_docstrings
RULES = check_docstrings.test_docstrings_follow_ament_pep257
LAYOUT = check_structure.test_layout_matches_the_contract
COMPLEXITY = check_structure.test_no_function_is_too_complex
COPIES = check_structure.test_no_block_is_repeated
CONVERSIONS = find("check_structure::test_conversions_are_in_utils_and_used")
HABITS = check_habits.test_no_bare_except_print_or_mutable_default
SLEEPING = check_habits.test_callbacks_do_not_sleep
NUMBERS = find("check_habits::test_contract_numbers_are_parameters")
ANNOTATIONS = check_habits.test_public_functions_are_annotated
Q1_TO_Q4 = (
    STYLE, DOCSTRINGS, RULES, LAYOUT, COMPLEXITY, COPIES, CONVERSIONS, HABITS, SLEEPING, NUMBERS, ANNOTATIONS,
)  # fmt: skip

BLOCK = "".join(f"    a = a * {n}\n" for n in range(8))
BAD = (
    "def decide(a, b=[]):\n"
    + "".join(f"    if a == {n}:\n        print( a)\n" for n in range(12))
    + BLOCK
    + "\n\ndef again(a):\n    try:\n        a = b\n    except:\n        pass\n"
    + BLOCK
)


def names(package: Path) -> list[str]:
    return [source.path for source in source_files.find(package, COURSE)]


def problems(package: Path, path: str) -> set[str]:
    """Return the kinds of findings in one file."""
    quality = facts(package)
    habits = {finding.rule for finding in quality.habits if finding.path == path}
    copied = {"copy" for copy in quality.copies if any(place.startswith(f"{path}:") for place in copy.places)}
    bare = {"undocumented" for thing in quality.definitions if thing.path == path and not thing.documented}
    return habits | copied | bare


BROKEN = "is not valid Python: line 2"
EVERYTHING = {"print", "bare-except", "mutable-default", "copy", "undocumented"}


# -- where the code is -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "path",
    [
        "ros2_robot_controller/bad.py",
        "ros2_robot_controller/.inner/bad.py",
        "ros2_robot_controller/.vscode-server/bad.py",
        ".inner/bad.py",
        "ros2_robot_controller/bad_test.py",
        "ros2_robot_controller/test_bad.py",
        "ros2_robot_controller/conftest.py",
        "ros2_robot_controller/bad_launch.py",
        "ros2_robot_controller/test/bad.py",
        "ros2_robot_controller/msg/bad.py",
        "ros2_robot_controller/srv/bad.py",
        "ros2_robot_controller/action/bad.py",
        "ros2_robot_controller/bad",
        "more/bad_test.py",
    ],
)
def test_a_module_is_read_wherever_the_build_takes_it_from(tmp_path: Path, path: str):
    text = BAD if path.endswith(".py") else f"#!/usr/bin/env python3\n{BAD}"
    assert problems(written(tmp_path, {path: text}), path) == EVERYTHING


def test_a_pyvenv_cfg_hides_nothing_in_the_packages_own_folders(tmp_path: Path):
    package = written(tmp_path, {"ros2_robot_controller/in/pyvenv.cfg": "", "ros2_robot_controller/in/bad.py": BAD})
    package = written(package, {"scripts/pyvenv.cfg": "", "scripts/bad.py": BAD})
    assert names(package) == ["ros2_robot_controller/in/bad.py", "scripts/bad.py"]


@pytest.mark.parametrize("first", ["#!/usr/bin/env python3", "#!/usr/bin/python3 -u", "#! /usr/bin/env -S python3 -u"])
def test_a_program_without_py_is_read_as_a_script(tmp_path: Path, first: str):
    """It may print like any script, and needs docstrings and good habits like any script."""
    package = written(tmp_path, {"scripts/robot_controller": f"{first}\n{BAD}"})
    assert problems(package, "scripts/robot_controller") == EVERYTHING - {"print"}
    assert {role(f"{folder}/robot_controller", PACKAGE) for folder in ("scripts", "nodes")} == {"script"}


def test_a_program_without_py_is_linted(tmp_path: Path):
    """Also under a name that flake8 skips by itself."""
    program = f"#!/usr/bin/env python3\n{BAD}"
    quality = with_linters(written(tmp_path, {"scripts/robot_controller": program, "scripts/CVS": program}))
    assert {(finding.path, finding.rule) for finding in quality.style} >= {
        ("scripts/robot_controller", "E201"),
        ("scripts/CVS", "E201"),
    }
    assert [finding.path for finding in quality.complex] == ["scripts/CVS", "scripts/robot_controller"]


@pytest.mark.parametrize(
    "files",
    [
        {"scripts/run": "#!/bin/sh\nexec python3 -m x\n"},
        {"resource/ros2_robot_controller": ""},
        {"LICENSE": "python\n", "scripts/notes": "python3\n"},
        {"scripts/node~": f"#!/usr/bin/env python3\n{BAD}", "scripts/node.orig": f"#!/usr/bin/env python3\n{BAD}"},
    ],
    ids=["a shell script", "a marker", "texts", "an editor's copies"],
)
def test_other_files_are_not_python_programs(tmp_path: Path, files: dict[str, str | bytes | None]):
    assert names(written(tmp_path, files)) == []


def test_tests_are_tests_where_pytest_is_started():
    tests = ["test/test_a.py", "tests/unit/a_test.py", "test/conftest.py", "tests/helpers.py", "conftest.py"]
    assert {role(path, PACKAGE) for path in tests} == {"test"}


# -- what cannot be read ----------------------------------------------------------------------------------------------


def test_a_long_comment_does_not_hide_a_module(tmp_path: Path):
    package = written(tmp_path, {"m/bad.py": f"# {'x ' * 2500}x\n{BAD}"})
    assert problems(package, "m/bad.py") == EVERYTHING
    quality = with_linters(package)
    assert [file.problem for file in quality.files] == [""]
    assert {"E501", "E201"} <= {finding.rule for finding in quality.style}


@pytest.mark.parametrize("check", [COMPLEXITY, COPIES, HABITS, SLEEPING], ids=lambda check: check.__name__)
def test_an_unreadable_module_counts_as_many_findings(check: Check):
    """A finding for every ten of its lines costs all points."""
    quality = facts_with(SourceFile("m/a.py", 400), SourceFile("m/b.py", 47, "nests brackets more than 100 deep"))
    result = judged(check, quality)
    assert result.share == 0.0
    assert "m/b.py nests brackets more than 100 deep" in result.seen


@pytest.mark.parametrize("check", [COMPLEXITY, DOCSTRINGS, RULES, CONVERSIONS, ANNOTATIONS, STYLE])
def test_a_line_that_keeps_a_module_from_being_read_is_to_be_fixed_first(check: Check):
    """Q3 said "move each decision into a function of its own", and that no node calls a conversion."""
    quality = facts_with(SourceFile("m/a.py", 400), SourceFile("m/b.py", 90, "is not valid Python: line 83: '(' was"))
    quality = replace(quality, functions=replace(quality.functions, calls=[]))
    result = judged(check, quality)
    assert result.try_ == "fix line 83 of m/b.py first"
    assert "no node calls" not in result.seen


@pytest.mark.parametrize(
    ("unread", "checks", "share"),
    [
        (SourceFile("m/b.py", 3, BROKEN), (COMPLEXITY,), 0.75),
        (SourceFile("m/b.py", 3, BROKEN), (DOCSTRINGS, RULES, ANNOTATIONS), 400 / 403),
        # No node runs it; T1 says that it cannot be run.
        (SourceFile("test/test_b.py", 300, BROKEN), (COMPLEXITY, DOCSTRINGS, STYLE), 1.0),
    ],
    ids=["one finding", "its lines", "a test"],
)
def test_a_small_unreadable_file_costs_little_and_a_test_nothing(unread: SourceFile, checks, share: float):
    quality = facts_with(SourceFile("m/a.py", 400), unread)
    assert {judged(check, quality).share for check in checks} == {share}


def facts_with(*files: SourceFile) -> Quality:
    return replace(untouched(), files=list(files))


def test_long_lines_count_as_several_in_an_unreadable_file():
    assert source_files.PythonFile("m/a.py", b"x = 1\n" * 20).rough_lines == 20
    assert source_files.PythonFile("m/a.py", b"x = 1;" * 400).rough_lines == 25


# -- padding ----------------------------------------------------------------------------------------------------------

NUMBERS_ONLY = "".join(f"N{n} = {n}\n" for n in range(1_000))
BULK = NUMBERS_ONLY + "# and so on\n" * 15_000


def test_the_contracts_files_are_read_before_padding(tmp_path: Path):
    padding = {f"ros2_robot_controller/a{n}.py": BULK for n in range(8)}
    padding |= {f"a{n}/a.py": "X = 1\n" for n in range(reading_limits.MAX_FILES)}
    found = {source.path: source for source in source_files.find(reference(tmp_path, files=padding), COURSE)}
    assert not found[CONTROLLER].problem
    assert found["launch/robot_controller_launch.py"].data


@pytest.mark.parametrize(
    ("files", "said"),
    [
        ({f"ros2_robot_controller/a{n}.py": BULK for n in range(8)}, "1024 KB of Python in the package"),
        ({f"a/a{n}.py": "X = 1\n" for n in range(200)}, "200 Python files in the package"),
        ({"a.py": "def f():\n    '''F.'''\n" * 2001}, "2000 public definitions"),
    ],
    ids=["bytes", "files", "definitions"],
)
def test_a_package_beyond_a_reading_limit_gets_nothing(tmp_path: Path, files: dict[str, str | bytes | None], said: str):
    package = reference(tmp_path, files=files)
    quality = facts(package, tests=True)
    unread = [SourceFile(found.path, 0, found.problem) for found in source_files.find(package, COURSE) if found.problem]
    quality = replace(quality, files=[*quality.files, *unread])
    for check in Q1_TO_Q4:
        result: Judged = judged(check, quality)
        assert result.share == 0.0, check.__name__
        assert said in result.seen


@pytest.mark.parametrize("line", ["x=f( 1)\n", "x=f( 1);" * 100 + "\n"], ids=["lines", "long lines"])
def test_a_module_too_large_to_be_read_costs_more_than_its_start(tmp_path: Path, line: str):
    """Nobody gains by making a bad module larger: a file cut to the limit is judged by its findings."""
    times = reading_limits.MAX_BYTES // len(line)
    name = "ros2_robot_controller/large.py"
    small = with_linters(reference(tmp_path / "small", files={name: line * (times // 50)}))
    large = with_linters(reference(tmp_path / "large", files={name: line * (times + 1)}))
    for check in (STYLE, DOCSTRINGS, COMPLEXITY, COPIES, HABITS, SLEEPING):
        result = judged(check, large)
        assert result.share <= judged(check, small).share, check.__name__
        assert result.share < 0.2
        assert f"{name} is larger than 256 KB" in result.seen


def test_lines_of_constants_do_not_dilute_the_findings(tmp_path: Path):
    bad = "x = [1,2 ]\n" * 45
    quality = with_linters(written(tmp_path, {"m/a.py": NUMBERS_ONLY, "m/b.py": NUMBERS_ONLY, "m/c.py": bad}))
    assert sum(file.lines for file in quality.files) == reading_limits.MAX_CONSTANT_LINES
    assert judged(STYLE, quality).share == 0.0


@pytest.mark.parametrize(
    ("text", "constants"),
    [
        ("A = 1\nB = -A\nC: float = 2.0\nD = (1, {'a': [2]})\n", 4),
        ("A = [\n    1,\n    2,\n]\n", 4),
        ("if True:\n    A = 1\n    pass\n0\n", 3),
        ("class A:\n    x = 1\n    y: int\n", 2),
        ("A = f(1)\nB = A[0]\nimport c\n", 0),
        ("def f():\n    x = 1\n    return x\n", 0),
    ],
)
def test_constant_lines_only_name_literals(text: str, constants: int):
    assert parse("m/a.py", text.encode(), PACKAGE).constants == constants


def test_the_counted_lines_of_files_and_packages_are_limited():
    assert reading_limits.counted_lines([SourceFile("m/a.py", 40_000)]) == 1000
    assert reading_limits.counted_lines([SourceFile(f"m/{n}.py", 900) for n in range(10)]) == 5000
    assert reading_limits.counted_lines([SourceFile("m/a.py", 700), SourceFile("m/b.py", 200)]) == 900
    findings = [Finding("m/a.py", line, "E501", "long") for line in range(50)]
    quality = replace(facts_with(SourceFile("m/a.py", 40_000)), style=findings)
    assert judged(STYLE, quality).share == 0.5
