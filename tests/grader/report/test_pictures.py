"""Pictures of trials: whatever a trial holds, a picture comes out or none is promised."""

import math
from dataclasses import replace

import pytest
from helpers import judging
from helpers.course import COURSE
from helpers.report_examples import drive_at_a_wall, drive_to_a_goal

from grader.evidence import Command, Goal, Sample
from grader.report import pictures

PNG = b"\x89PNG\r\n\x1a\n"
WALL, GOAL = drive_at_a_wall(), drive_to_a_goal()
FAR = Goal(0.1, math.nan, math.inf, math.nan, False, "rejected", None, math.nan, math.nan, math.nan)


@pytest.mark.parametrize(
    "trial",
    [
        WALL,
        GOAL,
        replace(WALL, world="a world that is gone"),
        replace(WALL, commands=[], scans=[], touches=[]),
        replace(WALL, commands=[Command(1.0, math.nan, 0.0), Command(2.0, 1e300, 0.0), Command(3.0, -math.inf, 0.0)]),
        replace(WALL, goals=[FAR, replace(FAR, x=1e9, y=0.0, tolerance=-1.0)]),
        replace(WALL, samples=[WALL.samples[0]] * 2),
        replace(WALL, samples=WALL.samples * 50, touches=WALL.touches * 1000),
    ],
    ids=["wall", "goal", "no world", "silent", "absurd commands", "absurd goals", "standing", "long"],
)
def test_a_picture_comes_out(trial):
    assert pictures.drawable(trial)
    assert pictures.png(trial).startswith(PNG)
    assert pictures.describe(trial)


def test_a_plot_has_a_line_for_the_thresholds_of_its_own_trial_only(monkeypatch):
    """Every plot of another course had the line of the kit's own, and a trial with another threshold the default's."""
    drawn = []
    monkeypatch.setattr(pictures, "draw_distances", lambda _axes, _run, thresholds: drawn.append(thresholds))
    for thresholds in ({}, {"stop": 0.75, "back off": 0.3}):
        pictures.png(replace(WALL, thresholds=thresholds))
    assert drawn == [{}, {"stop": 0.75, "back off": 0.3}]


def test_thresholds_are_what_the_contract_says_is_drawn_with_the_trials_own_values():
    controller = COURSE.nodes["robot_controller"]
    assert controller.thresholds({}) == {"obstacle": 0.5, "emergency": 0.2}
    assert controller.thresholds({"obstacle_detection_threshold": 1.0}) == {"obstacle": 1.0, "emergency": 0.2}
    assert COURSE.nodes["sensor_processor"].thresholds({}) == {}


def test_a_trial_in_which_nothing_was_seen_is_not_drawable():
    assert not pictures.drawable(replace(WALL, samples=[]))


def test_a_robot_that_stood_still_and_was_told_nothing_is_not_drawable():
    still = replace(WALL, samples=[WALL.samples[0]] * 9, commands=[Command(1.0, 0.0, 0.0)], touches=[])
    assert not pictures.drawable(still)
    assert pictures.drawable(replace(still, commands=[Command(1.0, 0.0, 0.3)]))


def test_the_words_tell_of_the_contact():
    assert "It touched wall ahead at 4.6 s, moving at 0.40 m/s." in pictures.describe(WALL)


def test_the_words_tell_of_the_goal():
    assert "It was sent to (1.50, 1.50) m; the goal succeeded." in pictures.describe(GOAL)


def test_the_longest_drive_is_the_one_worth_drawing():
    assert pictures.worth_drawing([WALL, GOAL, replace(GOAL, name="still", samples=[])]) is GOAL
    assert pictures.worth_drawing([]) is None


@pytest.mark.parametrize(("v", "shown"), [(0.0, "omega (rad/s)"), (0.2, "v (m/s)")])
def test_a_robot_that_only_turns_is_shown_turning_and_the_break_is_marked(monkeypatch, v, shown):
    axes = []
    monkeypatch.setattr(pictures.Figure, "savefig", lambda figure, *_, **__: axes.extend(figure.axes))
    samples = [Sample(t / 20, v * t / 20, 0, 0, v, 0.5, 0, 0, 0, 9.0) for t in range(21)]
    pictures.png(judging.trial("turns", samples=samples, commands=[Command(0.0, v, 0.5)]), 0.75)
    assert shown in [each.get_ylabel() for each in axes]
    marked = [line.get_xdata()[0] for each in axes for line in each.lines if line.get_label() == "promise broken"]
    assert marked == [0.75, 0.75]
