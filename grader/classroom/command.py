"""The verbs of a class: `grader batch` and those that work on the folder that it makes."""

from __future__ import annotations

import argparse
import datetime as dt
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TextIO

from grader import report as report_room
from grader.classroom import (
    batch,
    class_folder,
    class_settings,
    comparison,
    gradebook,
    hand_ins,
    overview,
    plan,
    rescore,
    roster,
    times,
)
from grader.classroom.class_folder import ClassFolder, Record, Status
from grader.classroom.plan import Plan
from grader.classroom.platform import Delivery
from grader.classroom.platforms import all_platforms, plain
from grader.classroom.roster import Person
from grader.errors import EXIT_GRADED, EXIT_INTERRUPTED, EXIT_OUR_FAULT, GraderError, KitError, UsageError
from grader.sanitize import printable
from grader.scoring import rubric


def add(verbs: Any) -> None:
    """Add the verbs to the grader's."""
    _add_batch(verbs)
    _add_gradebook(verbs)
    _add_rescore(verbs)
    _add_compare(verbs)


def _add_batch(verbs: Any) -> None:
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
    parser.add_argument("--scheduler", default="", metavar="tcp://HOST:PORT", help="grade on a Dask cluster instead")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.add_argument(
        "--deadline", type=_time, metavar="TIME", help="such as 2026-11-20T23:59; local time without a zone"
    )
    parser.add_argument("--late", metavar="RULE", help='such as "10 %% per started day, at most 3 days"')
    parser.add_argument("--regrade", action="store_true", help="grade again what another version of the kit graded")
    parser.add_argument("--fresh", action="store_true", help="grade again what is graded already")
    parser.add_argument(
        "--despite-doubts", action="store_true", help="grade even if it is doubtful whose most submissions are"
    )
    parser.set_defaults(run=_batch)


