"""index.html: the class at a glance."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace

import pytest
from helpers.class_reports import report

from grader.classroom import gradebook, overview, similarity
from grader.classroom.doubt import Doubt, DoubtKind
from grader.classroom.platforms import plain
from grader.classroom.similarity import Pair
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
    assert cells[2:9] == ["not graded yet", *["–"] * 6]
    assert cells[-1] == "–"
    assert "submissions/later/" not in page


def test_the_page_is_there_while_the_class_is_graded(class_of_four):
    folder = class_of_four()
    page = overview.LivePage(folder)
    before = (folder.path / "index.html").read_text()
    folder.keep(folder.working("boek"), replace(folder.record("boek"), why="boek.zip is a picture."))
    page.write()
    after = (folder.path / "index.html").read_text()
    assert ("boek.zip is a picture." in before, "boek.zip is a picture." in after) == (False, True)
    folder.overrides.write_text("submissions: {stranger: {}}\n")
    page.write()  # what is wrong with it stops no grading
    assert (folder.path / "index.html").read_text() == after


def test_what_the_class_lost_is_shown_with_the_section_and_linked_to_the_submissions(page):
    (teach,) = re.findall(r'id="teach".*?</section>', page, re.DOTALL)
    assert "touched it at … s" in teach
    assert '<a href="submissions/team07/report.html">team07</a>' in teach
    assert "05_moving_safely: Stop before the wall" in teach


def test_a_class_that_shares_no_loss_has_each_in_sight(page):
    """There was an empty table, and what one submission alone had lost was folded below it."""
    (teach,) = re.findall(r'id="teach".*?</section>', page, re.DOTALL)
    assert "<details>" not in teach
    assert teach.count('<table class="failed">') == 1


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


def test_packages_that_are_alike_are_on_the_page_once_they_were_looked_for(class_of_four):
    folder = class_of_four()
    assert "Alike" not in overview.write(folder, gradebook.read(folder)).read_text()
    pairs = [
        Pair("boek", "team07", 0.9, 0.7, "a.py 3 to 40"),
        Pair("boek", "x", 0.1, 0.2),
        Pair("x", "team07", 0.1, 0.2),
    ]
    similarity.write(folder, pairs)
    page = overview.write(folder, gradebook.read(folder)).read_text()
    assert "90 % of one is in the other; most of it in boek: a.py 3 to 40</li>" in page
    assert page.count("of one is in the other") == 1


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


def test_the_histogram_counts_every_total_once(class_of_four):
    folder = class_of_four()
    found = overview.summarise(folder, gradebook.read(folder))
    assert sum(bar.count for bar in found.bars) == len(found.totals) == 1
    assert (found.bars[-1].low, found.bars[-1].high, found.bars[-1].count) == (90, 100, 1)


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
    page = overview.write(folder, gradebook.read(folder)).read_text()
    standings = overview.summarise(folder, gradebook.read(folder)).league
    ranked = [(each.rank, each.line.row.submission) for each in standings]
    assert ranked == [(1, "quick"), (2, "near"), (3, "slow"), (4, "lost"), (5, "team07"), (6, "boek")]
    (league,) = re.findall(r'id="league".*?</section>', page, re.DOTALL)
    assert '<td class="num">30.00</td><td class="num">0.30</td>' in " ".join(league.split()).replace("> <", "><")
