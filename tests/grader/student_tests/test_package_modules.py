"""Python in other encodings, with form feeds, or too complex to parse: nothing is gained by it. And the probe, in which
every function of a package raises, and its modules can be imported all the same."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from helpers import beside
from helpers.archives import write
from helpers.course import COURSE
from submissions import toy

from grader.mutation.operators import mutants
from grader.mutation.source import mutate
from grader.mutation.source_text import parse
from grader.sandbox import untrusted
from grader.student_tests.discover import discover_tests
from grader.student_tests.package_modules import function_lines, handed_in, raising
from grader.student_tests.source import run_suite

TEXTS = beside(__file__)


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
    write(tmp_path, {"src/arm.py": "A = 1\n", "pkg/base.py": "B = 1\n", "test/arm.py": "A = 1\n"})
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


@pytest.fixture
def probed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "probed_limits.py").write_text(raising(TEXTS["MODULE"]))
    (tmp_path / "probed_user.py").write_text(raising("from probed_limits import twice\nFOUR = twice(2)\n"))
    monkeypatch.syspath_prepend(tmp_path)
    import probed_limits
    import probed_user

    yield probed_limits, probed_user
    for name in ("probed_limits", "probed_user"):
        del sys.modules[name]


def test_what_modules_call_while_they_are_imported_works(probed):
    limits, user = probed
    assert (limits.TOP, limits.Robot.LIMIT, limits.ROBOT.speed, user.FOUR) == (0.5, 1.0, 0.0, 4)


@pytest.mark.parametrize(
    "call",
    [
        lambda limits: limits.twice(1),
        lambda limits: limits.Robot(),
        lambda limits: limits.ROBOT.fast,
        lambda limits: limits.ROBOT.wait().send(None),
        lambda limits: limits.drive(),
    ],
)
def test_each_function_raises_as_soon_as_it_is_called(probed, call):
    with pytest.raises(Exception, match="every function of the package raises in this run"):
        call(probed[0])


@pytest.mark.parametrize("text", ["def (:\n", "x = " + "+".join(["1"] * 5000), ""])
def test_what_python_cannot_take_apart_stays_as_it_is(text: str):
    assert raising(text) == text or not text


def test_docstrings_and_heads_are_no_lines_of_a_function():
    text = 'def f(a,\n      b):\n    """Say."""\n    c = a\n    return c\n\n\ndef g(): return 1\nX = f(1, 2)\n'
    assert function_lines(text) == {4, 5}
