"""Read overrides.yaml: what people have decided about a class. Every mistake in it is named with its line.

docs/classes.md shows a whole one. The kit never writes this file.
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import yaml

from grader import yaml_reader
from grader.classroom.class_folder import ClassFacts, ClassFolder, Doubt, DoubtKind, too_many
from grader.classroom.identity import ANY, Claim, identify
from grader.classroom.roster import IDENTITY, Person
from grader.classroom.times import local_time
from grader.scoring.grading import Decision
from grader.scoring.rubric import Rubric
from grader.yaml_reader import YamlReader


@dataclass(frozen=True)
class Reason:
    """Who decided, and why: that no grade is expected, or that integrity flags need not keep any points."""

    why: str
    by: str


@dataclass(frozen=True)
class Extension:
    """A later deadline."""

    until: dt.datetime
    why: str
    by: str


_ADJUSTED = {"points": "{:+f} points", "total": "total of {:f} points", "bonus": "bonus of {:f} points"}


@dataclass(frozen=True)
class Adjustment:
    """A change of the whole instead of one requirement.

    `change` is "points" (added or subtracted after lateness; the total stays between 0 and the maximum), "total" (that
    is it, whatever was graded) or "bonus" (added at last, also beyond the maximum).
    """

    change: str
    points: Decimal
    why: str
    by: str

    def __str__(self) -> str:
        return f"{_ADJUSTED[self.change].format(self.points)} by {self.by} ({self.why})"


@dataclass(frozen=True)
class SubmissionDecision:
    """What people have decided about one submission."""

    points: tuple[Decision, ...] = ()
    adjustments: tuple[Adjustment, ...] = ()
    comments: tuple[str, ...] = ()
    submitted: dt.datetime | None = None
    flags_accepted: Reason | None = None
    package: str = ""
    """Which package is graded, by its path in the submission, instead of the grader's choice."""
    people: tuple[Person, ...] | None = None
    """Whose it is, instead of whom the export was matched with; None if that was not decided."""


@dataclass(frozen=True)
class PersonDecision:
    """What people have decided about one student."""

    excused: Reason | None = None
    extension: Extension | None = None
    adjustments: tuple[Adjustment, ...] = ()
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class Decisions:
    """All decisions, by submission id and by Person.key."""

    submissions: Mapping[str, SubmissionDecision] = field(default_factory=dict)
    people: Mapping[tuple[str, str], PersonDecision] = field(default_factory=dict)

    def on(self, submission: str) -> SubmissionDecision:
        """Return the decisions on a submission."""
        return self.submissions.get(submission, SubmissionDecision())

    def about(self, person: Person) -> PersonDecision:
        """Return the decisions about a student."""
        return self.people.get(person.key, PersonDecision())


def load(path: Path, submissions: Iterable[str], people: Sequence[Person], rubric: Rubric) -> Decisions:
    """Return the decisions in `path`, none if there is no such file.

    Raises:
        GraderError: it cannot be read, or names something that the class or the rubric does not have.
    """
    root = yaml_reader.read(path) if path.exists() else None
    return _Reader(tuple(submissions), people, rubric).read(root) if root else Decisions()


def of_class(folder: ClassFolder, facts: ClassFacts, rubric: Rubric) -> Decisions:
    """Return what the class's overrides.yaml says; as `load`."""
    everyone = [*dict.fromkeys(person for entry in facts.entries for person in entry.people), *facts.missing]
    return load(folder.overrides, [entry.id for entry in facts.entries], everyone, rubric)


def applied(facts: ClassFacts, decisions: Decisions) -> ClassFacts:
    """Return the facts with the people and times that a person gave to submissions, without doubts that are decided.

    class.yaml keeps what was found, so that a decision can be taken back.
    """
    assigned = {name: on.people for name, on in decisions.submissions.items() if on.people is not None}
    timed = [replace(entry, submitted=decisions.on(entry.id).submitted or entry.submitted) for entry in facts.entries]
    entries = tuple(
        replace(entry, people=people, matched=(Claim("overrides", "overrides.yaml"),) * len(people))
        if (people := assigned.get(entry.id)) is not None
        else entry
        for entry in timed
    )
    everyone = dict.fromkeys([*(who for entry in facts.entries for who in entry.people), *facts.missing])
    handed_in = {who.key for entry in entries for who in entry.people}
    whose = (DoubtKind.UNMATCHED, DoubtKind.AMBIGUOUS)
    doubts = tuple(doubt for doubt in facts.doubts if doubt.kind not in whose or doubt.entry not in assigned)
    if not too_many([entry for entry in entries if not entry.people and entry.id not in assigned], entries):
        doubts = tuple(doubt for doubt in doubts if doubt.kind is not DoubtKind.MOST_UNMATCHED)
    doubts = tuple(each for doubt in doubts if (each := _undecided(doubt, decisions)))
    missing = tuple(who for who in everyone if who.key not in handed_in)
    return replace(facts, entries=entries, missing=missing, doubts=doubts)


