"""Own tests run in the sandbox, and those that pass whatever the package does test nothing.

One toy package holds all the cases, each in a folder of its own with its own conftest.py, so one run serves all.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from helpers import beside
from helpers.course import COURSE
from submissions import toy

from grader import evidence
from grader.student_tests.discover import discover_tests
from grader.student_tests.source import SuiteRun, run_suite

TEXTS = beside(__file__)

pytestmark = [pytest.mark.sandbox]

CONTROLLER, PROCESSOR = (f"ros2_robot_controller/{node}.py" for node in ("robot_controller", "sensor_processor"))

FAILING = (
    "from ros2_robot_controller.robot_controller import stop_distance\n\n\n"
    "def test_it():\n    assert stop_distance(0.5) == 7.0\n"
)
CASES = TEXTS["CASES"] | dict.fromkeys((f"{name}/test_it.py" for name in ("hook", "swallows", "patches")), FAILING)
CASES |= {"honest/test_thorough.py": toy.THOROUGH, "pragmas/test_it.py": FAILING.replace("7.0", "0.0625")}
SETTINGS = {
    "pytest.ini": "[pytest]\naddopts = --ignore=test --collect-only -p evil\n",
    "tox.ini": "[pytest]\naddopts = -p evil\n",
    "setup.cfg": "[tool:pytest]\naddopts = --deselect test\n",
    ".coveragerc": "[run]\nomit = *\n",
    "pyproject.toml": "[tool.coverage.run]\nomit = ['*']\n",
}
EVIL = {
    "sitecustomize.py": "import sys\nsys.EVIL = True\n",
    "evil.py": "def pytest_runtest_makereport(item, call):\n    raise SystemExit(0)\n",
    "evil.pth": "import sys; sys.EVIL = True\n",
    "evil-1.0.dist-info/entry_points.txt": "[pytest11]\nevil = evil\n",
    "evil-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n",
}
PRAGMA = toy.PROCESSOR.replace(
    "def never_called(first, second):", "def never_called(first, second):  # pragma: no cover"
)


def run_all(folder: Path, cases: Mapping[str, str]) -> SuiteRun:
    files = {f"test/{name}": text for name, text in cases.items()} | SETTINGS
    files["test/evil/test_it.py"] = "import sys\n\n\ndef test_it():\n    assert not hasattr(sys, 'EVIL')\n"
    made = toy.make(folder, files, {"sensor_processor.py": PRAGMA})
    for name, text in EVIL.items():
        path = next((made.install / "lib").rglob("site-packages")) / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    return run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, seconds=5.0)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> SuiteRun:
    quick = {name: text for name, text in CASES.items() if not name.startswith(("honest/", "patches/"))}
    return run_all(tmp_path_factory.mktemp("toy"), quick)


@pytest.fixture
def module(ran: SuiteRun):
    return lambda case: next(m for m in ran.tests.modules if m.path.startswith(f"test/{case}/"))


@pytest.fixture(scope="module")
def probed(tmp_path_factory: pytest.TempPathFactory):
    kinds = {f"{name}/test_it.py": text for name, text in (TEXTS["NOTHING"] | TEXTS["REAL"]).items()}
    kinds |= {name: text for name, text in CASES.items() if name.startswith(("honest/", "patches", "hook", "swallows"))}
    run = run_all(tmp_path_factory.mktemp("toy"), kinds)
    return lambda case: next(m for m in run.tests.modules if m.path.startswith(f"test/{case}/"))


def counts(module: evidence.TestModule) -> tuple[int, int, int, int]:
    return module.passed, module.failed, module.errors, module.skipped


@pytest.mark.slow  # the reference's own tests, as in the whole grading
def test_honest_tests_are_counted_and_test_both_nodes(probed):
    honest = probed("honest")
    assert counts(honest) == (11, 0, 0, 0)
    assert (honest.tested, honest.idle) == ([CONTROLLER, PROCESSOR], [])


def test_fixtures_in_a_conftest_count(module):
    assert counts(module("honest_conftest")) == (2, 0, 0, 0)


def test_tests_that_share_a_fixture_are_interdependent(ran: SuiteRun):
    interdependent = {reach.module.split("/")[1] for reach in ran.reach if reach.interdependent}
    assert interdependent == {"honest_conftest"}


def test_each_outcome_is_counted(module):
    results = module("results")
    assert counts(results) == (1, 1, 1, 2)
    assert results.failures[0].startswith("test_fails: AssertionError: one and one")
    assert "no robot" in results.failures[1]


def test_the_reason_why_a_module_cannot_be_imported_is_reported(module):
    unreadable = module("unreadable")
    assert counts(unreadable) == (0, 0, 1, 0)
    assert "No module named 'robot_that_is_not_there'" in unreadable.failures[0]


def test_a_test_that_hangs_costs_only_itself(module):
    hangs = module("hangs")
    assert hangs.timed_out
    assert counts(hangs) == (2, 0, 1, 0)
    assert hangs.failures == ["test_waits: ran out of time"]


def test_a_test_that_ends_the_process_costs_only_itself(module, ran: SuiteRun):
    """A crash, a signal, an exit."""
    crashes = module("crashes")
    assert counts(crashes) == (2, 0, 3, 0)
    assert crashes.failures == [
        "test_crashes: ended the process that ran it, with status -11",
        "test_kills_itself: ended the process that ran it, with status -9",
        "test_exits: ended the process that ran it, with status 0",
    ]
    [reach] = [reach for reach in ran.reach if reach.module == "test/crashes/test_it.py"]
    assert {test for tests in reach.lines["ros2_robot_controller/robot_controller.py"].values() for test in tests} == {
        "", "test/crashes/test_it.py::test_first", "test/crashes/test_it.py::test_last"
    }  # fmt: skip


@pytest.mark.slow  # a suite for each kind
@pytest.mark.parametrize("case", [*TEXTS["NOTHING"], "patches", "hook", "swallows"])
def test_a_test_that_passes_whatever_the_package_does_tests_nothing(probed, case: str):
    """Three of four points for imports and mocks, and all four for tests that cannot fail or forge their reports."""
    assert (probed(case).passed, probed(case).tested, probed(case).starts) == (1, [], [])
    assert probed(case).idle == (["test_it"] if case in ("excepts", "patches", "hook", "swallows") else [])


@pytest.mark.slow  # a suite for each kind
@pytest.mark.parametrize("case", TEXTS["REAL"])
def test_a_test_that_fails_where_every_function_raises_tests_what_it_runs(probed, case: str):
    assert probed(case).tested == [CONTROLLER] + [PROCESSOR] * (case == "program")
    assert probed(case).starts == ["robot_controller"] * (case == "program")


def test_the_packages_settings_of_pytest_and_coverage_do_not_count(ran: SuiteRun):
    """The package has pytest.ini, tox.ini, setup.cfg, .coveragerc, pyproject.toml and `# pragma: no cover`."""
    files = {file.path: file for file in ran.tests.coverage}
    processor = files["ros2_robot_controller/sensor_processor.py"]
    assert files["ros2_robot_controller/robot_controller.py"].lines_hit >= 15
    assert processor.lines == 9, "without the pragma's function it would be 5"


def test_nothing_of_the_install_tree_is_loaded_before_pytest(module):
    """The install tree has a sitecustomize.py, a .pth file and a pytest11 entry point."""
    assert counts(module("evil")) == (1, 0, 0, 0)


def test_without_tests_nothing_runs(tmp_path):
    made = toy.make(tmp_path, {})
    assert run_suite(made.package, made.install, [], COURSE) == SuiteRun(evidence.StudentTests())
