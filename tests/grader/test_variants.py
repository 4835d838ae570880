"""Grade other correct packages, of strangers too: other executors and layouts lose what the contract takes alone."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import COURSE
from helpers.short_nodes import run_trials
from submissions.edits import REFERENCE
from submissions.reports import taken, words
from variants import LAUNCHED, VARIANTS, Variant, make

from grader import KIT, building, evidence, pipeline
from grader.report import data
from grader.trials import catalog

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # F and I of each variant

BY_TRIALS = (*(f"F{number}" for number in range(1, 15)), *(f"I{number}" for number in range(1, 9)))
# Whole solutions by authors who had read only the handout, as they were handed in: CMake writes the nodes' launchers,
# an ament_python package has its interfaces beside it, and a MultiThreadedExecutor has callbacks that block.
STRANGERS: dict[str, Mapping[str, float]] = {
    "launchers_by_cmake": {},
    "ament_python_and_interfaces": {"I3": 2.0},  # the types' names, by the contract's own words
    "many_threads": {},
}


@pytest.mark.parametrize("name", [*VARIANTS, *STRANGERS])
def test_a_correct_package_loses_what_the_contract_takes_and_no_more(name: str, settings, tmp_path: Path):
    """Of the variants, which come without tests, F and I are judged; of the strangers' packages everything."""
    package, loses = KIT / "tests" / "submissions" / "strangers" / f"{name}.zip", STRANGERS.get(name)
    if variant := VARIANTS.get(name):
        package, loses = make(variant, tmp_path), variant.loses
        settings = replace(settings, requirements=BY_TRIALS)
    report = json.loads(data.as_json(pipeline.grade(package, tmp_path / "out", settings)))
    assert taken(report) == loses, words(report)


@pytest.mark.parametrize("name", LAUNCHED)
def test_programs_that_the_build_makes_cost_nothing_alone_and_in_company(name: str, settings, tmp_path: Path):
    """They run, and what they start is read; a check of style by itself sees the same."""
    submission = make(LAUNCHED[name], tmp_path)
    for asked in (("Q1",), ("F1", "I1", "Q1", "Q2", "Q3")):
        grading = pipeline.grade(submission, tmp_path / "-".join(asked), replace(settings, requirements=asked))
        report = json.loads(data.as_json(grading))
        lost = {r["id"]: r["max"] - r["points"] for r in report["requirements"] if r["id"] in asked}
        # The variants come without tests: the layout misses two files of twenty.
        assert lost == dict.fromkeys(asked, 0) | ({"Q3": lost["Q3"]} if "Q3" in asked else {}), words(report)
        assert lost.get("Q3", 0) < 0.3
        assert not grading.evidence.flags


@pytest.mark.parametrize(("variant", "pace"), [("wall_feedback", "real time"), ("", "lockstep")])
def test_a_loop_that_sleeps_by_wall_time_is_given_real_time(
    settings, contract, tmp_path: Path, variant: str, pace: str
):
    """Feedback every 0.4 s of wall time would come every ten simulated seconds; a timer on the clock is not suspect."""
    trial = play(VARIANTS.get(variant), settings, contract, tmp_path, ["cancel_early"])["cancel_early"]
    assert (trial.pace, trial.goals[0].status) == (pace, "canceled")


def test_the_last_zero_of_a_node_that_ends_at_once_is_heard(settings, contract, tmp_path: Path):
    """Its publisher is gone within a millisecond; before, the zero was lost in two of three trials."""
    names = ["interrupted_driving", "interrupted_navigating"]
    for time in range(4):
        for trial in play(VARIANTS["ends_at_once"], settings, contract, tmp_path / str(time), names).values():
            assert trial.process.exit_code == 0, trial.process
            assert trial.commands[-1].v == 0.0


@pytest.mark.parametrize("times", [3, 10])
def test_the_same_trial_gives_the_same_commands_at_the_same_times(settings, contract, tmp_path: Path, times: int):
    names = ["wall_fast", "obstacle_vanishes", "navigate_beside"]
    first, *others = (play(None, settings, contract, tmp_path / str(n), names) for n in range(times))
    for other in others:
        for name in names:
            assert first[name].commands, first[name].ended
            assert other[name].commands == first[name].commands
            assert other[name].scans == first[name].scans


def test_a_callback_that_waits_ends_its_goals_on_a_busy_machine_too(settings, contract, tmp_path: Path):
    """With as many threads as cores, one of which waits in the action, the goals end the same each time."""
    names = ["navigate_beside", "navigate_again", "cancel_late"]
    with load_on_every_core():
        for number in range(3):
            found = play(VARIANTS["default_executor"], settings, contract, tmp_path / str(number), names)
            ends = [(goal.status, goal.success) for name in names for goal in found[name].goals]
            reached, canceled = ("succeeded", True), ("canceled", False)
            assert ends == [reached, reached, canceled, reached, canceled]
            assert {trial.pace for trial in found.values()} == {"lockstep"}


@contextlib.contextmanager
def load_on_every_core() -> Iterator[None]:
    """Keep every core busy with two processes each, which end when the tests do."""
    busy = f"import os\nwhile os.getppid() == {os.getpid()}:\n    sum(range(100000))"
    with contextlib.ExitStack() as running:
        for _ in range(2 * (os.cpu_count() or 1)):
            process = running.enter_context(subprocess.Popen([sys.executable, "-I", "-S", "-c", busy]))
            running.callback(process.kill)
        yield


def play(variant: Variant | None, settings, contract, folder: Path, names: list[str]) -> dict[str, evidence.Trial]:
    """Play trials with a variant, or with the reference."""
    folder.mkdir(parents=True, exist_ok=True)
    packages = [REFERENCE]
    if variant is not None:
        packages = sorted(path.parent for path in make(variant, folder).glob("*/package.xml"))
    install = building.build(packages, settings.cache, COURSE).install
    plans = [catalog.trials(COURSE)[name] for name in names]
    return run_trials(plans, install=install, contract=contract.install, folder=folder, seed=3, package=packages[0])
