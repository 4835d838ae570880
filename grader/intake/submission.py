"""Turn a folder or an archive into a Submission: unpack it safely, find its package. Runs and imports nothing of it."""

from __future__ import annotations

import errno
import hashlib
import itertools
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from grader.course import Course
from grader.course.reader import COURSE
from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag, Intake
from grader.intake import choose, course_marker
from grader.intake.choose import Candidate, Tree
from grader.intake.containers import (
    ARCHIVE_SUFFIXES,
    CLOSED_ARCHIVES,
    SUBMISSION,
    Entry,
    Kind,
    SizeLimits,
    damaged,
    open_container,
    refused,
)
from grader.intake.copy_plan import CopyPlan, plan_copy
from grader.sanitize import printable
from grader.words import mark, say

BLOCK = 256 * 1024


def unpack(
    source: Path, into: Path, limits: SizeLimits, *, leave_out: Path | None = None, export: bool = False
) -> CopyPlan:
    """Copy the files of the folder or archive `source` into the empty folder `into`, and return what was followed.

    The folder `leave_out` inside `source` is not copied. `export` is as for `plan_copy`.

    Raises:
        SubmissionError: it cannot be opened, is damaged, or exceeds `limits`.
        GraderError: `into` cannot be written, or `source` cannot be read.
    """
    container = open_container(source, [into, *([leave_out] if leave_out else [])], limits)
    plan = plan_copy(container, limits, export=export)
    with _disk_errors(into):
        for folder in ("", *plan.folders):
            (into / folder).mkdir(parents=True, exist_ok=True)
    paths = {entry.index: path for path, entry in plan.files.items() if entry.kind is Kind.FILE}
    for index, stream in container.contents(paths.keys()):
        path, entry = paths[index], plan.files[paths[index]]
        if _write(into / path, stream, entry, container.name) != entry.size:
            words = mark(
                "{file} in {name} does not have its declared size: the archive is damaged, or the folder changed in "
                "the meantime."
            )
            raise refused(container.name, words, mark("Pack it again."), file=printable(path))
    with _disk_errors(into):
        for path, entry in plan.files.items():
            if entry.kind is Kind.HARD_LINK:
                (into / path).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(into / entry.target, into / path, follow_symlinks=False)
    return plan


def _write(path: Path, stream: IO[bytes], entry: Entry, name: str) -> int:
    """Write the `stream` of an entry of the container `name` to the new file `path`; return the number of bytes read.

    Stop one byte after the size of the entry.
    """
    done, mode = 0, 0o755 if entry.mode & stat.S_IXUSR else 0o644
    with _disk_errors(path):  # also as the file is closed, which writes the rest of it
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, mode)
        with os.fdopen(handle, "wb") as file:
            while done <= entry.size:
                with damaged(name):
                    block = stream.read(min(BLOCK, entry.size + 1 - done))
                if not block:
                    break
                done += len(block)
                file.write(block)
    return done


@contextmanager
def _disk_errors(path: Path) -> Iterator[None]:
    """Turn an OSError on the grader's own disk into a GraderError."""
    try:
        yield
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        raise GraderError(
            say("Cannot write {path}: {why}.", path=printable(str(path)), why=error.strerror),
            say("Free some space and grade again.") if full else say("Choose another --out and grade again."),
        ) from error


def content_hash(folder: Path, files: list[str]) -> str:
    """Return the SHA-256 over the sorted paths and bytes of `files`: the same however they were packed."""
    total = hashlib.sha256()
    for path in sorted(files):
        data = (folder / path).read_bytes()
        total.update(f"{len(path.encode())}:{path}:{len(data)}:".encode())
        total.update(data)
    return total.hexdigest()


MAX_NESTED = 2  # archives inside one another
MAX_SIDE_BY_SIDE = 5
MAX_OTHERS = 20


@dataclass(frozen=True)
class Submission:
    """A submission, copied to the grader's disk: regular files only, all below `root`."""

    intake: Intake
    root: Path
    package: Path
    interfaces: Path | None
    flags: tuple[Flag, ...]


def open_submission(
    source: Path,
    into: Path,
    course: Course,
    limits: SizeLimits = SUBMISSION,
    *,
    package: str = "",
    leave_out: Path | None = None,
) -> Submission:
    """Copy the submission `source` (a folder, zip or tar) into the new folder `into` and find its package.

    If no package is found, archives inside are opened too, up to two levels deep. `package` is the path of the package
    to take, as messages and reports show it. The folder `leave_out` inside `source` is not copied.

    Raises:
        SubmissionError: it does not exist, cannot be opened, is too large, or has no package that can be graded.
        UsageError: there is no package at the path `package`.
        GraderError: a problem with this host's disk or permissions.
    """
    name = source.resolve().name
    opened = _Opened(unpack(source, into, limits, leave_out=leave_out), limits)
    tree = choose.survey(into, course)
    for _ in range(MAX_NESTED if source.is_dir() else MAX_NESTED - 1):
        if not tree.candidates or (package and not choose.find_named(tree, package)):
            opened.open_archives(tree)
            tree = choose.survey(into, course)
    try:
        if opened.refused and not tree.candidates:
            raise opened.refused[0]
        if opened.flags and not tree.files:
            words = mark("{name} has no file that could be taken in: {why}")
            advice = mark("Zip the package folder again with an ordinary program.")
            raise refused(name, words, advice, why=next(opened.remarks()))
        return _describe(name, tree, *choose.choose(tree, name, package), opened)
    except SubmissionError as error:
        error.remarks = [*opened.remarks(), *itertools.islice(opened.closed(tree), MAX_OTHERS)]
        raise


