"""`grader self-test`: how attacks are defined, and how their results are judged."""

from __future__ import annotations

import dataclasses
import os
import re
import socket
import subprocess
from pathlib import Path

import attacks
import pytest
from helpers import until
from helpers.course import COURSE, REFERENCE
from helpers.judging import evidence_with

from grader import KIT, cli, pipeline
from grader.evidence import Flag
from grader.host import submission_user
from grader.intake.package_edits import copy
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import CheckResult, Outcome, score
from grader.selftest.attacks import command
from grader.selftest.attacks.attack import attack
from grader.selftest.attacks.command import ATTACKS
from grader.selftest.attacks.honeytokens import SECRET_VARIABLE, planted

KNOWN = 43  # the list of known attacks on autograders from which this one started
NOT_APPLICABLE = {18}  # it edits or locks a gradebook's database; a grading here is a folder of files
RUBRIC = rubric.load(COURSE.rubric)
ALL = [each.on(COURSE, RUBRIC) for each in (*ATTACKS.values(), *attacks.ATTACKS)]
F1 = ("check_idle::test_publishes_zero_without_a_command", "check_idle::test_publishes_at_the_control_rate")


def graded(settings: pipeline.Settings, *outcomes: Outcome, flags: tuple[Flag, ...] = ()) -> Grading:
    """Return a grading of F1 alone, whose two checks have these outcomes."""
    results = [CheckResult(i, o, float(o is Outcome.PASSED), seen="seen") for i, o in zip(F1, outcomes, strict=True)]
    found = evidence_with(flags=list(flags))
    return Grading(score(pipeline._only(settings.rubric, {"F1"}), results), found, {}, "x", 0, 1.0)


# -- the catalogue ------------------------------------------------------------------------------------------------


def test_every_known_attack_is_listed():
    assert {each.number for each in ALL} >= set(range(1, KNOWN + 1)) - NOT_APPLICABLE
    assert all(each.needs and each.stopped for each in ALL)


def test_every_attack_refers_to_known_requirements(settings: pipeline.Settings):
    known = {requirement.id for requirement in settings.rubric.requirements}
    for each in ALL:
        assert set(each.needs) <= known, each.name
        assert each.costs <= set(each.needs), each.name


@pytest.mark.parametrize("each", ALL, ids=lambda each: each.name)
def test_an_attack_changes_the_reference(each, tmp_path: Path):
    """An attack whose edits no longer apply must not pass silently."""
    package = copy(REFERENCE, tmp_path)
    before = {path: path.read_bytes() for path in package.rglob("*") if path.is_file()}
    for change in (*each.weak, *each.changes):
        change(package)
    after = {path: path.read_bytes() for path in package.rglob("*") if path.is_file()}
    assert before != after or each.pack


# -- honeytokens --------------------------------------------------------------------------------------------------


def test_a_changed_report_of_another_submission_is_damage():
    with planted() as tokens:
        assert tokens.damage() == []
        (tokens.neighbour / "report.json").write_text("{}")
        assert tokens.damage() == ["the neighbour's report changed"]


