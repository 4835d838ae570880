"""`grader attack`: what attacks are made of, and how their outcome is judged."""

from __future__ import annotations

import dataclasses
import os
import socket
import subprocess
import time
from pathlib import Path

import pytest

from grader import KIT, build, cli, pipeline
from grader.evidence import Build, Evidence, Flag, Intake
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import CheckResult, Outcome, score
from grader.selftest.attacks import attack_run, summary
from grader.selftest.attacks.attack import attack, copy
from grader.selftest.attacks.catalogue import ATTACKS, KNOWN
from grader.selftest.attacks.honeytokens import SECRET_VARIABLE, scene
from grader.selftest.attacks.weaknesses import WEAK

ROOT = KIT
REFERENCE = ROOT / "solution_pkg" / "ros2_robot_controller"
RUN = [each for each in ATTACKS.values() if not each.no_door]
F1 = ("check_idle::test_publishes_zero_without_a_command", "check_idle::test_publishes_at_the_control_rate")


@pytest.fixture(scope="module")
def settings() -> pipeline.Settings:
    return pipeline.Settings(rubric=rubric.load(ROOT / "rubric.yaml"), cache=build.cache_folder())


def graded(settings: pipeline.Settings, *outcomes: Outcome, flags: tuple[Flag, ...] = ()) -> Grading:
    """A grading of F1 alone, whose two checks came out so."""
    results = [CheckResult(i, o, float(o is Outcome.PASSED), seen="seen") for i, o in zip(F1, outcomes, strict=True)]
    intake = Intake("x", "0", "p", ".")
    found = Evidence(intake, Build(True, False, 1.0, 0, False, ""), flags=list(flags))
    return Grading(score(pipeline._only(settings.rubric, {"F1"}), results), found, {}, "x", 0, 1.0)


# -- the catalogue ------------------------------------------------------------------------------------------------


def test_every_known_attack_is_there_or_says_why_not():
    assert {each.number for each in ATTACKS.values()} >= set(range(1, KNOWN + 1))
    assert all(each.no_door or (each.needs and each.stopped) for each in ATTACKS.values())


def test_every_attack_needs_requirements_that_there_are(settings: pipeline.Settings):
    known = {requirement.id for requirement in settings.rubric.requirements}
    for each in ATTACKS.values():
        assert set(each.needs) <= known, each.name
        assert each.costs <= set(each.needs), each.name
        assert each.weak in WEAK, each.name


@pytest.mark.parametrize("each", RUN, ids=lambda each: each.name)
def test_an_attack_bites_into_the_reference(each, tmp_path: Path):
    """Its edits find what they change, so that an attack which no longer bites is no silent pass."""
    package = copy(REFERENCE, tmp_path)
    before = {path: path.read_bytes() for path in package.rglob("*") if path.is_file()}
    for change in (*WEAK[each.weak], *each.changes):
        change(package)
    after = {path: path.read_bytes() for path in package.rglob("*") if path.is_file()}
    assert before != after or each.pack


# -- the scene ----------------------------------------------------------------------------------------------------


def test_a_scene_that_nobody_touched_is_undamaged():
    with scene() as there:
        assert there.damage() == []


def test_a_changed_neighbour_is_damage():
    with scene() as there:
        (there.neighbour / "report.json").write_text("{}")
        assert there.damage() == ["the neighbour's report was changed"]


def test_a_call_to_the_host_is_damage():
    with scene() as there:
        socket.create_connection(("127.0.0.1", int(there.filled.words["PORT"]))).close()
        deadline = time.monotonic() + 5.0
        while not there.calls and time.monotonic() < deadline:
            time.sleep(0.01)
        assert there.damage() == ["a port of the host was reached 1 times"]


def test_a_process_that_is_left_is_damage():
    with scene() as there:
        # The shell's last argument is what `ps` shows of it.
        left = subprocess.Popen(["sh", "-c", "read -r _", there.token], stdin=subprocess.PIPE)
        assert there.damage() == [f"the process {left.pid} still runs"]
        left.communicate(b"end\n")
        assert there.damage() == []


