"""`grader check-course`: each mistake in a course is named with its file, its line and the nearest name."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from helpers import judging
from helpers.course import COURSE

from grader import KIT, building, cli
from grader.authoring import check_course, course_trials
from grader.course import load
from grader.intake.package_edits import replace
from grader.scoring.scorecard import CheckResult, Outcome, score
from grader.settings import Settings

GOOD = KIT / "grader" / "authoring" / "template_course"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOOD, tmp_path / "course"))


def edit(folder: Path, file: str, old: str, new: str) -> None:
    replace(file, old, new)(folder)


@pytest.mark.parametrize("course", [GOOD, COURSE.folder], ids=lambda path: path.name)
def test_the_courses_that_the_kit_has_are_in_order(course: Path):
    assert check_course.mistakes(course) == []


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        # unknown keys
        ("course.yaml", "title:", "titel:", "course.yaml, line N: titel is not allowed here. Did you mean title?"),
        ("contract/contract.yaml", "answers_every:", "answer_every:", "line N: answer_every is not allowed here. Did you mean answers_every?"),
        ("rubric.yaml", "title: Stands at first", "titel: Stands at first", "rubric.yaml, line N: titel is not allowed here. Did you mean title?"),
        ("notebooks.yaml", "exercises:", "excercises:", "notebooks.yaml, line N: excercises is not allowed here. Did you mean exercises?"),
        ("worlds/hall.yaml", "walls:", "wals:", "worlds/hall.yaml: wals: unknown key. Fix: write 'walls'"),
        ("trials/patrol.py", '["B3"], world=', '["B3"], wrld=', "trials/patrol.py, line N: TypeError: wrld is not an option of @trial. Did you mean world?"),
        # ids and points
        ("rubric.yaml", "id: B2", "id: B1", "rubric.yaml, line N: B1 is listed twice, first in line"),
        ("rubric.yaml", "title: Stops at the end", "points: 20", "rubric.yaml, line N: B3 has 20 points, its checks 15"),
        ("rubric.yaml", "_wall::test_stops_before_the_wall", "_wall::test_stops_at_the_wall", "rubric.yaml, line N: check_wall::test_stops_at_the_wall is not a check of the kit. Did you mean check_wall::test_stops_before_the_wall?"),
        ("rubric.yaml", "#The end of the hall", "#The end of a hall", "rubric.yaml, line N: no notebook in notebooks has the section of B3, 01_guard#The end of a hall"),
        # checks
        ("checks/check_patrol.py", "def test_drives_on_patrol", "def test_never_asked_for():\n    pass\n\n\ndef test_drives_on_patrol", "checks/check_patrol.py, line N: no requirement has the check check_patrol::test_never_asked_for; add"),
        ("checks/check_wall.py", '    """The guard stands still', '    _ = """The guard stands still', "checks/check_wall.py, line M: check_wall::test_stops_before_the_wall has no docstring, the sentence that students read"),
        ("checks/check_wall.py", '"to_the_end"', '"to_the_ende"', "checks/check_wall.py, line N: to_the_ende is not a trial. Did you mean to_the_end?"),
        ("checks/check_wall.py", '"to_the_end"', '"on_and_off"', "checks/check_wall.py, line N: check_wall::test_stops_before_the_wall is of B3, which the trial on_and_off does not serve"),
        ("checks/check_wall.py", "def test_stops", "def test-stops", "checks/check_wall.py, line N: SyntaxError: expected '('"),
        ("checks/check_wall.py", "import Judge, NotReached", "import Juge, NotReached", "checks/check_wall.py, line N: ImportError: cannot import name 'Juge' from 'grader.checks.judge'"),
        ("checks/check_wall.py", '(trial, "patrol", 0)', '(trial, "patrl", 0)', "checks/check_wall.py, line N: patrl is not a service of the contract. Did you mean patrol?"),
        # trials and worlds
        ("trials/patrol.py", '["B3"]', '["B3", "B33"]', "trials/patrol.py, line N: the trial to_the_end: B33 is not a requirement of the rubric. Did you mean B3?"),
        ("trials/patrol.py", '@trial(serves=["B3"], world="hall")', '@trial(world="hall")', "trials/patrol.py, line N: the trial to_the_end serves no requirement; name those whose checks read it"),
        ("trials/patrol.py", '["B3"], world="hall"', '["B3"], world="hal"', "trials/patrol.py, line N: the trial to_the_end: hal is not a world. Did you mean hall?"),
        ("trials/patrol.py", '["B3"], world="hall"', '["B3"], node="gard"', "the contract has no node gard"),
        ("trials/patrol.py", "from grader.trials.catalog", "from grader.trials.catalogue", "trials/patrol.py, line N: ModuleNotFoundError: No module named 'grader.trials.catalogue'"),
        ("trials/patrol.py", '"patrol", data=False', '"petrol", data=False', "trials/patrol.py, line N: petrol is not a service of the contract. Did you mean patrol?"),
        ("worlds/hall.yaml", "[3.0, -2.0], end: [3.0, 2.0]", "[3.0, -2.0], end: [3.0, -2.0]", "worlds/hall.yaml: walls[0].end: the wall starts and ends at [3.0, -2.0]"),
        # known-bad edits
        ("known_bad/ignores_its_speed.yaml", "self._publish(self.", "self._publish(2 * self.", "known_bad/ignores_its_speed.yaml, line N: `old` occurs 0 times in hall_guard/guard.py of the solution, not once; its nearest line, 85, is: self._publish("),
        ("known_bad/hits_the_wall.yaml", "{B3: 15}", "{B3: 16}", "known_bad/hits_the_wall.yaml, line N: B3 has 15 points; 16 is outside 0 to 15"),
        ("known_bad/hits_the_wall.yaml", "{B3: 15}", "{P8: 15}", "known_bad/hits_the_wall.yaml, line N: P8 is not a requirement of the rubric. Did you mean P"),
        ("known_bad/hits_the_wall.yaml", "hall_guard/guard.py", "hall_guard/gard.py", "known_bad/hits_the_wall.yaml, line N: hall_guard/gard.py is not a file of the solution. Did you mean hall_guard/guard.py?"),
        # hunts
        ("rubric.yaml", "title: Stops at the end", "hunt: {cases: 9, points: 1}\n        title: Stops at the end", "rubric.yaml, line M: B3 is not what a module of hunts/ makes up cases for"),
        # what is missing
        ("course.yaml", "solution/hall_guard", "solution/guard_hall", "course.yaml, line N: there is no package in solution/guard_hall"),
        ("contract/contract.yaml", "  - README.md", "  - launch/hall_launch.py", "contract/contract.yaml, line N: the solution has no launch/hall_launch.py"),
        ("handout.md.j2", "{% for requirement in", "{% foor requirement in", "handout.md.j2, line N: Encountered unknown tag 'foor'"),
        ("handout.md.j2", "{{ rubric.title }}", "{{ rubrik.title }}", "handout.md.j2, line N: UndefinedError: 'rubrik' is undefined"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_place(folder: Path, file: str, old: str, new: str, said: str):
    line = (folder / file).read_text().partition(old)[0].count("\n") + 1
    edit(folder, file, old, new)
    found = check_course.mistakes(folder)
    said = said.replace("line N", f"line {line}").replace("line M", f"line {line - 1}")
    assert any(said in each for each in found), found
    assert len(found) <= 4  # others name what cannot be read, or an id that is not there


def test_mistakes_in_several_files_are_named_at_once(folder: Path, capsys: pytest.CaptureFixture[str]):
    edit(folder, "worlds/hall.yaml", "walls:", "wals:")
    edit(folder, "known_bad/hits_the_wall.yaml", "{B3: 15}", "{B4: 15}")
    edit(folder, "known_bad/begins_on_patrol.yaml", "loses", "looses")
    edit(folder, "trials/patrol.py", '["B3"]', '["B33"]')
    (folder / "handout.md.j2").unlink()
    assert cli.main(["check-course", "--static", str(folder)]) == 1
    said = capsys.readouterr().out.splitlines()
    assert len(said) == 7  # the check of B3 now reads a trial that does not serve B3
    assert said[-1] == f"{folder}: 6 mistakes with its files"
    assert cli.main(["check-course", str(folder)]) == 1
    assert capsys.readouterr().out.splitlines()[-2:] == [
        "note: nothing was graded yet; that comes when the files are in order", f"{folder}: 6 mistakes",
    ]  # fmt: skip


def test_what_cannot_be_read_hides_no_mistake_in_other_files(folder: Path):
    """A rubric that did not load hid all mistakes about its ids, and a module that did not load those of the others."""
    edit(folder, "rubric.yaml", "title: Stands at first", "titel: Stands at first")
    edit(folder, "rubric.yaml", "title: Stops at the end", "titel: Stops at the end")
    edit(folder, "trials/patrol.py", "from grader.trials.catalog", "from grader.trials.catalogue")
    (folder / "trials" / "more.py").write_text("def more(:\n")
    edit(folder, "checks/check_wall.py", "def test_stops", "def test-stops")
    edit(folder, "checks/check_patrol.py", "import Judge", "import Juge")
    edit(folder, "known_bad/hits_the_wall.yaml", "{B3: 15}", "{B33: 15, P9: 1}")
    edit(folder, "known_bad/hits_the_wall.yaml", "hall_guard/guard.py", "hall_guard/gard.py")
    edit(folder, "notebooks.yaml", "hall_guard/__init__.py", "hall_guard/init.py")
    (folder / "solution" / "hall_guard" / "package.xml").rename(folder / "solution" / "hall_guard" / "package.xml.old")
    found = "\n".join(check_course.mistakes(folder))
    for said in (
        "line 19: titel", "line 33: titel", "named 'grader.trials.catalogue'", "trials/more.py, line 1: SyntaxError",
        "check_wall.py, line 10: SyntaxError", "cannot import name 'Juge'", "there is no package in",
    ):  # fmt: skip
        assert said in found, found
    (folder / "solution" / "hall_guard" / "package.xml.old").rename(folder / "solution" / "hall_guard" / "package.xml")
    found = "\n".join(check_course.mistakes(folder))
    for said in (
        "B33 is not", "P9 is not", "hall_guard/gard.py is not", "the solution has no hall_guard/init.py",
    ):  # fmt: skip
        assert said in found, found


def test_a_folder_without_a_course_says_what_a_course_needs(tmp_path: Path):
    assert "A course needs course.yaml" in check_course.mistakes(tmp_path)[0]


# -- graded, by a stand-in ---------------------------------------------------------------------------------------------


@pytest.fixture
def graded(monkeypatch: pytest.MonkeyPatch) -> dict[str, Callable[[str, int], bool]]:
    """Gradings without a run. What is in here says for a check whether it fails, by the guard's text and the seed."""
    fails: dict[str, Callable[[str, int], bool]] = {}

    def grade(package: Path, _out: Path, settings: Settings) -> SimpleNamespace:
        text = (package / "hall_guard" / "guard.py").read_text()
        results = [
            CheckResult(check.id, Outcome.FAILED, 0.0, seen="stood still")
            if check.id in fails and fails[check.id](text, settings.seed)
            else CheckResult(check.id, Outcome.PASSED, 1.0)
            for check in settings.rubric.checks
        ]
        return SimpleNamespace(
            scorecard=score(settings.rubric, results), seed=settings.seed, evidence=judging.evidence_with()
        )

    monkeypatch.setattr(course_trials.pipeline, "grade", grade)
    return fails


