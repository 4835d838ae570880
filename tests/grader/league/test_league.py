"""A league of trials: what is handed in, on which packages it is run, what it is worth, and what a student reads of it.

The course is the small one beside the kit's own, with promises, and a pool of two edits and a whole package.
"""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest
from helpers import beside
from helpers.archives import write
from helpers.hunting import FakeObservers
from helpers.judging import Judged, ask, evidence_with, find, trial

from grader import KIT, cli, evidence
from grader.authoring import check_course
from grader.authoring.release import TOP
from grader.course import Course, load
from grader.course.reader import VARIABLE
from grader.evidence import Kind, League, LeagueCase, Reason, Touch, Trial
from grader.league import cases as league_cases
from grader.league import pool
from grader.league.cases import CaseRun
from grader.scoring import rubric
from grader.trials.case import Case
from grader.trials.observers import Observers

TEXTS = beside(__file__)
TEMPLATE = KIT / "grader" / "authoring" / "template_course"
GOOD: dict[str, str] = TEXTS["GOOD"]
SECRETS = ("secret_behind", "secret_recall", "secret_team", "looks behind", "math.pi - SECTOR")


@pytest.fixture(scope="module")
def course(tmp_path_factory: pytest.TempPathFactory) -> Course:
    folder = tmp_path_factory.mktemp("course") / "hall_guard"
    shutil.copytree(TEMPLATE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    whole = folder / "rubric.yaml"
    figures = "league:\n- {figure: caught, unit: packages, best: most}\n"
    whole.write_text(whole.read_text().replace("\ncriteria:\n", f"\n{figures}\ncriteria:\n") + TEXTS["ENTRY"])
    edits = {f"held_back/league/{name}": text for name, text in TEXTS["EDITS"].items()}
    write(folder, {"hunts/guard.py": TEXTS["HUNTS"], **edits})
    # One that no case catches: it keeps every promise.
    shutil.copytree(folder / "solution" / "hall_guard", folder / "held_back/league/broken/secret_team")
    return load(folder)


# -- what is handed in -------------------------------------------------------------------------------------------------


def problem(folder: Path, course: Course, text: str) -> str:
    ((said, case),) = league_cases.read(write(folder, {"cases/mine.yaml": text}), course)
    assert (case is None) == bool(said.problem)
    return said.problem


WAIT = "node: guard\nsteps:\n- wait: 1.0\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WAIT, ""),
        (WAIT.replace("wait", "wiat"), "cases/mine.yaml, line 3: wiat is not allowed here. Did you mean wait?"),
        (WAIT + "- [", "cases/mine.yaml, line 4: expected the node content"),
        ("", "cases/mine.yaml, line 1: 'node' is missing"),
        (WAIT + "# " + 10_000 * "x", "cases/mine.yaml is not a file of at most 10000 bytes."),
        (WAIT + 30 * "- wait: 1.0\n", "has 31 steps and takes 31 s of simulated time; at most 100 and 30 s count."),
        (WAIT + 100 * "- cancel: null\n", "has 101 steps"),
        (WAIT + "- arrive: 29.5\n", "takes 30.5 s"),
        (TEXTS["BOMB"], "cases/mine.yaml, line 3: write the value out"),
        (WAIT + "- cancel: " + 50 * "[" + 50 * "]", "line 4: write the value out"),
        (WAIT + "- cancel: " + 4000 * "[", "line 4: write the value out"),
        (WAIT + "- cancel: !!python/name:os.system x", "line 4: write the value out"),
        (WAIT + '- cancel: "\\0"', "line 4: write the value out"),
        (WAIT + "- cancel: 2026-11-29", "cannot be read"),
        (WAIT + "- cancel: 2026-13-45", "cannot be read"),
        (WAIT + f"seed: {4500 * '9'}", f"line 4: {30 * '9'} is out of range here"),
        (WAIT + "heading: 1.0e+300", "line 4: 1.0e+300 is out of range here"),
        ("\x00", "is not YAML"),
        (WAIT + "parameters:\n", ""),
    ],
)  # fmt: skip
def test_each_mistake_in_a_case_is_named_with_its_line(tmp_path: Path, course: Course, text: str, said: str):
    found = problem(tmp_path, course, text)
    assert said in found
    assert str(tmp_path) not in found
    assert bool(said) == bool(found)


