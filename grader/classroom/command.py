"""The verbs of a class: `grader batch`, and those that work on the folder that it makes."""

from __future__ import annotations

import argparse
import datetime as dt
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

from grader.classroom import after_grading, batch, class_folder, class_settings, file_names, plan, roster, times
from grader.classroom.class_folder import ClassFolder, Record, Status
from grader.classroom.plan import Plan
from grader.classroom.roster import Person
from grader.errors import EXIT_GRADED, EXIT_INTERRUPTED, EXIT_OUR_FAULT, KitError, UsageError
from grader.progress import Progress
from grader.sanitize import printable
from grader.words import counted


def add(verbs: Any, course_texts: Callable[[], Mapping[str, str]]) -> None:
    """Add the verbs to the grader's. `course_texts` returns what the course gives to all, by path."""
    after_grading.add(verbs, course_texts)
    parser = verbs.add_parser(
        "batch",
        help="grade a class",
        description="Grade every submission of a class: an export of Moodle, Canvas or Gradescope, clones of GitHub "
        "Classroom, or a folder of archives and folders. The class remembers source, roster, rubric, seed, deadline "
        "and late rule: `grader batch --out CLASS` goes on where a run was interrupted.",
        epilog="Example:  grader batch submissions.zip --roster roster.csv --out class --plan",
    )
    parser.add_argument(
        "source", type=Path, nargs="?", help="the folder or the archive with the submissions; a class knows its own"
    )
    parser.add_argument("--out", type=Path, metavar="CLASS", help="the folder for the class's results")
    parser.add_argument(
        "--plan", action="store_true", help="only show what would be done, and write it to CLASS/plan.csv"
    )
    parser.add_argument("--roster", type=Path, help="CSV with columns such as id, name, email, login, team")
    parser.add_argument(
        "--times", type=Path, nargs="+", default=[], metavar="LIST",
        help="when submissions were handed in: a grading worksheet of Moodle, a list of submissions of Canvas (JSON), "
        "or a CSV with a column submitted; a roster with such a column is enough",
    )  # fmt: skip
    parser.add_argument(
        "--pattern", metavar="NAMES",
        help=f"how files are named where the platform is not recognised: {', '.join(file_names.KNOWN)}, or words such "
        "as {login}_{time}_{attempt} (docs/classes.md)",
    )  # fmt: skip
    parser.add_argument("--rubric", type=Path, help="a rubric other than the course's own")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course, for a new class")
    parser.add_argument("--seed", type=int, help="decides speeds, places and noise (default 0)")
    parser.add_argument(
        "--add", type=Path, nargs="+", default=[], metavar="SOURCE", help="read a further export, such as of late ones"
    )
    parser.add_argument(
        "--change", nargs="+", default=[], choices=list(class_settings.CHANGEABLE), metavar="NAME",
        help=f"what the class has is to be changed: {', '.join(class_settings.CHANGEABLE)}",
    )  # fmt: skip
    parser.add_argument("--only", nargs="+", default=[], metavar="ID", help="grade only these submissions")
    parser.add_argument(
        "--jobs", type=int, default=0, metavar="N", help="submissions at a time (default: what this machine can run)"
    )
    parser.add_argument(
        "--minutes",
        type=int,
        default=60,
        metavar="N",
        help="end the grading of a submission after N minutes (default 60)",
    )
    parser.add_argument("--scheduler", default="", metavar="tcp://HOST:PORT", help="grade on a Dask cluster instead")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.add_argument(
        "--deadline", type=_time, metavar="TIME", help="such as 2026-11-20T23:59; local time without a zone"
    )
    parser.add_argument("--late", metavar="RULE", help='such as "10 %% per started day, at most 3 days"')
    parser.add_argument("--regrade", action="store_true", help="grade again what another version of the kit graded")
    parser.add_argument("--fresh", action="store_true", help="grade again what is graded already")
    parser.add_argument("--despite-doubts", action="store_true", help="grade even if a doubt stops the class")
    parser.add_argument(
        "--zero-missing", action=argparse.BooleanOptionalAction,
        help="whoever handed in nothing, or nothing that can be graded, gets 0; without, a person decides each",
    )  # fmt: skip
    parser.add_argument("--ros", type=Path, metavar="PREFIX", help="build and run packages with the ROS 2 in PREFIX")
    parser.set_defaults(run=_batch)


_INTERRUPTED = "grader: interrupted; what is finished is kept. The same command goes on from there."


def _time(text: str) -> dt.datetime:
    if (time := times.local_time(text)) is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; write it as 2026-11-20T23:59")
    if twice := times.twice(text):
        raise argparse.ArgumentTypeError(f"{text!r} {twice}")
    return time


