"""Tests that cannot fail, only import, or put a mock in the node's place count for no node; real ones with mocks do."""

from __future__ import annotations

from textwrap import dedent

import pytest
from helpers.course import COURSE
from submissions import toy

from grader import evidence
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import run_suite

pytestmark = [pytest.mark.sandbox]

# Importing it calls a function, so that a line in a function's body is reached.
CONTROLLER = toy.CONTROLLER + "\n\ndef limits():\n    top = TOP_SPEED\n    return -top, top\n\n\nLIMITS = limits()\n"
NOTHING = {
    "imports": """
        from ros2_robot_controller import robot_controller

        def test_it():
            assert robot_controller.RobotController is not None
    """,
    "imports_late": """
        def test_it():
            from ros2_robot_controller.robot_controller import RobotController
            assert RobotController
    """,
    "mocks": """
        from unittest.mock import MagicMock
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            robot = MagicMock(spec=RobotController)
            robot.set_speed.return_value = True
            assert robot.set_speed(0.3)
    """,
    "sleeps": """
        import time
        from ros2_robot_controller import robot_controller

        def test_it():
            began = time.monotonic()
            time.sleep(0.01)
            assert time.monotonic() > began
    """,
    "swallows": """
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            try:
                ok = RobotController().set_speed(0.3)
            except Exception:
                ok = True
            assert ok
    """,
    "or_true": """
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            assert RobotController().set_speed(7.0) or 1 > 0

        def test_another():
            robot = RobotController()
            assert (robot.set_speed(7.0), "a pair")
            if False:
                assert robot.speed == 7.0
    """,
}
REAL = {
    "collaborators": """
        from unittest.mock import MagicMock
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            robot = RobotController()
            robot.publish = MagicMock()
            robot.on_scan(0.1)
            robot.publish.assert_called_once_with(0.0)
    """,
    "new": """
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            robot = RobotController.__new__(RobotController)
            assert robot.set_speed(0.3)
    """,
    "shared_fixture": """
        import pytest
        from ros2_robot_controller.robot_controller import RobotController

        @pytest.fixture(scope="module")
        def robot():
            return RobotController()

        def test_it(robot):
            assert robot.speed == 0.0
    """,
    "expects_an_error": """
        import pytest
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            with pytest.raises(TypeError):
                RobotController().set_speed("fast")
    """,
    "nothing_happens": """
        from ros2_robot_controller.robot_controller import RobotController

        def test_it():
            robot = RobotController()
            robot.set_speed(7.0)
            assert robot.published == []
    """,
}


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> dict[str, evidence.TestModule]:
    files = {f"test/{name}/test_it.py": dedent(text) for name, text in (NOTHING | REAL).items()}
    made = toy.make(tmp_path_factory.mktemp("toy"), files, {"robot_controller.py": CONTROLLER})
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE).tests.modules
    assert [module.failures for module in found] == [[]] * len(files)
    return {module.path.split("/")[1]: module for module in found}


@pytest.mark.slow  # a suite for each kind
@pytest.mark.parametrize("name", NOTHING)
def test_a_test_of_nothing_counts_for_no_node(modules: dict[str, evidence.TestModule], name: str):
    """Three of four points for imports and mocks, and all four for tests that cannot fail."""
    module = modules[name]
    assert module.subjects == []
    assert not (module.reaches and module.asserting)


@pytest.mark.slow  # the toy's tests and probes
@pytest.mark.parametrize("name", REAL)
def test_a_test_that_runs_the_nodes_own_code_counts(modules: dict[str, evidence.TestModule], name: str):
    module = modules[name]
    assert (module.subjects, module.asserting, module.reaches) == (["robot_controller"], 1, True)
