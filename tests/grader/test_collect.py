"""Collecting: which sources are asked, in which order, and what is merged."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import PACKAGE

from grader import KIT, collect
from grader.evidence import Build, Flag, FunctionAnswer, Intake
from grader.intake.submission import Submission
from grader.scoring.rubric import load
from grader.settings import Settings
from grader.source import Collected, Phase, Source, Subject

RUBRIC = load(KIT / "rubric.yaml")


class Answers(Source):
    """A source that notes when it was asked, and answers what it was made with."""

    def __init__(
        self, name: str, phase: Phase, serves: str, collected: Collected, asked: list[str], uses: str = ""
    ) -> None:
        self.name, self.phase, self._serves = name, phase, frozenset(serves.split())
        self.uses = frozenset(uses.split())
        self._collected, self._asked = collected, asked
        self.subject: Subject | None = None

    def serves(self, _: Settings) -> frozenset[str]:
        return self._serves

    def collect(self, subject: Subject) -> Collected:
        self.subject = subject
        self._asked.append(self.name)
        return self._collected


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
    facts = replace(Build.not_tried(PACKAGE), ok=True, flags=[Flag("build", "second")])

    def build(_: Submission, contract: collect.Built, __: Settings) -> tuple[collect.Built, collect.Built]:
        builds.append("built")
        return collect.Built(facts, tmp_path), contract

    monkeypatch.setattr(collect, "_contract", lambda *_: collect.Built(facts, tmp_path))
    monkeypatch.setattr(collect, "_build", build)
    return builds


@pytest.mark.parametrize("name", ["Q1", "Q2", "Q3", "I2"])
def test_a_requirement_of_the_text_alone_needs_no_build(name: str):
    assert not collect.needs_build(asking(name))


@pytest.mark.parametrize("left", [{}, {"p/made.py": Path("made.py")}], ids=["nothing", "a module"])
def test_code_of_the_builds_own_that_ran_is_read_with_the_rest(
    monkeypatch, submission, settings, built, tmp_path: Path, left: dict[str, Path]
):
    asked: list[str] = []
    read = Answers("read", Phase.TEXT, "Q1", Collected(), asked)
    drive = Answers("trials", Phase.RUN, "F4", Collected(handover=left), asked)
    monkeypatch.setattr(collect, "SOURCES", (drive, read))
    collect.collect(submission, tmp_path, replace(settings, requirements=("F4", "Q1")))
    assert sorted(asked) == (["read", "read", "trials"] if left else ["read", "trials"])
    assert read.subject is not None
    assert read.subject.earlier == ({"trials": left} if left else {})


@pytest.mark.parametrize("name", ["F1", "F14", "I1", "I3", "Q4", "Q5", "Q6", "T1", "T3"])
def test_a_requirement_that_something_must_run_for_needs_a_build(name: str):
    assert collect.needs_build(asking(name, "Q1"))


def test_every_requirement_is_served_by_a_source_but_what_the_build_shows():
    served = frozenset[str]().union(*(source.serves(asking()) for source in collect.SOURCES))
    assert {r.id for r in RUBRIC.requirements if r.checks} - served == {"I1"}
    assert served <= {r.id for r in RUBRIC.requirements}


def test_only_sources_of_wanted_requirements_are_asked(monkeypatch, submission, settings, built, tmp_path: Path):
    asked: list[str] = []
    drive = Answers("drive", Phase.RUN, "F4", Collected(), asked)
    read = Answers("read", Phase.TEXT, "Q1", Collected(), asked)
    monkeypatch.setattr(collect, "SOURCES", (drive, read))
    collect.collect(submission, tmp_path, replace(settings, requirements=("Q1",)))
    assert (asked, built) == (["read"], [])


def test_facts_and_flags_are_merged_in_the_order_of_the_sources(monkeypatch, submission, settings, built, tmp_path):
    asked: list[str] = []
    answers = [FunctionAnswer("clamp", [1.0, 0.0, 1.0], [1.0])]
    last = Answers("last", Phase.TEXT, "Q1", Collected({}, (Flag("text", "fourth"),)), asked)
    first = Answers("first", Phase.RUN, "F14", Collected({"functions": answers}, (Flag("run", "third"),)), asked)
    monkeypatch.setattr(collect, "SOURCES", (first, last))
    found = collect.collect(submission, tmp_path, replace(settings, requirements=("F14", "Q1")))
    assert [flag.what for flag in found.flags] == ["first", "second", "third", "fourth"]
    assert found.functions == answers


def test_what_a_source_hands_over_reaches_those_that_use_it(monkeypatch, submission, settings, built, tmp_path: Path):
    asked: list[str] = []
    tests = Answers("tests", Phase.RUN, "T1 T3", Collected(handover="reach"), asked)
    drive = Answers("drive", Phase.RUN, "F4 T3", Collected(handover="poses"), asked)
    mutants = Answers("mutants", Phase.RUN, "T3", Collected(), asked, uses="tests")
    monkeypatch.setattr(collect, "SOURCES", (mutants, drive, tests))
    collect.collect(submission, tmp_path, replace(settings, requirements=("T3",)))
    assert asked.index("tests") < asked.index("mutants")
    assert mutants.subject is not None
    assert mutants.subject.earlier == {"tests": "reach"}


def test_a_source_waits_only_for_those_that_it_uses(monkeypatch, submission, settings, built, tmp_path: Path):
    """Mutants are tried while trials go on."""
    tried = threading.Event()

    class Waits(Answers):
        def collect(self, subject: Subject) -> Collected:
            assert tried.wait(60.0)
            return super().collect(subject)

    class Tells(Answers):
        def collect(self, subject: Subject) -> Collected:
            tried.set()
            return super().collect(subject)

    asked: list[str] = []
    drive = Waits("drive", Phase.RUN, "F4", Collected(), asked)
    tests = Answers("tests", Phase.RUN, "T3", Collected(), asked)
    mutants = Tells("mutants", Phase.RUN, "T3", Collected(), asked, uses="tests")
    monkeypatch.setattr(collect, "SOURCES", (drive, tests, mutants))
    collect.collect(submission, tmp_path, replace(settings, requirements=("F4", "T3")))
    assert asked == ["tests", "mutants", "drive"]


def test_nothing_is_run_of_a_package_that_does_not_build(monkeypatch, submission, settings, tmp_path: Path):
    asked: list[str] = []
    broken = collect.Built(Build.not_tried(PACKAGE), tmp_path)
    monkeypatch.setattr(collect, "_contract", lambda *_: broken)
    monkeypatch.setattr(collect, "_build", lambda *_: (broken, broken))
    drive = Answers("drive", Phase.RUN, "F4", Collected(), asked)
    read = Answers("read", Phase.TEXT, "Q1", Collected(), asked)
    monkeypatch.setattr(collect, "SOURCES", (drive, read))
    collect.collect(submission, tmp_path, replace(settings, requirements=("F4", "Q1")))
    assert asked == ["read"]


def test_an_error_of_this_host_in_a_source_ends_the_grading(monkeypatch, submission, settings, built, tmp_path: Path):
    class Breaks(Answers):
        def collect(self, subject: Subject) -> Collected:  # noqa: ARG002 (it breaks whatever the subject is)
            raise OSError("disk full")

    monkeypatch.setattr(collect, "SOURCES", (Breaks("drive", Phase.RUN, "F4", Collected(), []),))
    with pytest.raises(OSError, match="disk full"):
        collect.collect(submission, tmp_path, replace(settings, requirements=("F4",)))
