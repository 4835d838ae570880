"""The rubric: the kit's own holds the contract, and one that does not add up is refused."""

import pytest
import yaml

from grader import KIT
from grader.errors import GraderError
from grader.scoring.rubric import load

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


def refused(path):
    with pytest.raises(GraderError) as error:
        load(path)
    return str(error.value)


def test_the_kits_rubric_holds_the_contracts_requirements_and_points():
    rubric = load(RUBRIC)
    assert {c.id: c.points for c in rubric.criteria} == {
        "functionality": 40,
        "code_quality": 25,
        "ros2_integration": 20,
        "testing": 15,
    }
    assert [f"{r.id}:{r.points:g}" for r in rubric.requirements] == POINTS.split()


def test_the_kits_rubric_tells_core_from_advanced_as_the_contract_does():
    advanced = {r.id: r.advanced for r in load(RUBRIC).requirements if r.advanced}
    assert advanced == {"F5": 1, "F11": 1, "F12": 1, "I4": 1, "I6": 1, "Q4": 1, "T3": 3}


def test_the_kits_rubric_names_a_notebook_section_for_each_requirement():
    stems = {
        "01_anatomy",
        "02_interfaces",
        "03_numbers_of_motion",
        "04_seeing",
        "05_moving_safely",
        "06_services",
        "07_going_there",
        "08_settings_and_launch",
        "09_tests_that_notice",
        "10_show_and_hand_in",
    }
    for requirement in load(RUBRIC).requirements:
        stem, _, title = requirement.section.partition("#")
        assert stem in stems
        assert title
        assert requirement.title


def test_a_rubric_is_read_in_its_order(write):
    rubric = load(write(small()))
    assert [r.id for r in rubric.requirements] == ["F1", "F2"]
    assert [c.id for c in rubric.checks] == ["test_a::test_one", "test_a::test_two"]
    assert rubric.requirement("F1").text == "It works."
    assert rubric.requirement("F1").criterion == "f"
    with pytest.raises(KeyError):
        rubric.requirement("F3")


def test_the_level_is_core_unless_said_otherwise(write):
    rubric = load(write(small()))
    assert [c.level for c in rubric.checks] == ["core", "advanced"]
    assert [r.level for r in rubric.requirements] == ["core 1 + advanced 2", "core"]


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
        ("check", "points", 2, "F1 has 3 points, its checks 4"),
        ("requirement", "points", 4, "f has 5 points, its requirements 6"),
        ("criterion", "points", 6, "f has 6 points, its requirements 5"),
        ("requirement", "advanced", 1, "F1 has 1 advanced points, its checks 2"),
        ("check", "id", "test_a::test_two", "test_a::test_two is listed twice"),
        ("requirement", "id", "F2", "F2 is listed twice"),
        ("check", "level", "hard", "test_a::test_one has the level 'hard', neither core nor advanced"),
        ("check", "points", -1, "test_a::test_one has -1 points"),
        ("check", "points", float("nan"), "test_a::test_one has nan points"),
        ("criterion", "levels", {"A": "all"}, "f needs words for the levels A, B, C and D"),
        ("rubric", "weights", {}, "the rubric has the unknown key weights"),
        ("criterion", "level", {}, "f has the unknown key level"),
        ("requirement", "check", [], "F1 has the unknown key check"),
        ("check", "point", 1, "test_a::test_one has the unknown key point"),
        ("check", "points", "one", "could not convert string to float"),
        ("requirement", "text", None, "cannot be read as a rubric"),
        ("requirement", "checks", None, "cannot be read as a rubric"),
    ],
)
def test_a_rubric_with_a_mistake_is_refused_by_name(write, where, key, value, says):
    path = write(change(small(), where, key, value))
    message = refused(path)
    assert says in message
    assert str(path) in message


@pytest.mark.parametrize("text", ["", "[]", "just words", "{title: [", "title: A\nversion: 1\n"])
def test_what_is_no_rubric_is_refused(write, text):
    assert "cannot be read as a rubric" in refused(write(text))


def test_a_missing_rubric_is_refused(tmp_path):
    assert "cannot be read as a rubric" in refused(tmp_path / "none.yaml")
