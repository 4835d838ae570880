"""After an edit of one test module only its runs are done again, with the same results as if all were."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from textwrap import dedent

import pytest
from helpers.course import COURSE
from submissions import toy

from grader.evidence.kept import Kept
from grader.mutation.mutant_run import mutate
from grader.student_tests.discover import discover_tests
from grader.student_tests.kept_runs import KeptRuns
from grader.student_tests.module_request import ModuleRequest
from grader.student_tests.source import keep_runs
from grader.student_tests.suite_run import SuiteRun, run_suite
from grader.student_tests.warm_worker import WarmWorker, start_workers

pytestmark = pytest.mark.slow  # each runs the toy's tests several times

SLOWLY = """
from ros2_robot_controller.robot_controller import RobotController


def test_a_valid_speed_is_set():
    assert RobotController().set_speed(0.25)
"""
FILES = {"test/test_thorough.py": toy.THOROUGH, "test/test_slowly.py": SLOWLY, "test/conftest.py": ""}


@pytest.fixture
def made(tmp_path: Path) -> toy.Toy:
    return toy.make(tmp_path / "toy", FILES)


@pytest.fixture
def handed_in(monkeypatch: pytest.MonkeyPatch) -> list[ModuleRequest]:
    """What workers were asked to run."""
    found: list[ModuleRequest] = []
    usual = WarmWorker._hand_in

    def hand_in(worker: WarmWorker, number: int, request: ModuleRequest) -> None:
        found.append(request)
        usual(worker, number, request)

    monkeypatch.setattr(WarmWorker, "_hand_in", hand_in)
    return found


@pytest.fixture
def make_runs(made: toy.Toy, tmp_path: Path) -> Callable[..., KeptRuns]:
    """Return a function that makes the KeptRuns of another check of the toy package."""

    def make(program: str = "program") -> KeptRuns:
        folder = tmp_path / f"check-{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        return KeptRuns(Kept(tmp_path / "kept"), made.package, program, folder)

    return make


def suite(made: toy.Toy, runs: KeptRuns | None = None) -> SuiteRun:
    found = run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, kept_runs=runs)
    assert not found.flags
    if runs:
        runs.keep()
    return found


def facts(ran: SuiteRun) -> object:
    modules = [(m.path, m.passed, m.failed, m.errors, m.subjects, m.reaches) for m in ran.tests.modules]
    return modules, ran.tests.coverage, [reach.lines for reach in ran.reach], ran.tests.doubts


def edit(made: toy.Toy, path: str, text: str) -> None:
    with (made.package / path).open("a") as file:
        file.write(text)


@pytest.mark.sandbox
def test_after_an_edit_only_the_runs_that_it_can_change_are_new(made, make_runs, handed_in):
    suite(made, make_runs())
    edit(made, "test/test_slowly.py", "    assert not RobotController().set_speed(7.0)\n")
    handed_in.clear()
    runs = make_runs()
    partly = suite(made, runs)
    assert handed_in
    assert all("test/test_slowly.py" in (request.module, *request.beside) for request in handed_in)
    assert runs.found == runs.asked - len(handed_in) > 0
    assert runs.since
    assert facts(partly) == facts(suite(made))


@pytest.mark.sandbox
def test_unchanged_runs_and_mutants_come_out_the_same(made, make_runs, handed_in):
    def everything() -> object:
        runs = make_runs()
        ran = suite(made, runs)
        found = mutate(made.package, made.install, ran.reach, COURSE, count=8, seconds=5.0, kept_runs=runs)
        runs.keep()
        return facts(ran), found.mutants, found.equivalent_mutants

    first = everything()
    asked = list(handed_in)
    handed_in.clear()
    assert everything() == first
    assert len(asked) > 10
    assert all(asked.count(request) > 1 for request in handed_in)  # to see whether it is steady


@pytest.mark.sandbox
@pytest.mark.parametrize("what", ["conftest", "program"])
def test_what_all_tests_depend_on_makes_all_runs_new(made, make_runs, handed_in, what: str):
    suite(made, make_runs())
    before = len(handed_in)
    if what == "conftest":
        edit(made, "test/conftest.py", "# edited\n")
    runs = make_runs("another" if what == "program" else "program")
    suite(made, runs)
    assert (runs.found, len(handed_in)) == (0, 2 * before)


@pytest.mark.sandbox
def test_a_module_whose_tests_failed_is_measured_again(made, make_runs, handed_in):
    """Perhaps it was chance. Other modules are not."""
    edit(made, "test/test_slowly.py", "    assert False\n")
    suite(made, make_runs())
    handed_in.clear()
    suite(made, make_runs())
    measured = [request.module for request in handed_in if not request.select]
    assert set(measured) == {"test/test_slowly.py"}


@pytest.mark.sandbox
def test_the_same_request_twice_in_one_check_is_two_runs(made, make_runs, handed_in):
    """A second run shows whether a result is steady."""
    suite(made, make_runs())
    runs = make_runs()
    assert runs.find(handed_in[0])
    assert runs.find(handed_in[0]) is None


@pytest.mark.sandbox
def test_runs_are_not_kept_if_something_was_flagged(made, make_runs, handed_in):
    for flagged in (True, False):
        runs = make_runs()
        run_suite(made.package, made.install, discover_tests(made.package, COURSE.nodes), COURSE, kept_runs=runs)
        assert keep_runs(runs, "runs", flagged=flagged) == {}
        assert bool(make_runs().find(handed_in[0])) is not flagged


LOOKING = {
    "imports": "from test_slowly import test_a_valid_speed_is_set as copied\n\n\ndef test_it():\n    copied()\n",
    # By no word that names the other module, nor any function that lists files.
    "reads": """
        from pathlib import Path

        SLOWLY = Path(__file__).with_name("_".join(["test", "slowly"]) + ".py")

        def test_it():
            assert SLOWLY.open().read()
    """,
    "starts": """
        import os

        def test_it():
            assert os.system("cat test/*.py") == 0
    """,
}


@pytest.mark.sandbox
def test_a_run_is_new_when_a_module_has_changed_that_it_opened(made, make_runs, handed_in):
    """A regular expression over its text decided that, and a test that read a file in another way had an old result."""
    for name, text in LOOKING.items():
        (made.package / f"test/test_{name}.py").write_text(dedent(text))
    runs = make_runs()
    requests = [ModuleRequest(f"test/test_{name}.py") for name in (*LOOKING, "thorough", "slowly")]
    with start_workers(made.package, made.install, 1, seconds=120.0, kept_runs=runs) as worker:
        assert all(test.outcome == "passed" for request in requests for test in worker.run(request).tests)
    runs.keep()
    edit(made, "test/test_slowly.py", "# edited\n")
    runs = make_runs()
    assert [request.module for request in requests if runs.find(request)] == ["test/test_thorough.py"]
