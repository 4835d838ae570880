"""What the first run of a class decides and later runs keep: sources, roster, rubric, seed, deadline, late rule."""

from __future__ import annotations

import datetime as dt
from argparse import Namespace
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

from grader.classroom import lateness
from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime
from grader.errors import UsageError
from grader.words import counted

_VOID = ("seed", "rubric")
"""The settings of which another value makes all grades void; any other only says whose a grade is, or how late."""


@dataclass(frozen=True)
class Options:
    """What a run's command says. None leaves a setting of the class as it is.

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
    late_rule: str | None = None
    added: Sequence[Path] = ()
    times: tuple[HandInTime, ...] = ()
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
    folder: ClassFolder, before: ClassFacts | None, source: Path | None, people: Sequence[Person] | None,
    rubric: str | None, options: Options,
) -> tuple[ClassFacts, list[str]]:  # fmt: skip
    """Return the class as it was `before` but for what the command says, and a remark on each setting that changes.

    Source, people and the hash of a rubric are None where the command does not name them.

    Raises:
        UsageError: another seed or rubric is given than the class has, and not to grade everything anew.
        GraderError: the late rule is none.
    """
    if options.late_rule:
        lateness.parse(options.late_rule)
    had = before or ClassFacts()
    if before and source and Path(had.source).resolve() == source.resolve():
        source = None
    given = {
        "source": str(source) if source else None,
        "roster": None if people is None else tuple(people),
        "rubric": rubric,
        **{name: getattr(options, name) for name in ("seed", "pattern", "deadline", "late_rule")},
    }
    new: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    changed = [name for name, value in new.items() if before and getattr(had, name) != value]
    if void := [] if options.fresh else [name for name in changed if name in _VOID]:
        raise UsageError(
            f"{folder.path} has another {void[0]}. With this one all grades are void: every submission is graded "
            "again, though `grader rescore CLASS --rubric FILE` judges the saved evidence by a rubric in seconds.",
            f"Add --fresh if that is meant; otherwise leave out --{void[0]}: the class knows it.",
        )
    now = replace(had, **new)
    sources = {Path(now.source).resolve(): now.source}
    for each in (*(() if "source" in changed else had.added), *map(str, options.added)):
        sources.setdefault(Path(each).resolve(), each)
    remarks = [
        f"The {name.replace('_', ' ')} was {_words(getattr(had, name))}, and is {_words(new[name])} from now on."
        for name in changed
        if name not in _VOID
    ]
    return replace(now, added=tuple(sources.values())[1:]), remarks


def _words(value: Any) -> str:
    if isinstance(value, tuple):
        return counted(len(value), "person", "people")
    return f"{value:%Y-%m-%d %H:%M}" if isinstance(value, dt.datetime) else f"{value or 'none'}"
