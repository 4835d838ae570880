"""The verbs of a class: `grader batch` and those that work on the folder that it makes."""

from __future__ import annotations

import argparse
import datetime as dt
import sys
import time
from pathlib import Path
from typing import Any

from grader.classroom import batch, roster
from grader.classroom.class_folder import ClassFolder, Record, Status
from grader.errors import EXIT_GRADED, EXIT_OUR_FAULT, GraderError
from grader.sanitize import printable
from grader.scoring import rubric

EXIT_INTERRUPTED = 130


def add(verbs: Any) -> None:
    """Add the verbs to the grader's."""
    _add_batch(verbs)


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


def _time(text: str) -> dt.datetime:
    try:
        time = dt.datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no time; write it as 2026-11-20T23:59") from None
    return time if time.tzinfo else time.astimezone()


def _batch(options: argparse.Namespace) -> int:
    people = roster.load(options.roster) if options.roster else ()
    if options.jobs < 0:
        raise GraderError("--jobs must be 1 or more.")
    said = _Said()
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
        print(f"Interrupted; {left} are left. The same command goes on from here.", file=sys.stderr)
        return EXIT_INTERRUPTED
    print(f"Class: {options.out}")
    return EXIT_OUR_FAULT if summary.errors else EXIT_GRADED


class _Said:
    """Shows on standard error how a run goes on: a line for each submission, and on a terminal one that changes."""

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._started = time.monotonic()

    def finished(self, record: Record, progress: batch.Progress) -> None:
        words = {Status.GRADED: "graded", Status.REFUSED: "cannot be graded", Status.ERROR: "ERROR of the grader"}
        why = f": {printable(record.why)}" if record.why else ""
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
