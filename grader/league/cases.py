"""Cases that a submission hands in for the league: read as untrusted text, and run on packages of the league."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from grader import yaml_reader
from grader.course import Course
from grader.errors import GraderError
from grader.evidence import LeagueCase
from grader.league.pool import Package
from grader.sandbox import untrusted
from grader.sanitize import one_line
from grader.settings import Settings
from grader.trials import case as cases
from grader.trials.case import Case
from grader.trials.observers import Observers
from grader.trials.promises import LIVES, Run, first_broken, hunts, unjudged
from grader.words import mark, say

FOLDER = "cases"
"""In a package: the folder of the files, `*.yaml`, that it hands in."""
MOST, LONGEST_S = 5, 30.0
"""How many files count, and how many simulated seconds a case may take."""
_BYTES, _STEPS, _DEEPEST = 10_000, 100, 6
_TAKE_TIME = ("wait", "arrive", "interrupt")


def read(package: Path, course: Course) -> list[tuple[LeagueCase, Case | None]]:
    """Return what a package hands in, by path, each with its case, or with the problem and None.

    The first few files are cases, and each further one is a problem.
    """
    found: list[tuple[LeagueCase, Case | None]] = []
    for number, file in enumerate(sorted((package / FOLDER).glob("*.yaml")), 1):
        name = one_line(file.relative_to(package).as_posix())
        try:
            if number > MOST:
                raise GraderError(say("{name} does not count: at most {most} files do.", name=name, most=MOST))
            found.append((LeagueCase(name), _case(file, name, course)))
        except GraderError as error:
            found.append((LeagueCase(name, problem=one_line(str(error), 500)), None))
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


@dataclass(frozen=True)
class CaseRun:
    """What came of a case on one package: the promise that was `broken` and how, "" if none was, or a `problem`."""

    broken: str = ""
    problem: str = ""


def run_cases(package: Package, cases: Sequence[Case], folder: Path, settings: Settings) -> list[CaseRun]:
    """Return what came of the cases on a package, in order."""
    (folder / "trials").mkdir(parents=True)
    source, built, contract = package.built(folder, settings)
    with Observers(
        settings.course, install=built.install, contract=contract.install, folder=folder / "trials",
        seed=settings.seed, package=source, ros_name=built.facts.package,
    ) as observers:  # fmt: skip
        return [run_case(case, f"case-{number}", observers, settings.course) for number, case in enumerate(cases, 1)]


def run_case(case: Case, name: str, observers: Observers, course: Course) -> CaseRun:
    """Return what came of a case, run as the trial `name`.

    A promise counts as broken if one is when the case is run again, too.
    """
    found = CaseRun()
    for time in range(2):
        trial = observers.run(case.plan(f"{name}-{time}"))
        if trial.script_error or unjudged(trial):
            why = trial.script_error.strip().splitlines()[-1] if trial.script_error else str(trial.ended)
            return CaseRun(problem=say("it cannot be run: {why}", why=one_line(why)))
        try:
            broken = first_broken((*hunts(course).promises, LIVES), Run(case, trial))
        except Exception as error:  # of the course's own code, by what a student has made up
            return CaseRun(problem=say("it cannot be judged: {why}", why=one_line(f"{type(error).__name__}: {error}")))
        if broken is None:
            return CaseRun()
        found = CaseRun(one_line(f"{broken[0].words} {broken[1].seen}", 500))
    return found
