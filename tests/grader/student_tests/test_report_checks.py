"""Probes are shared by the modules that agree with them, and convict nobody but the forger."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.student_tests import warm_worker
from grader.student_tests.discover import discover_tests
from grader.student_tests.suite_run import SuiteRun, run_suite
from grader.student_tests.warm_worker import ModuleRequest

pytestmark = [pytest.mark.sandbox, pytest.mark.slow]  # each runs the toy's tests and probes several times

STOPS = """
    from ros2_robot_controller import robot_controller

    def test_it_stops():
        assert robot_controller.stop_distance(0.5) == 0.0625
"""
DRIVES = """
    from ros2_robot_controller import robot_controller

    def test_it_takes_over_a_speed():
        assert robot_controller.RobotController().set_speed(0.1)
"""
SHOWS = """
    from ros2_robot_controller import sensor_processor

    def test_percent():
        assert sensor_processor.percent(0.5) == 50.0
"""
CLAIMS = """
    from ros2_robot_controller import sensor_processor

    def test_percent():
        import coverage
        running = coverage.Coverage.current()
        if running:
            path = sensor_processor.__file__
            running.get_data().add_arcs({path: [(a, b) for a in range(1, 30) for b in (a + 1, -a)]})
        assert sensor_processor.percent(0.5) == 50.0
"""
STOPS_ON_IMPORT = """
    from ros2_robot_controller import robot_controller

    FAR = robot_controller.stop_distance(0.5)

    def test_it_is_far():
        assert FAR == 0.0625
        assert robot_controller.RobotController().set_speed(0.1)
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function from test modules to what was found, and the modules of each probe."""

    def run(**modules: str) -> tuple[SuiteRun, list[list[str]]]:
        probes: list[list[str]] = []
        plain = warm_worker.WarmWorker.run

        def noted(self: warm_worker.WarmWorker, request: ModuleRequest):
            if request.coverage and request.select:
                probes.append(sorted(Path(name).stem for name in (request.module, *request.beside)))
            return plain(self, request)

        monkeypatch.setattr(warm_worker.WarmWorker, "run", noted)
        made = toy.make(tmp_path, {f"test/{name}.py": dedent(text) for name, text in modules.items()})
        return run_suite(
            made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, seconds=20.0
        ), probes

    return run


def test_modules_that_agree_with_the_probes_share_them(run):
    """Three modules and two probes, the two halves of what they call: not six runs."""
    found, probes = run(test_drives=DRIVES, test_shows=SHOWS, test_stops=STOPS)
    assert found.tests.doubts == []
    assert probes == [["test_drives", "test_shows", "test_stops"]] * 2


def test_a_claim_is_found_out_among_honest_modules_and_costs_these_nothing(run):
    found, probes = run(test_claims=CLAIMS, test_drives=DRIVES, test_stops=STOPS)
    [doubt] = found.tests.doubts
    assert doubt.startswith("test/test_claims.py: lines of ros2_robot_controller/sensor_processor.py were reported")
    assert ["test_claims"] in probes
    assert ["test_stops"] in probes


def test_a_function_that_another_module_calls_on_import_is_probed_alone(run):
    """Raising, it would keep the other module from running at all; not raising, it would be no probe."""
    found, probes = run(test_drives=DRIVES, test_on_import=STOPS_ON_IMPORT, test_stops=STOPS)
    assert found.tests.doubts == []
    assert ["test_drives", "test_on_import"] in probes
    assert ["test_stops"] in probes
    assert not any("test_stops" in probe and len(probe) > 1 for probe in probes)


def test_a_hanging_probe_is_no_verdict_on_the_other_modules(run):
    """With a broken `set_speed` one module waits forever; the claim of the other is found out all the same."""
    waits = """
        from ros2_robot_controller import robot_controller

        def test_it_waits():
            robot = robot_controller.RobotController()
            while robot.speed == 0.0:
                try:
                    assert robot.set_speed(0.1)
                except RuntimeError:
                    pass
    """
    found, _ = run(test_claims=CLAIMS, test_waits=waits)
    [doubt] = found.tests.doubts
    assert doubt.startswith("test/test_claims.py: lines of")
