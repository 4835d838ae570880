"""Decide which entries of a container are copied, and under which names. Pure: it touches no files."""

from __future__ import annotations

import posixpath
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from grader.errors import SubmissionError
from grader.evidence import Flag
from grader.intake.containers import SUBMISSION, Entry, Kind, Reach, largest
from grader.intake.names import (
    BUILD_MARKERS,
    BUILD_NAMES,
    MAX_DEPTH,
    MAX_NAME_BYTES,
    MAX_PATH_BYTES,
    collision_key,
    safe_name,
    shortened,
    tool_file,
    tool_folder,
)
from grader.sanitize import printable
from grader.words import mark, say

MB = 1024**2
VENV_MARKER = "pyvenv.cfg"
MAX_REMARKS = 30
_ALSO_A_FOLDER = mark("there is a folder of the same name; it was left out")


@dataclass(frozen=True)
class SizeLimits:
    """The size that a submission may have. The reference package has 60 files and 0.2 MB."""

    total_bytes: int = 50 * MB
    file_bytes: int = 10 * MB
    files: int = 5000
    # Text is packed 3 to 10 times smaller; a map or a log of one value 200 times, but those are small.
    ratio: int = 100
    ratio_applies_above_bytes: int = 5 * MB
    reach: Reach = SUBMISSION


@dataclass(frozen=True)
class LeftOut:
    """An entry that is not copied, by its name in the container, and why. `link` also says that of a device or pipe."""

    name: str
    why: str
    link: bool = False


@dataclass(frozen=True)
class CopyPlan:
    """What to copy: `files` maps an entry's index to its path, `copies` a path to the file that it is a copy of.

    `folders` are to be made even if nothing is in them; `left_out` are all entries that tools have not made and that
    are not copied; `shortened` are the names that were too long.
    """

    files: dict[int, str] = field(default_factory=dict)
    executable: frozenset[str] = frozenset()
    copies: dict[str, str] = field(default_factory=dict)
    bytes: int = 0
    flags: tuple[Flag, ...] = ()
    notes: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    shortened: tuple[str, ...] = ()


class _Refused(Exception):
    """An entry is left out, with a flag of `kind`, or with a note if `kind` is "" (an innocent entry)."""

    def __init__(self, kind: str, reason: str) -> None:
        super().__init__(reason)
        self.kind = kind


def plan_copy(
    name: str, entries: Sequence[Entry], limits: SizeLimits, packed_bytes: int | None = None, *, export: bool = False
) -> CopyPlan:
    """Return which of `entries` to copy, and where.

    The order of the entries makes no difference, but for those of the very same name: the last of them counts, as for
    `unzip` and `tar`. `name` is that of the container; `packed_bytes` the size of the archive, None for a folder. In
    an instructor's `export` of several hand-ins, what tools have made is kept, and long names are shortened.

    Raises:
        SubmissionError: together they are more than `limits` allow.
    """
    planner = _Planner(limits, export)
    planner.add(entries)
    total = sum(planner.sizes.values())
    _check_limits(name, planner.sizes, limits, packed_bytes)
    remarks = planner.remarks
    return CopyPlan(
        planner.files, frozenset(planner.executable), planner.copies, total, tuple(remarks.flags), tuple(remarks.notes),
        tuple(planner.folders), tuple(planner.left_out), tuple(planner.shortened),
    )  # fmt: skip


