"""The verbs of a class after its grading: `grader regrade`, `grader term` and `grader forget`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from grader.classroom import command, forgetting, overrides, regrades, term, words
from grader.classroom.class_folder import CLASS, RUBRIC, ClassFacts, ClassFolder
from grader.classroom.platforms import all_platforms
from grader.classroom.regrades import Regrade
from grader.errors import EXIT_GRADED, UsageError
from grader.evidence.kept import KEPT_DAYS
from grader.report import PAGE
from grader.sanitize import printable
from grader.scoring import rubric
from grader.scoring.rubric import Rubric


def add(verbs: Any) -> None:
    """Add the verbs to the grader's."""
    _add_regrade(verbs)
    _add_term(verbs)
    _add_forget(verbs)


def _add_regrade(verbs: Any) -> None:
    parser = verbs.add_parser(
        "regrade",
        help="look at a requirement again on a student's request, and decide",
        description="With a reason, add a student's request to regrades.yaml of the class. Without one, show what the "
        "grader saw and how to see it again. With --why and --by, decide: the points, or that they stay. Without a "
        "submission, list the open requests.",
        epilog='Example:  grader regrade class team07 F4 --points 3 --why "the wall stood in the start" --by "A. Lee"',
    )
    parser.add_argument("folder", type=Path, metavar="CLASS", help="the folder that `grader batch` has made")
    parser.add_argument("submission", nargs="?", default="", help="its id in the class, such as team07")
    parser.add_argument("requirement", nargs="?", default="", help="such as F4")
    parser.add_argument("--reason", default="", metavar="TEXT", help="the student's reason; records the request")
    parser.add_argument("--points", metavar="N", help="the points that the requirement gets; without, they stay")
    parser.add_argument("--why", default="", metavar="TEXT", help="the reason of the decision, which the student reads")
    parser.add_argument("--by", default="", metavar="NAME", help="who decides")
    parser.set_defaults(run=_regrade)


def _add_term(verbs: Any) -> None:
    parser = verbs.add_parser(
        "term",
        help="add up the classes of a term",
        description="Add up the classes that term.yaml lists, each with a weight, into one total for each person. "
        "Whoever cannot be matched with certainty is listed and not counted.",
        epilog="Example:  grader term robotics/term.yaml",
    )
    parser.add_argument("term", type=Path, metavar="TERM", help="term.yaml, or the folder that it is in")
    parser.add_argument("--out", type=Path, help=f"the CSV file (default: {term.TOTALS} beside term.yaml)")
    parser.set_defaults(run=_term)


def _add_forget(verbs: Any) -> None:
    parser = verbs.add_parser(
        "forget",
        help="remove all that a class or a term keeps of one person",
        description="Show what a class, or each class of a term, keeps of one person; with --yes remove it. A team's "
        "submission stays as long as it has another member. docs/privacy.md says what is kept elsewhere.",
        epilog="Example:  grader forget s1234 class --yes",
    )
    parser.add_argument("person", help="an id, a login, an e-mail or the whole name")
    parser.add_argument("folder", type=Path, metavar="CLASS", help="a class, term.yaml, or the folder of a term")
    parser.add_argument("--yes", action="store_true", help="remove it; without, nothing is changed")
    parser.set_defaults(run=_forget)


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
    print(f"Class: {command.write_pages(folder)}")
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
        for line in words.losses(measured):
            print(printable(line, 600))
        trials = dict.fromkeys(check["trial"] for check in measured["checks"] if check.get("trial"))
        for trial in trials:
            for path in sorted((folder.submission(submission) / "evidence").rglob(f"{trial}.*")):
                print(f"evidence: {path}")
    print(f"replay:   {folder.submission(submission) / PAGE}#{name}")
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


def _term(options: argparse.Namespace) -> int:
    found = term.read(options.term)
    totals = term.add_up(found)
    beside = options.term if options.term.is_dir() else options.term.parent
    out: Path = options.out or beside / term.TOTALS
    term.write(found, totals, out)
    for doubt in totals.doubts:
        print(f"doubt: {printable(doubt, 300)}")
    whole = sum(line.total is not None for line in totals.lines)
    print(f"{len(totals.lines)} people, {whole} with a total of at most {totals.max:f}; {len(totals.doubts)} doubts")
    print(f"Totals: {out}")
    return EXIT_GRADED


def _forget(options: argparse.Namespace) -> int:
    is_class = (options.folder / CLASS).is_file()
    folders = [options.folder] if is_class else [sheet.folder for sheet in term.read(options.folder).sheets]
    for path in folders:
        folder = ClassFolder(path)
        exports = {platform.out for platform in all_platforms().values()}
        planned = forgetting.plan(folder, options.person, sorted(exports))
        print(f"{path}: {planned.person.label}")
        if options.yes:
            with folder.locked():
                for step in planned.steps:
                    step.do()
            command.write_pages(folder)
        for step in planned.steps:
            print(f"  {'removed' if options.yes else 'to remove'}: {printable(step.what, 200)}")
        named = forgetting.still_named(folder, planned.words) if options.yes else []
        for text in (*planned.left, *(f"{each} still names them" for each in named)):
            print(f"  left: {printable(text, 200)}")
    if not is_class and options.yes:
        _term(argparse.Namespace(term=options.folder, out=None))
    print(
        f"left: builds and evidence that this machine keeps without names, {KEPT_DAYS:g} and 30 days after their last "
        "use; `grader cache --prune --older-than 0` removes them now. Exports, rosters, backups and what a platform "
        "has are yours to remove, and a source that still has the submission brings it back: docs/privacy.md."
    )
    if not options.yes:
        print("Nothing was changed. Add --yes to remove it.")
    return EXIT_GRADED
