"""A class on disk: plain files, written completely or not at all; and what a person should look at before it is graded.

    class.yaml               what was graded: rubric, kit, seed, source, deadline, and each submission with its people
    rubric.yaml              the rubric by which it was graded
    plan.csv                 what the last run was about to do
    batch.log                how all runs went, with times
    submissions/ID/          record.json, report.json, report.html, evidence/
    gradebook.csv            one line for each person
    index.html               the class at a glance
    overrides.yaml           written by people, never by the kit

`record.json` is in a submission's folder only if everything beside it is complete: the folder is made elsewhere and
moved to its place by one rename.
"""

from __future__ import annotations

import datetime as dt
import fcntl
import json
import os
import shutil
from collections.abc import Iterator, Sized
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import cattrs
import yaml

from grader import report, yaml_reader
from grader.classroom.identity import Claim
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.host import tempdir
from grader.host.tempdir import write_atomically
from grader.report.data import DATA


class DoubtKind(Enum):
    """What is doubtful."""

    MOST_UNMATCHED = "most submissions match nobody"
    UNMATCHED = "matches nobody of the roster"
    AMBIGUOUS = "could be of several people"
    SEVERAL = "several hand-ins of the same people"
    NO_TIME = "no time of submission"
    GROUPS = "named after groups"
    LEFT_OUT = "cannot be graded"
    LOST = "handed in, and not among the submissions"
    UNREADABLE = "cannot be read"
    # Of classes that an earlier kit has made.
    LAYOUT = "the layout of the export"
    UNLINKED = "no account on the platform"


@dataclass(frozen=True)
class Doubt:
    """One doubt about a class.

    Attributes:
        kind: what is doubtful.
        label: the submission, person or file as the export or the roster calls it.
        what: a sentence that says what was found.
        todo: a sentence that says what to do.
        entry: the id of the submission in the class, "" if the doubt is not about one.
        people: the people of the roster whom it may concern: until it is decided, none of them handed in nothing.
        anyone: it may concern everyone who has no submission.
        stops: nothing should be graded before a person has looked at it.
    """

    kind: DoubtKind
    label: str
    what: str
    todo: str
    entry: str = ""
    people: tuple[Person, ...] = ()
    stops: bool = False
    anyone: bool = False

    @property
    def text(self) -> str:
        """Return the doubt and what to do as one line."""
        return f"{self.what} {self.todo}".strip()


def too_many(unmatched: Sized, entries: Sized) -> bool:
    """Return whether so many of the submissions match nobody that the roster is hardly that of the class."""
    return 2 * len(unmatched) > len(entries)


CLASS, RECORD, RUBRIC = "class.yaml", "record.json", "rubric.yaml"
OVERRIDES, GRADEBOOK, OVERVIEW = "overrides.yaml", "gradebook.csv", "index.html"
PLAN, LOG = "plan.csv", "batch.log"
SUBMISSIONS = "submissions"
_WORK, _LOCK = ".work", ".lock"
_UNREADABLE = (OSError, ValueError, AttributeError, KeyError, TypeError, yaml.YAMLError, cattrs.BaseValidationError)
_CLASS_SCHEMA, _RECORD_SCHEMA = "ros2-course-kit/class/1", "ros2-course-kit/record/1"


@dataclass(frozen=True)
class Entry:
    """One submission of a class.

    Attributes:
        id: its name in the class folder and in overrides.yaml: lower case letters, digits and hyphens.
        label: how the export calls it.
        number: the platform's own number for it or for who handed it in, "" if it gives none.
        path: the archive or folder.
        content: the SHA-256 of what was handed in, packed as it was.
        people: who handed it in, with all their team; empty if it is not certain.
        submitted: when, None if that is not known.
        matched: by what each of `people` was matched, in their order: what the export says of them, "team" for a
            member beside whom another one was matched, or "overrides" for a person's decision.
        late: whether the export marks it as late.
        notes: remarks for the instructor.
        source: the folder or archive in which it was found, as it was given.
        absent: an earlier run found it, and the present sources do not have it. What was graded stays.
    """

    id: str
    label: str
    path: Path
    content: str
    people: tuple[Person, ...] = ()
    submitted: dt.datetime | None = None
    late: bool = False
    notes: tuple[str, ...] = ()
    number: str = ""
    matched: tuple[Claim, ...] = ()
    source: str = ""
    absent: bool = False