def _batch(options: argparse.Namespace) -> int:
    if options.jobs < 0 or options.minutes < 1:
        raise UsageError("--jobs and --minutes must be 1 or more.")
    if options.source is not None and (options.source / class_folder.CLASS).exists():
        raise UsageError(f"{options.source} is a class.", f"Go on with it: grader batch --out {options.source}")
    if options.out is None and (options.source is None or not options.plan):
        raise UsageError("The folder for the results is missing.", "Add --out CLASS.")
    people = roster.load(options.roster) if options.roster else None
    lists = [*options.times, *([options.roster] if options.roster else [])]
    wanted = class_settings.Options(
        course=options.course,
        rubric=options.rubric,
        seed=options.seed,
        deadline=options.deadline,
        late_rule=options.late,
        added=tuple(options.add),
        times=tuple(time for path in lists for time in times.load(path)),
        change=frozenset(options.change),
        only=frozenset(options.only),
        regrade=options.regrade,
        fresh=options.fresh,
        despite_doubts=options.despite_doubts,
        pattern=options.pattern,
        zero_missing=options.zero_missing,
        cache=options.cache,
        jobs=options.jobs,
        minutes=options.minutes,
        scheduler=options.scheduler,
    )
    if options.plan:
        return _plan(options, people, wanted)
    console = _Console(options.out / class_folder.LOG)
    try:
        return _run_batch(options, people, wanted, console)
    except KeyboardInterrupt:
        console.say(_INTERRUPTED)
        return EXIT_INTERRUPTED
    except KitError as error:
        console.clear()
        console.log(str(error))
        raise
    finally:
        console.close()


def _plan(options: argparse.Namespace, people: Sequence[Person] | None, wanted: class_settings.Options) -> int:
    """Print the plan in full, and write it into the class's folder where one is named."""
    with tempfile.TemporaryDirectory(prefix="plan-") as empty:
        planned = batch.look(options.source, options.out or Path(empty), people, wanted)
    for line in (*plan.table(planned), "", *plan.summary(planned)):
        print(line)
    if options.out:
        plan.write(planned, options.out / class_folder.PLAN)
        print(f"Plan: {options.out / class_folder.PLAN}")
    return EXIT_GRADED


def _run_batch(
    options: argparse.Namespace, people: Sequence[Person] | None, wanted: class_settings.Options, console: _Console
) -> int:
    summary = batch.run(options.source, options.out, people, wanted, console)
    console.clear()
    words = (
        f"{counted(summary.entries, 'submission')}: {summary.graded} graded, {summary.refused} cannot be graded, "
        f"{summary.errors} with an error of the kit or machine"
        + (f"; {summary.kept} of them were graded before" if summary.kept else "")
        + (f"; {counted(summary.missing, 'person', 'people')} handed in nothing" if summary.missing else "")
    )
    print(words)
    console.log(words)
    if summary.interrupted:
        left = summary.entries - summary.graded - summary.refused - summary.errors
        console.say(f"{_INTERRUPTED} {left} are left.")
        console.say(f"`grader gradebook {options.out}` writes the gradebook of those that are graded.")
        return EXIT_INTERRUPTED
    print(f"Class: {after_grading.write_pages(ClassFolder(options.out))}")
    return EXIT_OUR_FAULT if summary.errors else EXIT_GRADED


class _Console:
    """Shows on standard error how a run goes on: a line for each submission, and on a terminal one that changes.

    The lines are in the class's log, too, with the time of each.
    """

    def __init__(self, log: Path) -> None:
        self._progress = Progress()
        self._path = log
        self._log: TextIO | None = None

    def planned(self, planned: Plan) -> None:
        self._log = self._path.open("a", encoding="utf-8", buffering=1)  # not before: the class is locked by now
        for line in plan.summary(planned):
            self.say(printable(line, 1000))

    def finished(self, record: Record, done: int, total: int) -> None:
        words = {Status.GRADED: "graded", Status.REFUSED: "cannot be graded", Status.ERROR: "ERROR of the grader"}
        why = f": {printable(' '.join(record.why.split()))}" if record.why else ""
        self.say(f"{done:>4}/{total}  {record.id:<20} {words[record.status]}, {record.seconds:.0f} s{why}")

    def going_on(self, done: int, total: int, running: Mapping[str, str]) -> None:
        names = ", ".join(f"{name} {what}".strip() for name, what in sorted(running.items()))
        self._progress.show(f"[{plan.clock(self._progress.seconds)}] {done}/{total}; {names}")

    def say(self, text: str) -> None:
        """Show a line that stays, and log it."""
        self._progress.keep(text)
        self.log(text)

    def log(self, text: str) -> None:
        """Write a line into the class's log only."""
        if self._log:
            self._log.write(f"{dt.datetime.now().astimezone().isoformat(sep=' ', timespec='seconds')}  {text}\n")

    def clear(self) -> None:
        """Remove the line that changes."""
        self._progress.done()

    def close(self) -> None:
        """Close the log."""
        if self._log:
            self._log.close()
