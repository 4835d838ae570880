"""Q2: docstrings of public definitions, and ament_pep257's rules for them. Q4, advanced: annotations."""

from __future__ import annotations

import ast
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE, PACKAGE
from helpers.quality_examples import REFERENCE, facts, judged, reference, untouched, written

from grader.checks.check_docstrings import test_docstrings_follow_ament_pep257 as rules
from grader.checks.check_docstrings import test_public_things_have_docstrings as coverage
from grader.evidence import Definition, Quality
from grader.quality import source_files
from grader.quality.linting import public_definitions
from grader.quality.parsed_module import parse


def named(text: str, path: str = "pkg/node.py") -> dict[str, Definition]:
    return {thing.name: thing for thing in public_definitions(parse(path, text.encode(), PACKAGE))}


F = "def f(): pass\n"
CLASS = "class A:\n  def f(self): pass\n  def _g(self): pass\n  def __init__(self): pass\nclass _B:\n  def h(self): 1\n"


@pytest.mark.parametrize(
    ("path", "text", "names"),
    [
        ("pkg/node.py", CLASS, {"pkg.node", "A", "A.f"}),
        ("pkg/node.py", "def f():\n  def g(): pass\n", {"pkg.node", "f"}),
        ("pkg/node.py", "import sys\nif sys.platform == 'linux':\n  def f(): pass\n", {"pkg.node", "f"}),
        ("pkg/__init__.py", "", set()),
        ("pkg/__init__.py", "X = 1\n", {"pkg"}),
        ("launch/a_launch.py", F, {"launch.a_launch", "f"}),
        ("scripts/demo.py", F, {"scripts.demo", "f"}),
        ("pkg/utils/scans.py", F, {"pkg.utils.scans", "f"}),
        *((path, F, set()) for path in ("test/test_x.py", "tests/test_x.py", "setup.py", "test/conftest.py")),
    ],
)
def test_what_is_public_needs_a_docstring(path: str, text: str, names: set[str]):
    """No leading underscore anywhere on the way, and in no function."""
    assert set(named(text, path)) == names


def test_a_property_and_its_setter_count_once_and_a_blank_docstring_not_at_all():
    text = "class A:\n  @property\n  def x(self): 'X.'\n  @x.setter\n  def x(self, value): pass\n"
    assert named(text)["A.x"].documented
    assert not named("def f():\n  '''  '''\n")["f"].documented


# -- coverage ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # the linters for ten packages
def test_docstrings_for_nine_of_ten_are_enough():
    things = [Definition("m/a.py", n, "function", f"f{n}", documented=n > 0) for n in range(10)]
    assert judged(coverage, with_things(things)).share == 1.0
    assert judged(coverage, with_things(things[:9])).share < 1.0


def with_docstring(path: str, text: str) -> str:
    """Return the text of a file of the reference in which every docstring is another one."""
    tree = ast.parse((REFERENCE / path).read_text())
    for number, node in enumerate(ast.walk(tree)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            node.body[0] = ast.Expr(ast.Constant(text.format(number)))
    return ast.unparse(tree) + "\n"


@pytest.mark.parametrize("text", ["Do the thing.", "Do thing {}.", "..."])
@pytest.mark.parametrize("check", [coverage, rules], ids=["coverage", "rules"])
def test_a_docstring_that_every_thing_has_counts_once(tmp_path: Path, check, text: str):
    files = {
        path: with_docstring(path, text) for path in (source.path for source in source_files.find(REFERENCE, COURSE))
    }
    assert judged(check, facts(reference(tmp_path, files=files))).share < 0.02


def test_what_is_replaced_may_have_the_docstring_of_what_replaces_it():
    def thing(n: int, name: str, words: str) -> Definition:
        return Definition("m/a.py", n, "function", name, documented=True, words=words)

    mains = [thing(n, "main" if n < 5 else f"C{n}.destroy_node", "run it" if n < 5 else "stop") for n in range(10)]
    assert judged(coverage, with_things(mains)).share == 1.0
    others = [thing(n, f"C{n}.f{n}", "do it" if n < 4 else f"word {n}") for n in range(10)]
    result = judged(coverage, with_things(others))
    assert result.share == pytest.approx(0.7 / 0.9)
    assert "m/a.py:1 function C1.f1 (it has the same docstring as others, which counts once)" in result.seen
    assert judged(coverage, with_things(others[1:])).share == 1.0


def with_things(things: list[Definition]) -> Quality:
    return replace(untouched(), definitions=things)


# -- pep257 -----------------------------------------------------------------------------------------------------------


def test_ament_pep257s_rules_hold_whatever_a_comment_says(tmp_path: Path):
    docstrings = {
        "good": '"""\n    Return a number.\n\n    It is 1.\n    """',
        "no_period": '"""Return a number"""',
        "not_imperative": '"""Returns a number."""',
        "noqa": '"""Return a number"""  # noqa: D400',
    }
    text = "\n\n".join(f"def {name}():\n    {doc}\n    return 1\n" for name, doc in docstrings.items())
    quality = facts(written(tmp_path, {"m/a.py": f'"""A module."""\n\n\n{text}'}), lint=True)
    found = {thing.name: {violation.rule for violation in thing.violations} for thing in quality.definitions}
    period = {"D400", "D415"}
    assert found == {"m.a": set(), "good": set(), "no_period": period, "not_imperative": {"D401"}, "noqa": period}


def test_one_good_docstring_among_twenty_earns_little():
    things = [Definition("m/a.py", n, "function", f"f{n}", documented=n == 0) for n in range(20)]
    assert judged(rules, with_things(things)).share < 0.1


# -- annotations ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("def f(a: int, b, *c, d, **e): pass\n", ["b", "d", "c", "e", "return"]),
        ("class A:\n  def f(self) -> None: 1\n", []),
        ("class A:\n  @classmethod\n  def f(cls) -> None: 1\n", []),
        ("class A:\n  @staticmethod\n  def f(x) -> None: 1\n", ["x"]),
    ],
)
def test_every_parameter_but_self_and_cls_and_the_result_need_a_type(text: str, missing: list[str]):
    assert [*named(text).values()][-1].unannotated == missing