class _Planner:
    """Collects the files and copies of a CopyPlan, and a remark on each entry that is left out."""

    def __init__(self, limits: SizeLimits, export: bool) -> None:
        self.remarks = _Remarks()
        self.left_out: list[LeftOut] = []
        self.folders: list[str] = []
        self.shortened: list[str] = []
        self._export = export
        self.files: dict[int, str] = {}
        self.copies: dict[str, str] = {}
        self.executable: set[str] = set()
        self.sizes: dict[str, int] = {}
        self._limits = limits
        self._folders: set[str] = set()

    def add(self, entries: Sequence[Entry]) -> None:
        paths: dict[int, str] = {}
        for entry in entries:
            with self._remarking(entry):
                paths[entry.index] = path = _clean(entry, self._export)
                if self._export and path != _safe(entry.name):
                    self.shortened.append(entry.name)
        pruned = set() if self._export else _pruned_folders(list(paths.values()))
        kept = sorted(
            (e for e in entries if e.index in paths and (self._export or not _is_pruned(paths[e.index], pruned))),
            key=lambda e: paths[e.index],
        )
        folders = [path for e in kept if e.kind is Kind.FOLDER and (path := paths[e.index]) and self._export]
        kept = self._last_of_each_name(kept, paths)
        for entry in kept:
            if entry.kind is not Kind.HARD_LINK:
                with self._remarking(entry):
                    self._add_file(entry, paths[entry.index])
        for entry in kept:
            if entry.kind is Kind.HARD_LINK:
                with self._remarking(entry):
                    self._add_copy(entry, paths[entry.index])
        self.folders += [path for path in folders if not any(each in self.sizes for each in (path, *_folders(path)))]
        self.remarks.flags += _look_alikes(self.sizes)[: MAX_REMARKS - len(self.remarks.flags)]
        if pruned:
            names = ", ".join(printable(path, 80) for path in sorted(pruned)[:8])
            self.remarks.note(say("Left out because tools made it: {names}.", names=names))

    def _last_of_each_name(self, entries: Sequence[Entry], paths: Mapping[int, str]) -> list[Entry]:
        """Return the files and links among `entries`, for each path the last, and none where others need a folder."""
        last = {paths[entry.index]: entry for entry in entries if entry.kind is not Kind.FOLDER}
        copied = (Kind.FILE, Kind.HARD_LINK)
        self._folders = {folder for path, entry in last.items() if entry.kind in copied for folder in _folders(path)}
        for entry in entries:
            path = paths[entry.index]
            with self._remarking(entry):
                if entry.kind is Kind.FILE and path in self._folders:
                    raise _Refused("collision", say(_ALSO_A_FOLDER))
                if entry.kind is not Kind.FOLDER and last[path] is not entry:
                    raise _Refused("collision", say("its name occurs again; only the last of that name was kept"))
        return [entry for path, entry in last.items() if path not in self._folders or entry.kind is not Kind.FILE]

    @contextmanager
    def _remarking(self, entry: Entry) -> Iterator[None]:
        try:
            yield
        except _Refused as refusal:
            self.remarks.add(refusal, entry)
            link = entry.kind in (Kind.LINK, Kind.HARD_LINK, Kind.SPECIAL)
            self.left_out.append(LeftOut(entry.name, str(refusal), link))

    def _add_file(self, entry: Entry, path: str) -> None:
        _accept(entry, path, self._limits)
        self.files[entry.index] = path
        self.sizes[path] = entry.size
        if entry.mode & (stat.S_ISUID | stat.S_ISGID):
            self.remarks.add(_Refused("setuid", say("the set-user-id bit was removed")), entry)
        if entry.mode & stat.S_IXUSR:
            self.executable.add(path)

    def _add_copy(self, entry: Entry, path: str) -> None:
        original = _clean(Entry(0, entry.target, Kind.FILE), self._export)
        if original not in self.sizes:
            words = mark("hard link to {target}, which is not in the submission")
            raise _Refused("link", say(words, target=printable(entry.target)))
        if path in self._folders:
            raise _Refused("collision", say(_ALSO_A_FOLDER))
        self.copies[path] = original
        self.sizes[path] = self.sizes[original]


def _clean(entry: Entry, export: bool) -> str:
    """Return the entry's path made of safe names; of an `export`, with long names shortened."""
    # Old Windows tools write backslashes; read as separators, they cannot smuggle a `..` past the check below.
    raw = entry.name.replace("\\", "/")
    if raw.startswith("/") or (len(raw) > 1 and raw[1] == ":" and raw[0].isalpha()):
        raise _Refused("absolute path", say("its path is absolute; it was left out"))
    parts = [part for part in _safe(raw).split("/") if part]
    if ".." in parts:
        raise _Refused("traversal", say("its path leads out of the submission with '..'; it was left out"))
    if export:
        parts = [shortened(part) for part in parts]
    path = "/".join(parts)
    times = 3 if export else 1  # a submission of full depth lies in folders of the export
    if (
        len(parts) > times * MAX_DEPTH
        or len(path.encode()) > times * MAX_PATH_BYTES
        or any(len(part.encode()) > MAX_NAME_BYTES for part in parts)
    ):
        raise _Refused("", say("its name is too long or too deep; it was left out"))
    if not parts and entry.kind is not Kind.FOLDER:
        raise _Refused("name", say("it has no name; it was left out"))
    return path


def _safe(name: str) -> str:
    """Return an entry's name as a path of printable names."""
    return "/".join(safe_name(part) for part in name.replace("\\", "/").split("/") if part not in ("", "."))