def _add_gradebook(verbs: Any) -> None:
    parser = verbs.add_parser(
        "gradebook",
        help="write grades in the form that a learning platform imports",
        description="Write the grades of a class, with overrides.yaml as it is now, for Canvas, Moodle, Gradescope, "
        "GitHub or a spreadsheet. For Gradescope and GitHub, CLASS may also be the folder of one grading.",
        epilog="Example:  grader gradebook class --for canvas --sheet canvas_export.csv --out canvas_import.csv",
    )
    parser.add_argument("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    parser.add_argument("--for", dest="platform", choices=sorted(all_platforms()), default="csv", help="default: csv")
    parser.add_argument("--out", type=Path, help="the file, or the folder for gradescope and github")
    parser.add_argument("--sheet", type=Path, help="an export of Canvas or Moodle to be filled in")
    parser.add_argument("--assignment", default="", metavar="TITLE", help="the assignment's title in Canvas or Moodle")
    parser.add_argument(
        "--feedback", action="store_true", help="also the reports, as the zip that Moodle or Canvas imports"
    )
    parser.add_argument(
        "--anonymous", action="store_true", help="csv without names; those are in a second file, *_key.csv"
    )
    parser.set_defaults(run=_gradebook)


def _add_rescore(verbs: Any) -> None:
    parser = verbs.add_parser(
        "rescore",
        help="judge a class again from its evidence",
        description="Run the checks over the saved evidence of a class, after a change of the rubric or of a check. "
        "No code of a submission runs; overrides stay.",
        epilog="Example:  grader rescore class --rubric new_rubric.yaml",
    )
    parser.add_argument("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="REQUIREMENT", help="such as F5; others keep their results"
    )
    parser.add_argument("--rubric", type=Path, help="a rubric instead of the class's own")
    parser.add_argument("--jobs", type=int, default=0, metavar="N", help="processes (default: one for each core)")
    parser.set_defaults(run=_rescore, interrupted="no submission is left half judged. The same command does it again.")


def _add_compare(verbs: Any) -> None:
    parser = verbs.add_parser(
        "compare",
        help="show what changed between two gradings or two classes",
        description="Print which requirements have other points, for whom, and what differs: the input, the evidence, "
        "the checks, the rubric, the seed or the kit. Exit status 1 if anything differs.",
        epilog="Example:  grader compare class_monday class_tuesday",
    )
    parser.add_argument("old", type=Path, help="a class, or the folder of one grading")
    parser.add_argument("new", type=Path, help="another one")
    parser.set_defaults(run=_compare)


_INTERRUPTED = "grader: interrupted; what is finished is kept. The same command goes on from there."


def _time(text: str) -> dt.datetime:
    try:
        time = dt.datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; write it as 2026-11-20T23:59") from None
    return time if time.tzinfo else time.astimezone()


def _batch(options: argparse.Namespace) -> int:
    if options.jobs < 0:
        raise UsageError("--jobs must be 1 or more.")
    if options.source is not None and (options.source / class_folder.CLASS).exists():
        raise UsageError(f"{options.source} is a class.", f"Go on with it: grader batch --out {options.source}")
    if options.out is None and (options.source is None or not options.plan):
        raise UsageError("The folder for the results is missing.", "Add --out CLASS.")
    people = roster.load(options.roster) if options.roster else None
    lists = [*options.times, *([options.roster] if options.roster else [])]
    wanted = batch.Options(
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
        cache=options.cache,
        jobs=options.jobs,
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


def _plan(options: argparse.Namespace, people: Sequence[Person] | None, wanted: batch.Options) -> int:
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
    options: argparse.Namespace, people: Sequence[Person] | None, wanted: batch.Options, console: _Console
) -> int:
    summary = batch.run(options.source, options.out, people, wanted, console)
    console.clear()
    words = (
        f"{summary.entries} submissions: {summary.graded} graded, {summary.refused} cannot be graded, "
        f"{summary.errors} with an error of the kit or machine"
        + (f"; {summary.kept} of them were graded before" if summary.kept else "")
        + (f"; {summary.missing} people handed in nothing" if summary.missing else "")
    )
    print(words)
    console.log(words)
    if summary.interrupted:
        left = summary.entries - summary.graded - summary.refused - summary.errors
        console.say(f"{_INTERRUPTED} {left} are left.")
        console.say(f"`grader gradebook {options.out}` writes the gradebook of those that are graded.")
        return EXIT_INTERRUPTED
    print(f"Class: {write_pages(ClassFolder(options.out))}")
    return EXIT_OUR_FAULT if summary.errors else EXIT_GRADED


def write_pages(folder: ClassFolder) -> Path:
    """Write the gradebook, the overview and the reports that are out of date, and return the overview's path."""
    book = gradebook.read(folder)
    _refresh(folder)
    plain.write(book, folder.path / class_folder.GRADEBOOK)
    return overview.write(folder, book)


def _refresh(folder: ClassFolder) -> None:
    try:
        changed = hand_ins.refresh(folder)
    except GraderError as error:  # another run is at work, and writes them at its end
        print(f"note: the reports were left as they are: {error}", file=sys.stderr)
        return
    if changed:
        print(f"Reports written anew: {printable(', '.join(changed), 300)}")


def _gradebook(options: argparse.Namespace) -> int:
    folder = ClassFolder(options.folder)
    if not (options.folder / class_folder.CLASS).exists() and (options.folder / "report.json").exists():
        report = json.loads((options.folder / "report.json").read_text(encoding="utf-8"))
        book = gradebook.of_one(report, rubric.load(rubric.RUBRIC))
        reports: dict[str, dict[str, Any] | None] = {book.rows[0].submission: report}
    else:
        book = gradebook.read(folder)
        _refresh(folder)
        reports = {row.submission: folder.report(row.submission) for row in book.rows if row.submission}
    platform = all_platforms()[options.platform]
    out: Path = options.out or options.folder / platform.out
    if options.anonymous and options.platform != "csv":
        raise UsageError("--anonymous is for --for csv; the other files need to say whose a grade is.")
    feedback = out.with_name(f"{out.stem}_feedback.zip") if options.feedback else None
    if feedback and (options.platform not in ("moodle", "canvas") or not (folder.path / class_folder.CLASS).exists()):
        raise UsageError("--feedback is for the classes of --for moodle and --for canvas.")
    entries = folder.facts().entries if feedback else ()
    pages = {e.id: page for e in entries if (page := folder.submission(e.id) / report_room.PAGE).is_file()}
    sources = {entry.id: entry.path.name for entry in entries}
    delivery = Delivery(
        book, reports, out, options.sheet, options.assignment, options.anonymous, feedback, pages, sources
    )  # fmt: skip
    for note in platform.write(delivery):
        print(f"note: {printable(note)}")
    states = Counter(row.state.value for row in book.rows)
    print(f"{len(book.rows)} people: " + ", ".join(f"{count} {state}" for state, count in states.most_common()))
    print(f"Grades: {out}")
    if feedback:
        print(f"Feedback: {feedback}")
    return EXIT_GRADED


def _rescore(options: argparse.Namespace) -> int:
    folder = ClassFolder(options.folder)
    started = time.monotonic()
    terminal = sys.stderr.isatty()

    def progress(done: int, total: int) -> None:
        if terminal:
            print(f"\r\x1b[K{done}/{total} judged", end="" if done < total else "\n", file=sys.stderr, flush=True)

    done = rescore.rescore(folder, only=options.only, new_rubric=options.rubric, jobs=options.jobs, progress=progress)
    write_pages(folder)
    for change in done.changes:
        print(f"{change.submission:<20} {change.requirement:<4} {_points(change.before)} -> {_points(change.after)}")
    changed = len({change.submission for change in done.changes})
    print(f"{done.judged} submissions judged again in {time.monotonic() - started:.1f} s; {changed} have other points")
    return EXIT_GRADED


def _points(value: object) -> str:
    return "none" if value is None else str(value)


def _compare(options: argparse.Namespace) -> int:
    differences, alone = comparison.compare(options.old, options.new)
    for each in differences:
        name = each.submission or options.new.name
        print(f"{name:<20} {each.requirement:<4} {each.before} -> {each.after}  because of {', '.join(each.why)}")
    for remark in alone:
        print(remark)
    if not differences and not alone:
        print("Nothing differs.")
    return 1 if differences or alone else EXIT_GRADED


class _Console:
    """Shows on standard error how a run goes on: a line for each submission, and on a terminal one that changes.

    The lines are in the class's log, too, with the time of each.
    """

    def __init__(self, log: Path) -> None:
        self._terminal = sys.stderr.isatty()
        self._started = time.monotonic()
        self._path = log
        self._log: TextIO | None = None

    def planned(self, planned: Plan) -> None:
        self._log = self._path.open("a", encoding="utf-8", buffering=1)  # not before: the class is locked by now
        for line in plan.summary(planned):
            self.say(printable(line, 1000))

    def finished(self, record: Record, progress: batch.Progress) -> None:
        words = {Status.GRADED: "graded", Status.REFUSED: "cannot be graded", Status.ERROR: "ERROR of the grader"}
        why = f": {printable(' '.join(record.why.split()))}" if record.why else ""
        self.say(
            f"{progress.done:>4}/{progress.total}  {record.id:<20} {words[record.status]}, {record.seconds:.0f} s{why}"
            f"{_left(progress)}"
        )

    def going_on(self, progress: batch.Progress) -> None:
        if self._terminal:
            running = ", ".join(f"{name} {what}".strip() for name, what in sorted(progress.running.items()))
            so_far = f"[{plan.clock(time.monotonic() - self._started)}] {progress.done}/{progress.total}"
            line = f"{so_far}{_left(progress)}; {running}"
            print(f"\r\x1b[K{printable(line, 118)}", end="", file=sys.stderr, flush=True)

    def say(self, text: str) -> None:
        """Show a line that stays, and log it."""
        self.clear()
        print(text, file=sys.stderr, flush=True)
        self.log(text)

    def log(self, text: str) -> None:
        """Write a line into the class's log only."""
        if self._log:
            self._log.write(f"{dt.datetime.now().astimezone().isoformat(sep=' ', timespec='seconds')}  {text}\n")

    def clear(self) -> None:
        """Remove the line that changes."""
        if self._terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Close the log."""
        if self._log:
            self._log.close()


def _left(progress: batch.Progress) -> str:
    return f"; about {plan.clock(progress.left_s)} left" if progress.left_s else ""