class Status(Enum):
    """How the grading of a submission ended."""

    GRADED = "graded"
    REFUSED = "refused"
    """It cannot be graded as it is; the student can fix it."""
    ERROR = "error"
    """The kit or the machine failed. It is graded again by the next run."""


@dataclass(frozen=True)
class Record:
    """How one submission was graded.

    `why` says why there is no grade; `content` to `seed`, and the `package` that a person chose by its path, decide the
    result; `judge` is the kit that judged the evidence last, if that is not the one that collected it; `started` is
    local time with its zone, `seconds` wall time.
    """

    id: str
    status: Status
    why: str = ""
    content: str = ""
    rubric: str = ""
    kit: str = ""
    seed: int = 0
    judge: str = ""
    started: str = ""
    seconds: float = 0.0
    package: str = ""

    @property
    def kits(self) -> str:
        """Return which kit graded, and which one judged if that was another: their hashes, cut short."""
        return self.kit[:8] + (f", judged by {self.judge[:8]}" if self.judge not in ("", self.kit) else "")

    def holds(self, content: str, rubric: str, seed: int) -> bool:
        """Return whether the result is that of this content by this rubric and seed.

        Without a grade only the content counts: neither rubric nor seed makes a package of what is none.
        """
        return self.content == content and (
            self.status is not Status.GRADED or (self.rubric, self.seed) == (rubric, seed)
        )


@dataclass(frozen=True)
class ClassFacts:
    """What class.yaml says. Hashes are SHA-256; `source` and those `added` to it are paths as they were given."""

    title: str = ""
    source: str = ""
    layout: str = ""
    rubric: str = ""
    kit: str = ""
    version: str = ""
    commit: str = ""
    seed: int = 0
    entries: tuple[Entry, ...] = ()
    missing: tuple[Person, ...] = ()
    notes: tuple[str, ...] = ()
    deadline: dt.datetime | None = None
    late_rule: str = ""
    doubts: tuple[Doubt, ...] = ()
    roster: tuple[Person, ...] = ()
    added: tuple[str, ...] = ()
    course: str = ""
    """The course's name, as `grader.course.named` reads it."""
    ledger: tuple[str, ...] = ()
    """How the entries of the sources and the people add up."""
    claimed: tuple[Person, ...] = ()
    """Everyone of whom a list of times or states said that they handed in."""
    zero_missing: bool = False
    """A person has decided that whoever handed in nothing, or nothing that can be graded, gets 0."""

    def doubt_about(self, person: Person) -> Doubt | None:
        """Return the doubt for which somebody without a submission has not handed in nothing."""
        return next((doubt for doubt in self.doubts if doubt.anyone or person in doubt.people), None)


