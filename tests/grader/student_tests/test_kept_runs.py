"""After an edit of one test module only its runs are done again, with the same results as if all were."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from submissions import toy

from grader.evidence.kept import Kept
from grader.mutation.mutant_run import mutate
from grader.student_tests.discover import discover_tests
from grader.student_tests.kept_runs import KeptRuns
from grader.student_tests.module_request import ModuleRequest
from grader.student_tests.source import keep_runs
from grader.student_tests.suite_run import SuiteRun, run_suite
from grader.student_tests.warm_worker import WarmWorker

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
        return KeptRuns(Kept(tmp_path / "kept"), made.package, program, discover_tests(made.package), folder)

    return make


def suite(made: toy.Toy, runs: KeptRuns | None = None) -> SuiteRun:
    found = run_suite(made.package, made.install, discover_tests(made.package), kept_runs=runs)
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
        found = mutate(made.package, made.install, ran.reach, count=8, seconds=5.0, kept_runs=runs)
        runs.keep()
        return facts(ran), found.mutants, found.equivalent_mutants, found.quiet_seconds

    first = everything()
    handed_in.clear()
    assert everything() == first
    assert handed_in == []


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
        run_suite(made.package, made.install, discover_tests(made.package), kept_runs=runs)
        assert keep_runs(runs, "runs", flagged=flagged) == {}
        assert bool(make_runs().find(handed_in[0])) is not flagged


LINTER = "from ament_flake8.main import main\n\n\ndef test_flake8():\n    assert main(argv=[]) == 0\n"


@pytest.mark.parametrize(
    ("texts", "shared"),
    [
        ({}, False),
        ({"test/test_other.py": "import test_one\n\ndef test_it():\n    pass\n"}, True),
        ({"test/conftest.py": "from pathlib import Path\nTESTS = [*Path('test').glob('*')]\n"}, True),
        ({"test/conftest.py": "SPEEDS = globals()\n"}, False),
        ({"test/test_flake8.py": LINTER}, False),  # it is not run
    ],
    ids=["alone", "imported", "found in its folder", "a word that is like one", "beside a linter"],
)
def test_a_module_decides_the_runs_of_those_that_may_look_at_it(tmp_path: Path, texts: dict[str, str], shared: bool):
    files = {"test/test_one.py": "def test_it():\n    pass\n", "test/test_two.py": "def test_it():\n    pass\n"}
    made = toy.make(tmp_path, files | texts)

    def keys() -> list[str]:
        runs = KeptRuns(Kept(), made.package, "", discover_tests(made.package), tmp_path)
        return [runs._key(ModuleRequest(f"test/test_{name}.py")) for name in ("one", "two")]

    before = keys()
    edit(made, "test/test_one.py", "# edited\n")
    assert [old != new for old, new in zip(before, keys(), strict=True)] == [True, shared]
