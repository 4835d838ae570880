"""The verbs of a class: `grader batch` and those that work on the folder that it makes."""

from __future__ import annotations

import argparse
import datetime as dt
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grader.classroom import batch, class_folder, comparison, gradebook, hand_ins, lateness, overview, rescore, roster
from grader.classroom.class_folder import ClassFolder, Record, Status
from grader.classroom.platform import Delivery
from grader.classroom.platforms import all_platforms, plain
from grader.classroom.roster import Person
from grader.errors import EXIT_GRADED, EXIT_INTERRUPTED, EXIT_OUR_FAULT, GraderError
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
        "Classroom, or a folder of archives and folders. The same command goes on where a run was interrupted.",
        epilog="Example:  grader batch submissions.zip --roster roster.csv --out class",
    )
    parser.add_argument("source", type=Path, help="the folder or the archive with the submissions")
    parser.add_argument("--out", type=Path, required=True, metavar="CLASS", help="the folder for the class's results")
    parser.add_argument("--roster", type=Path, help="CSV with columns such as id, name, email, login, team")
    parser.add_argument("--rubric", type=Path, default=rubric.RUBRIC, help="a rubric other than the kit's own")
    parser.add_argument("--seed", type=int, default=0, help="decides speeds, places and noise (default 0)")
    parser.add_argument(
        "--jobs", type=int, default=0, metavar="N", help="submissions at a time (default: what this machine bears)"
    )
    parser.add_argument("--scheduler", default="", metavar="tcp://HOST:PORT", help="grade on a Dask cluster instead")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.add_argument(
        "--deadline", type=_time, metavar="TIME", help="such as 2026-11-20T23:59; local time without a zone"
    )
    parser.add_argument("--late", default="", metavar="RULE", help='such as "10 %% per started day, at most 3 days"')
    parser.add_argument("--fresh", action="store_true", help="grade again what is graded already")
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
    people = roster.load(options.roster) if options.roster else ()
    if options.jobs < 0:
        raise GraderError("--jobs must be 1 or more.")
    if options.late:
        lateness.parse(options.late)
    said = _Said()
    try:
        return _run_batch(options, people, said)
    except KeyboardInterrupt:
        said.close()
        print(_INTERRUPTED, file=sys.stderr)
        return EXIT_INTERRUPTED


def _run_batch(options: argparse.Namespace, people: Sequence[Person], said: _Said) -> int:
    summary = batch.run(
        options.source,
        options.out,
        people,
        batch.Options(
            rubric=options.rubric,
            seed=options.seed,
            cache=options.cache,
            jobs=options.jobs,
            scheduler=options.scheduler,
            deadline=options.deadline,
            late_rule=options.late,
            fresh=options.fresh,
        ),
        said,
    )
    said.close()
    for note in ClassFolder(options.out).facts().notes:
        print(f"note: {printable(note, 300)}")
    print(
        f"{summary.entries} submissions: {summary.graded} graded, {summary.refused} cannot be graded, "
        f"{summary.errors} with an error of the kit or machine"
        + (f"; {summary.kept} of them were graded before" if summary.kept else "")
        + (f"; {summary.missing} people handed in nothing" if summary.missing else "")
    )
    if summary.interrupted:
        left = summary.entries - summary.graded - summary.refused - summary.errors
        print(f"{_INTERRUPTED} {left} are left.", file=sys.stderr)
        print(f"`grader gradebook {options.out}` writes the gradebook of those that are graded.", file=sys.stderr)
        return EXIT_INTERRUPTED
    print(f"Class: {_write_pages(ClassFolder(options.out))}")
    return EXIT_OUR_FAULT if summary.errors else EXIT_GRADED


def _write_pages(folder: ClassFolder) -> Path:
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
    for note in platform.write(Delivery(book, reports, out, options.sheet, options.assignment, options.anonymous)):
        print(f"note: {printable(note)}")
    states = Counter(row.state.value for row in book.rows)
    print(f"{len(book.rows)} people: " + ", ".join(f"{count} {state}" for state, count in states.most_common()))
    print(f"Grades: {out}")
    return EXIT_GRADED


def _rescore(options: argparse.Namespace) -> int:
    folder = ClassFolder(options.folder)
    started = time.monotonic()
    terminal = sys.stderr.isatty()

    def progress(done: int, total: int) -> None:
        if terminal:
            print(f"\r\x1b[K{done}/{total} judged", end="" if done < total else "\n", file=sys.stderr, flush=True)

    done = rescore.rescore(folder, only=options.only, new_rubric=options.rubric, jobs=options.jobs, progress=progress)
    _write_pages(folder)
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


class _Said:
    """Shows on standard error how a run goes on: a line for each submission, and on a terminal one that changes."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._started = time.monotonic()

    def finished(self, record: Record, progress: batch.Progress) -> None:
        words = {Status.GRADED: "graded", Status.REFUSED: "cannot be graded", Status.ERROR: "ERROR of the grader"}
        why = f": {printable(' '.join(record.why.split()))}" if record.why else ""
        self._line(
            f"{progress.done:>4}/{progress.total}  {record.id:<20} {words[record.status]}, {record.seconds:.0f} s{why}"
            f"{_left(progress)}"
        )

    def going_on(self, progress: batch.Progress) -> None:
        if self._terminal:
            running = ", ".join(f"{name} {what}".strip() for name, what in sorted(progress.running.items()))
            so_far = f"[{_clock(time.monotonic() - self._started)}] {progress.done}/{progress.total}"
            line = f"{so_far}{_left(progress)}; {running}"
            print(f"\r\x1b[K{printable(line, 118)}", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _line(self, text: str) -> None:
        self.close()
        print(text, file=sys.stderr, flush=True)


def _left(progress: batch.Progress) -> str:
    return f"; about {_clock(progress.left_s)} left" if progress.left_s else ""


def _clock(seconds: float) -> str:
    minutes = int(seconds) // 60
    return f"{minutes // 60}:{minutes % 60:02}:{int(seconds) % 60:02}"
