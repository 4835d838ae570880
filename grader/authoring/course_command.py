"""The verbs with which a lecturer makes a course: their arguments, their output, their exit status."""

from __future__ import annotations

import argparse
import importlib.util
import keyword
import re
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grader.course import Course, find, load
from grader.errors import EXIT_GRADED, EXIT_NOT_GRADED, UsageError
from grader.intake import package_edits
from grader.progress import Progress
from grader.words import counted

_TEMPLATE = Path(__file__).parent / "template_course"
_NOT_COPIED = shutil.ignore_patterns("__pycache__", ".*", "ws", "build", "install", "log")
_NAME = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_MOST = 40  # letters of a name
_IMPORTS = re.compile(r"(?:^(?:import|from) .*\n)+", re.MULTILINE)


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
    of_course: dict[str, Any] = {"type": Path, "metavar": "DIR"}
    of_course["help"] = "the folder of the course (default: as for grade)"
    parser.add_argument("folder", nargs="?", **of_course)
    parser.add_argument("--course", **of_course)
    parser.add_argument("--static", action="store_true", help="only read the files; takes a second")
    parser.add_argument(
        "--seeds", type=int, default=1, metavar="N",
        help="grade the solution and each edit with N seeds, and name those with which an edit passes",
    )  # fmt: skip
    parser.add_argument(
        "--hunt", action="store_true",
        help="make the seeds up but for the first, so that each run tries other worlds (default: 20 seeds)",
    )  # fmt: skip
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.set_defaults(run=_check_course, interrupted="the course was not tried to the end.", for_authors=True)
    parser = verbs.add_parser(
        "new-course",
        help="lay out a course of your own",
        description="Lay out a small course that works, with comments that say what each part is for.",
        epilog="Example:  grader new-course mycourse --package door_opener",
    )
    parser.add_argument("folder", type=Path, help="a folder that does not exist yet, or is empty")
    parser.add_argument("--package", default="", metavar="NAME", help="the name of the package that students write")
    parser.set_defaults(run=_new_course)


def _check_course(options: argparse.Namespace) -> int:
    from grader.authoring import check_course

    if options.seeds < 1:
        raise UsageError("--seeds must be 1 or more.")
    folder: Path = options.folder or options.course or find().folder
    found = check_course.mistakes(folder)
    notes: tuple[str, ...] = ()
    if not found and not options.static:
        from grader import building
        from grader.authoring import course_trials

        progress = Progress()
        seeds: Sequence[int] = range(1, options.seeds)
        if options.hunt:
            seeds = course_trials.made_up(len(seeds) or course_trials.HUNTED)
        tried = course_trials.run(find(folder), options.cache or building.cache_folder(), progress.say, seeds)
        progress.done()
        found, notes = list(tried.problems), tried.notes
    elif not options.static:
        notes = ("nothing was graded yet; that comes when the files are in order",)
    for line in found:
        print(line)
    for line in notes:
        print(f"note: {line}")
    count = counted(len(found), "mistake") if found else "nothing is wrong"
    print(f"{folder}: {count}{' with its files' if options.static else ''}")
    return EXIT_NOT_GRADED if found else EXIT_GRADED


def _new_course(options: argparse.Namespace) -> int:
    folder: Path = options.folder
    course = lay_out(folder, options.package)
    print(
        f"{folder} is a course in which students write the package {course.package}. Next:\n"
        f"    grader check-course --static {folder}    # reads its files\n"
        f"    grader check-course {folder}             # grades its solution, and edits of it\n"
        f"    grader handout --course {folder}\n"
        "No course is used because you stand in its folder: there, type --course . instead.\n"
        "docs/own-course.md of the kit leads from here to a graded class."
    )
    return EXIT_GRADED


def lay_out(folder: Path, package: str = "") -> Course:
    """Copy the small course to `folder`, with another name of its package unless that is "", and return it.

    Raises:
        UsageError: there is something in the folder, or ROS or Python would not take the name.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UsageError(f"{folder} is not an empty folder; nothing was written.", "Choose a new one.")
    old = load(_TEMPLATE).package
    if package and (not _NAME.fullmatch(package) or keyword.iskeyword(package) or len(package) > _MOST):
        why = f"is no name for a package: small letters, digits and single underscores, {_MOST} at most"
        raise UsageError(f"{package} {why}.", "Choose another --package.")
    if package not in ("", old) and importlib.util.find_spec(package):
        why = "is the name of a Python module that is installed here, which the package would hide"
        raise UsageError(f"{package} {why}.", "Choose another --package.")
    shutil.copytree(_TEMPLATE, folder, ignore=_NOT_COPIED, dirs_exist_ok=True)
    if package:
        package_edits.rename(old, package)(folder)
        for path in folder.rglob("*.py"):
            path.write_text(_IMPORTS.sub(_by_module, path.read_text(encoding="utf-8")), encoding="utf-8")
    return load(folder)


def _by_module(imports: re.Match[str]) -> str:
    """Return lines of imports in the order that ament_flake8 asks for."""
    return "".join(sorted(imports[0].splitlines(keepends=True), key=lambda line: line.split()[1].lower()))