def tried(folder: Path, seeds: int = 1) -> course_trials.Tried:
    for path in (folder / "known_bad").glob("*.yaml"):
        if path.name != "hits_the_wall.yaml":
            path.unlink()
    return course_trials.run(load(folder), folder, lambda _words: None, range(1, seeds))


WALL, PATROL = "check_wall::test_stops_before_the_wall", "check_patrol::test_drives_on_patrol"
OURS = check_course.known_bad(GOOD / "known_bad" / "hits_the_wall.yaml", load(GOOD), {"B3": 15}).edit.new


Fails = Callable[[str, int], bool]
LUCK = "known_bad/hits_the_wall.yaml: B3 is not lost with the seeds 3 and 7 of 10: a package like this passes by luck"
BY_SEED = f"what is asked depends on the seed: {WALL}: passed with seed 0, with seed 5 failed: stood still"


@pytest.mark.parametrize(
    ("check", "fails", "problems", "of_ten_seeds"),
    [
        (WALL, lambda text, seed: OURS in text and seed not in (3, 7), (), (LUCK,)),  # a robot that cannot turn
        (WALL, lambda text, seed: OURS in text or seed == 5, (), (BY_SEED,)),
        (
            PATROL, lambda _text, _seed: True,  # the solution loses points elsewhere
            (f"the solution loses points: {PATROL}: failed: stood still",
             "known_bad/hits_the_wall.yaml: B3 should lose 15 and loses 0"), None,
        ),
        (WALL, lambda _text, _seed: True, (f"the solution loses points: {WALL}: failed: stood still",), None),
    ],
    ids=["an edit passes by luck", "the solution fails by luck", "of something else", "of what the edit is about"],
)  # fmt: skip
def test_what_is_not_lost_as_it_should_be_is_named(
    folder: Path, graded: dict[str, Fails], check: str, fails: Fails, problems: tuple[str, ...],
    of_ten_seeds: tuple[str, ...] | None,
):  # fmt: skip
    graded[check] = fails
    assert tried(folder).problems == problems
    if of_ten_seeds is not None:
        assert tried(folder, seeds=10).problems == of_ten_seeds


