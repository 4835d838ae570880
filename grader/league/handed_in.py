"""Read the cases that a submission hands in for the league. What is read is untrusted, and nothing of it runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.course import Course
from grader.errors import GraderError
from grader.sandbox import untrusted
from grader.sanitize import one_line
from grader.trials import case as cases
from grader.trials.case import Case
from grader.words import mark, say

FOLDER = "cases"
"""In a package: the folder of the files, `*.yaml`, that it hands in."""
MOST, LONGEST_S = 5, 30.0
"""How many files count, and how many simulated seconds a case may take."""
_BYTES, _STEPS, _DEEPEST = 10_000, 100, 6
_TAKE_TIME = ("wait", "arrive", "interrupt")


@dataclass(frozen=True)
class HandedIn:
    """A file by its path in the package: a case, or None and the `problem` with it."""

    path: str
    case: Case | None
    problem: str = ""


def read(package: Path, course: Course) -> list[HandedIn]:
    """Return what a package hands in, by path; the first few files are cases, and each further one is a problem."""
    found = []
    for number, file in enumerate(sorted((package / FOLDER).glob("*.yaml")), 1):
        name = one_line(file.relative_to(package).as_posix())
        try:
            if number > MOST:
                raise GraderError(say("{name} does not count: at most {most} files do.", name=name, most=MOST))
            found.append(HandedIn(name, _case(file, name, course)))
        except GraderError as error:
            found.append(HandedIn(name, None, one_line(str(error), 500)))
    return found


def _case(file: Path, name: str, course: Course) -> Case:
    text = untrusted.read_text(file, _BYTES, errors="replace")
    if text is None:
        raise GraderError(say("{name} is not a file of at most {most} bytes.", name=name, most=_BYTES))
    _require_plain(text, name)
    case = cases.of_text(Path(name), text, course)
    seconds = sum(step.to for step in case.steps if step.do in _TAKE_TIME)
    if len(case.steps) > _STEPS or seconds > LONGEST_S:
        words = mark(
            "{name} has {n} steps and takes {seconds:g} s of simulated time; at most {steps} and {most:g} s count."
        )
        raise GraderError(say(words, name=name, n=len(case.steps), seconds=seconds, steps=_STEPS, most=LONGEST_S))
    return case


def _require_plain(text: str, name: str) -> None:
    """Refuse what a case never needs, and what could make a small file a large one."""
    depth = 0
    try:
        for event in yaml.parse(text, yaml_reader.FAST_LOADER):
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            anchor, tag = getattr(event, "anchor", None), getattr(event, "tag", None)
            value = event.value.replace("\n", "") if isinstance(event, yaml.ScalarEvent) else ""
            if anchor or tag or depth > _DEEPEST or not value.isprintable():
                raise GraderError(
                    say("{name}, line {line}: write the value out, without &, *, ! or characters that do not show",
                        name=name, line=event.start_mark.line + 1 if event.start_mark else "?")
                )  # fmt: skip
    except yaml.YAMLError:
        return  # named with its line when it is read