def _accept(entry: Entry, path: str, limits: SizeLimits) -> None:
    """Refuse an entry that is not a regular file of a reasonable size."""
    if entry.kind is Kind.LINK:
        target, shown = entry.target.replace("\\", "/"), printable(entry.target)
        reached = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        if target.startswith("/") or reached == ".." or reached.startswith("../"):
            raise _Refused("link", say("link out of the submission, to {target}; it was left out", target=shown))
        words = mark("it is a link to {target} and was left out; submit the file itself")
        raise _Refused("", say(words, target=shown))
    if entry.kind is Kind.SPECIAL:
        words = mark("it is not a regular file (but a device, pipe or sparse file); it was left out")
        raise _Refused("special file", say(words))
    if entry.size > limits.file_bytes:
        if entry.packed is not None and entry.size > limits.ratio * max(entry.packed, 1):
            words = mark("{size} bytes packed into {packed}; it was left out")
            raise _Refused("bomb", say(words, size=entry.size, packed=entry.packed))
        words = mark("it has {size} MB, more than {most} MB, and was left out")
        raise _Refused("", say(words, size=entry.size // MB, most=limits.file_bytes // MB))


def _pruned_folders(paths: Collection[str]) -> set[str]:
    """Return the topmost folders among `paths` that tools made."""
    found: set[str] = set()
    venvs: set[str] = set()
    for path in paths:
        *folders, last = path.split("/")
        named = next((depth for depth, folder in enumerate(folders, 1) if tool_folder(folder)), None)
        if named is not None:
            found.add("/".join(folders[:named]))
        elif folders and last == VENV_MARKER:
            venvs.add("/".join(folders))
        elif folders and folders[-1] in BUILD_NAMES and last in BUILD_MARKERS:
            found.add("/".join(folders))
    # If the workspace itself is the virtual environment, the package is in it too.
    found |= venvs - {venv for venv in venvs for path in paths if _is_source(path, venv)}
    return {path for path in found if not _below(path, found)}


def _is_source(path: str, venv: str) -> bool:
    """Return whether `path` is the package.xml of a package that was written, not installed, below `venv`."""
    return (
        path.startswith(venv + "/")
        and path.endswith("/package.xml")
        and not {"share", "site-packages"} & set(path.split("/"))
    )


def _below(path: str, folders: set[str]) -> bool:
    return any(folder in folders for folder in _folders(path))


def _is_pruned(path: str, pruned: set[str]) -> bool:
    last = path.rpartition("/")[2]
    return path in pruned or _below(path, pruned) or tool_folder(last) or tool_file(last)


def _folders(path: str) -> list[str]:
    """Return the folders that a path leads through, the outermost first."""
    parts = path.split("/")
    return ["/".join(parts[:depth]) for depth in range(1, len(parts))]


def _look_alikes(paths: Iterable[str]) -> list[Flag]:
    """Return a flag for each two names that are one on some file systems (letter case, Unicode form). Both are kept."""
    spellings: dict[str, str] = {}
    flags: dict[tuple[str, str], Flag] = {}
    for path in sorted(paths):
        for name in (*_folders(path), path):
            first = spellings.setdefault(collision_key(name), name)
            if first != name:
                words = mark("it is one name with {first} on Windows and macOS; both were kept")
                flags.setdefault((first, name), Flag("collision", say(words, first=printable(first)), printable(name)))
                break
    return list(flags.values())


class _Remarks:
    """Flags for the instructor and notes for everyone, in limited number: an archive must not fill a report."""

    def __init__(self) -> None:
        self.flags: list[Flag] = []
        self.notes: list[str] = []

    def add(self, refusal: _Refused, entry: Entry) -> None:
        if refusal.kind and len(self.flags) < MAX_REMARKS:
            self.flags.append(Flag(refusal.kind, str(refusal), printable(entry.name)))
        elif not refusal.kind:
            self.note(f"{printable(entry.name)}: {refusal}.")

    def note(self, text: str) -> None:
        if len(self.notes) < MAX_REMARKS:
            self.notes.append(text)


def _check_limits(name: str, sizes: Mapping[str, int], limits: SizeLimits, packed_bytes: int | None) -> None:
    count, total = len(sizes), sum(sizes.values())
    shown = printable(name)
    advice = say("Submit the package folder only, without recordings, build trees and virtual environments.")
    if count > limits.files:
        words = mark("{name} contains {count} files, more than {most}.")
        raise SubmissionError(say(words, name=shown, count=count, most=limits.files), advice)
    if total > limits.total_bytes:
        raise SubmissionError(
            say(
                "{name} contains {size} MB, more than {most} MB. The largest files are {largest}.",
                name=shown,
                size=total // MB,
                most=limits.total_bytes // MB,
                largest=largest(sizes),
            ),
            advice,
        )
    if packed_bytes is not None and total > limits.ratio_applies_above_bytes and total > limits.ratio * packed_bytes:
        raise SubmissionError(
            say(
                "{name} unpacks to {times} times its size, like a decompression bomb.",
                name=shown,
                times=total // max(packed_bytes, 1),
            ),
            advice,
        )
