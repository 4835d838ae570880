"""Grading the same again: what has not changed is not collected again, and the report says so."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.course import COURSE

from grader import KIT, evidence, pipeline
from grader.checks import checks_run
from grader.collect import SOURCES
from grader.evidence import Flag, Mutation, StudentTests
from grader.evidence.kept import Kept, NotKept
from grader.host import provenance
from grader.mutation import source as mutation_source
from grader.report import console
from grader.scoring.rubric import load
from grader.scoring.scorecard import CheckResult, Outcome
from grader.settings import Settings
from grader.source import Source
from grader.student_tests import source as tests_source
from grader.student_tests.suite_run import SuiteRun
from grader.trials.request import LATE_VARIABLE

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return Path(shutil.copytree(REFERENCE, tmp_path / "ros2_robot_controller"))


@pytest.mark.slow  # three gradings
@pytest.mark.sandbox
def test_the_text_is_read_again_only_when_it_has_changed(package: Path, tmp_path: Path):
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), keep=True)

    def grade(settings: Settings = settings) -> pipeline.Grading:
        return pipeline.grade(package, tmp_path / "out", settings)

    first, second = grade(), grade()
    assert not first.unchanged
    assert second.unchanged.endswith("so earlier results are used for: the package's files.")
    assert second.evidence.quality == first.evidence.quality
    assert "`--fresh` collects" in console.render_checks(second)
    assert not grade(replace(settings, fresh=True)).unchanged
    assert not grade(replace(settings, keep=False)).unchanged
    assert not grade(replace(settings, seed=1)).unchanged
    (package / "README.md").write_text("changed")
    assert not grade().unchanged


def checked_in_a_notebook(package: Path, out: Path, settings: Settings) -> pipeline.Grading:
    with checks_run.Checks(COURSE, pipeline.check_ids(settings)) as checks:
        pipeline.observe(package, out, settings)
        return pipeline.checked(out / pipeline.EVIDENCE, checks, settings)


@pytest.mark.slow  # three gradings of one requirement
@pytest.mark.sandbox
def test_of_an_unchanged_submission_the_verdict_is_kept_too(package: Path, tmp_path: Path, monkeypatch: Any):
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), keep=True)
    assert pipeline.unchanged(package, settings) is None
    first = checked_in_a_notebook(package, tmp_path / "out", settings)
    monkeypatch.setattr(checks_run, "Checks", None)
    again = pipeline.unchanged(package, settings)
    assert again is not None
    assert again.scorecard == first.scorecard
    assert again.evidence == replace(first.evidence, kept=again.evidence.kept)
    assert again.unchanged.endswith("so earlier results are used for: the package's files.")
    for other in ({"fresh": True}, {"keep": False}, {"seed": 1}, {"requirements": ("I2", "Q2")}):
        assert pipeline.unchanged(package, replace(settings, **other)) is None
    (package / "README.md").write_text("changed")
    assert pipeline.unchanged(package, settings) is None


@pytest.mark.slow  # three gradings of one requirement
@pytest.mark.sandbox
def test_a_verdict_is_kept_for_its_own_evidence_and_checks(package: Path, tmp_path: Path, monkeypatch: Any):
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), keep=True)
    checked_in_a_notebook(package, tmp_path / "out", settings)
    with monkeypatch.context() as patched:
        patched.setattr(provenance, "kit_hash", lambda _course: "another kit")
        assert pipeline.unchanged(package, settings) is None
    with monkeypatch.context() as patched:
        patched.setattr(provenance, "environment", lambda: {"python": "another"})
        assert pipeline.unchanged(package, settings) is None
    assert pipeline.unchanged(package, settings) is not None


@pytest.mark.slow  # two gradings
@pytest.mark.sandbox
def test_a_check_that_broke_is_run_again(package: Path, tmp_path: Path, monkeypatch: Any):
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), keep=True)
    broken = [CheckResult(check, Outcome.ERROR, 0.0) for check in pipeline.check_ids(settings)]
    with monkeypatch.context() as patched:
        patched.setattr(checks_run.Checks, "results", lambda _: broken)
        checked_in_a_notebook(package, tmp_path / "out", settings)
    assert pipeline.unchanged(package, settings) is None


@pytest.mark.slow  # two gradings
@pytest.mark.sandbox
def test_a_grading_keeps_no_verdict(package: Path, tmp_path: Path):
    """None of a grading is taken from an earlier one."""
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), keep=True)
    pipeline.grade(package, tmp_path / "out", settings)
    assert pipeline.unchanged(package, settings) is None


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
@pytest.mark.parametrize("late", ["", "0.1"])
def test_no_source_runs_anything_where_only_what_is_kept_is_wanted(
    source: Source, late: str, subject: Any, monkeypatch: Any
):
    if late:  # then no trial is taken from what is kept
        monkeypatch.setenv(LATE_VARIABLE, late)
    for runs in ("trials.scheduler.run", "student_tests.source.run_suite", "mutation.source.mutate"):
        monkeypatch.setattr(f"grader.{runs}", None)
    subject.kept = Kept(subject.kept.folder, only=True)
    subject.settings = replace(subject.settings, requirements=())
    subject.built = subject.contract = SimpleNamespace(install=subject.install)
    with pytest.raises(NotKept):
        source.collect(subject)


def test_nothing_is_built_where_only_what_is_kept_is_wanted(package: Path, tmp_path: Path, monkeypatch: Any):
    monkeypatch.setattr("grader.building.build", None)
    monkeypatch.setattr("grader.building.build_contract", None)
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I1",), keep=True)
    assert pipeline.unchanged(package, settings) is None


STEADY = evidence.TestModule("test/test_a.py", stub=False, tests=1, asserting=1, passed=1)


@pytest.fixture
def subject(package: Path, tmp_path: Path) -> Any:
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path, requirements=("T1", "T3"))
    submission = SimpleNamespace(package=package)
    return SimpleNamespace(
        submission=submission, settings=settings, install=tmp_path, kept=Kept(tmp_path / "kept"), text="t", program="p",
        earlier={"student tests": None},
    )  # fmt: skip


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Stand in for the runs of the tests and the mutants; `count` says how often each was run."""
    found = SimpleNamespace(modules=[STEADY], flags=[], count=[0, 0])

    def run_suite(*_: Any, **__: Any) -> SuiteRun:
        found.count[0] += 1
        return SuiteRun(StudentTests(modules=found.modules), flags=found.flags)

    def mutate(*_: Any, **__: Any) -> Mutation:
        found.count[1] += 1
        return Mutation(seed=0, possible=1)

    monkeypatch.setattr(tests_source, "run_suite", run_suite)
    monkeypatch.setattr(mutation_source, "mutate", mutate)
    return found