def test_a_secret_in_the_evidence_is_found(tmp_path: Path):
    with scene() as there:
        (tmp_path / "trial.json").write_text(f"it printed {os.environ[SECRET_VARIABLE]}")
        assert there.told(tmp_path) == ["trial.json"]
    assert SECRET_VARIABLE not in os.environ


# -- the verdict --------------------------------------------------------------------------------------------------


def test_points_that_rise_are_a_fault(settings: pipeline.Settings):
    grading = graded(settings, Outcome.PASSED, Outcome.PASSED)
    faults = attack_run._wrong_points(attack("a", "x", needs="F1", costs="F1"), grading, {"F1": 1.5})
    assert faults == ["F1 rose from 1.5 to 3 points"]


def test_points_that_fall_are_a_fault_where_they_should_not(settings: pipeline.Settings):
    grading = graded(settings, Outcome.PASSED, Outcome.FAILED)
    assert attack_run._wrong_points(attack("a", "x", needs="F1", costs="F1"), grading, {"F1": 3.0}) == []
    faults = attack_run._wrong_points(attack("a", "x", needs="F1"), grading, {"F1": 3.0})
    assert faults == ["F1 fell from 3 to 1.5 points"]


def test_an_error_of_ours_is_a_fault(settings: pipeline.Settings):
    """An error costs no points, so an attack that brings one about would have found a door."""
    grading = graded(settings, Outcome.PASSED, Outcome.ERROR)
    faults = attack_run._wrong_points(attack("a", "x", needs="F1", costs="F1"), grading, {"F1": 3.0})
    assert faults == ["F1 could not be judged: seen"]


def test_a_missing_flag_and_an_attack_that_never_happened_are_faults(settings: pipeline.Settings):
    each = attack("a", "x", needs="F1", flag="flood", proof="ATTACK")
    with scene() as there:
        there.results.mkdir()
        faults = attack_run._wrong_signs(each, graded(settings, Outcome.PASSED, Outcome.PASSED), there)
        assert faults[0] == "no integrity flag of the kind 'flood'"
        assert faults[1].startswith("it was not carried out")
        flag = Flag("flood", "the node sent more than could be kept")
        kept = graded(settings, Outcome.PASSED, Outcome.PASSED, flags=(flag,))
        assert attack_run._wrong_signs(dataclasses.replace(each, proof=""), kept, there) == []


def test_the_table_says_what_was_tried_and_what_stopped_it():
    each = attack("bomb", "Forks.", stopped="a limit", needs="F1")
    lines = summary.row(attack_run.Carried(each, {"F1": 3.0}, {"F1": 0.0}), 6).splitlines()
    assert lines[0].startswith("bomb    contained      0 of 3")
    assert lines[1:] == ["    tried     Forks.", "    stopped   a limit"]
    bad = attack_run.Carried(each, faults=("F1 rose from 0 to 3 points",))
    assert "NOT CONTAINED" in summary.row(bad, 6)
    assert summary.summary([bad]) == "1 of 1 attacks were NOT contained: bomb."


def test_an_attack_without_a_door_is_named_with_its_reason(capsys: pytest.CaptureFixture[str]):
    assert cli.main(["attack", "--only", "edits_the_database"]) == 0
    said = capsys.readouterr().out
    assert "no such door" in said
    assert "keeps no database" in said


def test_an_attack_that_there_is_not_is_wrong_usage(capsys: pytest.CaptureFixture[str]):
    assert cli.main(["attack", "--only", "magic"]) == 2
    assert "--list names them all" in capsys.readouterr().err


@pytest.mark.sandbox
@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize("each", RUN, ids=lambda each: each.name)
def test_an_attack_is_contained(each, settings: pipeline.Settings):
    [carried] = attack_run.run([each], REFERENCE, settings)
    assert carried.faults == ()
