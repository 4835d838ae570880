"""The list of trials."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.archives import write
from helpers.course import COURSE, PARAMETERS

from grader.errors import GraderError
from grader.trials import catalog
from grader.trials.plan import TrialPlan
from sim import Pose, World

BEGIN = "from grader.trials.catalog import trial\n"


@pytest.mark.parametrize("plan", catalog.trials(COURSE).values(), ids=lambda plan: plan.name)
def test_each_trial_says_in_a_short_sentence_what_happens(plan):
    """It is shown as progress, behind the trial's name."""
    assert plan.sentence.endswith(".")
    assert len(plan.sentence) <= 100


def test_every_numeric_parameter_of_which_the_contract_says_what_it_does_has_another_value_in_some_trial():
    """A number in the code in its place was never noticed: Q4, I6, F9 and F11 were given in full."""
    varied = {name for plan in catalog.trials(COURSE).values() for name in plan.parameters}
    said = {name for parameters in PARAMETERS.values() for name in parameters} - {"fusion_rate"}  # its text is read
    assert said - varied == set()


@pytest.mark.parametrize(
    ("script", "why"),
    [
        ("@trial(serves=[])\ndef idle(stage): ...\n", "the trial idle: another trial has this name"),
        ("@trial(serves=[], node='drver')\ndef one(stage): ...\n", "the contract has no node drver"),
        ("@trial(follows='idle', parameters={'a': 1})\ndef one(stage): ...\n", "start their nodes in different ways"),
        (
            "@trial(follows='two')\ndef one(stage): ...\n@trial(follows='one')\ndef two(stage): ...\n",
            "it comes before itself",
        ),
    ],
)
def test_a_trial_that_cannot_be_told_or_has_no_node_is_refused(tmp_path: Path, script: str, why: str):
    idle = f"{BEGIN}@trial(serves=[])\ndef idle(stage): ...\n"
    write(tmp_path, {"trials/a.py": idle, "trials/b.py": f"{BEGIN}{script}"})
    with pytest.raises(GraderError, match=why):
        catalog.trials(replace(COURSE, folder=tmp_path))


def test_a_trial_begins_a_life_of_its_own_where_the_one_before_is_gone(tmp_path: Path):
    """It may be in a file that is gone."""
    write(tmp_path, {"trials/a.py": f"{BEGIN}@trial(follows='nowhere')\ndef one(stage): ...\n"})
    assert catalog.trials(replace(COURSE, folder=tmp_path))["one"].follows == ""


def test_nothing_public_follows_what_is_held_back(tmp_path: Path):
    """The node would still know the world, and its output in the public trial is the student's to read."""
    write(tmp_path, {"trials/of_trials.py": f"{BEGIN}@trial(follows='secret')\ndef open(stage): ...\n"})
    write(tmp_path, {"held_back/trials/of_held_back.py": f"{BEGIN}@trial()\ndef secret(stage): ...\n"})
    with pytest.raises(GraderError, match="cannot follow secret: a node could tell"):
        catalog.trials(replace(COURSE, folder=tmp_path))


def test_only_the_demonstration_sees_what_is_not_installed():
    """A node could run an archive or a data file from the source folder, which no check of the build has seen."""
    assert [name for name, plan in catalog.trials(COURSE).items() if plan.shows_source] == ["demo"]


def test_parameters_that_depend_on_the_world_are_those_of_the_turned_world():
    """A place in a parameter lay elsewhere than in the world, which each trial turns, mirrors and shifts."""
    plan = TrialPlan(
        "a", "", lambda _stage: None, parameters={"speed": 0.2},
        world_parameters=lambda world: {"dock": [world.start.x, world.start.y]},
    )  # fmt: skip
    world = World(start=Pose(1.0, 2.0)).transformed(mirror=True, shift=(3.0, 0.0))
    assert plan.placed_in(world).parameters == {"speed": 0.2, "dock": [4.0, -2.0]}