def test_a_link_or_a_folder_is_no_case(tmp_path: Path, course: Course):
    (tmp_path / "cases" / "folder.yaml").mkdir(parents=True)
    (tmp_path / "cases" / "link.yaml").symlink_to(write(tmp_path, {"elsewhere": WAIT}) / "elsewhere")
    assert [case for _, case in league_cases.read(tmp_path, course)] == [None, None]


def test_only_the_first_five_files_count(tmp_path: Path, course: Course):
    read = league_cases.read(write(tmp_path, {f"cases/{name}.yaml": WAIT for name in "abcdef"}), course)
    assert [bool(case) for _, case in read] == [True] * 5 + [False]
    assert read[5][0].problem == "cases/f.yaml does not count: at most 5 files do."


# -- the pool ----------------------------------------------------------------------------------------------------------


def test_the_pool_is_made_of_edits_of_the_solution_and_of_packages(course: Course):
    found = [(package.name, package.broken) for package in pool.read(course)]
    right = [("", False), ("counts_again.yaml", False)]
    assert found == [*right, ("secret_behind.yaml", True), ("secret_recall.yaml", True), ("secret_team", True)]
    assert len({package.content for package in pool.read(course)}) == 5
    assert check_course.mistakes(course.folder) == []


def test_an_edit_that_does_not_fit_is_named_by_check_course(course: Course, tmp_path: Path):
    folder = tmp_path / "hall_guard"
    shutil.copytree(course.folder, folder, ignore=shutil.ignore_patterns("__pycache__"))
    bad = "file: hall_guard/guard.py\nold: there is no such line\nnew: x\n"
    write(folder, {"held_back/league/broken/secret_behind.yaml": bad})
    (mistake,) = check_course.mistakes(folder)
    assert mistake == (
        "held_back/league/broken/secret_behind.yaml, line 2: `old` occurs 0 times in hall_guard/guard.py of the "
        "solution, not once"
    )
    shutil.rmtree(folder / "held_back" / "league" / "broken")
    (mistake,) = check_course.mistakes(folder)
    assert mistake == "rubric.yaml: a league needs broken packages to catch, in held_back/league/broken"


def test_students_get_the_requirement_without_checks_or_pool(
    course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(VARIABLE, "")
    assert cli.main(["release", "--course", str(course.folder), "--out", str(tmp_path / "kit.zip")]) == 0
    with zipfile.ZipFile(tmp_path / "kit.zip") as kit:
        texts = b"".join(kit.read(name) for name in kit.namelist()).decode(errors="replace")
        (tmp_path / "rubric.yaml").write_bytes(kit.read(f"{TOP}/hall_guard/rubric.yaml"))
    asked = rubric.load(tmp_path / "rubric.yaml").requirement("L1")
    assert (asked.points, asked.checks, asked.waits) == (8, (), "judged at hand-in")
    assert not [secret for secret in SECRETS if secret in texts]


# -- a case on a package -----------------------------------------------------------------------------------------------


def ran(course: Course, make: Callable[[Case], Trial]) -> tuple[CaseRun, int]:
    observers = FakeObservers(make)
    case = Case.of({"node": "guard", "steps": [{"wait": 1.0}]})
    return league_cases.run_case(case, "case", cast(Observers, observers), course), len(observers.ran)


def guarding(**facts: Any) -> Trial:
    return trial("case", "guard", **facts)


TOUCHED = guarding(touches=[Touch(2.0, "pole", 0.25)])


def test_a_promise_that_is_broken_twice_is_broken(course: Course):
    assert ran(course, lambda _: guarding()) == (CaseRun(), 1)
    assert ran(course, lambda _: TOUCHED) == (CaseRun("It touches nothing. (B3) touched pole at 2.00 s"), 2)


def test_a_promise_that_is_broken_only_once_is_not(course: Course):
    trials = iter([TOUCHED, guarding()])
    assert ran(course, lambda _: next(trials)) == (CaseRun(), 2)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (
            guarding(script_error="Traceback\nValueError: a radius of -1"),
            "it cannot be run: ValueError: a radius of -1",
        ),
        (guarding(ended=Reason(Kind.OBSERVER_CRASHED)), "it cannot be run: "),
        (guarding(touches=[None]), "it cannot be judged: AttributeError: "),
    ],
)
def test_what_cannot_be_run_or_judged_is_a_problem_and_no_crash(course: Course, made: Trial, said: str):
    assert ran(course, lambda _: made)[0].problem.startswith(said)


# -- what it is worth --------------------------------------------------------------------------------------------------

