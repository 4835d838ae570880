"""What a class lost points for: counted without numbers, failed apart from not reached."""

from __future__ import annotations

import json
from typing import Any

import pytest

from grader.classroom import causes, sections
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


@pytest.mark.parametrize("requirement", RUBRIC.requirements, ids=lambda requirement: requirement.id)
def test_the_section_of_every_requirement_can_be_read_from_the_class(requirement):
    section = sections.read([requirement.section])[requirement.section]
    kind, text = section.parts[0]
    assert kind == "markdown"
    assert text.startswith("<h")


def test_a_section_ends_at_the_next_heading_that_is_as_high(tmp_path):
    cells = [
        {"cell_type": "markdown", "source": "# Book\n## One\nfirst <b>bold</b>\n### Inside\nmore"},
        {"cell_type": "code", "source": ["x = 1\n", "y = 2"]},
        {"cell_type": "markdown", "source": "end\n## Two\nother"},
    ]
    (tmp_path / "01_book.ipynb").write_text(json.dumps({"cells": cells}))
    section = sections.read(["01_book#One"], tmp_path)["01_book#One"]
    assert [kind for kind, _ in section.parts] == ["markdown", "code", "markdown"]
    text = "".join(text for _, text in section.parts)
    assert "&lt;b&gt;" in text
    assert "end" in text
    assert "other" not in text
