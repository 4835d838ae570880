"""The verbs of a class: `grader batch`, and those that work on the folder that it makes."""

from __future__ import annotations

import argparse
import datetime as dt
import json
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from grader import evidence, python_ast
from grader import report as report_room
from grader.classroom import batch, class_folder, discovery, gradebook, hand_ins, overview, plan, roster, times
from grader.classroom.batch import Console
from grader.classroom.class_folder import ClassFolder
from grader.classroom.gradebook import State
from grader.classroom.platform import Delivery
from grader.classroom.platforms import all_platforms, plain
from grader.classroom.roster import Person
from grader.course import Course, find, named
from grader.errors import (
    EXIT_GRADED,
    EXIT_INTERRUPTED,
    EXIT_OUR_FAULT,
    GraderError,
    KitError,
    SubmissionError,
    UsageError,
)
from grader.host import tempdir
from grader.intake.submission import open_submission
from grader.progress import Progress
from grader.quality import source_files
from grader.report import EVIDENCE
from grader.report.data import DATA
from grader.sandbox import untrusted
from grader.sanitize import one_line, printable
from grader.scoring import rubric
from grader.words import counted, some

_SHOWN = 10
_ZERO = "whoever handed in nothing, or nothing that can be graded, gets 0; the class remembers it"
_INTERRUPTED = "grader: interrupted; what is finished is kept. The same command goes on from there."