CAUGHT, ALONE = "check_league::test_broken_packages_are_caught", "check_league::test_right_packages_are_left_alone"


def judged(check: str, *cases: LeagueCase) -> Judged:
    return ask(find(check), evidence_with(league=League([*cases], 3)))


ONE = LeagueCase("cases/a.yaml", caught=["secret_recall"])
TWO = LeagueCase("cases/b.yaml", caught=["secret_behind", "secret_recall"])
UNFAIR = LeagueCase("cases/c.yaml", unfair="It touches nothing. (B3) touched cart", caught=["secret_team"])
BROKEN = LeagueCase("cases/d.yaml", problem="cases/d.yaml, line 3: wiat is not allowed here.")


def test_each_package_that_is_caught_counts_once():
    found = judged(CAUGHT, ONE, TWO)
    assert found.share == pytest.approx(2 / 3)
    assert found.seen == "2 of 3 broken packages caught\ncases/a.yaml catches 1\ncases/b.yaml catches 2"
    assert judged(CAUGHT, ONE, TWO, replace(UNFAIR, unfair="")).share == 1.0


def test_what_an_unfair_case_catches_does_not_count_and_it_is_said_why():
    found = judged(CAUGHT, ONE, UNFAIR, BROKEN)
    assert found.share == pytest.approx(1 / 3)
    assert (
        "cases/c.yaml does not count: a right package breaks a promise in it. It touches nothing. (B3) touched cart"
        in found.seen
    )
    assert BROKEN.problem in found.seen


def test_fairness_is_worth_something_where_something_is_caught():
    assert judged(ALONE, ONE, TWO).share == 1.0
    assert judged(ALONE, ONE, UNFAIR).share == 0.5
    found = judged(ALONE, LeagueCase("cases/a.yaml"))
    assert not found.reached
    assert "no case catches a broken package" in found.seen


@pytest.mark.parametrize("check", [CAUGHT, ALONE])
def test_who_hands_in_nothing_gets_nothing(check: str):
    found = judged(check)
    assert (found.share, found.seen) == (0.0, "no case is handed in: there is no file cases/*.yaml")


def test_no_name_of_the_pool_is_in_what_is_said():
    said = [judged(check, ONE, TWO, UNFAIR, BROKEN).seen for check in (CAUGHT, ALONE)]
    assert not [secret for secret in SECRETS if secret in str(said)]


# -- graded ------------------------------------------------------------------------------------------------------------


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # builds five packages, and runs three cases on each
def test_two_of_three_are_caught_by_a_submission_that_does_not_build(
    course: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    monkeypatch.setenv(VARIABLE, "")
    package = tmp_path / "hall_guard"
    shutil.copytree(course.solution, package)
    (package / "setup.py").write_text("raise SystemExit('no')\n")
    cases = GOOD | {"cases/c_cart.yaml": TEXTS["UNFAIR"], "cases/d_slip.yaml": WAIT.replace("wait", "wiat")}
    command = ["grade", str(write(package, cases)), "--course", str(course.folder), "--out", str(tmp_path / "out")]
    assert cli.main(command) == 0
    said = json.loads((tmp_path / "out" / "report.json").read_text())
    (league,) = [each for each in said["requirements"] if each["id"] == "L1"]
    assert league["points"] == pytest.approx(6 * 2 / 3 + 2 * 2 / 4)
    assert league["checks"][0]["figures"] == {"caught": 2}
    assert league["checks"][0]["seen"].splitlines() == [
        "2 of 3 broken packages caught",
        "cases/a_recall.yaml catches 1",
        "cases/b_pole.yaml catches 1",
        league["checks"][0]["seen"].splitlines()[3],
        "cases/d_slip.yaml, line 3: wiat is not allowed here. Did you mean wait? There are: "
        + league["checks"][0]["seen"].partition("There are: ")[2],
    ]
    assert (
        "cases/c_cart.yaml does not count: a right package breaks a promise in it. It touches nothing"
        in (league["checks"][0]["seen"])
    )
    theirs = "".join(path.read_text() for path in (tmp_path / "out" / "for_student").iterdir())
    assert "2 of 3 broken packages caught" in theirs
    printed = "".join(capfd.readouterr())
    assert not [secret for secret in SECRETS if secret in theirs + printed]
    found = evidence.load(tmp_path / "out" / "evidence").league
    assert found is not None
    assert [case.caught for case in found.cases[:2]] == [["secret_recall.yaml"], ["secret_behind.yaml"]]
