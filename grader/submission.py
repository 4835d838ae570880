"""From a folder or an archive to a Submission: unpacked safely, its package found. Nothing of it is run or imported."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag, Intake
from grader.intake.containers import ARCHIVE_SUFFIXES
from grader.intake.locate import PACKAGE, Candidate, Tree, choose, interfaces_beside, survey
from grader.intake.names import printable
from grader.intake.plan import Limits
from grader.intake.unpack import content_hash, unpack

DEFAULT_LIMITS = Limits()
MOST_NESTED = 2  # archives inside one another, and how many are opened side by side is MOST_SIDE_BY_SIDE
MOST_SIDE_BY_SIDE = 5
MOST_OTHERS = 20


@dataclass(frozen=True)
class Submission:
    """A submission on our own disk: regular files only, all below `root`."""

    intake: Intake
    root: Path
    package: Path
    interfaces: Path | None
    flags: tuple[Flag, ...]


def open_submission(source: Path, into: Path, limits: Limits = DEFAULT_LIMITS) -> Submission:
    """Copy the submission `source` (a folder, zip or tar) into the new or empty folder `into` and find its package.

    Where no package is found, archives inside are opened too, up to two levels deep. `into` is left empty on failure.

    Raises:
        SubmissionError: it is not there, cannot be opened, is too large, or holds no package that can be graded.
        GraderError: our disk or the permissions on this host are in the way.
    """
    name = source.resolve().name
    with _own_folder(into):
        unpacked = unpack(source, into, limits)
        flags, notes = list(unpacked.flags), list(unpacked.notes)
        tree = survey(into)
        nested = 0 if source.is_dir() else 1
        unopened = _archives(tree)
        left = unpacked.left
        while not tree.candidates and unopened and nested < MOST_NESTED:
            for archive in unopened[:MOST_SIDE_BY_SIDE]:
                inner = unpack(into / archive, _beside(into / archive), left)
                (into / archive).unlink()
                flags += inner.flags
                notes += [f"Opened {printable(archive)} inside.", *inner.notes]
                left = inner.left
            tree, nested = survey(into), nested + 1
            unopened = _archives(tree)
        package = choose(tree, name)
        return _describe(name, tree, package, flags, notes)


def _describe(name: str, tree: Tree, package: Candidate, flags: list[Flag], notes: list[str]) -> Submission:
    interfaces = interfaces_beside(tree, package)
    others = [c for c in tree.candidates if c is not package and c is not interfaces]
    intake = Intake(
        name=printable(name),
        sha256=content_hash(tree.root, list(tree.files)),
        package=package.name,
        package_path=package.path,
        files=list(tree.files),
        others=[f"{other.path} ({other.name})" for other in others[:MOST_OTHERS]],
        notes=[*_notes_on(package, others), *notes],
        interfaces_package=interfaces.path if interfaces else "",
    )
    return Submission(
        intake=intake,
        root=tree.root,
        package=tree.root / package.path,
        interfaces=tree.root / interfaces.path if interfaces else None,
        flags=tuple(flags),
    )


def _notes_on(package: Candidate, others: list[Candidate]) -> Iterator[str]:
    if package.xml is None:
        yield f"{package.path} has no package.xml; it was taken for the package because of its modules."
    elif package.xml.problem:
        yield f"{package.path}/package.xml {package.xml.problem}.".removeprefix("./")
    elif package.xml.name != PACKAGE:
        yield f"The package is named {printable(package.xml.name) or 'nothing'}, not {PACKAGE}."
    twins = [other.path for other in others if other.name == package.name]
    if twins:
        yield f"The name {package.name} occurs more than once; {package.path} was taken, not {', '.join(twins[:5])}."


def _archives(tree: Tree) -> list[str]:
    """Return the archives in the tree, shallowest first."""
    found = [path for path in tree.searched if path.lower().endswith(ARCHIVE_SUFFIXES)]
    return sorted(found, key=lambda path: (path.count("/"), path))


def _beside(archive: Path) -> Path:
    """Return a free folder next to `archive`, named after it."""
    name = PurePosixPath(archive.name).stem.removesuffix(".tar")
    folder = archive.with_name(name)
    while folder.exists():
        folder = folder.with_name(folder.name + "_")
    return folder


@contextmanager
def _own_folder(into: Path) -> Iterator[None]:
    """Hold `into`, which must be free, and empty it again when the submission cannot be opened."""
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


__all__ = ["Submission", "SubmissionError", "open_submission"]