def _undecided(doubt: Doubt, decisions: Decisions) -> Doubt | None:
    """Return a doubt without those to whom a person gave a total or an excuse; None if it was about nobody else."""
    if doubt.kind is not DoubtKind.LOST or not doubt.people:
        return doubt
    about = {who: decisions.about(who) for who in doubt.people}
    left = tuple(
        who for who, on in about.items() if not on.excused and all(each.change != "total" for each in on.adjustments)
    )
    return replace(doubt, people=left) if left else None


class _Reader(YamlReader):
    def __init__(self, submissions: Sequence[str], people: Sequence[Person], rubric: Rubric) -> None:
        self._submissions = submissions
        self._worth = {requirement.id: requirement.points for requirement in rubric.requirements}
        self._people = people
        self._names = {getattr(person, kind) for person in people for kind in (*IDENTITY, "name")} - {""}

    def read(self, root: yaml.Node) -> Decisions:
        submissions: dict[str, SubmissionDecision] = {}
        about: dict[tuple[str, str], PersonDecision] = {}
        for key, _, value in self.mapping(root, ("submissions", "people")):
            for name, where, decided in self.mapping(value):
                if key == "submissions":
                    self.require_known(name, where, self._submissions, "a submission of this class")
                    submissions[name] = SubmissionDecision(**self._decided(decided, {
                        "points": lambda node: tuple(self._points(*each) for each in self.mapping(node)),
                        "flags_accepted": self._reason, "submitted": self._time, "package": self.text,
                        "people": lambda node: tuple(self._person(self.text(each), each) for each in _listed(node)),
                    }))  # fmt: skip
                else:
                    known = {"excused": self._reason, "extension": self._extension}
                    about[self._person(name, where).key] = PersonDecision(**self._decided(decided, known))
        return Decisions(submissions, about)

    def _decided(self, node: yaml.Node, known: Mapping[str, Callable[[yaml.Node], object]]) -> dict[str, Any]:
        """Return what is decided about a submission or a person, by the names of its fields."""
        found: dict[str, Any] = {"adjustments": ()}
        for key, _, value in self.mapping(node, (*known, "adjust", "bonus", "comments")):
            if key in ("adjust", "bonus"):
                found["adjustments"] += (self._adjustment(key, value),)
            elif key == "comments":
                found[key] = tuple(self.text(each) for each in _listed(value))
            else:
                found[key] = known[key](value)
        return found

    def _person(self, name: str, where: yaml.Node) -> Person:
        found = identify([Claim(ANY, name)], self._people)
        if not found.people and not found.why:
            self.require_known(name, where, self._names, "a person of this class")
        if not found.people:
            names = " or ".join(f"{value} ({kind})" for kind, value in (person.key for person in found.rivals))
            several = f"is {len(found.rivals)} people of this class" if found.rivals[1:] else f"is nobody: {found.why}"
            self.fail(where, f"{name} {several}; write {names}")
        return found.people[0]

    def _reason(self, node: yaml.Node) -> Reason:
        given = self.fields(node, node, ("why", "by"), "a decision")
        return Reason(self.text(given["why"]), self.text(given["by"]))

    def _extension(self, node: yaml.Node) -> Extension:
        given = self.fields(node, node, ("until", "why", "by"), "a decision")
        return Extension(self._time(given["until"]), self.text(given["why"]), self.text(given["by"]))

    def _adjustment(self, key: str, node: yaml.Node) -> Adjustment:
        given = self.fields(node, node, ("why", "by"), "a decision", ("points", "total"))
        kinds = [kind for kind in ("points", "total") if kind in given]
        allowed = ("points",) if key == "bonus" else ("points", "total")
        if len(kinds) != 1 or kinds[0] not in allowed:
            self.fail(node, f"{key} needs {' or '.join(allowed)}, why, by")
        most = sum(self._worth.values()) if kinds[0] == "total" else None
        value = self.points(given[kinds[0]], most, "the rubric")
        if key == "bonus" and value < 0:
            self.fail(given["points"], f"a bonus of {value} points is none; `adjust` subtracts points")
        return Adjustment(
            "bonus" if key == "bonus" else kinds[0], value, self.text(given["why"]), self.text(given["by"])
        )

    def _points(self, name: str, where: yaml.Node, node: yaml.Node) -> Decision:
        self.require_known(name, where, self._worth, "a requirement of the rubric")
        given = self.fields(node, node, ("points", "why", "by"), "a decision")
        value = self.points(given["points"], self._worth[name], name)
        return Decision(name, float(value), self.text(given["why"]), self.text(given["by"]))

    def _time(self, node: yaml.Node) -> dt.datetime:
        if (time := local_time(self.text(node))) is None:
            self.fail(node, f"{self.text(node)} is not a time; write it as 2026-11-21T10:00")
        return time


def _listed(node: yaml.Node) -> list[yaml.Node]:
    return list(node.value) if isinstance(node, yaml.SequenceNode) else [node]
