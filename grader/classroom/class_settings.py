"""What the first run of a class decides and later runs keep: sources, roster, rubric, seed, deadline, late rule."""

from __future__ import annotations

import datetime as dt
import hashlib
from argparse import Namespace
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from grader.classroom import lateness
from grader.classroom.class_folder import CLASS, RUBRIC, ClassFolder
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime
from grader.errors import UsageError
from grader.words import counted, some

_REGRADED = "makes all grades void: every submission is graded again"
_DEDUCTIONS = "changes only the deductions for lateness"
CHANGEABLE: Mapping[str, str] = {
    "source": "reads other submissions; people who are only in the old one keep their grades (--add reads both)",
    "roster": "matches submissions with people again; each submission keeps its grade",
    "rubric": f"{_REGRADED} (`grader rescore CLASS --rubric FILE` judges the saved evidence instead, in seconds)",
    "seed": _REGRADED,
    "pattern": "reads names of files otherwise; each submission keeps its grade, and may be matched with other people",
    "deadline": _DEDUCTIONS,
    "late": _DEDUCTIONS,
}
"""The settings that a later run may change, and what a change does."""
_FIELDS = {"late": "late_rule"}
_TITLES = {"late": "late rule"}


@dataclass(frozen=True)
class ClassSettings:
    """What all runs of a class have in common, as class.yaml calls it; `rubric` is a rubric's text."""

    source: str = ""
    roster: tuple[Person, ...] = ()
    rubric: str = ""
    seed: int = 0
    deadline: dt.datetime | None = None
    late_rule: str = ""
    added: tuple[str, ...] = ()
    pattern: str = ""

    @property
    def rubric_hash(self) -> str:
        """Return the SHA-256 of the rubric."""
        return hashlib.sha256(self.rubric.encode()).hexdigest()


@dataclass(frozen=True)
class Options:
    """What a run's command says. None leaves a setting of the class as it is, and `change` names those to be changed.

    Attributes:
        course: the folder of the course, for a new class.
        added: further sources, read together with the class's own.
        times: when submissions were handed in, where the sources do not say it; the class remembers them.
        only: the submissions to grade; all if it is empty.
        regrade: grade again what another kit has graded.
        fresh: grade everything again, from nothing that is kept.
        despite_doubts: grade even where a doubt about whose the submissions are would stop the class.
        minutes: after which the grading of one submission is ended.
        pattern: how the sources' files are named.
        zero_missing: whether missing, empty and damaged hand-ins get 0.
        scheduler: a Dask scheduler's address, "" for this machine with `jobs` submissions at a time.
    """

    course: Path | None = None
    rubric: Path | None = None
    seed: int | None = None
    deadline: dt.datetime | None = None
    late: str | None = None
    added: Sequence[Path] = ()
    times: tuple[HandInTime, ...] = ()
    change: Collection[str] = ()
    only: Collection[str] = ()
    regrade: bool = False
    fresh: bool = False
    despite_doubts: bool = False
    pattern: str | None = None
    zero_missing: bool | None = None
    jobs: int = 0
    minutes: int = 60
    scheduler: str = ""

    @classmethod
    def of(cls, command: Namespace, times: tuple[HandInTime, ...]) -> Options:
        """Return what a command says, whose options have the names of these fields."""
        given = {field.name: getattr(command, field.name) for field in fields(cls)}
        return cls(**given | {"times": times})


def settle(
    folder: ClassFolder, source: Path | None, people: Sequence[Person] | None, rubric: str | None, options: Options
) -> ClassSettings:
    """Return the settings of a run: the class's own, with sources added and what may be changed.

    Source, people and the text of a rubric are None where the command does not name them.

    Raises:
        UsageError: another value is given than the class has, and not as a change.
        GraderError: the late rule is none, or the class cannot be read.
    """
    if options.late:
        lateness.parse(options.late)
    given = {
        "source": str(source) if source else None,
        "roster": None if people is None else tuple(people),
        "rubric": rubric,
        "seed": options.seed,
        "pattern": options.pattern,
        "deadline": options.deadline,
        "late": options.late,
    }
    new: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if lacking := sorted(set(options.change) - set(new)):
        raise UsageError(f"--change {lacking[0]} needs the new value.", f"Add {_option(lacking[0])}.")
    had = ClassSettings()
    if source is None or (folder.path / CLASS).exists():
        facts = folder.facts()
        known = {field.name: getattr(facts, field.name) for field in fields(had) if field.name != "rubric"}
        had = ClassSettings(**known, rubric=(folder.path / RUBRIC).read_text(encoding="utf-8"))
        for name, value in new.items():
            before = getattr(had, _FIELDS.get(name, name))
            same = before == value or (name == "source" and Path(before).resolve() == Path(value).resolve())
            if name not in options.change and not same:
                has, gives = _words(name, before, value), _words(name, value, before)
                raise UsageError(
                    f"{folder.path} has {has}; the command gives {gives}. "
                    f"Changing the {_TITLES.get(name, name)} {CHANGEABLE[name]}. "
                    f"Add --change {name} if that is meant; otherwise leave out {_option(name)}: the class knows it."
                )
    settings = replace(had, **{_FIELDS.get(name, name): value for name, value in new.items()})
    sources = {Path(settings.source).resolve(): settings.source}
    for each in (*(() if "source" in options.change else had.added), *map(str, options.added)):
        sources.setdefault(Path(each).resolve(), each)
    return replace(settings, added=tuple(sources.values())[1:])


def _option(name: str) -> str:
    return "SOURCE" if name == "source" else f"--{name}"


def _words(name: str, value: Any, other: Any) -> str:
    """Return a setting in words; of a roster, whoever the `other` one does not have."""
    title = _TITLES.get(name, name)
    if not value and name != "seed":
        return f"no {title}"
    if name == "roster":
        only = [person.label for person in value if person not in other]
        more = f", {some(only, 5)} only there" if only else ""
        return f"a roster of {counted(len(value), 'person', 'people')}{more}"
    if name == "rubric":
        return f"a rubric with the hash {hashlib.sha256(value.encode()).hexdigest()[:12]}"
    shown = f"{value:%Y-%m-%d %H:%M}" if name == "deadline" else f'"{value}"' if name == "late" else value
    return f"the {title} {shown}"