class ClassFolder:
    """One class folder. Reading needs nothing but the files; writing needs the lock."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def overrides(self) -> Path:
        """Return the path of the people's decisions; the file need not exist."""
        return self.path / OVERRIDES

    def submission(self, name: str) -> Path:
        """Return the folder of one submission's results."""
        return self.path / SUBMISSIONS / name

    def located(self, source: str) -> Path:
        """Return where a source of the class is: where it was given, or near the class if both were moved together."""
        given = Path(source)
        parents = list(self.path.resolve().parents)[:3]
        near = [parents[0] / given.name, *(parent / given for parent in parents)]
        return next((path for path in (given, *near) if path.exists()), given)

    def facts(self) -> ClassFacts:
        """Return what class.yaml says.

        Raises:
            GraderError: this is not a class folder, or the file is damaged.
        """
        path = self.path / CLASS
        if not path.is_file():
            raise GraderError(
                f"{self.path} is not a class: it has no {CLASS}. `grader batch SOURCE --out CLASS` makes one."
            )
        try:
            data = yaml.load(path.read_text(encoding="utf-8"), yaml_reader.FAST_LOADER)
            if data.pop("schema") != _CLASS_SCHEMA:
                raise ValueError("made by another version of the kit")
            told = {name: value for name, value in data.items() if value is not None}  # a list may be emptied by hand
            return _CONVERTER.structure(told, ClassFacts)
        except _UNREADABLE as error:
            raise GraderError(
                f"{path} is damaged ({type(error).__name__}: {error}). Move it away and run `grader batch` with the "
                "source and all options, as the first time; what is graded stays graded."
            ) from error

    def write_facts(self, facts: ClassFacts) -> None:
        """Write class.yaml."""
        data = {"schema": _CLASS_SCHEMA} | _CONVERTER.unstructure(facts)
        write_atomically(self.path / CLASS, yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120))

    def record(self, name: str) -> Record | None:
        """Return how a submission was graded, None if it was not, or not to its end."""
        try:
            data = json.loads((self.submission(name) / RECORD).read_text(encoding="utf-8"))
            if data.pop("schema") != _RECORD_SCHEMA:
                return None
            return _CONVERTER.structure(data, Record)
        except _UNREADABLE:
            return None

    def current(self, entry: Entry, facts: ClassFacts) -> Record | None:
        """Return how a submission was graded; None if that was for other content, another rubric or another seed.

        A run that was interrupted leaves results of the run before it.
        """
        record = self.record(entry.id)
        return record if record and record.holds(entry.content, facts.rubric, facts.seed) else None

    def report(self, name: str, *, for_student: bool = False) -> dict[str, Any]:
        """Return a submission's report.json, {} if there is none; `for_student` without what is held back."""
        folder = self.submission(name)
        path = report.for_student(folder, DATA) if for_student else folder / DATA
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return data if isinstance(data, dict) else {}

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the folder, so that no second run writes to it; remove what a killed run has left.

        Raises:
            GraderError: another run holds it, or it cannot be written.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            handle = os.open(self.path / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise GraderError(f"{self.path} cannot be written ({error.strerror}). Choose another --out.") from error
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise GraderError(
                    f"{self.path} is being written by another run of the grader. Wait for its end."
                ) from None
            tempdir.remove(self.path / _WORK)
            yield
        finally:
            os.close(handle)
            shutil.rmtree(self.path / _WORK, ignore_errors=True)

    def working(self, name: str) -> Path:
        """Return a new empty folder in which one submission's results can be made."""
        folder = self.path / _WORK / name
        tempdir.remove(folder)
        folder.mkdir(parents=True)
        return folder

    def keep(self, made: Path, record: Record) -> None:
        """Move the results in `made` to their place, together with their record, instead of earlier ones."""
        write_atomically(
            made / RECORD, json.dumps({"schema": _RECORD_SCHEMA} | _CONVERTER.unstructure(record), indent=2) + "\n"
        )
        place = self.submission(record.id)
        place.parent.mkdir(exist_ok=True)
        if place.exists():
            place.rename(self.working(f"{record.id}-old") / place.name)
        made.rename(place)


def _converter() -> cattrs.Converter:
    converter = cattrs.Converter()
    converter.register_unstructure_hook(Path, lambda path: path.as_posix())
    converter.register_structure_hook(Path, lambda value, _: Path(value))
    converter.register_unstructure_hook(dt.datetime, lambda time: time.isoformat(timespec="seconds"))
    converter.register_structure_hook(
        dt.datetime, lambda value, _: value if isinstance(value, dt.datetime) else dt.datetime.fromisoformat(value)
    )
    # Only what the roster knows about a person is written.
    converter.register_unstructure_hook(Person, lambda person: {k: v for k, v in asdict(person).items() if v})
    return converter


_CONVERTER = _converter()