def collect(subject: Any) -> tuple[Any, Any]:
    tests = tests_source.StudentTestRuns().collect(subject)
    subject.earlier["student tests"] = tests.handover
    return tests, mutation_source.Mutants().collect(subject)


def test_unchanged_tests_and_mutants_are_not_run_again(subject: Any, runs: SimpleNamespace):
    first, second = collect(subject), collect(subject)
    assert runs.count == [1, 1]
    assert [found.facts for found in first] == [found.facts for found in second]
    assert [list(found.kept) for found in second] == [["the package's own tests"], ["mutants"]]


def test_tests_are_run_again_for_mutants_that_were_not_tried_yet(subject: Any, runs: SimpleNamespace):
    only_tests: Any = SimpleNamespace(**vars(subject) | {"settings": replace(subject.settings, requirements=("T1",))})
    tests_source.StudentTestRuns().collect(only_tests)
    collect(subject)
    assert runs.count == [2, 1]
    tests_source.StudentTestRuns().collect(only_tests)
    assert runs.count == [2, 1]


def test_another_budget_tries_mutants_again(subject: Any, runs: SimpleNamespace):
    collect(subject)
    subject.settings = replace(subject.settings, mutation_budget_s=3.0)
    collect(subject)
    assert runs.count == [2, 2]


@pytest.mark.parametrize("odd", [{"failed": 1}, {"errors": 1}, {"timed_out": True}, {"unsteady": ["test_a"]}])
def test_tests_that_failed_are_run_again(subject: Any, runs: SimpleNamespace, odd: dict[str, Any]):
    """Perhaps they failed by chance."""
    runs.modules = [replace(STEADY, **odd)]
    collect(subject)
    collect(subject)
    assert runs.count[0] == 2


def test_what_was_flagged_is_run_again(subject: Any, runs: SimpleNamespace):
    runs.flags = [Flag("tampering", "with reports")]
    collect(subject)
    collect(subject)
    assert runs.count == [2, 2]
