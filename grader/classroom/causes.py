"""Count over a class what its submissions lost points for: first causes, failed checks, and what was not reached."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from grader.sanitize import prose
from grader.scoring.rubric import Requirement, Rubric

_WORDS = 240  # characters of a message
# Not the digits of a name: `ros2_robot_controller`, F4 and `test_2` stay what they are.
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:[.:]\d+)*(?:e[-+]?\d+)?(?!\w)")
_CUT = re.compile(r"\s*\S+ \(… characters more\)")  # what sanitize says of a text that it has cut
_NAMED = re.compile(r"([A-Z]\d+)\b")


@dataclass
class Message:
    """What several submissions were told, without its numbers, and by how many points each of them lost with it."""

    words: str
    lost: dict[str, float] = field(default_factory=dict)

    @property
    def points(self) -> float:
        """Return the points that all of them lost."""
        return sum(self.lost.values())


@dataclass
class Topic:
    """What points were lost for: the requirements, where the course teaches them, and the messages about it."""

    title: str
    requirements: dict[str, Requirement] = field(default_factory=dict)
    messages: dict[str, Message] = field(default_factory=dict)

    @property
    def submissions(self) -> list[str]:
        """Return the submissions that lost points."""
        return sorted({name for message in self.messages.values() for name in message.lost})

    @property
    def points(self) -> float:
        """Return the points that all of them lost."""
        return sum(message.points for message in self.messages.values())

    @property
    def is_shared(self) -> bool:
        """Return whether several submissions lost points."""
        return len(self.submissions) > 1

    @property
    def sections(self) -> list[str]:
        """Return the sections of the course that teach the requirements."""
        return list(dict.fromkeys(requirement.section for requirement in self.requirements.values()))

    @property
    def dearest(self) -> list[Message]:
        """Return the messages, those that cost most first."""
        return sorted(self.messages.values(), key=lambda message: (-round(message.points, 6), -len(message.lost)))

    def add(self, submission: str, words: str, lost: float, *requirements: Requirement) -> None:
        """Count a loss of a submission."""
        self.requirements |= {requirement.id: requirement for requirement in requirements}
        message = self.messages.setdefault(words, Message(words))
        message.lost[submission] = message.lost.get(submission, 0.0) + lost


@dataclass(frozen=True)
class Causes:
    """What a class lost points for, the dearest first.

    Attributes:
        first: causes from which the losses of several requirements of a submission follow, and refusals.
        failed: checks that failed, or passed in part.
        not_reached: why checks could not be judged at all.
    """

    first: tuple[Topic, ...]
    failed: tuple[Topic, ...]
    not_reached: tuple[Topic, ...]


def count(reports: Mapping[str, Mapping[str, Any]], rubric: Rubric) -> Causes:
    """Return what the submissions lost points for, by their report.json."""
    first: dict[str, Topic] = {}
    failed: dict[str, Topic] = {}
    not_reached: dict[str, Topic] = {}
    known = {requirement.id: requirement for requirement in rubric.requirements}
    for submission, report in reports.items():
        if words := (report.get("cause") or {}).get("sentence", "") or (report.get("refused") or {}).get("because", ""):
            topic = first.setdefault(without_numbers(words), Topic(without_numbers(words)))
            lost = report["cause"]["points"] if report.get("cause") else sum(r.points for r in known.values())
            topic.add(submission, topic.title, lost, *_named(words, report, known))
        for requirement, check, lost in _losses(report, known):
            if check["outcome"] == "not_reached":
                words = without_numbers(check["because"])
                not_reached.setdefault(words, Topic(words)).add(submission, words, lost, requirement)
            else:
                title = prose(check["sentence"].replace("`", "") or check["id"])
                topic = failed.setdefault(check["id"], Topic(title))
                topic.add(submission, without_numbers(check["seen"]), lost, requirement)
    return Causes(*(tuple(sorted(found.values(), key=_rank)) for found in (first, failed, not_reached)))


def without_numbers(words: str) -> str:
    """Return a message on one line with "…" for each number, so that it is the same for everyone whom it concerns."""
    text = _CUT.sub("…", _NUMBER.sub("…", prose(words.replace("`", ""))))
    return text if len(text) <= _WORDS else f"{text[:_WORDS]}…"


def _losses(
    report: Mapping[str, Any], known: Mapping[str, Requirement]
) -> Iterator[tuple[Requirement, Mapping[str, Any], float]]:
    for each in report.get("requirements", ()):
        for check in each["checks"] if each["id"] in known else ():
            lost = check.get("worth", 0.0) * (1 - check.get("fraction", 0.0))
            if check["outcome"] in ("failed", "not_reached") or (check["outcome"] == "partial" and lost >= 0.005):
                yield known[each["id"]], check, lost


def _named(words: str, report: Mapping[str, Any], known: Mapping[str, Requirement]) -> list[Requirement]:
    """Return the requirement that a first cause is about: the one it names, or the first whose checks say the same."""
    if (named := _NAMED.match(words)) and named[1] in known:
        return [known[named[1]]]
    said = words.partition(": ")[2]
    for requirement, check, _ in _losses(report, known):
        if check["outcome"] == "failed" and said and said[:40] in " ".join(check["seen"].split()):
            return [requirement]
    return []


def _rank(topic: Topic) -> tuple[float, int]:
    return -round(topic.points, 6), -len(topic.submissions)
