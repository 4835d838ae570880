"""Python in other encodings, with form feeds, or too complex to parse: nothing is gained by it."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.mutation.operators import mutants
from grader.mutation.source import mutate
from grader.mutation.source_text import parse
from grader.sandbox import untrusted
from grader.student_tests.discover import discover_tests
from grader.student_tests.package_modules import handed_in
from grader.student_tests.source import run_suite


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


def test_a_module_that_is_installed_from_another_folder_has_the_path_at_which_it_was_handed_in(tmp_path: Path):
    for name, text in {"src/arm.py": "A = 1\n", "pkg/base.py": "B = 1\n", "test/arm.py": "A = 1\n"}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    installed = {"pkg/arm.py": "A = 1\n", "pkg/base.py": "B = 1\n", "pkg/made.py": "C = 1\n"}
    assert handed_in(tmp_path, installed) == {"pkg/arm.py": "src/arm.py", "pkg/made.py": "pkg/made.py"}


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
@pytest.mark.slow  # runs the toy's tests
def test_in_a_module_that_cannot_be_read_nothing_counts_as_noticed(tmp_path: Path):
    made = toy.make(tmp_path, {"test/test_robot_controller.py": toy.THOROUGH + USES_IT}, {"hidden.py": HIDDEN})
    ran = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    found = mutate(made.package, made.install, ran.reach, COURSE, count=8, seconds=3.0)
    hidden = [mutant for mutant in found.mutants if mutant.path.endswith("hidden.py")]
    assert hidden
    assert all(mutant.outcome == "unreached" and "cannot be read" in mutant.words for mutant in hidden)
    assert any(mutant.outcome == "noticed" for mutant in found.mutants)


@pytest.mark.sandbox
@pytest.mark.slow  # runs the toy's tests
def test_another_usual_encoding_costs_nothing(tmp_path: Path):
    made = toy.make(tmp_path, {"test/test_robot_controller.py": ""})
    for path in (made.package, made.install):
        for module in path.rglob("robot_controller.py"):
            module.write_bytes(f"# coding: latin-1\n# für\n{toy.CONTROLLER}".encode("latin-1"))
    test = made.package / "test" / "test_robot_controller.py"
    test.write_bytes(f"# coding: latin-1\n# für\n{toy.THOROUGH}".encode("latin-1"))
    ran = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE)
    assert ran.tests.modules[0].failed == 0
    found = mutate(made.package, made.install, ran.reach, COURSE, count=8, seconds=3.0)
    assert any(mutant.outcome == "noticed" and mutant.path.endswith("robot_controller.py") for mutant in found.mutants)
