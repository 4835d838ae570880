"""Replays: the seconds around a failure in the page, and the whole trial as an MCAP file beside it."""

from __future__ import annotations

import html as markup
import json
import math
import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from helpers import recordings
from helpers.report_examples import BUILD, INTAKE, TOUCHED, drive_at_a_wall, grading, results

from grader import report
from grader.evidence import Command, Evidence
from grader.report import html
from grader.report.pictures import moment, recording, replay
from grader.scoring.rubric import RUBRIC, load
from grader.scoring.scorecard import CheckResult, Outcome

WALL = drive_at_a_wall()


def replays(page):
    """Return the data of all replays in a page."""
    return [json.loads(markup.unescape(found)) for found in re.findall(r'data-replay="(.*?)"', page)]


@pytest.mark.parametrize(
    ("seen", "at"),
    [
        ("touched the wall at 4.25 s, moving at 0.40 m/s", 4.25),
        ("after the first scan below 0.5 m at 4.50 s a zero came at 4.95 s", 4.5),
        ("at 99 s it was too late", 4.57),
        ("touched it", 4.57),
    ],
)
def test_the_moment_is_the_one_that_the_check_names_else_the_first_contact(seen, at):
    assert moment(WALL, seen) == at


def test_the_seconds_around_the_moment_are_shown_and_all_of_a_trial_without_one():
    around = json.loads(replay(WALL, "touched it at 2.00 s"))
    assert (around["at"], around["t"][0], around["t"][-1]) == (2.0, 0.0, 5.0)
    whole = json.loads(replay(replace(WALL, touches=[]), ""))
    assert (whole["at"], whole["t"][0], whole["t"][-1]) == (None, 0.0, 8.0)


def test_each_frame_has_the_pose_the_speed_and_what_was_commanded_and_read_by_then():
    data = json.loads(replay(WALL, "at 4.5 s"))
    frame = data["t"].index(2.0)
    assert (data["x"][frame], data["y"][frame], data["yaw"][frame]) == (0.8, 0, 0)
    assert (data["v"][frame], data["command"][frame], data["ahead"][frame]) == (0.4, 0.4, 1.2)
    assert len({len(data[name]) for name in ("t", "x", "y", "yaw", "v", "command", "ahead")}) == 1


def test_obstacles_are_drawn_by_their_shapes_and_until_they_were_taken_away():
    data = json.loads(replay(recordings.load("reference").trials["blocked_goal"], ""))
    assert [len(shape) for shape in data["shapes"]] == [3, 3]
    assert data["until"] == [None, 14.5]


def test_an_obstacle_is_there_from_when_the_robot_lost_room_by_it():
    """The evidence does not say when one was put down; `blocked` is the script's own mark of that."""
    trial = recordings.load("reference").trials["blocked_goal"]
    post, circle = recording(trial).presences
    assert post.since == 0
    assert trial.marks["blocked"] <= circle.since <= trial.marks["blocked"] + 0.1


@pytest.mark.parametrize(
    "trial",
    [
        replace(WALL, commands=[Command(1.0, math.nan, 0.0), Command(2.0, 1e300, 0.0)]),
        replace(WALL, scene={"walls": "none"}),
        replace(WALL, samples=[replace(sample, v=math.inf) for sample in WALL.samples]),
        replace(WALL, samples=WALL.samples * 50, touches=WALL.touches * 1000),
    ],
    ids=["absurd commands", "no world", "infinite speed", "long"],
)
def test_whatever_a_trial_holds_its_replay_is_strict_and_short(trial):
    text = replay(trial, "")
    json.loads(text, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert len(text) < 40_000


def test_every_failed_check_with_a_trial_has_its_replay_and_names_where(rubric):
    far = CheckResult("check_navigation::test_reaches_a_target", Outcome.FAILED, 0, seen="at 3.0 s", trial="other")
    trials = {"drive_at_a_wall": WALL, "other": replace(WALL, name="other")}
    page = html.render(grading(rubric, results(rubric, TOUCHED, far), Evidence(INTAKE, BUILD, trials=trials)))
    assert [data["at"] for data in replays(page)] == [4.9, 3.0]
    assert page.index("What cost most") < page.index("Trial drive_at_a_wall.") < page.index('id="F4"')
    assert page.index('id="F8"') < page.index("Trial other.")


@pytest.mark.slow  # a report with all replays
def test_a_report_of_a_package_that_fails_in_every_trial_is_below_3_mb():
    """All trials of the reference, each with a check that failed in it."""
    rubric, found = load(RUBRIC), recordings.load("reference")
    names = [name for name, trial in found.trials.items() if len(trial.samples) > 1]
    failed = [
        CheckResult(check.id, Outcome.FAILED, 0, seen="x" * 1000, trial=names[number % len(names)])
        for number, check in enumerate(rubric.checks)
    ]
    page = html.render(grading(rubric, failed, found))
    assert len(replays(page)) == len(names) > 40
    assert len(page) < 3_000_000


@pytest.mark.slow  # a browser
def test_the_replay_runs_in_a_browser_under_the_pages_own_policy(rubric, tmp_path):
    """It opens at the moment of the failure."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no chromium: install it to test the page in a browser")
    made = grading(rubric, results(rubric, TOUCHED), Evidence(INTAKE, BUILD, trials={"drive_at_a_wall": WALL}))
    _, page = report.write(made, tmp_path)
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    done = subprocess.run(
        [*command, "--dump-dom", page.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )
    assert "4.90 s \u00b7 0.00 m/s \u00b7 commanded 0.40 \u00b7 0.17 m ahead</output>" in done.stdout
    assert 'class="robot" transform="translate(1.829,0) rotate(0)"' in done.stdout
    assert ">Play</button>" in done.stdout
