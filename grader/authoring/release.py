"""Write the kit for students, and what platforms take that grade by themselves: a zip each.

The students' files are listed here by name, so a new file is left out until it is added here. `grader` and `sim` go in
whole, without the folders in `_WITHHELD`. An export holds the kit without the reference package, and a course of one's
own in the folder `course`; the platform sets it up as `make setup` does, and grader/classroom/platforms/ says what
becomes of a grading there.
"""

from __future__ import annotations

import argparse
import re
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import nbformat
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from grader import KIT
from grader.authoring import checkpoint_texts, held_back
from grader.course import Course, find, handout, name_of, reader
from grader.errors import EXIT_GRADED, GraderError
from grader.host import provenance
from grader.notebook import checkpoints, lanes, last_hint
from grader.notebook.packing import Entry, write_zip
from grader.scoring import rubric
from grader.words import counted

TOP = "ros2-course-kit"
_COURSES = KIT / "grader" / "courses"
_STUDENT_KIT = KIT / "grader" / "authoring" / "student_kit"
_PAGES = (
    "handout.md", "glossary.md", "hunt.md", "live-view.md", "ros2-command.md", "ros2-session.md", "simulator.md",
    "launch.md", "ros-from-wheels.md", "setup.md", "turtlebot4.md", "turtlebot4/turtlebot4_launch.py",
    "turtlebot4/adapter.py",
)  # fmt: skip
# The tools with which instructors make, attack and release the course.
_WITHHELD = ("grader/authoring/", "grader/classroom/", "grader/selftest/", "grader/courses/")
# Sections about what the kit has not: the published edition, the sources, the tests, the developers' tools.
_LEFT_OUT = (
    "## Only look\n", "## How they are made\n", "## How it is tested\n", "## Pinned versions\n",
    "## Continuous integration\n", "## What it finds\n", "## Points by a hunt\n",
)  # fmt: skip
_NO_EXTRAS = ("dev", "cluster")
_NO_SOURCE = ("__pycache__", ".pyc", ".ipynb_checkpoints")
_EXPORTS = Path(__file__).parent / "exports"
_OF_AN_EXPORT = ("Makefile", "README.md", "LICENSE", "rubric.yaml", ".ci/setup", ".ci/setup.py")
_NOT_EXPORTED = "grader/selftest/"
_PLATFORM_MINUTES = 40  # the most that Gradescope allows; its default, 10, is short for its half of a core
_SPARE_S = 60  # to end a grading and write the results
_SOLUTIONS = checkpoints.PACKED.relative_to(KIT).as_posix()


def release(out: Path, course: Course, *, solutions: bool = True, lane: str = lanes.WHOLE) -> str:
    """Write the students' kit to the zip `out`, and return in words what is in it, and whether `start_at` works.

    For a shorter lane, a rubric of what it asks for is written beside it.

    Raises:
        GraderError: this is not a whole checkout, `out` cannot be written, or the course has no such lane.
    """
    if lane != lanes.WHOLE and not solutions:
        raise GraderError(f"The lane {lane} gives solved pieces, so it cannot be released without solutions.")
    if not course.solution.is_dir():
        raise GraderError(f"There is no {course.solution}. Release the students' kit from a whole checkout.")
    files = contents(course, solutions=solutions, lane=lane)
    entries = {f"{TOP}/{name}": Entry(data, data.startswith(b"#!")) for name, data in sorted(files.items())}
    # JupyterLab's file browser shows how old a file is.
    write_zip(out, entries, time.gmtime(provenance.commit_time() or time.time())[:6])
    words = "without any solved file, so `start_at` lays out nothing"
    if solutions and (solved := checkpoint_texts.packed()):
        which = " to ".join(dict.fromkeys((solved[0], solved[-1])))
        words = f"with the solved files of {which}, so `start_at` works; --without-solutions leaves them out"
    if lane != lanes.WHOLE:
        profile = out.with_suffix(".rubric.yaml")
        profile.write_text(profile_of(lane, course.rubric.read_text(encoding="utf-8")), encoding="utf-8")
        words += f"; the notebooks are those of the lane {lane}, and {profile.name} is the rubric of what it asks for"
    return f"{counted(len(files), 'file')}, {out.stat().st_size / 1e6:.1f} MB; {words}"


