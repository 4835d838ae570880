"""The `grader` command: verbs, printing, exit codes. It knows every room and decides nothing."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grader import KIT
from grader.course import Course, find, passed_over
from grader.errors import (
    EXIT_GRADED,
    EXIT_INTERRUPTED,
    EXIT_OUR_FAULT,
    GraderError,
    KitError,
    SubmissionError,
    UsageError,
)
from grader.host import namespaces, shortage, tempdir
from grader.processes import supervised
from grader.progress import Progress
from grader.scoring.rubric import Rubric
from grader.settings import Reuse, Settings
from grader.words import mark, say


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit status (grader.errors).

    As the program itself, without `arguments`, a verb that grades runs in a child process, so that Ctrl-C ends it.
    """
    words = sys.argv[1:] if arguments is None else arguments
    options = _parser(words).parse_args(words)
    if arguments is None and "interrupted" in options:
        return _supervised(options)
    return _carry_out(options)


def _supervised(options: argparse.Namespace) -> int:
    out: Path | None = options.out if options.run is _grade else None
    new = out is not None and not out.exists()
    try:
        return supervised.run(lambda: _carry_out(options))
    except KeyboardInterrupt:
        words, status = "", EXIT_INTERRUPTED
    except GraderError as error:
        words, status = str(error), EXIT_OUR_FAULT
    from grader import building
    from grader.building import cache

    with contextlib.suppress(GraderError):  # the work was done in a process of its own, which alone chose the language
        find(getattr(options, "course", None))
    cache.remove_abandoned(getattr(options, "cache", None) or building.cache_folder())
    if out is not None:
        tempdir.remove_left(out, new=new)
    Progress().done()
    words = say(words) if words else say("interrupted; {what}", what=say(options.interrupted))
    print(f"grader: {words}", file=sys.stderr)
    return status


def _carry_out(options: argparse.Namespace) -> int:
    try:
        if "course" in options and not (options.course or getattr(options, "folder", None)):
            _name_course_passed_over(options)
        return int(options.run(options))
    except KitError as error:
        return _fail(error, options.debug)
    except KeyboardInterrupt:
        print("grader: " + say("interrupted."), file=sys.stderr)
        return EXIT_INTERRUPTED
    except Exception as error:
        if options.debug:
            raise
        if said := shortage.explain(error):
            print(f"grader: {said}", file=sys.stderr)
            return EXIT_OUR_FAULT
        words = mark(
            "internal error: {name}: {error}. No submission loses points by it. "
            "Run again with --debug and send the traceback to the kit's maintainers."
        )
        print("grader: " + say(words, name=type(error).__name__, error=error), file=sys.stderr)
        return EXIT_OUR_FAULT


def _name_course_passed_over(options: argparse.Namespace) -> None:
    """Print a line about a course that is in the current folder or above it, and is not used.

    Raises:
        UsageError: the verb is one for authors of courses, who would change or release another course.
    """
    if (getattr(options, "out", None) or Path()).joinpath("class.yaml").is_file():
        return  # a class remembers its course
    if note := passed_over():
        if "for_authors" in options:
            raise UsageError(note)
        print("grader: " + note, file=sys.stderr)