class _Opened:
    """What was unpacked so far: the submission, and archives inside it."""

    def __init__(self, plan: CopyPlan, limits: SizeLimits) -> None:
        self.notes, self.flags = list(plan.notes), list(plan.flags)
        self.refused: list[SubmissionError] = []
        self._failed: set[str] = set()
        self._left = plan.left_of(limits)

    def open_archives(self, tree: Tree) -> None:
        """Unpack the archives in `tree`, the highest first, each into a folder beside it.

        An archive that cannot be opened stays and is noted, and its error is added to `refused`.
        """
        archives = [p for p in tree.searched if p.lower().endswith(ARCHIVE_SUFFIXES) and p not in self._failed]
        for path in sorted(archives, key=lambda path: (path.count("/"), path))[:MAX_SIDE_BY_SIDE]:
            folder = _free_folder(tree.root / path)
            try:
                inner = unpack(tree.root / path, folder, self._left)
            except SubmissionError as error:
                shutil.rmtree(folder, ignore_errors=True)
                self.refused.append(error)
                self._failed.add(path)
                self.notes.append(say("{path} was not opened: {why}", path=printable(path), why=error))
                continue
            (tree.root / path).unlink()
            self.notes += [say("Opened {path} inside.", path=printable(path)), *inner.notes]
            self.flags += inner.flags
            self._left = inner.left_of(self._left)

    def remarks(self) -> Iterator[str]:
        """Yield the notes, and the flags as notes."""
        yield from self.notes
        yield from (f"{flag.where}: {flag.what}." for flag in self.flags)

    def closed(self, tree: Tree) -> Iterator[str]:
        """Yield a note on each archive that is still closed."""
        outside = say("there is a package outside of it.")
        why = outside if tree.candidates else say("it is one of too many, or too deep inside.")
        kinds = {ARCHIVE_SUFFIXES: why, CLOSED_ARCHIVES: say("the grader opens zip and tar only.")}
        for path, (suffixes, why) in itertools.product(tree.searched, kinds.items()):
            if path.lower().endswith(suffixes) and path not in self._failed:
                yield say("{path} was not opened: {why}", path=printable(path), why=why)


def _describe(name: str, tree: Tree, package: Candidate, because: str, opened: _Opened) -> Submission:
    interfaces = choose.interfaces_beside(tree, package)
    others = [candidate for candidate in tree.candidates if candidate not in (package, interfaces)]
    intake = Intake(
        name=printable(name),
        sha256=content_hash(tree.root, list(tree.files)),
        package=package.name,
        package_path=package.path,
        files=list(tree.files),
        others=[choose.remark(candidate) for candidate in others[:MAX_OTHERS]],
        notes=[*_notes_on(tree, package), *opened.notes, *itertools.islice(opened.closed(tree), MAX_OTHERS)],
        interfaces_package=interfaces.path if interfaces else "",
        chosen_because=because,
    )
    return Submission(
        intake=intake,
        root=tree.root,
        package=tree.root / package.path,
        interfaces=tree.root / interfaces.path if interfaces else None,
        flags=tuple(opened.flags),
    )


def _notes_on(tree: Tree, package: Candidate) -> Iterator[str]:
    if package.xml.problem:
        yield f"{package.path}/package.xml {package.xml.problem}.".removeprefix("./")
    elif package.xml.name != tree.course.package:
        named = printable(package.xml.name) or say("nothing")
        yield say("The package is named {name}, not {wanted}.", name=named, wanted=tree.course.package)
    if package.inside:
        words = mark("{path} lies inside the package {package}, where colcon does not look.")
        yield say(words, path=package.path, package=package.inside)
    if note := course_marker.note(tree.root / package.path):
        yield note
    for path in [path for path in tree.searched if PurePosixPath(path).name == COURSE][:MAX_OTHERS]:
        yield say("{path} is not used: no course comes from a submission.", path=printable(path))


def _free_folder(archive: Path) -> Path:
    """Return an unused path for a folder beside `archive`, named after it."""
    name = PurePosixPath(archive.name).stem.removesuffix(".tar")
    folder = archive.with_name(name)
    while folder.exists():
        folder = folder.with_name(folder.name + "_")
    return folder
