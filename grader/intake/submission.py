"""Turn a folder or an archive into a Submission: unpack it safely, find its package. Runs and imports nothing of it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from grader.contract.spec import PACKAGE
from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag, Intake
from grader.intake import course_marker
from grader.intake.containers import ARCHIVE_SUFFIXES
from grader.intake.copy_plan import SizeLimits
from grader.intake.locate import Candidate, Tree, choose, interfaces_beside, survey
from grader.intake.unpack import Unpacked, content_hash, unpack
from grader.sanitize import printable

DEFAULT_LIMITS = SizeLimits()
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


def open_submission(source: Path, into: Path, limits: SizeLimits = DEFAULT_LIMITS) -> Submission:
    """Copy the submission `source` (a folder, zip or tar) into the new or empty folder `into` and find its package.

    If no package is found, archives inside are opened too, up to two levels deep. On failure `into` is left empty.

    Raises:
        SubmissionError: it does not exist, cannot be opened, is too large, or has no package that can be graded.
        GraderError: a problem with this host's disk or permissions.
    """
    name = source.resolve().name
    with _emptied_on_failure(into):
        opened = unpack(source, into, limits)
        tree = survey(into)
        refused: list[SubmissionError] = []
        for _ in range(MAX_NESTED if source.is_dir() else MAX_NESTED - 1):
            if not tree.candidates:
                opened = _open_archives(tree, opened, refused)
                tree = survey(into)
        if refused and not tree.candidates:
            raise refused[0]
        package = choose(tree, name)
        return _describe(name, tree, package, opened)


def _open_archives(tree: Tree, so_far: Unpacked, refused: list[SubmissionError]) -> Unpacked:
    """Unpack the archives in `tree`, the shallowest first, each into a folder beside it; return the remarks on all.

    An archive that cannot be opened stays and is noted, and its error is added to `refused`.
    """
    archives = [path for path in tree.searched if path.lower().endswith(ARCHIVE_SUFFIXES)]
    for path in sorted(archives, key=lambda path: (path.count("/"), path))[:MAX_SIDE_BY_SIDE]:
        folder = _free_folder(tree.root / path)
        try:
            inner = unpack(tree.root / path, folder, so_far.left)
        except SubmissionError as error:
            shutil.rmtree(folder, ignore_errors=True)
            refused.append(error)
            so_far = replace(so_far, notes=(*so_far.notes, f"{printable(path)} was not opened: {error}"))
            continue
        (tree.root / path).unlink()
        notes = (*so_far.notes, f"Opened {printable(path)} inside.", *inner.notes)
        so_far = Unpacked(flags=(*so_far.flags, *inner.flags), notes=notes, left=inner.left)
    return so_far


def _describe(name: str, tree: Tree, package: Candidate, opened: Unpacked) -> Submission:
    interfaces = interfaces_beside(tree, package)
    others = [c for c in tree.candidates if c is not package and c is not interfaces]
    intake = Intake(
        name=printable(name),
        sha256=content_hash(tree.root, list(tree.files)),
        package=package.name,
        package_path=package.path,
        files=list(tree.files),
        others=[f"{other.path} ({other.name})" for other in others[:MAX_OTHERS]],
        notes=[*_notes_on(tree, package, others), *opened.notes],
        interfaces_package=interfaces.path if interfaces else "",
    )
    return Submission(
        intake=intake,
        root=tree.root,
        package=tree.root / package.path,
        interfaces=tree.root / interfaces.path if interfaces else None,
        flags=opened.flags,
    )


def _notes_on(tree: Tree, package: Candidate, others: list[Candidate]) -> Iterator[str]:
    if package.xml is None:
        yield f"{package.path} has no package.xml; its modules show that it is the package."
    elif package.xml.problem:
        yield f"{package.path}/package.xml {package.xml.problem}.".removeprefix("./")
    elif package.xml.name != PACKAGE:
        yield f"The package is named {printable(package.xml.name) or 'nothing'}, not {PACKAGE}."
    if note := course_marker.note(tree.root / package.path):
        yield note
    twins = [other.path for other in others if other.name == package.name]
    if twins:
        yield f"The name {package.name} occurs more than once; {package.path} is graded, not {', '.join(twins[:5])}."


def _free_folder(archive: Path) -> Path:
    """Return an unused path for a folder beside `archive`, named after it."""
    name = PurePosixPath(archive.name).stem.removesuffix(".tar")
    folder = archive.with_name(name)
    while folder.exists():
        folder = folder.with_name(folder.name + "_")
    return folder


@contextmanager
def _emptied_on_failure(into: Path) -> Iterator[None]:
    """Check that `into` is free, and empty it again if an exception is raised."""
    if into.exists() and (not into.is_dir() or any(into.iterdir())):
        raise GraderError(f"{into} is not an empty folder. Choose another --out or remove it.")
    existed = into.exists()
    try:
        yield
    except BaseException:
        for child in into.iterdir() if into.is_dir() else ():
            shutil.rmtree(child) if child.is_dir() else child.unlink()
        if into.is_dir() and not existed:
            into.rmdir()
        raise
