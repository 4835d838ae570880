"""What tests reach counts for the nodes whose code they run; code that only tests call counts for nothing."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest
from helpers.course import COURSE
from submissions import toy

from grader import evidence
from grader.evidence import FileCoverage
from grader.mutation.mutant_run import mutate
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import SuiteRun, run_suite

pytestmark = [pytest.mark.sandbox, pytest.mark.slow]  # each runs the toy's tests

PAD = "".join(f"def pad{n}(x):\n    y = x + {n}\n    return y * 2\n\n\n" for n in range(60))
TESTS = {
    "nothing": """
        def test_the_front_is_free():
            front_dist = 1.2
            assert front_dist > 0.5
    """,
    "imports": """
        def test_robot_controller():
            from ros2_robot_controller import robot_controller, sensor_processor
            assert robot_controller.TOP_SPEED == 0.5 and sensor_processor.percent
    """,
    "robot_controller": """
        from ros2_robot_controller.robot_controller import stop_distance

        def test_it_stops():
            assert stop_distance(0.5) == 0.0625
    """,
    "unittest": """
        import unittest
        from ros2_robot_controller.robot_controller import RobotController

        class TestController(unittest.TestCase):
            @classmethod
            def setUpClass(cls):
                cls.robot = RobotController()

            def test_it_stands(self):
                self.assertEqual(self.robot.speed, 0.0)
    """,
    "program": """
        import subprocess
        import sys

        def test_it_runs():
            assert subprocess.run([sys.executable, "scripts/robot_controller"]).returncode == 0
    """,
    "killed": """
        import subprocess
        import sys

        def test_it_starts():
            node = subprocess.Popen([sys.executable, "scripts/robot_controller"])
            node.kill()
            assert node.wait() == -9
    """,
    "parametrized": """
        import pytest
        from ros2_robot_controller import sensor_processor

        @pytest.fixture
        def percent():
            return sensor_processor.percent

        @pytest.mark.parametrize("share", [0.0, 0.5])
        def test_percent(percent, share):
            assert percent(share) == 100 * share
    """,
    "pads": """
        from ros2_robot_controller import pad

        def test_pads():
            for n in range(60):
                assert getattr(pad, f"pad{n}")(1) == 2 * (n + 1)
    """,
}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> toy.Toy:
    files = {f"test/{name}/test_it.py": dedent(text) for name, text in TESTS.items()}
    return toy.make(tmp_path_factory.mktemp("toy"), files, {"pad.py": PAD})


@pytest.fixture(scope="module")
def ran(made: toy.Toy) -> SuiteRun:
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, seconds=20.0)
    assert [module.failures for module in found.tests.modules] == [[]] * len(TESTS)
    assert found.tests.doubts == []
    return found


def module(ran: SuiteRun, name: str) -> evidence.TestModule:
    return next(module for module in ran.tests.modules if module.path == f"test/{name}/test_it.py")


def coverage(ran: SuiteRun, name: str) -> FileCoverage:
    return next(file for file in ran.tests.coverage if file.path.endswith(f"/{name}"))


@pytest.mark.parametrize(
    ("name", "nodes"),
    [
        ("nothing", []),
        ("imports", []),
        ("pads", []),
        ("robot_controller", ["robot_controller"]),
        ("unittest", ["robot_controller"]),
        ("program", ["robot_controller", "sensor_processor"]),
        ("killed", ["robot_controller"]),
        ("parametrized", ["sensor_processor"]),
    ],
)
def test_a_module_counts_for_the_nodes_whose_code_its_tests_run(ran: SuiteRun, name: str, nodes: list[str]):
    assert module(ran, name).subjects == nodes
    assert module(ran, name).reaches == (name not in ("nothing", "imports"))


def test_what_only_tests_call_is_not_covered_and_flagged(ran: SuiteRun):
    pad, controller = coverage(ran, "pad.py"), coverage(ran, "robot_controller.py")
    assert (pad.lines, pad.lines_hit, pad.padding) == (0, 0, 180)
    assert controller.lines_hit > 10
    assert controller.padding == 0
    [flag] = [flag for flag in ran.flags if flag.kind == "padding"]
    assert flag.where == "ros2_robot_controller/pad.py"
    assert flag.what.startswith("tests run 180 lines that no node can come to, of ")


def test_the_evidence_says_which_modules_are_the_nodes(ran: SuiteRun):
    assert ran.tests.of_contract
    assert ran.tests.nodes == ["ros2_robot_controller/robot_controller.py", "ros2_robot_controller/sensor_processor.py"]


def test_what_only_tests_call_has_no_mutants(made: toy.Toy, ran: SuiteRun):
    mutation = mutate(made.package, made.install, ran.reach, COURSE, seconds=10.0)
    assert {mutant.path for mutant in mutation.mutants} == set(ran.tests.nodes)


def test_what_no_test_reaches_counts_although_no_node_seems_to(tmp_path: Path):
    """A node may come to it in a way that cannot be seen; hiding code must not pay."""
    made = toy.make(tmp_path, {"test/test_it.py": dedent(TESTS["robot_controller"])}, {"pad.py": PAD})
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, seconds=20.0)
    assert (coverage(found, "pad.py").lines, coverage(found, "pad.py").lines_hit) == (180, 0)
    assert "padding" not in {flag.kind for flag in found.flags}


def test_without_a_module_of_the_contract_the_evidence_says_so(tmp_path: Path):
    made = toy.make(tmp_path, {})
    for root in (made.package, next(made.install.rglob("site-packages"))):
        for name in ("robot_controller", "sensor_processor"):
            path = root / f"ros2_robot_controller/{name}.py"
            path.rename(path.with_name(f"talk_{name[0]}.py"))
    (made.package / "scripts/robot_controller").unlink()
    assert not run_suite(made.package, made.install, [], COURSE).tests.of_contract
