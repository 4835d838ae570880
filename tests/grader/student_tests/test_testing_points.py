"""T1 to T3 of whole packages, built and graded: the reference, and the reference with other tests."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest
from submissions.edits import apply

from grader import KIT, building, pipeline
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import RequirementScore

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # runs of the tests with their mutants

ROOT = KIT
QUICK = ("test_conversions.py", "test_motion.py", "test_scans.py", "test_steering.py")
Grade = Callable[[Callable[[Path], object]], dict[str, RequirementScore]]


@pytest.fixture
def grade(tmp_path: Path) -> Grade:
    """Return a function that grades the reference, changed by a function, and gives T1, T2 and T3."""

    def grade(change: Callable[[Path], object]) -> dict[str, RequirementScore]:
        package = apply(None, tmp_path)
        change(package)
        settings = pipeline.Settings(
            rubric=rubric.load(ROOT / "rubric.yaml"), cache=building.cache_folder(), requirements=("T1", "T2", "T3")
        )
        grading: Grading = pipeline.grade(package, tmp_path / "out", settings)
        assert grading.scorecard.complete, words(grading.scorecard.requirements)
        return {score.requirement.id: score for score in grading.scorecard.requirements if score.results}

    return grade


def words(scores: object) -> str:
    return "\n".join(
        f"{result.id}: {result.seen}{result.because}"
        for score in (scores.values() if isinstance(scores, dict) else scores)  # type: ignore[attr-defined]
        for result in score.results
    )


def points(scores: dict[str, RequirementScore]) -> dict[str, float]:
    return {name: score.points for name, score in scores.items()}


def only(package: Path, files: dict[str, str], keep: tuple[str, ...] = ()) -> None:
    """Leave `keep` of the reference's tests and add these files."""
    for path in (package / "test").iterdir():
        if path.is_file() and path.name not in keep:
            path.unlink()
    for name, text in files.items():
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(dedent(text))


def test_the_reference_has_all_fifteen_points(grade: Grade):
    scores = grade(lambda _package: None)
    assert points(scores) == {"T1": 4, "T2": 5, "T3": 6}, words(scores)


def test_a_package_without_tests_has_none(grade: Grade):
    scores = grade(lambda package: shutil.rmtree(package / "test"))
    assert points(scores) == {"T1": 0, "T2": 0, "T3": 0}
    assert "found no tests in test/ or tests/" in words(scores)


def test_generated_stubs_do_not_count_as_tests(grade: Grade):
    stub = """
        from ament_flake8.main import main_with_errors
        import pytest


        @pytest.mark.flake8
        @pytest.mark.linter
        def test_flake8():
            rc, errors = main_with_errors(argv=[])
            assert rc == 0
    """
    scores = grade(lambda package: only(package, {"test/test_flake8.py": stub}))
    assert points(scores) == {"T1": 0, "T2": 0, "T3": 0}
    assert "only generated tests that call a linter and do not test the code: test/test_flake8.py" in words(scores)


def test_tests_that_assert_nothing_cover_and_notice_nothing(grade: Grade):
    silent = """
        import pytest
        from ros2_robot_controller import robot_controller, sensor_processor, speed_server
        from ros2_robot_controller.utils import conversions, motion


        def test_everything_runs():
            conversions.clamp(1.0, 0.0, 2.0)
            conversions.normalize_angle(7.0)
            motion.ramp(0.0, 1.0, 0.1)
            speed_server.speed_refusal(0.1, 0.5)
            sensor_processor.battery_percent(0.5, 100.0)
            robot_controller.RobotController
    """
    scores = grade(lambda package: only(package, {"test/test_all.py": silent}))
    assert points(scores)["T1"] == 0
    assert points(scores)["T3"] == 0
    assert "1 of 1 tests assert nothing: test/test_all.py test_everything_runs" in words(scores)


def test_tests_that_compare_the_source_get_no_points_for_noticing(grade: Grade):
    def change(package: Path) -> None:
        known = {path.name: path.read_text() for path in (package / "ros2_robot_controller/utils").glob("[!_]*.py")}
        text = f"""
            import pytest
            from ros2_robot_controller.utils import conversions, motion, scans

            KNOWN = {known!r}
            USE = {{
                conversions: lambda: (conversions.clamp(1.0, 0.0, 2.0), conversions.normalize_angle(7.0)),
                motion: lambda: (motion.ramp(0.0, 1.0, 0.1), motion.clearance(scans.Proximity(), 0.5)),
                scans: lambda: scans.Proximity(),
            }}


            @pytest.mark.parametrize('module', USE)
            def test_the_source_is_unchanged(module):
                USE[module]()
                assert open(module.__file__).read() == KNOWN[module.__name__.rpartition('.')[2] + '.py']
        """
        only(package, {"test/test_robot_controller_and_sensor_processor.py": text})

    scores = grade(change)
    assert points(scores)["T3"] == 0
    assert "failed each time a line was rewritten without changing what the package does" in words(scores)


def test_a_conftest_that_rewrites_reports_earns_neither_passing_nor_coverage(grade: Grade):
    tamper = """
        from _pytest.reports import TestReport

        make = TestReport.from_item_and_call.__func__


        def always(cls, item, call):
            call.excinfo = None
            return make(cls, item, call)


        TestReport.from_item_and_call = classmethod(always)
    """
    failing = """
        from ros2_robot_controller import sensor_processor, speed_server


        def test_both():
            refused = speed_server.speed_refusal(0.1, 0.5)
            assert refused == sensor_processor.battery_percent(0.5, 100.0)
    """
    scores = grade(lambda package: only(package, {"test/conftest.py": tamper, "test/test_both.py": failing}))
    assert points(scores) == {"T1": 0, "T2": 0, "T3": 0}, words(scores)  # they pass whatever raises
    assert "passes whatever the code does" in words(scores)


def test_entry_points_and_settings_of_the_submission_change_nothing(grade: Grade, tmp_path: Path):
    """A pytest11 plugin, a sitecustomize.py, pytest.ini, and a .coveragerc that omits everything."""

    def evil(package: Path) -> None:
        only(package, {
            "evil/evil.py": "def pytest_runtest_makereport(item, call):\n    raise SystemExit(0)\n",
            "evil/sitecustomize.py": "import os\n\nos._exit(0)\n",
            "evil/evil-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n",
            "evil/evil-1.0.dist-info/entry_points.txt": "[pytest11]\nevil = evil\n",
            ".coveragerc": "[run]\nomit = *\n",
            "pytest.ini": "[pytest]\naddopts = --collect-only\n",
            "test/pytest.ini": "[pytest]\naddopts = --collect-only\n",
        }, keep=QUICK)  # fmt: skip
        cmake = package / "CMakeLists.txt"
        install = "install(DIRECTORY evil/ DESTINATION ${PYTHON_INSTALL_DIR})\n\nament_package()"
        cmake.write_text(cmake.read_text().replace("ament_package()", install))

    scores = grade(evil)
    assert points(scores)["T1"] == 3, words(scores)  # the quick tests do not use the nodes
    assert points(scores)["T3"] > 0.5, words(scores)
    assert "% covered" in words(scores)
    assert scores["T2"].results[0].seen.split()[0] not in ("0.0", "100.0")
