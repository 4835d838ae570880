"""The rubric: the kit's own holds the contract, and one that does not add up is refused."""

import re
from pathlib import Path

import pytest
import yaml
from helpers.course import COURSE

from grader import KIT
from grader.checks import checks_run
from grader.errors import GraderError
from grader.scoring.rubric import HUNT, load

POINTS = """
F1:3 F2:4 F3:3 F4:5 F5:2 F6:3 F7:2 F8:6 F9:2 F10:2 F11:3 F12:3 F13:1 F14:1
Q1:5 Q2:5 Q3:5 Q4:4 Q5:3 Q6:3
I1:3 I2:2 I3:4 I4:3 I5:3 I6:3 I7:1 I8:1
T1:4 T2:5 T3:6
"""

RUBRIC = KIT / "rubric.yaml"


def small():
    """Return a rubric that adds up, to be broken."""
    checks = [{"id": "test_a::test_one", "points": 1}, {"id": "test_a::test_two", "points": 2, "level": "advanced"}]
    requirement = {"id": "F1", "points": 3, "advanced": 2, "text": "It\n works.", "section": "01_a#B", "checks": checks}
    later = {"id": "F2", "points": 2, "text": "It works well.", "section": "01_a#C", "checks": []}
    levels = {"A": "all", "B": "most", "C": "some", "D": "little"}
    criterion = {"id": "f", "title": "F", "points": 5, "levels": levels, "requirements": [requirement, later]}
    return {"title": "A rubric", "version": 1, "criteria": [criterion]}


@pytest.fixture
def write(tmp_path):
    def write_rubric(data):
        path = tmp_path / "rubric.yaml"
        path.write_text(data if isinstance(data, str) else yaml.safe_dump(data))
        return path

    return write_rubric


def refused(path, checks=None):
    with pytest.raises(GraderError) as error:
        load(path, checks)
    return str(error.value)


def test_the_kits_rubric_has_the_contracts_requirements_points_and_levels():
    rubric = load(RUBRIC)
    points = {"functionality": 40, "code_quality": 25, "ros2_integration": 20, "testing": 15}
    assert {c.id: c.points for c in rubric.criteria} == points
    assert [f"{r.id}:{r.points:g}" for r in rubric.requirements] == POINTS.split()
    advanced = {r.id: r.advanced for r in rubric.requirements if r.advanced}
    assert advanced == {"F4": 1, "F5": 1, "F11": 1, "F12": 1, "I4": 1, "I6": 1, "Q4": 1, "T3": 3}


def test_a_rubric_is_read_in_its_order(write):
    rubric = load(write(small()))
    assert [r.id for r in rubric.requirements] == ["F1", "F2"]
    assert [c.id for c in rubric.checks] == ["test_a::test_one", "test_a::test_two"]
    assert rubric.requirement("F1").text == "It works."
    assert rubric.requirement("F1").criterion == "f"
    assert [c.level for c in rubric.checks] == ["core", "advanced"]
    assert [r.level for r in rubric.requirements] == ["core 1 + advanced 2", "core"]
    with pytest.raises(KeyError):
        rubric.requirement("F3")


def test_points_that_are_not_typed_are_sums(write):
    """The same points were typed three times, and had to agree."""
    data = small()
    criterion = data["criteria"][0]
    del criterion["points"], criterion["requirements"][0]["points"], criterion["requirements"][0]["advanced"]
    rubric = load(write(data))
    first = rubric.requirement("F1")
    assert (first.points, first.advanced, rubric.criteria[0].points) == (3, 2, 5)
    assert rubric.criteria == load(write(small())).criteria


def test_a_hunt_is_one_more_check_with_points_of_its_own(write):
    data = small()
    criterion = data["criteria"][0]
    del criterion["points"], criterion["requirements"][0]["points"], criterion["requirements"][0]["advanced"]
    criterion["requirements"][0]["hunt"] = {"cases": 300, "points": 2}
    criterion["requirements"][1] |= {"hunt": {"cases": 50, "points": 2, "level": "advanced"}, "advanced": 2}
    first, second = load(write(data), ["test_a::test_one", "test_a::test_two"]).requirements
    assert [(r.hunt, r.points, r.advanced) for r in (first, second)] == [(300, 5, 2), (50, 2, 2)]
    assert [r.checks[-1].id for r in (first, second)] == [f"{HUNT}[F1]", f"{HUNT}[F2]"]
    assert HUNT in checks_run.known(COURSE)
    criterion["requirements"][0]["held_back"] = True
    assert "F1 is held back, and students have the promises that a hunt is about" in refused(write(data))


def test_a_requirement_without_checks_needs_its_points(write):
    data = small()
    del data["criteria"][0]["requirements"][1]["points"]
    assert re.search(r"line \d+: F2 has no checks to sum its points from; write its `points`", refused(write(data)))


def test_all_wrong_entries_are_named_at_once(write):
    data = small()
    data["criteria"][0]["requirements"][0]["checks"][0]["id"] = "test_a::test_ones"
    data["criteria"][0]["requirements"][1]["section_"] = "x"
    said = refused(write(data), ["test_a::test_one", "test_a::test_two"]).splitlines()
    assert ["Did you mean test_a::test_one" in said[0], "Did you mean section?" in said[1]] == [True, True]


def change(data, where, key, value):
    criterion = data["criteria"][0]
    requirement = criterion["requirements"][0]
    part = {"rubric": data, "criterion": criterion, "requirement": requirement, "check": requirement["checks"][0]}[
        where
    ]
    part[key] = value
    return data


