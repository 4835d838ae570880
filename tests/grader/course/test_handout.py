"""The handout and the rubric cannot drift apart."""

from __future__ import annotations

from helpers.course import COURSE

from grader import KIT
from grader.course import handout, load
from grader.scoring import rubric


def test_the_handout_in_docs_is_what_the_rubric_says_now():
    """Mend it with: grader handout --out docs/handout.md"""
    assert (KIT / "docs" / "handout.md").read_text() == handout.render(rubric.load(KIT / "rubric.yaml"), COURSE)


def test_every_requirement_stands_in_the_handout_with_its_words_and_points():
    whole = rubric.load(KIT / "rubric.yaml")
    text = handout.render(whole, COURSE)
    for requirement in whole.requirements:
        assert f"| {requirement.id} | {requirement.points:g} |" in text
        assert requirement.text in text


READINGS = (
    "only claimed earns nothing", "0 is a speed", "hold backwards", "more than 60 degrees",
    "`ACTIVE` on the way to a goal", "reached already when it comes succeeds",
    "orientation of `final_pose` is not judged", "not their defaults", "costs F13 alone", "graded under that name",
    "Executables in `bin`", "`test_depend`", "does not depend on itself", "starts without any argument",
    "are measured on what runs", "neither earns nor costs", "can be read", "A flag takes no points by itself",
    "crashes or hangs",
)  # fmt: skip


def test_the_interfaces_and_the_readings_of_the_requirements_are_in_the_handout():
    text = handout.render(rubric.load(KIT / "rubric.yaml"), COURSE)
    assert "float32 battery_level\ngeometry_msgs/Vector3 linear_acceleration" in text
    assert [words for words in READINGS if words not in text] == []


def test_the_handout_lists_what_a_package_may_import():
    found = load(KIT / "grader" / "authoring" / "template_course")
    page = handout.render(rubric.load(found.rubric), found)
    assert "`numpy` 2." in page
    assert "`yaml` (pyyaml" in page
    assert "`geometry_msgs`" in page
    assert "launch" not in page, "the course has no launch files"
