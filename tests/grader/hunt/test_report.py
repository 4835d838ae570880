"""What a hunt says of a case: words, a file that is read again, and a page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings
from helpers.course import COURSE
from helpers.hunting import NODE, SLOW

from grader.hunt import report
from grader.hunt.search import Finding
from grader.trials.case import Case, Step
from grader.trials.promises import Broken

POLE = {"name": "pole 1", "bearing": -43, "distance": 0.5, "radius": 0.015}
CASE = Case(NODE, (Step("wait", 0.3), Step("call", {"service": "set_speed", "speed": 0.375}), Step("obstacle", POLE)))
FINDING = Finding(
    CASE, recordings.load("reference").trials["wall_fast"], SLOW, Broken(3.2, "touched <pole> at 3.2 s"), 5
)


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (("call", {"service": "set_speed", "speed": math.nan}), "call set_speed, speed nan"),
        (("cancel", None), "cancel"),
        (("remove", "pole 1"), "remove pole 1"),
        (("readings", {"kind": "too far", "every": 7}), "readings kind too far, every 7"),
        (("interrupt", 5.0), "interrupt 5.0"),
    ],
)
def test_each_step_is_said_as_in_the_file(step: tuple[str, object], said: str):
    assert report.in_words(Case(NODE, (Step("wait", 0.5), Step(*step)))) == f"at 0.5 s {said}"


def test_a_case_is_one_sentence():
    assert report.in_words(CASE) == (
        "at 0.3 s call set_speed, speed 0.375; at 0.3 s obstacle pole 1, bearing -43, distance 0.5, radius 0.015"
    )


def test_what_is_kept_is_read_again_with_the_promise_that_it_breaks(tmp_path: Path):
    file = report.save(FINDING, tmp_path / "hunt")
    assert file.name == "F1-is_slow.yaml"
    assert report.read(file, COURSE) == (CASE, "is_slow")
    assert file.read_text().startswith("breaks: is_slow\nseen: touched <pole> at 3.2 s\n")
    file.write_text(CASE.text())
    assert report.read(file, COURSE) == (CASE, "")


def test_the_page_shows_what_was_done_seen_and_promised_with_the_replay(tmp_path: Path):
    page = report.save(FINDING, tmp_path).with_suffix(".html").read_text()
    assert "touched &lt;pole&gt; at 3.2 s" in page
    assert "touched <pole>" not in page
    assert "It is slow. (F1)" in page
    assert "<h1>Not kept: It is slow.</h1>" in page
    assert "obstacle pole 1, bearing -43" in page
    assert "data-replay=" in page
    assert "default-src &#39;none&#39;" in page or "default-src 'none'" in page
    assert "set_speed, speed: 0.375" in page


def test_a_finding_without_a_recording_has_a_page_all_the_same(tmp_path: Path):
    empty = replace(FINDING.trial, samples=[], commands=[], scans=[])
    assert "It is slow." in report.page(replace(FINDING, trial=empty))
