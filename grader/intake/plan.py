"""Decide what of a container is kept, and under which name. Pure: no files, no writing."""

from __future__ import annotations

import posixpath
import stat
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from grader.errors import SubmissionError
from grader.evidence import Flag
from grader.intake.containers import Entry, Kind
from grader.intake.names import (
    DEEPEST,
    LONGEST_NAME,
    LONGEST_PATH,
    collision_key,
    never_kept,
    never_kept_file,
    safe_name,
)
from grader.sanitize import printable

MB = 1024**2
# A build tree has one of these in it. Going by the name alone would take a student's own folder `log` away.
BUILD_NAMES = frozenset({"build", "install", "log", "devel"})
BUILD_MARKERS = frozenset(
    {"COLCON_IGNORE", ".built_by", ".colcon_install_layout", ".catkin", "CMakeCache.txt", "local_setup.sh"}
)
VENV_MARKER = "pyvenv.cfg"
MOST_REMARKS = 30


@dataclass(frozen=True)
class Limits:
    """How much a submission may be. The reference package is 60 files and 0.2 MB."""

    total_bytes: int = 50 * MB
    file_bytes: int = 10 * MB
    files: int = 5000
    # Text packs 3 to 10 times; a map or a log of one value 200 times, but those are small.
    ratio: int = 100
    ratio_counts_above: int = 5 * MB


@dataclass(frozen=True)
class Plan:
    """What to copy: `files` maps an entry's index to its path, `copies` a path to the earlier one that it repeats."""

    files: dict[int, str] = field(default_factory=dict)
    executable: frozenset[str] = frozenset()
    copies: dict[str, str] = field(default_factory=dict)
    bytes: int = 0
    flags: tuple[Flag, ...] = ()
    notes: tuple[str, ...] = ()


class _Refused(Exception):
    """This entry is left out: an innocent one with a note, another with a flag of `kind`."""

    def __init__(self, kind: str, what: str) -> None:
        super().__init__(what)
        self.kind = kind


def plan(name: str, entries: Sequence[Entry], limits: Limits, packed_bytes: int | None = None) -> Plan:
    """Return what is kept of `entries`, the same for every order in which they come.

    `packed_bytes` is the size of the archive they come from; None for a folder.

    Raises:
        SubmissionError: together they are more than `limits` allow.
    """
    remarks = _Remarks()
    paths: dict[int, str] = {}
    for entry in entries:
        try:
            paths[entry.index] = _clean(entry)
        except _Refused as refusal:
            remarks.add(refusal, entry)
    pruned = _pruned_folders(list(paths.values()))
    kept = sorted(
        (e for e in entries if e.index in paths and not _is_pruned(paths[e.index], pruned)),
        key=lambda e: paths[e.index],
    )
    places = _Places()
    files: dict[int, str] = {}
    sizes: dict[str, int] = {}
    executable = set()
    hard_links = []
    for entry in kept:
        path = paths[entry.index]
        try:
            if entry.kind is Kind.HARD_LINK:
                hard_links.append(entry)
            elif entry.kind is not Kind.FOLDER:
                _accept(entry, path, limits)
                places.take(path)
                files[entry.index] = path
                sizes[path] = entry.size
                if entry.mode & (stat.S_ISUID | stat.S_ISGID):
                    remarks.add(_Refused("setuid", "the set-user-id bit was removed"), entry)
                if entry.mode & stat.S_IXUSR:
                    executable.add(path)
        except _Refused as refusal:
            remarks.add(refusal, entry)
    copies: dict[str, str] = {}
    for entry in hard_links:
        try:
            path, original = paths[entry.index], _inside(entry.target)
            if original not in sizes:
                raise _Refused("link", f"hard link to {printable(entry.target)}, which is not in the submission")
            places.take(path)
            copies[path] = original
            sizes[path] = sizes[original]
        except _Refused as refusal:
            remarks.add(refusal, entry)
    if pruned:
        remarks.note(
            f"Not looked at, because tools made it: {', '.join(printable(p, 80) for p in sorted(pruned)[:8])}."
        )
    total = sum(sizes.values())
    _check_limits(name, len(sizes), total, limits, packed_bytes)
    return Plan(files, frozenset(executable), copies, total, tuple(remarks.flags), tuple(remarks.notes))


def _clean(entry: Entry) -> str:
    """Return the entry's path made of safe names."""
    # Old Windows tools write backslashes; taken as separators they cannot smuggle a `..` past the check below.
    raw = entry.name.replace("\\", "/")
    if raw.startswith("/") or (len(raw) > 1 and raw[1] == ":" and raw[0].isalpha()):
        raise _Refused("absolute path", "its path is absolute; it was left out")
    parts = [part for part in raw.split("/") if part not in ("", ".")]
    if ".." in parts:
        raise _Refused("traversal", "its path leads out of the submission with '..'; it was left out")
    parts = [safe_name(part) for part in parts]
    path = "/".join(parts)
    if len(parts) > DEEPEST or len(path.encode()) > LONGEST_PATH or any(len(p.encode()) > LONGEST_NAME for p in parts):
        raise _Refused("", "its name is too long or too deep; it was left out")
    if not parts and entry.kind is not Kind.FOLDER:
        raise _Refused("name", "it has no name; it was left out")
    return path


