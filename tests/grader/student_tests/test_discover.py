"""What is known of test modules before anything runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.archives import write
from helpers.course import COURSE
from submissions import toy

from grader import KIT, evidence
from grader.student_tests.discover import copy_flags, discover_tests


def read(folder: Path, **files: str) -> dict[str, evidence.TestModule]:
    write(folder, {f"{name.replace('__', '/')}.py": text for name, text in files.items()})
    return {module.path: module for module in discover_tests(folder, COURSE.nodes)}


def test_modules_are_found_in_test_and_tests_and_below(tmp_path: Path):
    test = "def test_it():\n    assert 1\n"
    found = read(tmp_path, test__test_a=test, tests__unit__b_test=test, test__deep__er__test_c=test, src__test_d=test)
    assert sorted(found) == ["test/deep/er/test_c.py", "test/test_a.py", "tests/unit/b_test.py"]


INHERITED = """
class Common:
    def test_name(self):
        assert self.node().get_name()

    class TestWithin:
        def test_nested(self):
            assert make().x == 1
"""
CASES = """
import unittest
class NodeCase(unittest.TestCase):
    def setUp(self):
        self.node = make()
"""


@pytest.mark.parametrize(
    ("helper", "text", "tests"),
    [
        (INHERITED, "class TestDriver(Common):\n    node = Driver\n", 2),
        (CASES, "class Drives(NodeCase):\n    def test_it(self):\n        self.assertTrue(self.node.x)\n", 1),
        ("", "class TestA:\n    def test_a(self):\n        assert x\n\nclass TestB(TestA):\n    pass\n", 1),
        ("", "class TestA:\n    class TestB(TestA):\n        def test_b(self):\n            assert x\n", 1),
        ("", "class Plain(Base):\n    def test_no(self):\n        assert x\n", 0),
    ],
    ids=["inherited", "own TestCase", "inherited here", "in themselves", "not collected"],
)
def test_tests_of_base_classes_and_nested_classes_are_found(tmp_path: Path, helper: str, text: str, tests: int):
    """A module all of whose tests were written in a base class was not run, which cost its node's points."""
    found = read(tmp_path, test__common=helper, test__test_a=text)["test/test_a.py"]
    assert (found.tests, found.asserting) == (tests, tests)


@pytest.mark.parametrize("linter", ["ament_copyright", "ament_flake8", "ament_pep257"])
def test_what_ros2_pkg_create_generates_is_a_stub(tmp_path: Path, linter: str):
    text = f"""
from {linter}.main import main
import pytest

@pytest.mark.linter
def test_it():
    rc = main(argv=['.', 'test'])
    assert rc == 0, 'Found errors'
"""
    assert read(tmp_path, test__test_lint=text)["test/test_lint.py"].stub


def test_a_module_that_lints_and_tests_a_node_is_not_a_stub(tmp_path: Path):
    text = "from ament_flake8.main import main\nfrom pkg.robot_controller import f\ndef test_it():\n    assert f(1)\n"
    assert not read(tmp_path, test__test_both=text)["test/test_both.py"].stub


def test_a_fixture_is_not_a_test_whatever_its_name(tmp_path: Path):
    text = (
        "import pytest\n@pytest.fixture\ndef test_node():\n    yield 1\ndef test_it(test_node):\n    assert test_node\n"
    )
    module = read(tmp_path, test__test_a=text)["test/test_a.py"]
    assert (module.tests, module.silent) == (1, [])


@pytest.mark.parametrize(
    "body",
    [
        "pass", "node.spin()", "assert True", "print('works')", "x = 1 == 2", "'assert x'", "return node.speed == 0",
    ],
)  # fmt: skip
def test_a_test_that_asserts_nothing_is_named(tmp_path: Path, body: str):
    module = read(tmp_path, test__test_a=f"def test_drives():\n    {body}\n")["test/test_a.py"]
    assert (module.tests, module.asserting, module.silent) == (1, 0, ["test_drives"])


@pytest.mark.parametrize(
    "body",
    [
        "assert x == 1",
        "if x:\n        return\n    assert x",
        "with pytest.raises(ValueError):\n        f()",
        "self.assertEqual(x, 1)",
        "numpy.testing.assert_allclose(x, 1)",
        "pytest.fail('no')",
        "check(x)",
    ],
)
def test_the_usual_ways_to_assert_are_known(tmp_path: Path, body: str):
    helper = "def check(x):\n    really(x)\n\ndef really(x):\n    assert x\n\n"
    module = read(tmp_path, test__test_a=f"{helper}def test_drives():\n    {body}\n")["test/test_a.py"]
    assert (module.tests, module.asserting, module.silent) == (1, 1, [])


@pytest.mark.slow  # a chain of thousands
def test_a_chain_of_helpers_is_walked_once(tmp_path: Path):
    """Repeated passes over all helpers, each finding one more, took hours."""
    chain = "".join(f"def check{n}(x):\n    check{n + 1}(x)\n\n" for n in range(5000))
    text = f"{chain}def check5000(x):\n    assert x\n\ndef test_it():\n    check0(1)\n"
    assert read(tmp_path, test__test_a=text)["test/test_a.py"].asserting == 1


def test_a_module_that_is_not_python_is_reported(tmp_path: Path):
    module = read(tmp_path, test__test_a="def test_(:\n")["test/test_a.py"]
    assert module.tests == 0
    assert "cannot be read as Python" in module.failures[0]


@pytest.mark.parametrize(
    "line", ["MASK = 0x" + "f" * 5000, "TOTAL = " + " + ".join(["1"] * 700), "DEEP = " + "[" * 5000 + "]" * 5000]
)
def test_a_module_that_is_too_complex_for_python_is_reported_and_stops_nothing(tmp_path: Path, line: str):
    test = "def test_it():\n    assert x == 1\n"
    found = read(tmp_path, test__test_a=f"{line}\n\n{test}", test__test_b=test)
    assert "cannot be read as Python" in found["test/test_a.py"].failures[0]
    assert found["test/test_b.py"].tests == 1


ORIGINALS = {"ros2_robot_controller/robot_controller.py": toy.CONTROLLER}
COMPARES = "def test_it():\n    assert original.stop_distance(0.3) == stop_distance(0.3)\n"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("original.py", toy.CONTROLLER.replace("    ", "  ").replace('"""Drive', '# A copy.\n  """Drive')),
        ("test_it.py", toy.CONTROLLER + COMPARES),
        ("original.txt", toy.CONTROLLER),
        ("test_it.py", f"KNOWN = {toy.CONTROLLER!r}\nexec(KNOWN)\n{COMPARES}"),
    ],
)
def test_a_copy_of_the_package_in_its_tests_is_flagged(tmp_path: Path, name: str, text: str):
    """Compared with itself by random calls it had 14.7 of 15 points for its tests."""
    (tmp_path / "test").mkdir()
    (tmp_path / "test" / name).write_text(text)
    [flag] = copy_flags(tmp_path, ORIGINALS)
    assert (flag.kind, flag.where) == ("copy of the package", f"test/{name}")
    assert flag.concerns == ["student tests", "mutation"]


def test_the_references_tests_hold_no_copy_of_it():
    package = KIT / "solution_pkg" / "ros2_robot_controller"
    texts = {str(path): path.read_text() for path in (package / "ros2_robot_controller").rglob("*.py")}
    assert copy_flags(package, texts) == []
