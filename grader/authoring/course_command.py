"""The verbs with which a lecturer makes a course: their arguments, their output, their exit status."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from grader.course import find
from grader.errors import EXIT_GRADED, EXIT_NOT_GRADED
from grader.progress import Progress


def add(verbs: Any) -> None:
    """Add the verbs to the command line."""
    parser = verbs.add_parser(
        "check-course",
        help="find what is wrong with a course before anything is graded by it",
        description="Read all files of a course and name each mistake with its file and line. Then grade its solution "
        "with two seeds, and each known-bad edit, which has to lose what it says.",
        epilog="Example:  grader check-course mycourse\nExit status: 0 nothing is wrong, 1 something is.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", nargs="?", type=Path, help="the course (default: as for grade)")
    parser.add_argument("--static", action="store_true", help="only read the files; takes a second")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.set_defaults(run=_check_course, interrupted="the course was not tried to the end.")


def _check_course(options: argparse.Namespace) -> int:
    from grader.authoring import check_course

    folder: Path = options.folder or find().folder
    found = check_course.mistakes(folder)
    notes: tuple[str, ...] = ()
    if not found and not options.static:
        from grader import building
        from grader.authoring import course_trials

        progress = Progress()
        tried = course_trials.run(find(folder), options.cache or building.cache_folder(), progress.say)
        progress.done()
        found, notes = list(tried.problems), tried.notes
    for line in found:
        print(line)
    for line in notes:
        print(f"note: {line}")
    count = f"{len(found)} mistake{'s' if len(found) > 1 else ''}" if found else "nothing is wrong"
    print(f"{folder}: {count}{' with its files' if options.static else ''}")
    return EXIT_NOT_GRADED if found else EXIT_GRADED
