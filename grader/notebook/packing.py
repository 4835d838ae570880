"""Pack a package for submission and describe what the grader will see of it: files, sizes, points."""

from __future__ import annotations

import os
import posixpath
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from grader import building, pipeline
from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag
from grader.intake import containers, course_marker
from grader.intake.copy_plan import plan_copy
from grader.intake.submission import open_submission
from grader.notebook import lanes, workspace
from grader.scoring import rubric
from grader.scoring.grading import Grading, at_hand_in, points
from grader.scoring.scorecard import Outcome
from grader.words import localized, mark, say, say_count

_KEPT_DOTS = {course_marker.MARKER, ".flake8", ".coveragerc", ".gitignore"}
_EPOCH = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class PackedSubmission:
    """A packed submission. `sizes` are in bytes, by file; `laid_out` names the files that the course wrote, not you.

    `lane` is the shorter lane of the workspace that the package lies in, "" if it is in none.
    """

    archive: Path
    sizes: dict[str, int]
    laid_out: tuple[str, ...]
    missing: tuple[str, ...]
    notes: tuple[str, ...]
    flags: tuple[Flag, ...] = ()
    grading: Grading | None = None
    lane: str = ""

    def __str__(self) -> str:
        return "\n".join([*self._files(), *self._graded()])

    def _files(self) -> Iterator[str]:
        total = sum(self.sizes.values())
        yield f"{self.archive.name}: {say_count('{n} file', '{n} files', len(self.sizes))}, {_size(total)}"
        for name, size in self.sizes.items():
            by = "   " + say("laid out by the course") if name in self.laid_out else ""
            yield f"  {_size(size):>8}  {name}{by}"
        yield from (say("missing: {missing}", missing=name) for name in self.missing)
        yield from (say("note: {note}", note=note) for note in self.notes)
        yield from (say("an instructor will review this: {what}", what=say(flag.what)) for flag in self.flags)
        if self.laid_out:
            words = mark("{n} of {every} files were laid out by the course, so not your work.")
            yield say(words, n=len(self.laid_out), every=len(self.sizes))

    def _graded(self) -> Iterator[str]:
        if self.grading is None:
            words = mark(
                "Nothing was checked. Run `grader submit` without --no-check to see the points of the public checks."
            )
            yield say(words)
            return
        card = self.grading.scorecard
        yield say("The public checks give:")
        for criterion in card.criteria:
            if criterion.max:
                yield _row(criterion.criterion.title, criterion.points, criterion.max)
        total, worth = sum(c.points for c in card.criteria), sum(c.max for c in card.criteria)
        rest = at_hand_in(score.requirement for score in card.requirements)
        yield _row(say("Together"), total, worth) + (say(" that can be judged here") if rest else "")
        if rest:
            yield f"  {rest}"
        if asked := lanes.asked_for(self.lane) if self.lane else ():
            of_lane = [score for score in card.requirements if score.requirement.id in asked]
            reached, worth = sum(s.points for s in of_lane), sum(s.requirement.points for s in of_lane)
            words = mark("Your lane, {lane}, asks for {worth} of these points, and you have {reached}.")
            yield "  " + say(words, lane=self.lane, worth=points(worth), reached=points(reached))
        lost = [s.requirement.id for s in card.requirements if s.outcome not in (Outcome.PASSED, Outcome.NOT_GRADED)]
        if lost:
            yield "  " + say("points lost in {ids}; `check(...)` in the notebook says why", ids=", ".join(lost))
        yield say("Your instructor grades with other speeds, places and seeds, so the points can differ.")