_OTHERS = {
    "grader.classroom.command": {
        "gradebook": "write grades in the form that a learning platform imports",
        "rescore": "judge a class again from its evidence",
        "similar": "write what Dolos and JPlag read, which find copies",
        "batch": "grade a class",
    },
    "grader.hunting": {"hunt": "make up worlds until a package breaks a promise"},
    "grader.authoring.release": {"export": "write what a platform that grades by itself takes"},
    "grader.authoring.course_command": {
        "check-course": "find what is wrong with a course before anything is graded by it",
        "new-course": "lay out a course of your own",
    },
    "grader.selftest.attacks.command": {
        "self-test": "attack the grader on this machine, and report what stopped each attack"
    },
}
"""Modules of other rooms, whose `add` is called for a verb of theirs, and each verb's line in the list of all.

They take a second to import, which nobody is to wait for who reads the list or grades.
"""


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of all verbs; of those of other rooms, it only knows the options of one that `words` name."""
    parser = argparse.ArgumentParser(
        prog="grader",
        description="Grade ROS 2 packages: build each in a sandbox, drive it through trials, score what was seen.",
        epilog="Example:  grader grade team07.zip --out out/team07",
    )
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    verbs = parser.add_subparsers(title="verbs", required=True, metavar="VERB")
    _add_grade(verbs)
    _add_check(verbs)
    _add_submit(verbs)
    _add_handout(verbs)
    doctor = verbs.add_parser("doctor", help="report what this machine has and lacks for grading, and how to fix it")
    doctor.set_defaults(run=_doctor)
    if _exists("grader.authoring.release"):
        _add_release(verbs)
    named = next((word for word in words if not word.startswith("-")), "")
    for module, lines in _OTHERS.items():
        if named in lines and _exists(module):
            given = [_course_texts] if module == "grader.classroom.command" else []
            importlib.import_module(module).add(verbs, *given)
        elif _exists(module):
            for verb, line in lines.items():
                verbs.add_parser(verb, help=line)
    return parser


def _exists(module: str) -> bool:
    """Return whether this kit has a module: the students' has no rooms for classes, authors and attacks."""
    return KIT.joinpath(*module.split(".")).with_suffix(".py").exists()


def _course_texts() -> Mapping[str, str]:
    from grader.authoring import checkpoint_texts

    return checkpoint_texts.course_texts()


