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
from grader.trials.case import STEPS, Case, Step
from grader.trials.promises import Broken

POLE = {"name": "pole 1", "bearing": -43, "distance": 0.5, "radius": 0.015}
CASE = Case(NODE, (Step("wait", 0.3), Step("call", {"service": "set_speed", "speed": 0.375}), Step("obstacle", POLE)))
FINDING = Finding(
    CASE, recordings.load("reference").trials["wall_fast"], SLOW, Broken(3.2, "touched <pole> at 3.2 s"), 5
)


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (("call", {"service": "set_speed", "speed": math.nan}), "set_speed nan"),
        (("call", {"service": "get_status"}), "get_status"),
        (("goal", {"bearing": 0, "distance": 1.5, "tolerance": 0.1}), "a goal 1.5 m away, straight ahead"),
        (("goal", {"bearing": 90, "distance": 1.5, "tolerance": 0.1}), "a goal 1.5 m away, 90 degrees to the left"),
        (("cancel", None), "the goal cancelled"),
        (("obstacle", POLE), "pole 1, round, 3 cm wide, 43 degrees to the right, 0.50 m away"),
        (("obstacle", {**POLE, "bearing": 180, "speed": 0.1}), "pole 1, round, 3 cm wide, right behind, 0.50 m away, moving at 0.1 m/s"),
        (("remove", "pole 1"), "pole 1 gone"),
        (("readings", {"kind": "nan"}), "all beams reading nan"),
        (("readings", {"kind": "too far", "every": 7}), "every beam in 7 reading more than range_max"),
        (("limits", {"least": 0.25, "most": 10.0}), "scans that go from 0.25 to 10 m"),
        (("silence", "scan"), "no more messages of scan"),
        (("hear", "scan"), "messages of scan again"),
        (("set", {"max_linear_speed": 0.25, "fusion_rate": 5.0}), "max_linear_speed = 0.25, fusion_rate = 5.0"),
        (("battery", 25), "the battery at 25 %"),
        (("interrupt", 5.0), "Ctrl-C"),
    ],
)  # fmt: skip
def test_each_step_is_said_in_words(step: tuple[str, object], said: str):
    assert report.in_words(Case(NODE, (Step("wait", 0.5), Step(*step)))) == f"at 0.5 s {said}"


def test_each_step_has_words_or_shows_in_the_times():
    assert {*STEPS} - {*report._WORDS} == {"wait", "arrive", "listen"}


def test_a_case_is_one_sentence():
    assert report.in_words(CASE) == (
        "at 0.3 s set_speed 0.375; at 0.3 s pole 1, round, 3 cm wide, 43 degrees to the right, 0.50 m away"
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
    assert "pole 1, round, 3 cm wide, 43 degrees to the right" in page
    assert "data-replay=" in page
    assert "default-src &#39;none&#39;" in page or "default-src 'none'" in page
    assert "set_speed, speed: 0.375" in page


def test_a_finding_without_a_recording_has_a_page_all_the_same(tmp_path: Path):
    empty = replace(FINDING.trial, samples=[], commands=[], scans=[])
    assert "It is slow." in report.page(replace(FINDING, trial=empty))
