"""index.html: the class at a glance."""

from __future__ import annotations

import re

import pytest
from helpers.class_reports import report

from grader.classroom import gradebook, overview


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


def test_what_the_class_lost_is_said_with_what_was_seen_most(page):
    (hard,) = re.findall(r'id="hard".*?</table>', page, re.DOTALL)
    assert re.findall(r"<strong>(\w+)</strong>", hard) == ["F8", "F4"]


def test_flags_and_who_handed_in_nothing_are_named(page):
    assert "tried &lt;b&gt;to&lt;/b&gt; reach 10.0.0.1" in page
    assert "Eva Ost" in page


def test_the_page_needs_nothing_from_elsewhere(page):
    assert "default-src 'none'" in page
    assert not re.search(r"https?://", page)


def test_the_histogram_counts_every_total_once(class_of_four):
    folder = class_of_four()
    found = overview.summarise(folder, gradebook.read(folder))
    assert sum(bar.count for bar in found.bars) == len(found.totals) == 1
    assert (found.bars[-1].low, found.bars[-1].high, found.bars[-1].count) == (90, 100, 1)
