"""index.html: the class at a glance."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from typing import Any

import pytest
from helpers.class_reports import report

from grader.classroom import gradebook, overview
from grader.classroom.class_folder import Doubt, DoubtKind
from grader.classroom.platforms import plain
from grader.scoring import rubric


@pytest.fixture
def page(class_of_four) -> str:
    flag = {"kind": "network", "what": "tried <b>to</b> reach 10.0.0.1", "where": ""}
    folder = class_of_four(report=report({"F4": 2.0, "F8": 6.0}, integrity=[flag]))
    return overview.write(folder, gradebook.read(folder)).read_text()


def test_each_submission_is_a_line_with_its_people_and_a_link(page):
    assert page.count('<tr class="attention">') + page.count("<tr>\n<td><a") == 2
    assert '<a href="submissions/team07/report.html">team07</a>' in page
    assert "=Li Wu, Jane Doe" in page or "Jane Doe, =Li Wu" in page
    assert "92.00" in page


def test_what_is_not_graded_has_a_dash_and_no_link(class_of_four):
    """It had 0.00 in every criterion, 0 seconds, and a link to a report that was not there."""
    folder = class_of_four()
    facts = folder.facts()
    waiting = replace(facts.entries[0], id="later", label="later", people=())
    folder.write_facts(replace(facts, entries=(*facts.entries, waiting)))
    page = overview.write(folder, gradebook.read(folder)).read_text()
    (row,) = re.findall(r"<tr[^>]*>\n<td>later</td>.*?</tr>", page, re.DOTALL)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL)
    assert cells[2:8] == ["not graded yet", *["–"] * 5]
    assert cells[-1] == "–"
    assert "submissions/later/" not in page


def test_a_mistake_in_overrides_yaml_stops_no_grading(class_of_four):
    folder = class_of_four()
    overview.attempt(folder)
    before = (folder.path / "index.html").read_text()
    folder.overrides.write_text("submissions: {stranger: {}}\n")
    overview.attempt(folder)
    assert (folder.path / "index.html").read_text() == before


def test_what_the_class_lost_is_shown_with_the_section_and_linked_to_the_submissions(page):
    (teach,) = re.findall(r'id="teach".*?</section>', page, re.DOTALL)
    assert "touched it at … s" in teach
    assert '<a href="submissions/team07/report.html">team07</a>' in teach
    assert "05_moving_safely: Stop before the wall" in teach


def lost(outcome: str, *, fraction: float = 0.0, **said: str) -> dict[str, Any]:
    """Return a report in which F4 lost something."""
    check = {"sentence": "stops", "outcome": outcome, "worth": 2.0, "fraction": fraction, "seen": "", "because": ""}
    return {"requirements": [{"id": "F4", "checks": [check | said]}]}


CRASH = "robot_controller did not start: KeyError: x, driver.py line {}"


@pytest.mark.parametrize(
    ("reports", "said"),
    [
        (
            [lost("failed", seen=f"touched the wall at {time} s, x = {time}e-1") for time in (7.3, 12.1)],
            [("F4", "stops: touched the wall at … s, x = …", 4.0, 2)],
        ),
        (
            [*(lost("partial", fraction=0.95, seen="a bit") for _ in range(3)), lost("failed", seen="much")],
            [("F4", "stops: much", 2.0, 1), ("F4", "stops: a bit", 0.3, 3)],
        ),
        ([lost("failed", seen="first\n  second\tline")], [("F4", "stops: first second line", 2.0, 1)]),
        (
            [lost("not_reached", because="`colcon build` ended with exit status 2 (I1)")],
            [("F4", "colcon build ended with exit status … (I1)", 2.0, 1)],
        ),
        (
            [
                {"cause": {"sentence": CRASH.format(7), "points": 9.0}},
                {"cause": {"sentence": "F4 Stops: touched it", "points": 9.0}},
                {"cause": {"sentence": CRASH.format(8), "points": 9.0}},
            ],
            [("", CRASH.format("…"), 18.0, 2), ("F4", "F4 Stops: touched it", 9.0, 1)],
        ),
        ([{"refused": {"because": "a.zip holds no package.xml."}}], [("", "a.zip holds no package.xml.", 100.0, 1)]),
    ],
    ids=["numbers", "dearest first", "line breaks", "not reached", "first causes", "refusals"],
)
def test_losses_are_counted_over_the_class_without_their_numbers(reports, said):
    found = overview.losses(dict(zip("abcd", reports, strict=False)), rubric.load(rubric.RUBRIC))
    assert [(e.requirement, e.words, round(e.points, 2), len(e.lost)) for e in found] == said


def test_digits_in_names_are_no_numbers():
    assert overview.without_numbers("lib/ros2_robot_controller/a2 in F4, 3 of 4") == (
        "lib/ros2_robot_controller/a2 in F4, … of …"
    )


def test_doubts_and_misfits_are_at_the_top_and_said_once(class_of_four):
    """They were among the notes at the end of the page, below two tables of all submissions."""
    folder = class_of_four()
    doubt = Doubt(DoubtKind.UNMATCHED, "eve.zip", "eve.zip fits nobody of the roster.", "Add the person.", "boek")
    folder.write_facts(replace(folder.facts(), doubts=(doubt,), notes=(doubt.what, "x.txt is not a submission.")))
    page = overview.write(folder, gradebook.read(folder)).read_text()
    before, _, after = page.partition('id="totals"')
    assert "Add the person." in before
    assert "x.txt is not a submission." in before
    assert "Eva Ost" in before  # who handed in nothing
    assert page.count(doubt.what) == 1
    assert "x.txt" not in after


def test_a_submission_that_was_graded_without_namespaces_is_named(class_of_four):
    """Of a class on several machines only the single report said which sandbox graded."""
    folder = class_of_four(report=report(confinement="users"))
    book = gradebook.read(folder)
    assert {row.submission: row.confinement for row in book.rows} == {"team07": "users", "boek": "", "": ""}
    page = overview.write(folder, book).read_text()
    above, _, _ = page.partition('id="totals"')
    assert above.index("Graded without namespaces") < above.index('<a href="submissions/team07/report.html">team07</a>')
    assert page.count("confinement: users") == 1
    plain.write(book, folder.path / "gradebook.csv")
    lines = csv.DictReader((folder.path / "gradebook.csv").read_text().splitlines())
    assert [line["confinement"] for line in lines].count("users") == 2


def test_the_page_needs_nothing_from_elsewhere(page):
    assert "default-src 'none'" in page
    assert not re.search(r"https?://", page)


LEAGUE = "league:\n  - {figure: time, unit: s, best: least}\n  - {figure: clearance, unit: m, best: most}\n\ncriteria:"


def test_a_class_is_ranked_by_points_and_then_by_the_figures_of_its_rubric(class_of_four):
    text = rubric.RUBRIC.read_text().replace("criteria:", LEAGUE, 1)
    folder = class_of_four(rubric=text)
    facts = folder.facts()
    more = tuple(
        replace(facts.entries[1], id=name, label=name, people=()) for name in ("quick", "near", "slow", "lost")
    )
    folder.write_facts(replace(facts, entries=(*facts.entries, *more)))
    for name, figures in (
        ("quick", {"time": 30.0, "clearance": 0.3}), ("near", {"time": 30.0, "clearance": 0.1}),
        ("slow", {"time": 50.0, "clearance": 0.5}), ("lost", {}),
    ):  # fmt: skip
        made = folder.working(name)
        found = report()
        found["requirements"][0]["checks"][0]["figures"] = figures
        (made / "report.json").write_text(json.dumps(found))
        folder.keep(made, replace(folder.record("team07"), id=name))
    book = gradebook.read(folder)
    page = overview.write(folder, book).read_text()
    standings = overview.league(book, {entry.id: folder.report(entry.id) for entry in folder.facts().entries})
    ranked = [(rank, row.submission) for rank, row, _ in standings]
    assert ranked == [(1, "quick"), (2, "near"), (3, "slow"), (4, "lost"), (5, "team07"), (6, "boek")]
    (league,) = re.findall(r'id="league".*?</section>', page, re.DOTALL)
    assert '<td class="num">30.00</td><td class="num">0.30</td>' in " ".join(league.split()).replace("> <", "><")
