"""Collecting: which sources are done, in which order, and what is merged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import PACKAGE

from grader import KIT, collect
from grader.evidence import Build, Flag, FunctionAnswer, Intake
from grader.intake.submission import Submission
from grader.processes.jobs import Job, Where
from grader.report import console
from grader.scoring.rubric import load
from grader.settings import Settings
from grader.source import Asked, Collected, Phase, Source, Subject

RUBRIC = load(KIT / "rubric.yaml")


class Answers(Source):
    """A source with one job that notes when it was done; what it has collected is what it was made with."""

    def __init__(self, name: str, phase: Phase, serves: str, collected: Collected, done: list[str]) -> None:
        self.name, self.phase, self._serves = name, phase, frozenset(serves.split())
        self._collected, self._done = collected, done
        self.subject: Subject | None = None

    def serves(self, _: Settings) -> frozenset[str]:
        return self._serves

    def ask(self, subject: Subject) -> Asked:
        self.subject = subject
        job = Job(self.name, Where.HOST, str, self.work)
        return Asked([job], lambda _results: self._collected)

    def work(self) -> str:
        self._done.append(self.name)
        return ""


def asking(*requirements: str) -> Settings:
    return Settings(rubric=RUBRIC, cache=Path(), requirements=requirements)


@pytest.fixture
def submission(tmp_path: Path) -> Submission:
    return Submission(Intake("team07.zip", "ab", "p", "."), tmp_path, tmp_path, None, (Flag("intake", "first"),))


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(rubric=RUBRIC, cache=tmp_path)


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Replace the build; the list that is returned grows by one for each."""
    builds: list[str] = []
    facts = Build(ok=True, package=PACKAGE, types_package=PACKAGE, flags=[Flag("build", "second")])

    def build(_: Submission, contract: collect.Built, __: Settings) -> tuple[collect.Built, collect.Built]:
        builds.append("built")
        return collect.Built(facts, tmp_path), contract

    monkeypatch.setattr(collect.building, "build_contract", lambda *_: collect.Built(facts, tmp_path))
    monkeypatch.setattr(collect, "_build", build)
    return builds


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Replace the sources by one that drives for F4 and one that reads for Q1; each adds its name when it was done."""
    names: list[str] = []
    drive = Answers("drive", Phase.RUN, "F4", Collected(), names)
    monkeypatch.setattr(collect, "SOURCES", (drive, Answers("read", Phase.TEXT, "Q1", Collected(), names)))
    return names


def test_a_requirement_of_the_text_alone_needs_no_build_and_one_that_something_must_run_for_does():
    """Style is measured on what runs, so something must run for it, too."""
    assert not collect.needs_build(asking("I2"))
    needing = ("F1", "F14", "I1", "I3", "Q1", "Q2", "Q3", "Q4", "Q5", "Q6", "T1", "T3")
    assert [name for name in needing if not collect.needs_build(asking(name, "I2"))] == []


@pytest.mark.parametrize("left", [{}, {"p/made.py": Path("made.py")}], ids=["nothing", "a module"])
def test_code_of_the_builds_own_that_ran_is_read_with_the_rest(
    monkeypatch, submission, settings, built, tmp_path: Path, left: dict[str, Path]
):
    done: list[str] = []
    read = Answers("read", Phase.TEXT, "Q1", Collected(), done)
    drive = Answers("trials", Phase.RUN, "F4", Collected(left=left), done)
    monkeypatch.setattr(collect, "SOURCES", (drive, read))
    collect.collect(Subject(submission, replace(settings, requirements=("F4", "Q1")), tmp_path))
    assert sorted(done) == (["read", "read", "trials"] if left else ["read", "trials"])
    assert read.subject is not None
    assert read.subject.left == left


def test_every_requirement_is_served_by_a_source_but_what_the_build_shows():
    served = frozenset[str]().union(*(source.serves(asking()) for source in collect.SOURCES))
    assert {r.id for r in RUBRIC.requirements if r.checks} - served == {"I1"}
    assert served <= {r.id for r in RUBRIC.requirements}


def test_only_sources_of_wanted_requirements_are_done(done, submission, settings, built, tmp_path: Path):
    collect.collect(Subject(submission, replace(settings, requirements=("Q1",)), tmp_path))
    assert (done, built) == (["read"], [])


def test_facts_and_flags_are_merged_in_the_order_of_the_sources(monkeypatch, submission, settings, built, tmp_path):
    done: list[str] = []
    answers = [FunctionAnswer("clamp", [1.0, 0.0, 1.0], [1.0])]
    last = Answers("last", Phase.TEXT, "Q1", Collected({}, (Flag("text", "fourth"),)), done)
    first = Answers("first", Phase.RUN, "F14", Collected({"functions": answers}, (Flag("run", "third"),)), done)
    monkeypatch.setattr(collect, "SOURCES", (first, last))
    found = collect.collect(Subject(submission, replace(settings, requirements=("F14", "Q1")), tmp_path))
    assert [flag.what for flag in found.flags] == ["first", "second", "third", "fourth"]
    assert found.functions == answers


def test_a_job_of_two_sources_is_done_once(monkeypatch, submission, settings, built, tmp_path: Path):
    done: list[str] = []
    sources = [Answers("tests", Phase.RUN, "T3", Collected(), done) for _ in range(2)]
    monkeypatch.setattr(collect, "SOURCES", tuple(sources))
    collect.collect(Subject(submission, replace(settings, requirements=("T3",)), tmp_path))
    assert done == ["tests"]


def test_the_jobs_are_listed_and_only_the_build_is_done(done, submission, settings, built, tmp_path: Path):
    listed = collect.explain(Subject(submission, replace(settings, requirements=("F4",)), tmp_path))
    assert [job.name for job, _ in listed] == ["read", "the contract's build", "the package's build", "drive"]
    assert (done, built) == ([], ["built"])
    words = console.jobs(listed)
    assert "\n  drive                                   to do" in words
    assert "the package's build                     to do; after the contract's build" in words


def test_nothing_is_run_of_a_package_that_does_not_build(monkeypatch, done, submission, settings, tmp_path: Path):
    broken = collect.Built(Build(ok=False, package=PACKAGE, types_package=PACKAGE), tmp_path)
    monkeypatch.setattr(collect.building, "build_contract", lambda *_: broken)
    monkeypatch.setattr(collect, "_build", lambda *_: (broken, broken))
    collect.collect(Subject(submission, replace(settings, requirements=("F4", "Q1")), tmp_path))
    assert done == ["read"]


def test_an_error_of_this_host_in_a_source_ends_the_grading(monkeypatch, submission, settings, built, tmp_path: Path):
    class Breaks(Answers):
        def work(self) -> str:
            raise OSError("disk full")

    monkeypatch.setattr(collect, "SOURCES", (Breaks("drive", Phase.RUN, "F4", Collected(), []),))
    with pytest.raises(OSError, match="disk full"):
        collect.collect(Subject(submission, replace(settings, requirements=("F4",)), tmp_path))
