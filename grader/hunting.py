"""The verb `grader hunt`: build a package, make up cases, find one in which a promise is broken, and keep it."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import building, collect, pipeline
from grader.checks import build_log
from grader.course import Course, find
from grader.errors import GraderError, SubmissionError, UsageError
from grader.hunt import report, search
from grader.hunt.search import Runner, of_build
from grader.processes import jobs, supervised
from grader.progress import Progress
from grader.scoring import rubric
from grader.settings import Settings
from grader.trials.promises import LIVES, Run, first_broken, hunts, unjudged
from grader.words import mark, say, say_count

CASES = 300


@contextmanager
def runner(package: Path, settings: Settings) -> Iterator[Runner]:
    """Build a package, or take its build, and yield what runs cases on it.

    Raises:
        SubmissionError: it cannot be read, or does not build.
        GraderError: this host cannot build or run it.
    """
    pipeline.require_host(settings)
    with pipeline.taken_in(package, settings) as subject:
        built, contract = jobs.run(collect.builds(subject), progress=settings.progress).results[collect.BUILD]
        if not built.facts.ok:
            said = build_log.find_error(built.facts.log_tail).said or say("`colcon build` failed")
            raise SubmissionError(
                say("{package} does not build: {error}", package=package.name, error=said),
                say("Build it first; `grader check` shows the whole message."),
            )
        yield of_build(replace(subject, built=built, contract=contract))


def add(verbs: Any) -> None:
    """Add the verb to the command line."""
    parser = verbs.add_parser(
        "hunt",
        help="make up worlds until a package breaks a promise",
        description="Make up trials within the contract, run the package in them, and stop at the first in which it\n"
        "breaks a promise; make that one as small as possible, and keep it as a file and as a page with its replay.",
        epilog="Example:  grader hunt REQUIREMENT --package ws/src/PACKAGE --for 60\n"
        "Exit status: 0 no fault found, 1 a fault found, 2 wrong usage, 3 an error of the kit or host.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("requirements", nargs="*", metavar="REQUIREMENT", help="what to hunt for (default: all)")
    parser.add_argument("--package", type=Path, default=Path(), help="the package's folder (default: this one)")
    parser.add_argument("--cases", type=int, default=CASES, help=f"how many to try (default {CASES})")
    parser.add_argument("--for", type=float, metavar="S", dest="seconds", help="try no new case after S seconds")
    parser.add_argument("--seed", type=int, default=0, help="the same seed tries the same cases (default 0)")
    parser.add_argument("--again", type=Path, metavar="CASE", help="run the case in this file again, and nothing else")
    parser.add_argument("--out", type=Path, default=Path("hunt"), help="the folder for what is found (default: hunt)")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course (default: as for grade)")
    parser.add_argument("--cache", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--facts", type=Path, help=argparse.SUPPRESS)  # for a notebook: the outcome as JSON
    parser.set_defaults(run=main, interrupted=mark("what was found by then is in the folder that --out names."))


def main(options: argparse.Namespace) -> int:
    """Hunt, say what was found, and return the exit status."""
    if options.cases < 1:
        raise UsageError(say("--cases must be at least 1."))
    course = find(options.course)
    again = report.read(options.again, course) if options.again else None
    of_course = None if again else hunts(course).of(options.requirements)
    progress = Progress()
    step = progress.show if options.facts is None else lambda what: print(supervised.STEP + what, flush=True)
    settings = Settings(
        rubric=rubric.load(course.rubric), course=course, cache=options.cache or building.cache_folder(),
        requirements=of_course[0].serves if of_course else (), progress=progress.say if options.facts is None else step,
    )  # fmt: skip
    with runner(options.package, settings) as running:
        if of_course is None:
            assert again is not None
            progress.done()
            return _again(running.again(again[0], 1)[0], again, course)
        begun = time.monotonic()

        def keep(finding: search.Finding) -> None:
            report.save(finding, options.out)
            step(say("found: {seen}; making it smaller", seen=finding.broken.seen))

        found = search.hunt(
            running, *of_course, cases=options.cases, seed=options.seed, found=keep,
            goes_on=lambda: options.seconds is None or time.monotonic() - begun < options.seconds,
            tried=lambda number: step(say("{n} cases tried", n=number)),
        )  # fmt: skip
    progress.done()
    if options.facts:
        options.facts.write_text(json.dumps(_facts(found, options.out)), encoding="utf-8")
        return 0
    return _say(found, options.out)


def _facts(found: search.Hunted, out: Path) -> dict[str, Any]:
    """Return the outcome as a notebook shows it."""
    facts: dict[str, Any] = {"cases": found.cases, "left_out": _left_out(found)}
    if found.finding:
        facts |= {"rows": report.rows(found.finding), "file": str(report.save(found.finding, out))}
    return facts


def _left_out(found: search.Hunted) -> str:
    """Return in words how many cases failed once and not again, or could not be judged, "" for none."""
    words = []
    if found.unsteady:
        words.append(say_count(
            "{n} case failed once and not again; it is not shown.",
            "{n} cases failed once and not again; they are not shown.",
            len(found.unsteady),
        ))  # fmt: skip
    if found.unjudged:
        trial = found.unjudged[0]
        why = trial.script_error.strip().rpartition("\n")[2] if trial.script_error else str(trial.ended)
        words.append(say("{n} of the cases could not be judged; of the first: {why}", n=len(found.unjudged), why=why))
    return " ".join(words)


def _say(found: search.Hunted, out: Path) -> int:
    if words := _left_out(found):
        print(words)
    if found.finding is None:
        print(say("{n} cases, no fault found, seed {seed}.", n=found.cases, seed=found.seed))
        return 0
    file = report.save(found.finding, out)
    print(say("Found in case {n}, seed {seed}:", n=found.finding.after, seed=found.seed))
    for name, text in report.rows(found.finding):
        print(f"  {name + ':':10} {text}")
    print(say("The replay: {page}. Again: grader hunt --again {file}", page=file.with_suffix(".html"), file=file))
    if (test := report.test_of(file)).exists():
        print(say("As a test of your package: {test}", test=test))
    return 1


def _again(trial: Any, again: tuple[Any, str], course: Course) -> int:
    case, name = again
    if trial.script_error:
        raise GraderError(say("The case cannot be run: {error}", error=trial.script_error))
    if unjudged(trial):
        raise GraderError(say("The case cannot be judged: {why}", why=trial.ended))
    promises, run = (*hunts(course).promises, LIVES), Run(case, trial)
    # Of a case that a person has changed another promise may be the one that is broken.
    broken = first_broken([each for each in promises if each.name == name], run) or first_broken(promises, run)
    if broken is None:
        print(say("No fault: every promise was kept in this case."))
        return 0
    promise, found = broken
    for row in report.rows(search.Finding(case, trial, promise, found, 1)):
        print(f"  {row[0] + ':':10} {row[1]}")
    return 1