def profile_of(lane: str, text: str) -> str:
    """Return the text of a rubric that has of another's what a lane asks for, for `grader grade --rubric`."""
    data, asked = yaml.safe_load(text), lanes.asked_for(lane)
    every = [each["id"] for criterion in data["criteria"] for each in criterion["requirements"]]
    for criterion in data["criteria"]:
        criterion.pop("points", None)
        criterion["requirements"] = [each for each in criterion["requirements"] if each["id"] in asked]
    data |= {"title": f"{data['title']}, the {lane} lane", "version": f"{data['version']}-{lane}"}
    data["dropped"] = [name for name in every if name not in asked]
    words = f"# What the lane {lane} asks for; the course gives the rest of the package.\n"
    return words + yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=120)


def contents(course: Course, *, solutions: bool = True, lane: str = lanes.WHOLE) -> dict[str, bytes]:
    """Return the files of a course's kit for students by their paths.

    Raises:
        GraderError: the course has no such lane.
    """
    if lane != lanes.WHOLE and lane not in lanes.table():
        raise GraderError(f"There is no lane {lane!r}; there are {', '.join(lanes.table()) or 'none in this course'}.")
    named = (".ci/setup", ".ci/setup.py", ".gitignore", "LICENSE", *(f"docs/{page}" for page in _PAGES))
    found = {name: (KIT / name).read_bytes() for name in named} | tree(*_WITHHELD)
    for path in (*_STUDENT_KIT.iterdir(), *(course.folder / "student_kit").glob("*")):
        found[path.name] = path.read_bytes()
    own, whole = _of(course), rubric.load(course.rubric)
    for name, path in own.items():
        found[name] = path.read_bytes()
        if lane != lanes.WHOLE and path.suffix == ".ipynb":
            found[name] = _in_lane(path, lane)
        elif path == course.rubric:
            found[name] = held_back.rubric_for_students(path.read_text(encoding="utf-8"), whole, course).encode()
    found["docs/handout.md"] = handout.render(whole, course).encode()
    found |= {name: for_students(text.decode()).encode() for name, text in found.items() if name.endswith(".md")}
    found["pyproject.toml"] = packaging((KIT / "pyproject.toml").read_text()).encode()
    found["requirements.txt"] = pins((KIT / "requirements.txt").read_text()).encode()
    found.pop(_SOLUTIONS, None)
    if solutions and checkpoint_texts.packed():
        found[_SOLUTIONS] = checkpoint_texts.pack()
    if course.rubric != rubric.RUBRIC:
        found[reader.INSTALLED] = f"{course.folder.name}\n".encode()
    names = {*own, _SOLUTIONS, "docs/handout.md"}
    held_back.require_apart(course, {name: content for name, content in found.items() if name in names})
    return found


def _in_lane(path: Path, lane: str) -> bytes:
    """Return a notebook as a lane has it; one that no lane has stays as it is."""
    if path.name[:2] not in lanes.minutes(lane):
        return path.read_bytes()
    notebook = lanes.fold(nbformat.read(path, as_version=4), path.name[:2], lane)
    return (nbformat.writes(notebook, version=4).rstrip("\n") + "\n").encode()


def tree(*withheld: str) -> dict[str, bytes]:
    """Return the files of `grader` and `sim` by their paths, but for those whose paths begin with one of `withheld`."""
    paths = {path.relative_to(KIT).as_posix(): path for top in ("grader", "sim") for path in (KIT / top).rglob("*")}
    return {
        name: path.read_bytes()
        for name, path in sorted(paths.items())
        if path.is_file() and not name.startswith(withheld) and not any(part in name for part in _NO_SOURCE)
    }