def submit(
    package: Path | None = None,
    out: Path | None = None,
    *,
    check: bool = True,
    progress: Callable[[str], None] = lambda _what: None,
) -> PackedSubmission:
    """Pack `package` (default: the workspace's) as the zip `out` (default: beside the workspace's src) and describe it.

    With `check`, run the public checks on the archive itself; this takes a few minutes.

    Raises:
        SubmissionError: there is no package to hand in, or it is too large.
        GraderError: the zip cannot be written, or this host cannot check.
    """
    here = Path.cwd()
    package = (package or (here if (here / "package.xml").is_file() else workspace.find().package)).resolve()
    if not (package / "package.xml").is_file():
        raise SubmissionError(
            say(
                "There is nothing to hand in: {name} holds no package.xml. Write one in notebook 01, or name another "
                "folder with `--package`.",
                name=package.name,
            )
        )
    course = workspace.course()
    beside = package.parent.parent if package.parent.name == "src" else package.parent  # never the package itself
    target = (out or beside / f"{course.package}.zip").resolve()
    sizes = _pack(package, target)
    needed = (*course.builds, *(node.module for node in course.nodes.values()))
    with tempfile.TemporaryDirectory(prefix="submit-") as scratch:
        taken = open_submission(target, Path(scratch) / "submission", course)
        found = PackedSubmission(
            target,
            sizes,
            laid_out=tuple(name for name in course_marker.unchanged(package) if name in sizes),
            missing=tuple(name for name in needed if name not in sizes),
            notes=tuple(taken.intake.notes),
            flags=taken.flags,
            lane=_lane_of(package),
        )
        if not check:
            return found
        whole = rubric.load(course.rubric)
        only = tuple(r.id for r in whole.requirements if r.can_be_checked) if at_hand_in(whole.requirements) else ()
        settings = pipeline.Settings(whole, building.cache_folder(), course, requirements=only, progress=progress)
        graded = pipeline.grade(target, Path(scratch) / "out", settings)
    return replace(found, grading=graded)


def _lane_of(package: Path) -> str:
    try:
        here = workspace.find(package)
    except GraderError:
        return ""
    return lanes.of(here) if here.package == package else ""


def _pack(package: Path, target: Path) -> dict[str, int]:
    """Write the package's own files into the zip, below one folder, and return their sizes in bytes."""
    top = workspace.course().package
    files = _own_files(package)
    interfaces = package.with_name(workspace.course().interfaces_package)
    if (interfaces / "package.xml").is_file():  # interfaces in a package of their own, which the grader accepts
        files |= {f"../{interfaces.name}/{name}": path for name, path in _own_files(interfaces).items()}
    entries = {name: Entry(path.read_bytes(), os.access(path, os.X_OK)) for name, path in files.items()}
    write_zip(target, {posixpath.normpath(f"{top}/{name}"): entry for name, entry in entries.items()})
    return {name: len(entry.content) for name, entry in entries.items()}


def _own_files(package: Path) -> dict[str, Path]:
    """Return the files that the grader would take in, by their paths, without archives and what is hidden.

    Raises:
        SubmissionError: they are more, or larger, than a submission may be.
    """
    limits = containers.SizeLimits(file_bytes=sys.maxsize)  # a file that is too large is named, not left out
    plan = plan_copy(containers.folder(package), limits)
    names = (PurePosixPath(name) for name in plan.files if not name.endswith(".zip"))
    shown = (n for n in names if n.name in _KEPT_DOTS or not any(part.startswith(".") for part in n.parts))
    return {str(name): package / name for name in sorted(shown)}


def _row(title: str, reached: float, worth: float) -> str:
    return f"  {title:<20} {say('{reached:>5} of {max}', reached=points(reached), max=points(worth))}"


def _size(size: int) -> str:
    return localized(f"{size / 1000:.1f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB")


class Entry(NamedTuple):
    """A file of an archive."""

    content: bytes
    executable: bool


def write_zip(target: Path, entries: Mapping[str, Entry], date: tuple[int, int, int, int, int, int] = _EPOCH) -> None:
    """Write the zip `target`, completely or not at all. All its files have the same date and time.

    Raises:
        GraderError: it cannot be written.
    """
    part = target.with_name(target.name + ".part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            for name, entry in entries.items():
                info = zipfile.ZipInfo(name, date)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.external_attr = (0o100755 if entry.executable else 0o100644) << 16
                archive.writestr(info, entry.content)
        part.replace(target)
    except OSError as error:
        words = mark("Cannot write {target}: {error}. Choose another --out.")
        raise GraderError(say(words, target=target, error=error)) from error
    finally:
        part.unlink(missing_ok=True)