@pytest.mark.parametrize(
    ("where", "key", "value", "says"),
    [
        ("check", "points", 2, "line 18: F1 has 3 points, its checks 4"),
        ("requirement", "points", 4, "F1 has 4 points, its checks 3"),
        ("criterion", "points", 6, "line 8: f has 6 points, its requirements 5"),
        ("requirement", "advanced", 1, "F1 has 1 advanced points, its checks 2"),
        ("check", "id", "test_a::test_two", "test_a::test_two is listed twice, first in line"),
        ("requirement", "id", "F2", "F2 is listed twice, first in line"),
        ("check", "id", HUNT, "write `hunt: {cases: 300, points: 2}` beside `checks` instead"),
        ("requirement", "hunt", {"cases": 0, "points": 1}, "0 is not a number of cases"),
        ("requirement", "hunt", {"cases": "60 s", "points": 1}, "60 s is not a number of cases"),
        ("requirement", "hunt", {"cases": 300}, "'points' is missing; a hunt needs cases, points"),
        ("requirement", "held_back", "yes, please", "yes, please is not a value of `held_back`"),
        ("check", "level", "cor", "cor is not a level. Did you mean core? There are: core, advanced."),
        ("check", "points", -1, "-1 is not a number of points"),
        ("check", "points", float("nan"), ".nan is not a number of points"),
        ("check", "points", "one", "one is not a number of points"),
        ("criterion", "levels", {"A": "all"}, "'B' is missing; a criterion needs A, B, C, D"),
        (
            "rubric",
            "weights",
            {},
            "weights is not allowed here. There are: title, version, criteria, scale, league, dropped, flags.",
        ),
        ("rubric", "flags", "withold", "withold is not a value of `flags`"),
        ("criterion", "level", {}, "level is not allowed here. Did you mean levels?"),
        ("requirement", "check", [], "check is not allowed here. Did you mean checks?"),
        ("check", "point", 1, "point is not allowed here. Did you mean points? There are: id, points, level."),
        ("requirement", "text", None, "a plain text or number is expected here"),
        ("requirement", "checks", None, "a list is expected here"),
    ],
)
def test_a_mistake_is_named_with_its_line(write, where, key, value, says):
    path = write(change(small(), where, key, value))
    message = refused(path)
    assert says in message
    assert re.match(re.escape(str(path)) + r", line \d+: ", message)


def test_the_line_is_the_mistakes_own(write):
    path = write(RUBRIC.read_text().replace("points: 1.5,", "point: 1.5,", 1))
    number = next(n for n, line in enumerate(path.read_text().splitlines(), 1) if "point: 1.5" in line)
    assert refused(path).startswith(f"{path}, line {number}: point is not allowed here.")


def test_a_check_that_there_is_not_is_refused_with_the_nearest_and_those_of_its_module(write):
    known = ["test_a::test_one", "test_a::test_both", "test_b::test_two"]
    assert refused(write(small()), known).endswith(
        "line 14: test_a::test_two is not a check of the kit. Did you mean test_a::test_one? "
        "There are: test_a::test_both, test_a::test_one."
    )
    assert len(load(write(small()), [*known, "test_a::test_two"]).checks) == 2


def names_of_tests(path: Path) -> list[str]:
    return re.findall(r"^def (test_\w+)\(", path.read_text(), re.MULTILINE)


def test_every_check_of_the_kits_own_course_is_in_its_rubric():
    graded = {check.id for check in load(RUBRIC).checks}
    assert graded <= set(checks_run.known(COURSE))
    defined = {f"{p.stem}::{name}" for p in COURSE.files("checks", "check_*.py") for name in names_of_tests(p)}
    assert defined <= graded


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "line 1: 'title' is missing; a rubric needs title, version, criteria"),
        ("[]", "line 1: a mapping is expected here"),
        ("just words", "line 1: a mapping is expected here"),
        ("title: A\nx: {title: [", "line 2: "),
        ("title: A\nversion: 1\n", "line 1: 'criteria' is missing; a rubric needs title, version, criteria"),
        ("title: \x00", "is not YAML"),
    ],
)
def test_what_is_no_rubric_is_refused(write, text, says):
    assert says in refused(write(text))


def test_a_missing_rubric_is_refused(tmp_path):
    assert "Compare it with the kit's own." in refused(tmp_path / "none.yaml")


GERMAN = [{"grade": "1.0", "percent": 95}, {"grade": "4.0", "percent": 50}, {"grade": "5.0", "percent": 0}]


def test_a_scale_gives_a_grade_for_every_total(write):
    path = write(change(small(), "rubric", "scale", GERMAN))
    whole = load(path)
    assert [whole.grade(points) for points in (6, 5, 4.75, 4.74, 2.5, 2.49, 0)] == [
        "1.0", "1.0", "1.0", "4.0", "4.0", "5.0", "5.0",
    ]  # fmt: skip
    assert load(write(small())).grade(5) == ""


@pytest.mark.parametrize(
    ("scale", "says"),
    [
        (GERMAN[:2], "a scale ends with the grade for 0 percent"),
        ([GERMAN[1], GERMAN[0], GERMAN[2]], "1.0 needs less than the 50 percent of the step before"),
        ([{"grade": "1.0"}], "'percent' is missing; a step of the scale needs grade, percent"),
    ],
)
def test_a_scale_that_is_not_sorted_or_has_no_end_is_refused(write, scale, says):
    assert says in refused(write(change(small(), "rubric", "scale", scale)))


def test_a_figure_of_the_league_says_which_is_best(write):
    rubric = small()
    rubric["league"] = [
        {"figure": "time", "unit": "s", "best": "least"},
        {"figure": "way", "unit": "m", "best": "most"},
    ]
    assert [(each.name, each.most) for each in load(write(rubric)).league] == [("time", False), ("way", True)]
    rubric["league"][1]["best"] = "mots"
    assert "mots is not a value of `best`" in refused(write(rubric))