def _of(course: Course) -> dict[str, Path]:
    """Return the files of a course by their paths in the kit: as in the checkout, or below the name of its folder.

    The solution, the notebooks' sources, the edits (known-bad ones, and those of the patients) and held_back/ stay
    with the instructor.
    """
    notebooks = course.notebooks
    top = KIT if course.rubric == rubric.RUBRIC else course.folder.parent
    pages = [*notebooks.glob("README.md"), *notebooks.glob("[0-9][0-9]_*.ipynb")]
    pages = [page for page in pages if page.name.count(".") == 1]  # not the folded copies of a lane
    pages += [*notebooks.glob("pictures/[0-9][0-9]*.png"), *notebooks.glob(f"{last_hint.FOLDER}/[0-9][0-9]_*.json")]
    found = {course.rubric, *pages, *files(course.folder), *([_COURSES / "__init__.py"] if top == KIT else [])}
    return {path.relative_to(top).as_posix(): path for path in found}


def files(folder: Path) -> list[Path]:
    """Return the files of a course's folder with which a student's package is checked."""
    found = [p for p in folder.glob("*") if p.suffix in (".yaml", ".j2", ".py")]
    for name in ("contract", "trials", "checks", "functions", "worlds", "words", "lessons", "hunts"):
        found += [path for path in (folder / name).rglob("*") if path.is_file()]
    return [path for path in found if not any(part in path.as_posix() for part in _NO_SOURCE)]


def for_students(page: str) -> str:
    """Return a page without its sections about what only the whole kit has."""
    sections = re.split(r"(?m)^(?=## )", page)
    return "".join(section for section in sections if not section.startswith(_LEFT_OUT)).rstrip("\n") + "\n"


def packaging(text: str) -> str:
    """Return pyproject.toml without what students do not use: some extras, entry points, linters' settings."""
    tables = re.split(r"(?m)^(?=\[)", text)
    kept = [t for t in tables if not t.startswith(("[tool.", "[[tool.", "[project.entry-points."))]
    kept += [t for t in tables if t.startswith("[tool.setuptools")]
    return re.sub(rf"(?m)^(#.*\n)?({'|'.join(_NO_EXTRAS)}) = .*\n", "", "".join(kept)).rstrip("\n") + "\n"


def pins(text: str) -> str:
    """Return requirements.txt without the packages that only those extras need.

    The lines "# via" below a package name the packages that need it.
    """
    # A package may have one pin for each Python version.
    pinned = re.findall(r"(?m)^(([\w.-]+)==.*\n(?: +#.*\n)*)", text)
    needed_by: dict[str, set[str]] = {name: set() for _, name in pinned}
    for lines, name in pinned:
        needed_by[name].update(re.findall(r"# +(?:via )?([\w.-]+)", lines))
    kept = _wanted() & needed_by.keys()
    while more := {name for name, parents in needed_by.items() if name not in kept and parents & kept}:
        kept |= more
    return "".join(lines for lines, name in pinned if name in kept)


def _wanted() -> set[str]:
    """Return the packages that the kit names itself: all but those of extras that it has not."""
    settings = tomllib.loads((KIT / "pyproject.toml").read_text())
    extras = settings["project"]["optional-dependencies"]
    # `make setup` builds the kit without fetching anything more.
    named = [*settings["project"]["dependencies"], *settings["build-system"]["requires"]]
    named += [requirement for extra, listed in extras.items() if extra not in _NO_EXTRAS for requirement in listed]
    return {canonicalize_name(Requirement(requirement).name) for requirement in named}


# -- for platforms that grade by themselves ----------------------------------------------------------------------------


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
    if reader.held_back_names(course):
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
    found = {name: (KIT / name).read_bytes() for name in _OF_AN_EXPORT} | tree(_NOT_EXPORTED)
    if name_of(course):  # the kit has its own
        if not course.rubric.is_relative_to(course.folder):
            raise GraderError(f"{course.rubric} is not in the course's folder {course.folder}. Move it there.")
        held_back = [path for path in course.held_back.rglob("*") if path.is_file() and path.suffix != ".pyc"]
        for path in (*files(course.folder), *held_back, course.rubric):
            found[f"course/{path.relative_to(course.folder).as_posix()}"] = path.read_bytes()
        found[reader.INSTALLED] = b"course\n"
    found["pyproject.toml"] = packaging((KIT / "pyproject.toml").read_text()).encode()
    found["requirements.txt"] = pins((KIT / "requirements.txt").read_text()).encode()
    return {name: Entry(data, data.startswith(b"#!")) for name, data in sorted(found.items())}
