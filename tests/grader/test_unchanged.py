"""Grading the same again: what has not changed is not collected again, and the report says so."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers import recordings

from grader import KIT, evidence, pipeline
from grader.checks import checks_run
from grader.evidence import Flag, Mutation, StudentTests
from grader.mutation import source as mutation_source
from grader.mutation.source import Mutants
from grader.processes import jobs
from grader.processes.kept import Kept
from grader.report import console
from grader.scoring.rubric import load
from grader.scoring.scorecard import CheckResult, Outcome
from grader.settings import Reuse, Settings
from grader.source import Source
from grader.student_tests import source as tests_source
from grader.student_tests.module_results import ModuleReach
from grader.student_tests.source import StudentTestRuns, SuiteRun

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return Path(shutil.copytree(REFERENCE, tmp_path / "ros2_robot_controller"))


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(load(KIT / "rubric.yaml"), tmp_path / "cache", requirements=("I2",), reuse=Reuse.KEPT)


@pytest.mark.slow  # three gradings
@pytest.mark.sandbox
def test_the_text_is_read_again_only_when_it_has_changed(package: Path, settings: Settings, tmp_path: Path):
    def grade(settings: Settings = settings) -> pipeline.Grading:
        return pipeline.grade(package, tmp_path / "out", settings)

    first, second = grade(), grade()
    assert not first.unchanged
    assert second.unchanged.endswith("so earlier results are used for: the package's files.")
    assert second.evidence.quality == first.evidence.quality
    assert "`--fresh` collects" in console.render_checks(second)
    assert not grade(replace(settings, reuse=Reuse.ANEW)).unchanged
    assert not grade(replace(settings, reuse=Reuse.NONE)).unchanged
    assert not grade(replace(settings, seed=1)).unchanged
    (package / "README.md").write_text("changed")
    assert not grade().unchanged


def judge(package: Path, out: Path, settings: Settings, *, keep_verdict: bool = True) -> pipeline.Grading:
    pipeline.observe(package, out, settings)
    return pipeline.judge(out / pipeline.EVIDENCE, settings, keep_verdict=keep_verdict)


@pytest.mark.slow  # gradings of one requirement
@pytest.mark.sandbox
def test_of_the_same_evidence_the_verdict_is_kept_if_that_is_wanted(
    package: Path, settings: Settings, tmp_path: Path, monkeypatch: Any
):
    """In a notebook. A grading takes no verdict of an earlier one."""
    ran: list[Path] = []

    def run(_course: object, folder: Path, ids: Sequence[str]) -> list[CheckResult]:
        ran.append(folder)
        return [CheckResult(each, Outcome.PASSED, 1.0) for each in ids]

    monkeypatch.setattr(checks_run, "run", run)
    first, again = (judge(package, tmp_path / "out", settings) for _ in range(2))
    assert len(ran) == 1
    assert again.scorecard == first.scorecard
    judge(package, tmp_path / "out", settings, keep_verdict=False)
    judge(package, tmp_path / "out", replace(settings, reuse=Reuse.ANEW))
    judge(package, tmp_path / "out", replace(settings, requirements=("I2", "Q2")))
    (package / "README.md").write_text("changed")
    judge(package, tmp_path / "out", settings)
    assert len(ran) == 5


@pytest.mark.sandbox
def test_a_check_that_broke_is_run_again(settings: Settings, tmp_path: Path, monkeypatch: Any):
    ran: list[str] = []

    def run(_course: object, _folder: Path, ids: Sequence[str]) -> list[CheckResult]:
        ran.extend(ids)
        return [CheckResult(each, Outcome.ERROR, 0.0) for each in ids]

    monkeypatch.setattr(checks_run, "run", run)
    evidence.save(recordings.load("reference"), tmp_path / "evidence")
    for _ in range(2):
        pipeline.judge(tmp_path / "evidence", settings, keep_verdict=True)
    assert len(ran) == 2 * len(set(ran))


STEADY = evidence.TestModule("test/test_a.py", stub=False, tests=1, asserting=1, passed=1)
REACH = ModuleReach("test/test_a.py", {"test_a": 0.1}, {"p/a.py": {3: frozenset({"test_a", ""})}})


@pytest.fixture
def subject(package: Path, tmp_path: Path) -> Any:
    settings = Settings(load(KIT / "rubric.yaml"), tmp_path, requirements=("T1", "T3"))
    submission = SimpleNamespace(package=package)
    return SimpleNamespace(
        submission=submission, settings=settings, install=tmp_path, kept=Kept(tmp_path / "kept"),
        handed_in="t", seen_by_nodes="p", closing=ExitStack(),
    )  # fmt: skip


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Stand in for the runs of the tests and the mutants; `count` says how often each was run."""
    found = SimpleNamespace(modules=[STEADY], flags=[], count=[0, 0], reach=[])

    def run_suite(*_: Any, **__: Any) -> SuiteRun:
        found.count[0] += 1
        return SuiteRun(StudentTests(modules=found.modules), [REACH], found.flags)

    def mutate(_package: object, _install: object, reach: Any, *_: Any, **__: Any) -> Mutation:
        found.count[1] += 1
        found.reach = reach
        return Mutation(seed=0)

    monkeypatch.setattr(tests_source, "run_suite", run_suite)
    monkeypatch.setattr(mutation_source, "mutate", mutate)
    return found


def collect(subject: Any, *sources: Source) -> list[str]:
    """Ask the sources, by default for the own tests and the mutants; return what was kept."""
    listed = [job for source in sources or (StudentTestRuns(), Mutants()) for job in source.ask(subject).jobs]
    return list(jobs.run(list({job.name: job for job in listed}.values()), subject.kept).kept)


def test_unchanged_tests_and_mutants_are_not_run_again(subject: Any, runs: SimpleNamespace):
    first, second = collect(subject), collect(subject)
    assert runs.count == [1, 1]
    assert first == []
    assert second == ["the package's own tests", "mutants"]


def test_mutants_are_tried_with_tests_that_were_run_before(subject: Any, runs: SimpleNamespace):
    collect(subject, StudentTestRuns())
    collect(subject)
    assert runs.count == [1, 1]
    assert runs.reach == [REACH]


def test_another_budget_tries_mutants_again(subject: Any, runs: SimpleNamespace):
    collect(subject)
    subject.settings = replace(subject.settings, mutation_budget_s=3.0)
    collect(subject)
    assert runs.count == [1, 2]


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
