"""A small class on disk, as `grader batch` leaves it."""

from __future__ import annotations

import datetime as dt
import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from helpers import recordings
from helpers.archives import write
from helpers.class_reports import Workers, judge, report
from helpers.report_examples import REFUSED

from grader import report as report_room
from grader.classroom import batch, hand_ins
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.one_grading import Ending, Order
from grader.classroom.overrides import Decisions
from grader.classroom.roster import Person
from grader.scoring import rubric

DEADLINE = dt.datetime(2026, 11, 20, 23, 59, tzinfo=dt.UTC)
LATE, LATE_RULE = dt.timedelta(hours=34, minutes=1), "10 % per started day, at most 3 days"
JANE = Person("s1", "Jane Doe", "jane@uni.edu", "jdoe", "team07", "12345")
LI = Person("s2", "=Li Wu", "li@uni.edu", "liwu", "team07", "12346")
BO = Person("s3", "Bo Ek", "bo@uni.edu", "boek", "", "12347")
EVA = Person("s4", "Eva Ost", "eva@uni.edu", "eost", "", "12348")


@pytest.fixture
def class_of_four(tmp_path) -> Callable[..., ClassFolder]:
    """Return what makes a class: team07 of two graded, boek refused, eost handed in nothing."""

    def make(
        overrides: str = "", late_rule: str = "", submitted: dt.datetime | None = None, *,
        zero_missing: bool = False, **changed: Any,
    ) -> ClassFolder:  # fmt: skip
        folder = ClassFolder(tmp_path / "class")
        folder.path.mkdir()
        entries = (
            Entry("boek", "boek", Path("boek.zip"), "b" * 64, (BO,)),
            Entry("team07", "team07", Path("team07.zip"), "a" * 64, (JANE, LI), submitted),
        )
        text = changed.pop("rubric", rubric.RUBRIC.read_text())
        (folder.path / RUBRIC).write_text(text)
        rubric_hash = hashlib.sha256(text.encode()).hexdigest()
        folder.write_facts(
            ClassFacts(
                "Robots", "export.zip", "plain", rubric_hash, "k", "0", "", 0, entries, (EVA,), (), DEADLINE, late_rule,
                zero_missing=zero_missing,
            )
        )  # fmt: skip
        for name, status, why in (("team07", Status.GRADED, ""), ("boek", Status.REFUSED, "boek.zip is empty.")):
            made = folder.working(name)
            if status is Status.GRADED:
                (made / "report.json").write_text(json.dumps(changed.get("report", report({"F4": 2.0}))))
            content = next(entry.content for entry in entries if entry.id == name)
            folder.keep(made, Record(name, status, why, content, rubric_hash))
        if overrides:
            folder.overrides.write_text(overrides)
        return folder

    return make


@pytest.fixture
def workers(monkeypatch) -> Callable[[Callable[[Order], Ending]], Workers]:
    def install(how: Callable[[Order], Ending]) -> Workers:
        made = Workers(how)

        @contextmanager
        def local(_jobs: int) -> Iterator[Workers]:
            yield made

        monkeypatch.setattr(batch, "local", local)
        return made

    return install


@pytest.fixture
def source(tmp_path) -> Path:
    return write(tmp_path / "source", {f"{name}/readme": name for name in ("team01", "team02", "team03")})


@pytest.fixture(scope="session")
def judged_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a class with the reference's recording as its only graded submission, and one that was refused."""
    folder = ClassFolder(tmp_path_factory.mktemp("made") / "class")
    whole = rubric.load(rubric.RUBRIC)
    folder.path.mkdir()
    (folder.path / RUBRIC).write_text(rubric.RUBRIC.read_text())
    people, later = (Person("s1", "Jane Doe", team="team07"), Person("s2", "Li Wu", team="team07")), DEADLINE + LATE
    entries = (
        Entry("team07", "Jane Doe_12345_file_", Path("Jane Doe_12345_file_/team07.zip"), "a" * 64, people, later),
        Entry("team08", "team08", Path("team08.zip"), "b" * 64),
    )
    facts = ClassFacts("Robots", "x", "plain", whole.sha256, "k", "0", "", 0, entries, (), (), DEADLINE, LATE_RULE)
    folder.write_facts(facts)
    for entry, status in zip(entries, (Status.GRADED, Status.REFUSED), strict=True):
        made = folder.working(entry.id)
        known = hand_ins.hand_in(entry, facts, Decisions())
        if status is Status.GRADED:
            judge(recordings.load("reference"), made, known)
        else:
            report_room.write(REFUSED, made, hand_in=known)
        folder.keep(made, Record(entry.id, status, content=entry.content, rubric=whole.sha256))
    assert hand_ins.refresh(folder) == ["team07"], "its final figure is known only after the grading"
    return folder.path


@pytest.fixture
def judged(judged_once: Path, tmp_path: Path) -> ClassFolder:
    """Return a copy of that class, which a test may change."""
    return ClassFolder(Path(shutil.copytree(judged_once, tmp_path / "class")))
