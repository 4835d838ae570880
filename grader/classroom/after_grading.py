"""The verbs of a class that is graded: gradebook, rescore, compare, similar and regrade."""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from grader import evidence
from grader import report as report_room
from grader.classroom import (
    class_folder,
    comparison,
    gradebook,
    hand_ins,
    overrides,
    overview,
    regrades,
    rescore,
    similarity,
)
from grader.classroom.class_folder import RUBRIC, ClassFacts, ClassFolder
from grader.classroom.gradebook import State
from grader.classroom.platform import Delivery, losses
from grader.classroom.platforms import all_platforms, plain
from grader.classroom.regrades import Regrade
from grader.course import Course, find, named
from grader.errors import EXIT_GRADED, GraderError, UsageError
from grader.progress import Progress
from grader.report import EVIDENCE
from grader.report.standing import DATA
from grader.sanitize import printable
from grader.scoring import rubric
from grader.scoring.rubric import Rubric
from grader.words import counted, some

_SHOWN = 10
Run = Callable[[argparse.Namespace], int]


def add(verbs: Any, course_texts: Callable[[], Mapping[str, str]]) -> None:
    """Add the verbs to the grader's. `course_texts` returns what the course gives to all, by path."""
    verb = _verb(
        verbs, "gradebook", _gradebook, "write grades in the form that a learning platform imports",
        "Write the grades of a class, with overrides.yaml as it is now, for Canvas, Moodle, Gradescope, GitHub or a "
        "spreadsheet. For Gradescope and GitHub, CLASS may also be the folder of one grading.",
        "class --for canvas --sheet canvas_export.csv --assignment Robots --out canvas_import.csv",
    )  # fmt: skip
    verb("--for", dest="platform", choices=sorted(all_platforms()), default="csv", help="default: csv")
    verb("--out", type=Path, help="the file, or the folder for gradescope and github")
    verb("--sheet", type=Path, help="an export of Canvas or Moodle to be filled in")
    verb("--assignment", default="", metavar="TITLE", help="the assignment's title in Canvas or Moodle")
    verb(
        "--zero-missing", action=argparse.BooleanOptionalAction,
        help="whoever handed in nothing, or nothing that can be graded, gets 0; the class remembers it",
    )  # fmt: skip
    verb("--feedback", action="store_true", help="also the reports, as the zip that Moodle or Canvas imports")
    verb = _verb(
        verbs, "rescore", _rescore, "judge a class again from its evidence",
        "Run the checks over the saved evidence of a class, after a change of the rubric or of a check. No code of a "
        "submission runs; overrides stay.",
        "class --rubric new_rubric.yaml",
        interrupted="no submission is left half judged. The same command does it again.",
    )  # fmt: skip
    verb("--only", nargs="+", default=[], metavar="REQUIREMENT", help="these requirements; others keep their results")
    verb("--rubric", type=Path, help="a rubric instead of the class's own")
    verb("--jobs", type=int, default=0, metavar="N", help="processes (default: one for each core)")
    verb = _verb(
        verbs, "compare", _compare, "show what changed between two gradings or two classes",
        "Print which requirements have other points, for whom, and what differs: the input, the evidence, the checks, "
        "the rubric, the seed or the kit. Exit status 1 if anything differs.",
        "class_monday class_tuesday", folder=("old", "", "a class, or the folder of one grading"),
    )  # fmt: skip
    verb("new", type=Path, help="another one")
    verb = _verb(
        verbs, "similar", partial(_similar, course_texts), "list the packages of a class that are most alike",
        "Compare the Python of all submissions of a class beyond what the course gives. Names, comments and strings do "
        "not count. Nothing is run. To see places side by side, or to compare with other classes, give --archive to "
        "Dolos or JPlag.",
        "class --archive class.zip",
    )  # fmt: skip
    verb(
        "--base", type=Path, metavar="DIR",
        help="what the course gives (default: the reference package and the files that the notebooks give)",
    )  # fmt: skip
    verb("--top", type=int, default=20, metavar="N", help="pairs to list (default 20)")
    verb("--archive", type=Path, metavar="ZIP", help="also write a zip of the class's Python that Dolos and JPlag read")
    verb = _verb(
        verbs, "regrade", _regrade, "look at a requirement again on a student's request, and decide",
        "With a reason, add a student's request to regrades.yaml of the class. Without one, show what the grader saw "
        "and how to see it again. With --why and --by, decide: the points, or that they stay. Without a submission, "
        "list the open requests.",
        'class team07 REQUIREMENT --points 3 --why "the wall stood in the start" --by "A. Lee"',
    )  # fmt: skip
    verb("submission", nargs="?", default="", help="its id in the class, such as team07")
    verb("requirement", nargs="?", default="", help="its id in the rubric")
    verb("--reason", default="", metavar="TEXT", help="the student's reason; records the request")
    verb("--points", metavar="N", help="the points that the requirement gets; without, they stay")
    verb("--why", default="", metavar="TEXT", help="the reason of the decision, which the student reads")
    verb("--by", default="", metavar="NAME", help="who decides")