def test_what_changed_in_the_home_folder_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Another program may have made it, as ssh makes an empty folder on its first start."""
    (tmp_path / ".bashrc").write_text("before")
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    with planted() as tokens:
        (tmp_path / ".ssh").mkdir()
        assert tokens.damage() == ["the home folder changed: .ssh"]


def test_a_call_to_the_host_is_damage():
    with planted() as tokens:
        socket.create_connection(("127.0.0.1", int(tokens.placeholders["PORT"]))).close()
        until(lambda: tokens.calls)
        assert tokens.damage() == ["a port of the host was reached 1 times"]


def test_a_process_that_still_runs_is_damage():
    with planted() as tokens:
        # The shell's last argument is in its command line.
        left = subprocess.Popen(["sh", "-c", "read -r _", tokens.token], stdin=subprocess.PIPE)
        # Popen returns when exec has closed its pipe, which is before /proc shows the new command line.
        until(lambda: tokens.token.encode() in Path(f"/proc/{left.pid}/cmdline").read_bytes())
        assert tokens.damage() == [f"the process {left.pid} still runs"]
        left.communicate(b"end\n")
        assert tokens.damage() == []


def test_a_secret_in_the_evidence_is_found(tmp_path: Path):
    with planted() as tokens:
        (tmp_path / "trial.json").write_text(f"it printed {os.environ[SECRET_VARIABLE]}")
        assert tokens.leaks(tmp_path) == ["trial.json"]
    assert SECRET_VARIABLE not in os.environ


# -- results ------------------------------------------------------------------------------------------------------


def test_a_mark_in_a_shared_build_tree_is_found_unless_it_is_in_the_key(tmp_path: Path):
    key, tree = tmp_path / "package.xml", tmp_path / "cache" / "trees" / "a"
    with planted() as tokens:
        key.write_text(f"<author>{tokens.token}</author>")
        tree.mkdir(parents=True)
        (tree / "package.xml.stamp").write_bytes(key.read_bytes())
        assert tokens.marks(tmp_path / "cache", key) == []
        (tree / "cmake_install.cmake").write_text(f"# {tokens.token}")
        assert tokens.marks(tmp_path / "cache", key) == ["its mark is in cmake_install.cmake of a shared build tree"]


PASSED, FAILED, ERROR = Outcome.PASSED, Outcome.FAILED, Outcome.ERROR


@pytest.mark.parametrize(
    ("second", "costs", "before", "problems"),
    [
        (PASSED, "F1", 1.5, ["F1 rose from 1.5 to 3 points"]),
        (FAILED, "F1", 3.0, []),
        (FAILED, "", 3.0, ["F1 fell from 3 to 1.5 points"]),
        # It costs no points, so an attack that causes one would have avoided a check.
        (ERROR, "F1", 3.0, ["F1 could not be judged: seen"]),
    ],
)
def test_points_that_change_are_a_problem_unless_the_attack_costs_them(
    settings: pipeline.Settings, second: Outcome, costs: str, before: float, problems: list[str]
):
    tried = attack("a", "x", needs="F1", costs=costs)
    assert command._point_problems(tried, graded(settings, PASSED, second), {"F1": before}) == problems


def test_a_missing_flag_and_a_missing_proof_are_problems(settings: pipeline.Settings):
    each = attack("a", "x", needs="F1", flag="flood", proof="ATTACK")
    with planted() as tokens:
        tokens.results.mkdir()
        problems = command._report_problems(each, graded(settings, Outcome.PASSED, Outcome.PASSED), tokens)
        assert problems[0] == "no integrity flag of the kind 'flood'"
        assert problems[1].startswith("it was not carried out")
        flag = Flag("flood", "the node sent more than could be kept")
        kept = graded(settings, Outcome.PASSED, Outcome.PASSED, flags=(flag,))
        assert command._report_problems(dataclasses.replace(each, proof=""), kept, tokens) == []


def test_the_table_shows_what_was_tried_and_what_stopped_it():
    each = attack("bomb", "Forks.", stopped="a limit", needs="F1")
    lines = command.row(command.AttackResult(each, {"F1": 3.0}, {"F1": 0.0}), 6).splitlines()
    assert lines[0].startswith("bomb    contained       0 of 3")
    assert lines[1:] == ["    tried     Forks.", "    stopped   a limit"]
    bad = command.AttackResult(each, problems=("F1 rose from 0 to 3 points",))
    assert "NOT CONTAINED" in command.row(bad, 6)
    assert command.summary([bad]) == "1 of 1 attacks were NOT contained: bomb."


def test_what_is_not_held_without_namespaces_is_named_and_no_other_attack(monkeypatch: pytest.MonkeyPatch):
    """An attack that got through there was a failure of the self-test; one that no longer does must leave the list."""
    listed = attack("calls", "x", needs="F1", not_without_namespaces="datagrams get through")
    reached, contained = (command.AttackResult(listed, problems=problems) for problems in (("a port",), ()))
    seen = command._as_known(reached)
    assert (seen.problems, seen.not_held) == ((), ("a port",))
    assert command.row(seen, 6).startswith("calls   not held        0 of 0")
    other = command.AttackResult(attack("other", "x", needs="F1"))
    summary = command.summary([seen, other])
    assert summary == "1 of 2 attacks were contained. Not held without namespaces: calls."
    assert command._as_known(contained).problems == (
        "it was contained, and the list says that no sandbox without namespaces holds it",
    )


def test_the_documentation_lists_what_the_users_sandbox_does_not_hold():
    text = (KIT / "docs" / "containers.md").read_text()
    assert set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)) == {
        each.name for each in ATTACKS.values() if each.not_without_namespaces
    }


def test_an_unknown_attack_is_wrong_usage(capsys: pytest.CaptureFixture[str]):
    assert cli.main(["self-test", "--only", "magic"]) == 2
    assert "--list shows all names" in capsys.readouterr().err


@pytest.mark.sandbox
@pytest.mark.ros
@pytest.mark.slow  # a grading for each attack
@pytest.mark.skipif(
    os.geteuid() != 0 or bool(submission_user.lacks()), reason="needs root, proot and Python outside /root"
)
@pytest.mark.parametrize("name", ATTACKS)
def test_the_users_sandbox_holds_what_it_says(name: str, settings: pipeline.Settings, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS2_COURSE_KIT_NAMESPACES", "this test forbids them")
    [result] = command.run([ATTACKS[name].on(COURSE, settings.rubric)], REFERENCE, settings)
    assert result.problems == ()
    assert bool(result.not_held) == bool(ATTACKS[name].not_without_namespaces)


@pytest.mark.sandbox
@pytest.mark.ros
@pytest.mark.slow  # a grading for each attack
@pytest.mark.parametrize("each", ALL, ids=lambda each: each.name)
def test_an_attack_is_contained(each, settings: pipeline.Settings):
    [result] = command.run([each], REFERENCE, settings)
    assert result.problems == ()