def _add_grade(verbs: Any) -> None:
    parser = verbs.add_parser(
        "grade",
        help="grade a submission",
        description="Grade a submission (a folder or an archive) and write report.json, report.html and evidence/.",
        epilog="Example:  grader grade team07.zip --out out/team07\n"
        "Exit status: 0 graded, whatever the points; 1 cannot be graded; 2 wrong usage; 3 an error of the kit or host.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("submission", type=Path, help="the package's folder, or an archive of it")
    parser.add_argument("--out", type=Path, help="the folder for the reports and the evidence")
    parser.add_argument(
        "--package-path",
        metavar="PATH",
        help="the package to grade, if the submission has several: its folder in there",
    )
    parser.add_argument("--force", action="store_true", help="replace another submission's report in --out")
    parser.add_argument(
        "--explain", action="store_true", help="build, and then print what a grading would do instead of doing it"
    )
    parser.add_argument("--rubric", type=Path, help="a rubric other than the course's own")
    _add_common(parser)
    parser.add_argument("--build-timeout", type=_seconds, default=300.0, metavar="S", help="for colcon (default 300 s)")
    parser.add_argument(
        "--unsafe-no-sandbox", action="store_true", help="disable the sandbox (INSECURE); recorded in every report"
    )
    parser.set_defaults(run=_grade, interrupted=mark("nothing was written."))


def _add_check(verbs: Any) -> None:
    parser = verbs.add_parser(
        "check",
        help="check single requirements of a package",
        description="Collect only what the named requirements need; print what was seen, expected, and what to try.",
        epilog="Example:  grader check REQUIREMENT --package ws/src/PACKAGE",
    )
    parser.add_argument(
        "requirements",
        nargs="*",
        metavar="REQUIREMENT",
        help="its id in the rubric (default: all); for an unknown one the ids are listed",
    )
    parser.add_argument("--package", type=Path, default=Path(), help="the package's folder (default: this one)")
    _add_common(parser)
    parser.set_defaults(run=_check, interrupted=mark("nothing was written."))


def _add_course(parser: argparse.ArgumentParser) -> None:
    words = "the folder of the course (default: $ROS2_COURSE, else the kit's own; never the current folder by itself)"
    parser.add_argument("--course", type=Path, metavar="DIR", help=words)


def _add_common(parser: argparse.ArgumentParser) -> None:
    """Add the options of the verbs that grade; `_settings` reads them."""
    _add_course(parser)
    parser.add_argument("--seed", type=int, default=0, help="decides speeds, places and noise (default 0)")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    words = "run everything again, even what has not changed since an earlier grading with this kit and seed"
    parser.add_argument("--fresh", action="store_true", help=words)


def _add_submit(verbs: Any) -> None:
    parser = verbs.add_parser(
        "submit",
        help="pack a package for handing in, and show what the grader will see",
        description="Pack the package as one zip, run the public checks on it, and show what the grader will see.",
        epilog="Example:  grader submit --package ws/src/PACKAGE --out team07.zip",
    )
    parser.add_argument("--package", type=Path, help="the package's folder (default: this one, or the workspace's)")
    parser.add_argument("--out", type=Path, help="the zip (default: in the workspace, above src)")
    parser.add_argument("--no-check", action="store_true", help="only pack and describe; checking takes some minutes")
    words = mark("the checks did not end. --no-check only packs.")
    parser.set_defaults(run=_submit, interrupted=words, course=None)


def _add_release(verbs: Any) -> None:
    parser = verbs.add_parser(
        "release",
        help="write the students' kit",
        description="Write what students get as one zip: notebooks, simulator, grader with the public checks, rubric "
        "and handout, without the reference package.",
        epilog="Example:  grader release --out kit.zip",
    )
    parser.add_argument("--out", type=Path, required=True, help="the zip")
    parser.add_argument(
        "--without-solutions", action="store_true", help="leave out the packed solutions; `start_at` then does nothing"
    )
    parser.add_argument(
        "--lane",
        default="whole",
        help="one of the course's lanes (default: whole): its notebooks, in which the cells that it leaves out are "
        "folded, and beside the zip a rubric of what it asks for",
    )
    _add_course(parser)
    parser.set_defaults(run=_release, for_authors=True)


def _add_handout(verbs: Any) -> None:
    parser = verbs.add_parser("handout", help="write the assignment for students, from the rubric, as Markdown")
    parser.add_argument("--out", type=Path, help="the file (default: standard output)")
    parser.add_argument("--rubric", type=Path, help="a rubric other than the course's own")
    _add_course(parser)
    parser.set_defaults(run=_handout)


def _seconds(text: str) -> float:
    with contextlib.suppress(ValueError):
        if 1 <= (value := float(text)) <= 3600:
            return value
    raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 1 to 3600")


def _settings(options: argparse.Namespace, course: Course, whole: Rubric, progress: Progress, **more: Any) -> Settings:
    from grader import building

    return Settings(
        rubric=whole, course=course, cache=options.cache or building.cache_folder(), seed=options.seed,
        reuse=Reuse.unless(options.fresh), progress=progress.say, **more,
    )  # fmt: skip


def _grade(options: argparse.Namespace) -> int:
    # Imported here, so that `grader --help` and `grader doctor` answer at once, even on hosts that lack half of this.
    from grader import pipeline, report
    from grader.checks import checks_run
    from grader.report import console
    from grader.scoring import rubric

    if options.out is None and not options.explain:
        raise UsageError(say("There is no place for the report."), say("Give one: --out FOLDER."))
    course = find(options.course)
    if options.unsafe_no_sandbox:
        os.environ[namespaces.UNSAFE_VARIABLE] = "1"
    progress = Progress()
    whole = rubric.load(options.rubric or course.rubric, checks_run.known(course))
    more = {"build_seconds": options.build_timeout, "package_path": options.package_path or ""}
    settings = _settings(options, course, whole, progress, **more)
    try:
        if options.explain:
            listed = pipeline.explain(options.submission, settings)
            progress.done()
            print(console.jobs(listed))
            return EXIT_GRADED
        grading = pipeline.grade(options.submission, options.out, settings, write=report.write, overwrite=options.force)
    except SubmissionError as error:
        progress.done()
        for remark in error.remarks:
            print(say("note: {note}", note=remark), file=sys.stderr)
        status = _fail(error, options.debug)
        if options.submission.exists():
            print(say("Report: {path}", path=options.out / report.PAGE))
        return status
    progress.done()
    colour = console.wants_colour(sys.stdout, os.environ)
    print(console.render(grading, colour=colour, encoding=sys.stdout.encoding or "utf-8"))
    print(say("Report: {path}", path=options.out / report.PAGE))
    if (theirs := report.for_student(options.out, report.PAGE)) != options.out / report.PAGE:
        print(say("For the student, without what is held back: {path}", path=theirs))
    return EXIT_GRADED


def _check(options: argparse.Namespace) -> int:
    from grader import pipeline
    from grader.report import console
    from grader.scoring import rubric
    from grader.scoring.grading import at_hand_in, points

    course = find(options.course)
    whole = rubric.load(course.rubric)
    known = {requirement.id for requirement in whole.requirements}
    if unknown := [name for name in options.requirements if name not in known]:
        ids = ", ".join(filter(None, (criterion.span for criterion in whole.criteria)))
        words = mark("no requirement is called {names}; the rubric has {ids}.")
        raise UsageError(say(words, names=", ".join(unknown), ids=ids))
    wanted = [r for r in whole.requirements if r.id in (options.requirements or known)]
    judged = [r.id for r in wanted if r.checks and (options.requirements or not r.held_back)]
    for requirement in wanted if options.requirements else ():
        if not requirement.checks:
            words = mark("{id} is {elsewhere}, not here ({worth} points)")
            worth = points(requirement.points)
            print(f"{say(words, id=requirement.id, elsewhere=requirement.waits, worth=worth)}.")
    if not judged:
        return EXIT_GRADED
    progress = Progress()
    settings = _settings(options, course, whole, progress, requirements=tuple(judged))
    with tempfile.TemporaryDirectory(prefix="check-") as scratch:
        grading = pipeline.grade(options.package.resolve(), Path(scratch), settings)
    progress.done()
    colour = console.wants_colour(sys.stdout, os.environ)
    print(console.render_checks(grading, colour=colour, encoding=sys.stdout.encoding or "utf-8"))
    if not options.requirements and (rest := at_hand_in(wanted)):
        card = grading.scorecard
        words = mark("{reached} of {worth} points that can be judged here.")
        print(say(words, reached=points(card.points), worth=points(card.max)), rest)
    return EXIT_GRADED


def _submit(options: argparse.Namespace) -> int:
    from grader.notebook import packing

    progress = Progress()
    found = packing.submit(options.package, options.out, check=not options.no_check, progress=progress.say)
    progress.done()
    print(found)
    near = os.path.relpath(found.archive)
    print(say("Hand in: {archive}", archive=near if near.count("..") <= 3 else found.archive))
    return EXIT_GRADED


def _release(options: argparse.Namespace) -> int:
    from grader.authoring.release import release
    from grader.course.reader import VARIABLE

    course = find(options.course)
    os.environ[VARIABLE] = str(course.folder)  # what the notebooks give and ask for goes by it
    print(release(options.out, course, solutions=not options.without_solutions, lane=options.lane))
    print(f"Kit: {options.out}")
    return EXIT_GRADED


def _handout(options: argparse.Namespace) -> int:
    from grader.checks import checks_run
    from grader.course import handout
    from grader.scoring import rubric

    course = find(options.course)
    text = handout.render(rubric.load(options.rubric or course.rubric, checks_run.known(course)), course)
    if options.out is None:
        print(text, end="")
    else:
        options.out.write_text(text)
        print(f"Handout: {options.out}")
    return EXIT_GRADED


def _doctor(_options: argparse.Namespace) -> int:
    from grader.host import doctor

    diagnoses = doctor.examine()
    print(doctor.render(diagnoses))
    return doctor.exit_status(diagnoses)


def _fail(error: KitError, debug: bool) -> int:
    if debug:
        raise error
    print(f"grader: {error}", file=sys.stderr)
    return error.status


if __name__ == "__main__":
    sys.exit(main())