def _verb(
    verbs: Any, name: str, run: Run, words: str, description: str, example: str,
    folder: tuple[str, str, str] = ("folder", "CLASS", "the folder that `grader batch` has made"), **more: Any,
) -> Callable[..., object]:  # fmt: skip
    """Add a verb whose first argument is `folder`: its name, how it is shown, what it is. Return what adds others."""
    epilog = f"Example:  grader {name} {example}"
    parser: argparse.ArgumentParser = verbs.add_parser(name, help=words, description=description, epilog=epilog)
    parser.set_defaults(run=run, **more)
    attribute, shown, what = folder
    parser.add_argument(attribute, type=Path, metavar=shown or None, help=what)
    return parser.add_argument


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
    if not (options.folder / class_folder.CLASS).exists() and (options.folder / DATA).exists():
        report = json.loads(report_room.for_student(options.folder, DATA).read_text(encoding="utf-8"))
        book = gradebook.of_one(report, rubric.load(_course_of(options.folder).rubric))
        reports: dict[str, dict[str, Any] | None] = {book.rows[0].submission: report}
    else:
        if options.zero_missing is not None:
            folder.decide(zero_missing=options.zero_missing)
        book = gradebook.read(folder)
        _refresh(folder)
        if options.out is None:
            overview.write(folder, book)
        reports = {
            row.submission: folder.report(row.submission, for_student=True) for row in book.rows if row.submission
        }
    platform = all_platforms()[options.platform]
    out: Path = options.out or options.folder / platform.out
    feedback = out.with_name(f"{out.stem}_feedback.zip") if options.feedback else None
    if feedback and (options.platform not in ("moodle", "canvas") or not (folder.path / class_folder.CLASS).exists()):
        raise UsageError("--feedback is for the classes of --for moodle and --for canvas.")
    entries = folder.facts().entries if feedback else ()
    found = {e.id: report_room.for_student(folder.submission(e.id), report_room.PAGE) for e in entries}
    pages = {name: page for name, page in found.items() if page.is_file()}
    sources = {entry.id: entry.path.name for entry in entries}
    delivery = Delivery(book, reports, out, options.sheet, options.assignment, feedback, pages, sources)
    for note in platform.write(delivery):
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
    if held and (folder.path / class_folder.CLASS).exists():
        print("overrides.yaml decides for one: flags_accepted: {why: ..., by: ...}, or points for each requirement")
    print(f"Grades: {out}")
    if feedback:
        print(f"Feedback: {feedback}")
    return EXIT_GRADED


def _course_of(folder: Path) -> Course:
    """Return the course that a single grading was made with; of a refusal the one around here."""
    place = folder / EVIDENCE
    origin = evidence.load(place).origin if any(place.glob("*.json")) else {}  # a refusal's folder is empty
    return named(origin["course"]) if "course" in origin else find()


def _rescore(options: argparse.Namespace) -> int:
    folder = ClassFolder(options.folder)
    progress = Progress()
    done = rescore.rescore(
        folder, only=options.only, new_rubric=options.rubric, jobs=options.jobs,
        progress=lambda done, total: progress.show(f"{done}/{total} judged"),
    )  # fmt: skip
    progress.done()
    write_pages(folder)
    for change in done.changes:
        print(f"{change.submission:<20} {change.requirement:<4} {change.before} -> {change.after}")
    changed = len({change.submission for change in done.changes})
    judged = counted(done.judged, "submission")
    have = f"{changed} {'has' if changed == 1 else 'have'} other points"
    print(f"{judged} judged again in {progress.seconds:.1f} s; {have}")
    return EXIT_GRADED


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


