"""Grade real packages on a real graph: the reference, and the reference with one thing wrong."""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from submissions.edits import EDITS, apply
from submissions.reports import lost, taken, words
from submissions.table import judged_by_trial

from grader import cli, pipeline
from grader.checks import checks_run

pytestmark = [pytest.mark.ros, pytest.mark.sandbox]

Grade = Callable[[str, Sequence[str]], dict[str, Any]]


def grader(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "grader.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=600, **options)


# Graded on everything that trials judge; only the one that nothing is run of is quick.
THOROUGHLY = (
    "does_not_compile", "crashes_at_start", "misnames_set_speed", "drives_into_the_wall", "ignores_the_limit",
    "installs_executables_in_bin",
)  # fmt: skip


@pytest.fixture(scope="session")
def whole(reference: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """The reference graded by the command, as an instructor grades: what it printed, and the report's folder."""
    out = tmp_path_factory.mktemp("whole") / "out"
    done = grader("grade", reference, "--out", out)
    assert done.returncode == 0, done.stderr
    return done.stdout, out


@pytest.fixture(scope="session")
def by_trial(settings: pipeline.Settings) -> tuple[str, ...]:
    """The requirements that are judged by the build and the trials."""
    return judged_by_trial(settings.rubric)


def test_the_reference_gets_every_point(whole: tuple[str, Path]):
    printed, out = whole
    report = json.loads((out / "report.json").read_text())
    assert lost(report) == set(), words(report)
    assert report["complete"]
    assert report["total"] == report["max"] == 100
    assert "100 of 100" in printed
    assert printed.strip().endswith(f"Report: {out / 'report.html'}")
    assert (out / "evidence" / "trials" / "idle_robot_controller.json").is_file()
    assert "<img" in (out / "report.html").read_text()


@pytest.mark.slow  # a second whole grading
def test_a_second_grading_builds_nothing_and_says_the_same(whole: tuple[str, Path], reference: Path, tmp_path: Path):
    done = grader("grade", reference, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    one, two = (json.loads((folder / "report.json").read_text()) for folder in (whole[1], tmp_path))
    assert one["requirements"] == two["requirements"]
    assert json.loads((tmp_path / "evidence" / "build.json").read_text())["cached"] is True


def test_evidence_that_another_process_will_judge_is_not_judged_before(
    settings: pipeline.Settings, reference: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """As by `check`: the kernel judges what a process that can be interrupted has collected."""
    quick = replace(settings, requirements=("I2",))
    with monkeypatch.context() as patched:
        patched.setattr(checks_run, "run", None)
        pipeline.observe(reference, tmp_path / "out", quick)
    assert pipeline.judge(tmp_path / "out" / pipeline.EVIDENCE, quick).scorecard.points == 2


# Half a minute each.
@pytest.mark.slow  # a build or a whole set of trials each
@pytest.mark.parametrize("name", THOROUGHLY)
def test_an_edit_costs_its_own_points_and_no_others(graded: Grade, by_trial: tuple[str, ...], name: str):
    report = graded(name, by_trial)
    assert report["complete"], words(report)
    assert lost(report) == EDITS[name].costs & set(by_trial), words(report)
    for said in EDITS[name].says:
        assert said in words(report)


@pytest.mark.slow  # a whole grading
@pytest.mark.parametrize("name", ["renames_the_package", "renames_all_but_its_modules"])
def test_another_name_costs_a_point_for_the_build_and_two_for_the_types(
    graded: Grade, settings: pipeline.Settings, name: str
):
    """Everything else is graded under the name that the package has: nodes, launch files, tests, mutants, layout."""
    report = graded(name, tuple(r.id for r in settings.rubric.requirements))
    assert taken(report) == {"I1": 1, "I3": 2}, words(report)
    assert report["total"] == 97


@pytest.mark.slow  # half a minute each
@pytest.mark.parametrize("name", sorted(set(EDITS) - {*THOROUGHLY}))
def test_an_edit_costs_the_requirements_it_names(graded: Grade, settings: pipeline.Settings, name: str):
    """That it costs nothing elsewhere is shown by `make known-bad`, which takes an hour."""
    wanted = tuple(r.id for r in settings.rubric.requirements if r.id in EDITS[name].costs)
    report = graded(name, wanted)
    assert report["complete"], words(report)
    for requirement in report["requirements"]:
        if requirement["id"] in set(wanted) - lost(report):  # less than a tenth of a point is shown and not taken
            missed = sum(check["worth"] * (1 - check["fraction"]) for check in requirement["checks"])
            assert 0 < missed < 0.1, words(report)
    assert lost(report) <= set(wanted), words(report)
    for said in EDITS[name].says:
        assert said in words(report)


def test_every_requirement_that_trials_judge_has_two_edits_or_more(by_trial: tuple[str, ...]):
    counts = {requirement: sum(requirement in edit.costs for edit in EDITS.values()) for requirement in by_trial}
    assert min(counts.values()) >= 2, counts


def test_an_edit_that_costs_more_than_one_requirement_says_why():
    assert all(edit.why for edit in EDITS.values() if len(edit.costs) > 1)


def test_a_check_of_nothing_is_wrong_usage(reference: Path, capsys: pytest.CaptureFixture[str]):
    assert cli.main(["check", "F99", "--package", str(reference)]) == 2
    assert "no requirement is called F99; the rubric has F1 to F14" in capsys.readouterr().err


@pytest.mark.parametrize("value", ["abc", "nan", "0", "3601"])
def test_a_number_of_seconds_that_is_none_is_refused_without_the_name_of_a_function(value: str, capsys):
    """`--build-timeout abc` said "invalid _seconds value"."""
    with pytest.raises(SystemExit, match="2"):
        cli.main(["grade", "team07.zip", "--build-timeout", value])
    assert f"argument --build-timeout: '{value}' is not a number of seconds from 1 to 3600\n" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["grade"], ["frobnicate"]])
def test_wrong_usage_is_status_2(words: list[str]):
    with pytest.raises(SystemExit, match="2"):
        cli.main(words)


def _verbs(words: Sequence[str]) -> argparse._SubParsersAction[argparse.ArgumentParser]:
    return next(each for each in cli._parser(words)._actions if isinstance(each, argparse._SubParsersAction))


@pytest.mark.parametrize("module", cli._OTHERS)
def test_the_list_of_verbs_has_the_line_that_each_room_has_for_its_verbs(module: str):
    lines = cli._OTHERS[module]
    shown = _verbs([next(iter(lines))])
    assert {each.dest: each.help for each in shown._choices_actions if each.dest in lines} == lines
    assert all(shown.choices[verb].description for verb in lines)  # its own parser, and not the line alone
    assert set(shown.choices) == set(_verbs([]).choices)


def test_the_list_of_verbs_and_a_grading_wait_for_no_other_room():
    code = "import sys; from grader import cli; [cli._parser([verb]) for verb in ('', 'grade', 'check')]; "
    code += "print([name for name in sys.modules if name.startswith(('grader.classroom', 'grader.auth', 'nbformat'))])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


@pytest.mark.slow  # a second build; test_colcon.py shows what is recorded of one that hangs
def test_a_build_that_hangs_is_stopped_and_reported(tmp_path: Path):
    package = apply(None, tmp_path)
    cmake = package / "CMakeLists.txt"
    hang = "execute_process(COMMAND sleep 1000)\nfind_package(ament_cmake"
    cmake.write_text(cmake.read_text().replace("find_package(ament_cmake", hang))
    done = grader("grade", package, "--out", tmp_path / "out", "--build-timeout", "3")
    assert done.returncode == 0, done.stderr
    assert "ran out of time" in done.stdout
    assert "Traceback" not in done.stdout + done.stderr


def test_a_host_without_a_sandbox_refuses_to_grade(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    bare = tmp_path / "bin"
    bare.mkdir()
    for tool in ("sh", "true"):
        (bare / tool).symlink_to(shutil.which(tool) or "")
    monkeypatch.setenv("PATH", str(bare))
    assert cli.main(["grade", str(reference), "--out", str(tmp_path / "out")]) == 3
    assert "grader doctor" in capsys.readouterr().err
