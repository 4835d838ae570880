"""Recognise a folder or an archive with the submissions of several people, of which none may be graded for all."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

from grader.errors import SubmissionError
from grader.intake.choose import candidate_hash
from grader.intake.containers import ARCHIVE_SUFFIXES, CLOSED_ARCHIVES, Entry, Kind
from grader.intake.locate import Tree
from grader.intake.names import tool_folder
from grader.sanitize import printable
from grader.words import say, some

_ARCHIVES = (*ARCHIVE_SUFFIXES, *CLOSED_ARCHIVES)
# As learning platforms name the submissions in an export; the group is whose it is.
_EXPORTED = (
    re.compile(r".+?_(\d+)_assignsubmission_.*", re.DOTALL),  # Moodle
    re.compile(
        rf"[^_]+(?:_late)?_(\d{{3,}})_\d{{3,}}_.+(?:{'|'.join(map(re.escape, _ARCHIVES))})", re.DOTALL | re.I
    ),  # Canvas
    re.compile(r"submission_(\d{4,})", re.DOTALL),  # Gradescope
)
# Folders in which students keep the package or copies of it.
_OWN = re.compile(
    r"src|v?\d+(\.\d+)*"
    r"|(.*[^a-z])?(backup|bak|copy|old|new|archive|draft|version|attempt|final)([^a-z].*)?",
    re.IGNORECASE | re.DOTALL,
)
_MANY = 3  # packages in as many folders of an archive are not one student's copies
_NAMED = 5


def refuse_export(name: str, entries: Sequence[Entry], max_bytes: int) -> None:
    """Check the listing of a container before anything is copied.

    Raises:
        SubmissionError: the names are those of a learning platform's export of several people's submissions, or it is
            larger than a submission may be and has archives or packages side by side.
    """
    files = [entry for entry in entries if entry.kind is Kind.FILE]
    paths = [entry.name.replace("\\", "/").removeprefix("./").lstrip("/") for entry in files]
    units = _units([path for path in paths if not any(tool_folder(part) for part in path.split("/"))])
    if "package.xml" in units:
        return
    for pattern in _EXPORTED:
        whose = {found[1]: unit for unit in units if (found := pattern.fullmatch(unit))}
        if len(whose) > 1:
            raise _refusal(name, sorted(whose.values()))
    parts = [u for u, inside in units.items() if u.lower().endswith(_ARCHIVES) or "package.xml" in inside]
    if sum(entry.size for entry in files) > max_bytes and len(parts) > 1:
        raise _refusal(name, sorted(parts))


def refuse_several(tree: Tree, name: str, opened: Mapping[str, str], folder: bool) -> None:
    """Check what was unpacked. `opened` maps the folders of archives that were inside to the archives' paths.

    Raises:
        SubmissionError: several archives hold a package for the assignment, or several folders do that do not look
            like one student's copies. In an archive (not a `folder`), that takes three.
    """
    ours = {
        candidate.path: candidate_hash(tree, candidate)
        for candidate in tree.candidates
        if (candidate.name == tree.course.package or candidate.modules) and not candidate.inside
    }
    archives: dict[str, str] = {}
    for path, content in ours.items():
        if archive := next((opened[parent] for parent in _way_to(path) if parent in opened), ""):
            archives.setdefault(content, archive)
    if len(set(archives.values())) > 1:
        raise _refusal(name, sorted(set(archives.values())))
    exact = [
        candidate.path
        for candidate in tree.candidates
        if candidate.name == tree.course.package and candidate.path in ours
    ]
    people: dict[str, str] = {}
    for unit, path in zip(_tops(exact), exact, strict=True):
        if not (_OWN.fullmatch(unit) or unit.lower().startswith(tree.course.package.lower())):
            people.setdefault(ours[path], unit)
    if len(set(people.values())) >= (2 if folder else _MANY):
        raise _refusal(name, sorted(set(people.values())))


def _units(paths: Sequence[str]) -> dict[str, set[str]]:
    """Return the topmost names in which paths differ, each with the names of the files below it."""
    found: dict[str, set[str]] = {}
    for top, path in zip(_tops(paths), paths, strict=True):
        found.setdefault(top, set()).add(PurePosixPath(path).name)
    return found


def _tops(paths: Sequence[str]) -> list[str]:
    """Return for each path its part behind the folders that all have in common."""
    parts = [PurePosixPath(path).parts or (".",) for path in paths]
    shared = 0
    while parts and all(len(each) > shared + 1 for each in parts) and len({each[shared] for each in parts}) == 1:
        shared += 1
    return [each[shared] for each in parts]


def _way_to(path: str) -> list[str]:
    return [path, *(parent.as_posix() for parent in PurePosixPath(path).parents)]


def _refusal(name: str, parts: Sequence[str]) -> SubmissionError:
    shown = some([printable(part, 60) for part in parts], _NAMED)
    return SubmissionError(
        say(
            "{name} holds the submissions of several people: {parts}. `grader grade` takes one.",
            name=printable(name),
            parts=shown,
        ),
        say(
            "Name one of them, or grade all with `grader batch`. "
            "If all are one student's, choose with `grader grade --package-path PATH`."
        ),
    )