def test_a_hunt_names_the_made_up_seeds_with_which_an_edit_passes_or_the_solution_fails(
    folder: Path, graded: dict[str, Fails], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    made = [course_trials.made_up(20), (4711, 31, 815)]
    assert len({*made[0]} - {0}) == 20
    monkeypatch.setattr(course_trials, "made_up", lambda count: made[1][:count])
    graded[WALL] = lambda text, seed: (OURS in text and seed != 815) or seed == 31
    for path in (folder / "known_bad").glob("[!h]*.yaml"):
        path.unlink()
    assert cli.main(["check-course", str(folder), "--hunt", "--seeds", "4", "--cache", str(folder)]) == 1
    said = capsys.readouterr().out
    assert f"{WALL}: passed with seed 0, with seed 31 failed: stood still" in said
    assert "B3 is not lost with seed 815 of 4: a package like this passes by luck" in said


def test_that_no_edit_was_tried_is_noted(folder: Path, graded: dict[str, Fails]):
    graded[WALL] = lambda _text, _seed: True
    why = "was not tried for B3, of which the solution itself loses points"
    assert tried(folder).notes[0] == f"known_bad/hits_the_wall.yaml {why}"


# -- graded ------------------------------------------------------------------------------------------------------------


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # the whole grading of a solution, with another seed, and five known-bad edits
def test_the_template_gets_the_points_that_it_should(capsys: pytest.CaptureFixture[str]):
    assert cli.main(["check-course", str(GOOD)]) == 0
    assert capsys.readouterr().out == f"{GOOD}: nothing is wrong\n"


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # six gradings
def test_a_seed_with_which_an_edit_passes_by_luck_is_named_with_what_it_has_chosen(folder: Path):
    """A trial that may end before the guard, which does not stop, comes to the wall."""
    edit(folder, "trials/patrol.py", "stage.run(14.0)", 'stage.run(stage.between("seconds", 8.5, 14.0))')
    whole = (folder / "rubric.yaml").read_text()
    (folder / "rubric.yaml").write_text(whole.partition("  # All these checks are stock")[0])
    for path in (folder / "known_bad").glob("[!h]*.yaml"):
        path.unlink()
    found = course_trials.run(load(folder), building.cache_folder(), lambda _words: None, (1, 7))
    luck = "with seed 7 of 3: a package like this passes by luck (seed 7: seconds 9.602 in to_the_end)"
    assert found.problems == (f"known_bad/hits_the_wall.yaml: B3 is not lost {luck}",)