def add(verbs: Any, course_texts: Callable[[], Mapping[str, str]]) -> None:
    """Add the verbs to the grader's. `course_texts` returns what the course gives to all, by path."""
    _add_batch(verbs)
    option = _verb(
        verbs, "gradebook", _gradebook, "write grades in the form that a learning platform imports",
        "Write the grades of a class, with overrides.yaml as it is now, for Canvas, Moodle, Gradescope, GitHub or a "
        "spreadsheet. For Gradescope and GitHub, CLASS may also be the folder of one grading.",
        "class --for canvas --sheet canvas_export.csv --assignment Robots --out canvas_import.csv",
    )  # fmt: skip
    option("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    option("--for", dest="platform", choices=sorted(all_platforms()), default="csv", help="default: csv")
    option("--out", type=Path, help="the file, or the folder for gradescope and github")
    option("--sheet", type=Path, help="the export of Canvas or Moodle that is filled in")
    option("--assignment", default="", metavar="TITLE", help="the assignment's title in Canvas")
    option("--zero-missing", action=argparse.BooleanOptionalAction, help=_ZERO)
    option = _verb(
        verbs, "rescore", _rescore, "judge a class again from its evidence",
        "Run the checks over the saved evidence of a class, after a change of the rubric or of a check. No code of a "
        "submission runs; overrides stay.",
        "class --rubric new_rubric.yaml",
        interrupted="no submission is left half judged. The same command does it again.",
    )  # fmt: skip
    option("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    option("--rubric", type=Path, help="a rubric instead of the class's own")
    option = _verb(
        verbs, "similar", partial(_similar, course_texts), "write what Dolos and JPlag read, which find copies",
        "Write a zip of the class's Python: a folder for each submission, and `_given` with what the course gives. "
        "Dolos and JPlag list the pairs that are most alike (docs/classes.md).",
        "class --out class.zip",
    )  # fmt: skip
    option("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    option("--out", type=Path, required=True, metavar="ZIP", help="the zip")


def _add_batch(verbs: Any) -> None:
    option = _verb(
        verbs, "batch", _batch, "grade a class",
        "Grade every submission of a class: an export of Moodle, Canvas or Gradescope, clones of GitHub Classroom, or "
        "a folder of archives and folders. The class remembers source, roster, rubric, seed, deadline and late rule: "
        "`grader batch --out CLASS` goes on where a run was interrupted.",
        "submissions.zip --roster roster.csv --out class --plan",
    )  # fmt: skip
    option("source", type=Path, nargs="?", help="the folder or the archive with the submissions; a class knows its own")
    option("--out", type=Path, metavar="CLASS", help="the folder for the class's results")
    option("--plan", action="store_true", help="only show what would be done, and write it to CLASS/plan.csv")
    option("--roster", type=Path, help="CSV with columns such as id, name, email, login, team")
    option(
        "--times", type=Path, nargs="+", default=[], metavar="LIST",
        help="when submissions were handed in: a grading worksheet of Moodle, a list of submissions of Canvas (JSON), "
        "or a CSV with a column submitted; a roster with such a column is enough",
    )  # fmt: skip
    option("--rubric", type=Path, help="a rubric other than the course's own")
    option("--course", type=Path, metavar="DIR", help="the folder of the course, for a new class")
    option("--seed", type=int, help="decides speeds, places and noise (default 0)")
    option(
        "--add", dest="added", type=Path, nargs="+", default=[], metavar="SOURCE",
        help="read a further export, such as of late ones",
    )  # fmt: skip
    option("--only", nargs="+", default=[], metavar="ID", help="grade only these submissions")
    option(
        "--jobs", type=int, default=0, metavar="N", help="submissions at a time (default: what this machine can run)"
    )
    option("--minutes", type=int, default=60, metavar="N", help="end a submission's grading after N minutes (60)")
    option("--scheduler", default="", metavar="tcp://HOST:PORT", help="grade on a Dask cluster instead")
    option("--deadline", type=_time, metavar="TIME", help="such as 2026-11-20T23:59; local time without a zone")
    option("--late", dest="late_rule", metavar="RULE", help='such as "10 %% per started day, at most 3 days"')
    option("--regrade", action="store_true", help="grade again what another version of the kit graded")
    option("--fresh", action="store_true", help="grade again what is graded already")
    option("--despite-doubts", action="store_true", help="grade even if a doubt stops the class")
    option("--zero-missing", action=argparse.BooleanOptionalAction, help=_ZERO)


def _verb(
    verbs: Any, name: str, run: Callable[[argparse.Namespace], int], words: str, description: str, example: str,
    **more: Any,
) -> Callable[..., object]:  # fmt: skip
    """Add a verb, and return what adds its options."""
    epilog = f"Example:  grader {name} {example}"
    parser = verbs.add_parser(name, help=words, description=description, epilog=epilog)
    parser.set_defaults(run=run, **more)
    added: Callable[..., object] = parser.add_argument
    return added


def _time(text: str) -> dt.datetime:
    if (time := times.local_time(text)) is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a time; write it as 2026-11-20T23:59")
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
    wanted = plan.Options.of(options, tuple(time for path in lists for time in times.load(path)))
    if options.plan:
        with tempfile.TemporaryDirectory(prefix="plan-") as empty:
            planned = batch.look(options.source, options.out or Path(empty), people, wanted)
        for line in (*plan.table(planned), "", *plan.summary(planned)):
            print(line)
        if options.out:
            plan.write(planned, options.out / class_folder.PLAN)
            print(f"Plan: {options.out / class_folder.PLAN}")
        return EXIT_GRADED
    console = Console(options.out / class_folder.LOG)
    try:
        return _run_batch(options, people, wanted, console)
    except KeyboardInterrupt:
        console.say(_INTERRUPTED)
        return EXIT_INTERRUPTED
    except KitError as error:
        console.clear()
        console.log(str(error))
        raise


def _run_batch(
    options: argparse.Namespace, people: Sequence[Person] | None, wanted: plan.Options, console: Console
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
    folder, platform = ClassFolder(options.folder), all_platforms()[options.platform]
    is_class = (options.folder / class_folder.CLASS).exists()
    if platform.fills and options.sheet is None:
        raise UsageError(
            f"For {options.platform} a file that it exported is filled in: {platform.fills}.", "Add --sheet."
        )
    if not is_class and (options.folder / DATA).exists():
        report = json.loads(report_room.for_student(options.folder, DATA).read_text(encoding="utf-8"))
        book = gradebook.of_one(report, rubric.load(_course_of(options.folder).rubric))
        reports = {book.rows[0].submission: report}
    else:
        if options.zero_missing not in (None, folder.facts().zero_missing):
            with folder.locked():
                folder.write_facts(replace(folder.facts(), zero_missing=options.zero_missing))
        book = gradebook.read(folder)
        _refresh(folder)
        if options.out is None:
            overview.write(folder, book)
        reports = {
            row.submission: folder.report(row.submission, for_student=True) for row in book.rows if row.submission
        }
    out: Path = options.out or options.folder / platform.out
    for note in platform.write(Delivery(book, reports, out, options.sheet or Path(), options.assignment)):
        print(f"note: {printable(note)}")
    states = Counter(row.state.value for row in book.rows)
    print(
        f"{counted(len(book.rows), 'person', 'people')}: "
        + ", ".join(f"{count} {state}" for state, count in states.most_common())
    )
    if waiting := [row for row in book.rows if row.state in (State.MISSING, State.REFUSED) and not row.final]:
        names = some([f"{row.person.label} ({row.state.value})" for row in waiting], _SHOWN)
        print(f"no grade before a person decides: {printable(names, 400)}")
        print("--zero-missing gives them 0; overrides.yaml decides for one: adjust: {total: 0, why: ..., by: ...}")
    if held := [row.submission for row in book.teams.values() if row.state is State.WITHHELD]:
        print(f"points withheld until a person decides: {printable(some(held, _SHOWN), 400)}")
        if is_class:
            print("overrides.yaml decides for one: flags_accepted: {why: ..., by: ...}, or points for each requirement")
    print(f"Grades: {out}")
    return EXIT_GRADED


def _course_of(folder: Path) -> Course:
    """Return the course that a single grading was made with; of a refusal the one around here."""
    place = folder / EVIDENCE
    origin = evidence.load(place).origin if any(place.glob("*.json")) else {}  # a refusal's folder is empty
    return named(origin["course"]) if "course" in origin else find()


def _rescore(options: argparse.Namespace) -> int:
    folder, progress = ClassFolder(options.folder), Progress()
    judged, changes = hand_ins.rescore(
        folder, options.rubric, lambda done, total: progress.show(f"{done}/{total} judged")
    )  # fmt: skip
    progress.done()
    _write_pages(folder)
    for submission, requirement, before, after in changes:
        print(f"{submission:<20} {requirement:<4} {before} -> {after}")
    changed = len({submission for submission, *_ in changes})
    have = f"{changed} {'has' if changed == 1 else 'have'} other points"
    print(f"{counted(judged, 'submission')} judged again in {progress.seconds:.1f} s; {have}")
    return EXIT_GRADED


def _similar(course_texts: Callable[[], Mapping[str, str]], options: argparse.Namespace) -> int:
    progress = Progress()
    notes = archive(ClassFolder(options.folder), course_texts(), options.out, progress.say)
    progress.done()
    for note in notes:
        print(f"note: {note}")
    print(f"Archive: {options.out}")
    return EXIT_GRADED


GIVEN = "_given"


def archive(folder: ClassFolder, given: Mapping[str, str], path: Path, progress: Callable[[str], None]) -> list[str]:
    """Write a folder for each submission and one for what the course gives; return remarks on what is not in it.

    Each has one file: these tools read no text that Python cannot read, nor two files of one name.
    """
    facts = folder.facts()
    course = named(facts.course)
    present = [entry for entry in facts.entries if not entry.absent]
    notes = [f"{entry.id} is left out: the present sources do not have it." for entry in facts.entries if entry.absent]
    texts = {GIVEN: given}
    with ExitStack() as stack:
        sources = {entry.source or facts.source for entry in present}
        roots = {source: stack.enter_context(discovery.opened(folder.located(source))).folder for source in sources}
        for entry in present:
            progress(f"reading {entry.id}")
            source = roots[entry.source or facts.source] / entry.path
            with tempdir.folder("similar") as scratch:
                try:
                    package = open_submission(source, scratch / "submission", course).package
                except SubmissionError as error:
                    notes.append(f"{entry.id} is left out: {one_line(error.what)}")
                    continue
                found = source_files.find(package, course)
                read = {f.path: None if f.problem else untrusted.read_python(package / f.path) for f in found}
            texts[entry.id] = {name: text for name, text in read.items() if text is not None and python_ast.parse(text)}
            notes += [f"{entry.id} is without {one_line(name)}." for name in read if name not in texts[entry.id]]
            if discovery.content_hash(source) != entry.content:
                notes.append(f"{entry.id} is as it is now; it is not what was graded.")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name, files in texts.items():
            parts = (f"# {one_line(file)}\n{text}" for file, text in sorted(files.items()))
            made.writestr(f"{name}/{name}.py", "\n\n".join(parts))
    return notes
