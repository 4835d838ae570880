"""What a class lost points for: counted without numbers, failed apart from not reached."""

from __future__ import annotations

from typing import Any

from grader.classroom import causes
from grader.scoring import rubric

RUBRIC = rubric.load(rubric.RUBRIC)
SECTION = {requirement.id: requirement.section for requirement in RUBRIC.requirements}


def check(outcome: str, **said: str) -> dict[str, Any]:
    return {
        "id": "check_a::test_b", "sentence": "stops", "outcome": outcome, "worth": 2.0, "fraction": 0.0,
        "seen": "", "because": "", **said,
    }  # fmt: skip


def lost(requirement: str, *checks: dict[str, Any], cause: str = "") -> dict[str, Any]:
    return {"cause": {"sentence": cause, "points": 9.0}, "requirements": [{"id": requirement, "checks": [*checks]}]}


def test_messages_that_differ_in_their_numbers_are_counted_as_one():
    """Each student touched the wall at a time of their own, and nothing was seen twice."""
    reports = {
        name: lost("F4", check("failed", seen=f"touched the wall at {time} s, x = {time}e-1"))
        for name, time in (("ann", 7.3), ("bob", 12.1))
    }
    (topic,) = causes.count(reports, RUBRIC).failed
    (message,) = topic.dearest
    assert message.words == "touched the wall at … s, x = …"
    assert sorted(message.lost) == topic.submissions == ["ann", "bob"]
    assert topic.points == 4.0
    assert topic.sections == [SECTION["F4"]]


def test_what_cost_the_class_most_comes_first():
    """Three who lost a tenth of a point stood above one who lost everything."""
    cheap = {name: lost("F5", {**check("partial", seen="a bit"), "fraction": 0.95}) for name in ("ann", "bob", "cem")}
    dear = {"dan": lost("F4", check("failed", seen="much") | {"id": "check_a::test_c"})}
    found = causes.count(cheap | dear, RUBRIC).failed
    assert [(round(topic.points, 2), len(topic.submissions)) for topic in found] == [(2.0, 1), (0.3, 3)]


def test_a_line_break_in_what_was_seen_is_a_blank():
    r"""The class page had `\n` there."""
    (topic,) = causes.count({"ann": lost("F4", check("failed", seen="first\n  second\tline"))}, RUBRIC).failed
    assert [message.words for message in topic.dearest] == ["first second line"]


def test_digits_in_names_are_no_numbers():
    assert causes.without_numbers("lib/ros2_robot_controller/a2 in F4, 3 of 4") == (
        "lib/ros2_robot_controller/a2 in F4, … of …"
    )


def test_what_was_not_reached_is_counted_apart_from_what_failed():
    reports = {"ann": lost("F4", check("not_reached", because="`colcon build` ended with exit status 2 (I1)"))}
    found = causes.count(reports, RUBRIC)
    assert found.failed == ()
    assert found.not_reached[0].title == "colcon build ended with exit status … (I1)"


def test_first_causes_are_counted_by_submission_and_the_most_common_is_first():
    said = "robot_controller did not start: KeyError: x, driver.py line {}"
    reports = {
        "ann": lost("F1", cause=said.format(7)),
        "bob": lost("F1", cause="F4 Stops: touched it at 3 s"),
        "cem": lost("F1", cause=said.format(8)),
    }
    first, second = causes.count(reports, RUBRIC).first
    assert (first.title, first.submissions) == (causes.without_numbers(said.format(7)), ["ann", "cem"])
    assert second.sections == [SECTION["F4"]]


def test_a_submission_that_cannot_be_graded_counts_with_its_reason():
    (topic,) = causes.count({"ann": {"refused": {"because": "a.zip holds no package.xml."}}}, RUBRIC).first
    assert topic.title == "a.zip holds no package.xml."
