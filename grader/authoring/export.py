"""Write what a platform that grades by itself takes: Gradescope's autograder.zip, a template repository for GitHub.

Both hold the kit, without the reference package, and a course of one's own in the folder `course`; the platform sets it
up as `make setup` does. What becomes of a grading there is in grader/classroom/platforms/.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

from grader import KIT
from grader.authoring import release
from grader.authoring.release import TOP, packaging, pins
from grader.course import Course, find, name_of
from grader.course.reader import INSTALLED, held_back_names
from grader.errors import EXIT_GRADED, GraderError
from grader.notebook.packing import Entry, write_zip

_EXPORTS = Path(__file__).parent / "exports"
_FILES = ("Makefile", "README.md", "LICENSE", "rubric.yaml", ".ci/setup", ".ci/setup.py")
_LEFT_OUT = "grader/selftest/"
_PLATFORM_MINUTES = 40  # the most that Gradescope allows; its default, 10, is short for its half of a core
_SPARE_S = 60  # to end a grading and write the results


def add(verbs: Any) -> None:
    """Add the verb to the grader's."""
    parser = verbs.add_parser(
        "export",
        help="write what a platform that grades by itself takes",
        description="Write the autograder that Gradescope runs for each submission, or a template repository whose "
        "workflow grades for GitHub Classroom. docs/containers.md says how to set each up.",
        epilog="Example:  grader export gradescope --out autograder.zip",
    )
    parser.add_argument("platform", choices=("gradescope", "github"))
    parser.add_argument("--out", type=Path, required=True, help="the zip")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course (default: as for grade)")
    parser.add_argument(
        "--minutes", type=int, choices=range(5, 121), metavar="N", default=_PLATFORM_MINUTES,
        help=f"the container's time limit in Gradescope's settings (default {_PLATFORM_MINUTES}); it must be that long",
    )  # fmt: skip
    parser.set_defaults(run=_export, for_authors=True)


def _export(options: argparse.Namespace) -> int:
    if options.platform == "gradescope":
        gradescope(options.out, find(options.course), options.minutes)
    else:
        github(options.out, find(options.course))
    print(f"{options.platform}: {options.out}")
    return EXIT_GRADED


def gradescope(out: Path, course: Course, minutes: int = _PLATFORM_MINUTES) -> None:
    """Write autograder.zip, which stops a grading one minute before the platform would."""
    entries = {f"kit/{name}": entry for name, entry in _kit(course).items()}
    for name in ("setup.sh", "run_autograder"):
        text = (_EXPORTS / "gradescope" / name).read_text().replace("@SECONDS@", str(60 * minutes - _SPARE_S))
        entries[name] = Entry(text.encode(), executable=True)
    write_zip(out, entries)


def github(out: Path, course: Course) -> None:
    """Write a zip with the content of a template repository.

    Raises:
        GraderError: the course holds something back, which students would read in their repositories.
    """
    if held_back_names(course):
        raise GraderError("The course holds something back, and a student's repository would show it. Grade elsewhere.")
    with tempfile.TemporaryDirectory(prefix="export-") as scratch:
        write_zip(kit := Path(scratch, "kit.zip"), {f"{TOP}/{name}": entry for name, entry in _kit(course).items()})
        entries = {kit.name: Entry(kit.read_bytes(), False)}
    folder = _EXPORTS / "github"
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        text = path.read_text().replace("@TOP@", TOP).replace("@PACKAGE@", course.package)
        entries[path.relative_to(folder).as_posix()] = Entry(text.encode(), False)
    write_zip(out, entries)


def _kit(course: Course) -> dict[str, Entry]:
    """Return the files of the kit and of a course of one's own that a grading needs, by their paths."""
    found = {name: (KIT / name).read_bytes() for name in _FILES} | release.tree(_LEFT_OUT)
    if name_of(course):  # the kit has its own
        if not course.rubric.is_relative_to(course.folder):
            raise GraderError(f"{course.rubric} is not in the course's folder {course.folder}. Move it there.")
        held_back = [path for path in course.held_back.rglob("*") if path.is_file() and path.suffix != ".pyc"]
        for path in (*release.files(course.folder), *held_back, course.rubric):
            found[f"course/{path.relative_to(course.folder).as_posix()}"] = path.read_bytes()
        found[INSTALLED] = b"course\n"
    found["pyproject.toml"] = packaging((KIT / "pyproject.toml").read_text()).encode()
    found["requirements.txt"] = pins((KIT / "requirements.txt").read_text()).encode()
    return {name: Entry(data, data.startswith(b"#!")) for name, data in sorted(found.items())}