def _similar(course_texts: Callable[[], Mapping[str, str]], options: argparse.Namespace) -> int:
    if options.base is None:
        base = course_texts()
    elif options.base.is_dir():
        base = {str(path): path.read_text(encoding="utf-8") for path in options.base.rglob("*.py")}
    else:
        raise UsageError(f"There is no folder {printable(str(options.base))}.", "Check --base.")
    progress = Progress()
    folder = ClassFolder(options.folder)
    texts, notes = similarity.read(folder, progress.say)
    progress.say("comparing")
    pairs = similarity.compare(texts, base, folder.facts())
    progress.done()
    little = "is not compared: it has hardly any Python beyond what the course gives."
    notes += [f"{name} {little}" for name in texts if not any(name in (pair.one, pair.other) for pair in pairs)]
    for note in notes:
        print(f"note: {note}")
    if pairs:
        usual = median(pair.share for pair in pairs)
        said = f"in half of them at most {usual:.0%} of a package is in the other one, too; to be alike proves nothing"
        print(f"{counted(len(pairs), 'pair')}; {said}")
    else:
        print("No two packages have anything to compare beyond what the course gives.")
    for pair in pairs[: options.top]:
        shares = f"{pair.one:<28} {pair.share_of_one:>4.0%}  {pair.other:<28} {pair.share_of_other:>4.0%}"
        print(f"{shares}  {printable(pair.places, 200)}".rstrip())
    similarity.write(folder, pairs)
    if options.archive:
        similarity.archive(texts, base, options.archive)
        print(f"Archive: {options.archive}")
    print(f"Class: {overview.write(folder, gradebook.read(folder))}")
    return EXIT_GRADED


def _regrade(options: argparse.Namespace) -> int:
    folder = ClassFolder(options.folder)
    facts, whole = folder.facts(), rubric.load(folder.path / RUBRIC)
    submissions = [entry.id for entry in facts.entries]
    known = regrades.read(folder.path, submissions, whole)
    if not options.submission:
        return _list(folder, known)
    _require(options.submission, submissions, "submission")
    _require(options.requirement, [requirement.id for requirement in whole.requirements], "requirement")
    about = (options.submission, options.requirement)
    if options.points is not None or options.why or options.by:
        if not options.why or not options.by:
            raise UsageError("A decision needs a reason and a name.", "Add --why and --by.")
        _require_undecided(folder, facts, whole, *about)
        if options.points is not None:
            _require_points(options.points, whole, options.requirement)
        regrades.add(folder.path, *about, points=options.points, why=options.why, by=options.by)
    elif options.reason:
        regrades.add(folder.path, *about, reason=options.reason)
    else:
        _show(
            folder, whole, next((each for each in known if (each.submission, each.requirement) == about), None), *about
        )
        return EXIT_GRADED
    print(f"Class: {write_pages(folder)}")
    return EXIT_GRADED


def _list(folder: ClassFolder, known: tuple[Regrade, ...]) -> int:
    waiting = [each for each in known if each.is_open]
    for each in waiting:
        print(f"{each.submission:<20} {each.requirement:<4} {printable(each.reason, 200)}")
    print(f"requests: {len(waiting)} open, {len(known) - len(waiting)} decided ({folder.path / regrades.FILE})")
    return EXIT_GRADED


def _show(folder: ClassFolder, whole: Rubric, known: Regrade | None, submission: str, name: str) -> None:
    """Print what was seen of a requirement, where the evidence is, and how to decide."""
    report = folder.report(submission) or {}
    measured = next((each for each in report.get("requirements", ()) if each["id"] == name), None)
    requirement = next(each for each in whole.requirements if each.id == name)
    print(f"{name} {requirement.title}: {requirement.text}")
    if known is not None:
        print(printable(str(known), 600))
    if measured is None:
        print("It was not graded.")
    else:
        print(f"{measured['points']:g} of {measured['max']:g} points by the grader")
        for line in losses(measured):
            print(printable(line, 600))
        trials = dict.fromkeys(check["trial"] for check in measured["checks"] if check.get("trial"))
        for trial in trials:
            for path in sorted((folder.submission(submission) / "evidence").rglob(f"{trial}.*")):
                print(f"evidence: {path}")
    print(f"replay:   {folder.submission(submission) / report_room.PAGE}#{name}")
    print(f"again:    grader batch --out {folder.path} --only {submission} --fresh")
    print(f'decide:   grader regrade {folder.path} {submission} {name} --points N --why "..." --by "..."')


def _require(name: str, known: list[str], what: str) -> None:
    if name not in known:
        raise UsageError(f"The class has no {what} {name or 'without a name'}.", f"It has {', '.join(known)}.")


def _require_points(text: str, whole: Rubric, name: str) -> None:
    worth = next(requirement.points for requirement in whole.requirements if requirement.id == name)
    try:
        fits = 0 <= float(text) <= worth
    except ValueError:
        fits = False
    if not fits:
        raise UsageError(f"{text} is not a number of points for {name}.", f"Choose 0 to {worth:g}.")


def _require_undecided(folder: ClassFolder, facts: ClassFacts, whole: Rubric, submission: str, name: str) -> None:
    """Check that overrides.yaml, which goes before any request, says nothing of the requirement."""
    written = overrides.written(folder, facts, whole).on(submission).points
    if found := next((each for each in written if each.requirement == name), None):
        raise UsageError(
            f"{folder.overrides} gives {submission} {found.points} points for {name}, whatever is decided here.",
            "Change it there.",
        )
