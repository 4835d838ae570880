"""Python in other encodings, with form feeds, or too complex to parse: nothing is gained by it."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.mutation.mutant_run import mutate
from grader.mutation.operators import mutants
from grader.mutation.source_text import is_too_complex, parse
from grader.sandbox import untrusted
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import run_suite

pytestmark = pytest.mark.slow  # each runs the toy's tests


def test_form_feeds_hide_nothing_from_mutation(tmp_path: Path):
    plain, fed = tmp_path / "plain.py", tmp_path / "fed.py"
    plain.write_text(toy.CONTROLLER)
    fed.write_text("\n".join(f"\f{line}" for line in toy.CONTROLLER.split("\n")))
    found = []
    for path in (plain, fed):
        text = untrusted.read_python(path)
        assert text is not None
        source = parse("m.py", text)
        assert source is not None
        found.append([(mutant.line, mutant.words) for mutant in mutants(source, COURSE)])
    assert len(found[0]) > 10
    assert found[0] == found[1]


def test_what_python_rejects_is_not_what_is_too_complex_for_it():
    assert not is_too_complex("def (:")
    assert not is_too_complex("x = 1\n")
    assert is_too_complex("x = " + " + ".join(["1"] * 5000))


HIDDEN = """# coding: unicode_escape
def twice(value):
    if value > 2:
        return 2 * value
    return value + value
"""
USES_IT = """
from ros2_robot_controller import hidden


def test_twice():
    assert hidden.twice(1) == 2
    assert hidden.twice(3) == 6
"""


@pytest.mark.sandbox
def test_of_a_module_that_cannot_be_read_nothing_counts_as_reached_or_noticed(tmp_path: Path):
    made = toy.make(tmp_path, {"test/test_robot_controller.py": toy.THOROUGH + USES_IT}, {"hidden.py": HIDDEN})
    ran = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    reached = {Path(file.path).name: (file.lines, file.lines_hit) for file in ran.tests.coverage}
    assert ran.tests.doubts == []
    assert reached["hidden.py"] == (4, 0)
    assert reached["robot_controller.py"][1] > 10
    found = mutate(made.package, made.install, ran.reach, COURSE, count=8, seconds=3.0)
    hidden = [mutant for mutant in found.mutants if mutant.path.endswith("hidden.py")]
    assert hidden
    assert all(mutant.outcome == "unreached" and "cannot be read" in mutant.words for mutant in hidden)
    assert any(mutant.outcome == "noticed" for mutant in found.mutants)


@pytest.mark.sandbox
def test_the_reports_of_tests_that_cannot_be_read_are_doubted(tmp_path: Path):
    """Such a test cannot be made to fail to see whether the failure is reported."""
    text = "# coding: unicode_escape\n" + toy.THOROUGH
    made = toy.make(tmp_path, {"test/test_robot_controller.py": text})
    ran = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    assert ran.tests.modules[0].passed > 0
    assert any("an encoding that the grader does not read" in doubt for doubt in ran.tests.doubts)


@pytest.mark.sandbox
def test_another_usual_encoding_costs_nothing(tmp_path: Path):
    made = toy.make(tmp_path, {"test/test_robot_controller.py": ""})
    for path in (made.package, made.install):
        for module in path.rglob("robot_controller.py"):
            module.write_bytes(f"# coding: latin-1\n# für\n{toy.CONTROLLER}".encode("latin-1"))
    test = made.package / "test" / "test_robot_controller.py"
    test.write_bytes(f"# coding: latin-1\n# für\n{toy.THOROUGH}".encode("latin-1"))
    ran = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    assert ran.tests.doubts == []
    assert ran.tests.modules[0].failed == 0
    found = mutate(made.package, made.install, ran.reach, COURSE, count=8, seconds=3.0)
    assert any(mutant.outcome == "noticed" and mutant.path.endswith("robot_controller.py") for mutant in found.mutants)