def _inside(target: str) -> str:
    return _clean(Entry(0, target, Kind.FILE))


def _accept(entry: Entry, path: str, limits: Limits) -> None:
    """Refuse what is not a regular file of a fair size."""
    if entry.kind is Kind.LINK:
        target = entry.target.replace("\\", "/")
        reached = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        if target.startswith("/") or reached == ".." or reached.startswith("../"):
            raise _Refused("link", f"link out of the submission, to {printable(entry.target)}; it was left out")
        raise _Refused("", f"it is a link to {printable(entry.target)} and was left out; submit the file itself")
    if entry.kind is Kind.SPECIAL:
        raise _Refused("special file", "neither a file nor a folder (a device, a pipe, a sparse file); it was left out")
    if entry.size > limits.file_bytes:
        if entry.packed is not None and entry.size > limits.ratio * max(entry.packed, 1):
            raise _Refused("bomb", f"{entry.size} bytes packed into {entry.packed}; it was left out")
        raise _Refused("", f"it has {entry.size // MB} MB, more than {limits.file_bytes // MB} MB, and was left out")


def _pruned_folders(paths: Collection[str]) -> set[str]:
    """Return the topmost folders among `paths` that tools made."""
    found: set[str] = set()
    venvs: set[str] = set()
    for path in paths:
        *folders, last = path.split("/")
        named = next((depth for depth, folder in enumerate(folders, 1) if never_kept(folder)), None)
        if named is not None:
            found.add("/".join(folders[:named]))
        elif folders and last == VENV_MARKER:
            venvs.add("/".join(folders))
        elif folders and folders[-1] in BUILD_NAMES and last in BUILD_MARKERS:
            found.add("/".join(folders))
    # Somebody who made the environment right in the workspace has the package in there too.
    found |= venvs - {venv for venv in venvs for path in paths if _is_source(path, venv)}
    return {path for path in found if not _below(path, found)}


def _is_source(path: str, venv: str) -> bool:
    """Say whether `path` is the package.xml of a package that was written, not installed, below `venv`."""
    return (
        path.startswith(venv + "/")
        and path.endswith("/package.xml")
        and not {"share", "site-packages"} & set(path.split("/"))
    )


def _below(path: str, folders: set[str]) -> bool:
    parts = path.split("/")
    return any("/".join(parts[:depth]) in folders for depth in range(1, len(parts)))


def _is_pruned(path: str, pruned: set[str]) -> bool:
    parts = path.split("/")
    return path in pruned or _below(path, pruned) or never_kept(parts[-1]) or never_kept_file(parts[-1])


class _Places:
    """The paths taken so far. No two may be one where letter case does not count, and no file may be a folder too."""

    def __init__(self) -> None:
        self._spelling: dict[str, str] = {}
        self._files: set[str] = set()

    def take(self, path: str) -> None:
        parts = path.split("/")
        prefixes = ["/".join(parts[: depth + 1]) for depth in range(len(parts))]
        for prefix in prefixes:
            key = collision_key(prefix)
            taken = self._spelling.get(key)
            if taken is not None and (prefix == path or taken != prefix or key in self._files):
                raise _Refused("collision", f"its name collides with {printable(taken)}; it was left out")
        for prefix in prefixes:
            self._spelling.setdefault(collision_key(prefix), prefix)
        self._files.add(collision_key(path))


class _Remarks:
    """Flags for an instructor, notes for everybody; a hostile archive must not fill a report with them."""

    def __init__(self) -> None:
        self.flags: list[Flag] = []
        self.notes: list[str] = []

    def add(self, refusal: _Refused, entry: Entry) -> None:
        if refusal.kind and len(self.flags) < MOST_REMARKS:
            self.flags.append(Flag(refusal.kind, str(refusal), printable(entry.name)))
        elif not refusal.kind:
            self.note(f"{printable(entry.name)}: {refusal}.")

    def note(self, text: str) -> None:
        if len(self.notes) < MOST_REMARKS:
            self.notes.append(text)


def _check_limits(name: str, count: int, total: int, limits: Limits, packed_bytes: int | None) -> None:
    advice = "Submit the package folder only, without recordings, build trees and virtual environments."
    if count > limits.files:
        raise SubmissionError(f"{printable(name)} holds {count} files, more than {limits.files}. {advice}")
    if total > limits.total_bytes:
        raise SubmissionError(
            f"{printable(name)} holds {total // MB} MB, more than {limits.total_bytes // MB} MB. {advice}"
        )
    if packed_bytes is not None and total > limits.ratio_counts_above and total > limits.ratio * packed_bytes:
        raise SubmissionError(
            f"{printable(name)} unpacks to {total // max(packed_bytes, 1)} times its size, as only bombs do. {advice}"
        )
