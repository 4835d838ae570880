"""Decide which entries of a container are copied, and under which names. Pure: it touches no files."""

from __future__ import annotations

import posixpath
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from grader.errors import SubmissionError
from grader.evidence import Flag
from grader.intake.containers import MB, Entry, Kind, SizeLimits, largest
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

VENV_MARKER = "pyvenv.cfg"
MAX_REMARKS = 30


@dataclass(frozen=True)
class LeftOut:
    """An entry that is not copied, by its name in the container, and why. `link` also says that of a device or pipe."""

    name: str
    why: str
    link: bool = False


@dataclass
class CopyPlan:
    """What to copy, and what not.

    Attributes:
        files: the path of each entry to copy, by its index; `executable` are those paths that have that bit.
        copies: the path of each hard link, with the path of the file that it becomes a copy of.
        sizes: the bytes of each path of these two.
        folders: folders of an export to be made even if nothing is in them.
        flags, notes: remarks for the instructor and for everyone, in limited number: an archive must not fill a report.
        left_out: all entries that tools have not made and that are not copied.
        shortened: the names that were too long.
    """

    files: dict[int, str] = field(default_factory=dict)
    executable: set[str] = field(default_factory=set)
    copies: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)
    folders: list[str] = field(default_factory=list)
    flags: list[Flag] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    shortened: list[str] = field(default_factory=list)

    def flag(self, kind: str, what: str, name: str) -> None:
        """Add a flag on the entry `name`."""
        if len(self.flags) < MAX_REMARKS:
            self.flags.append(Flag(kind, what, printable(name)))

    def note(self, text: str) -> None:
        """Add a note."""
        if len(self.notes) < MAX_REMARKS:
            self.notes.append(text)

    @contextmanager
    def remarking(self, entry: Entry) -> Iterator[None]:
        """Leave the entry out, with a flag or a note, if it is refused in the block."""
        try:
            yield
        except _Refused as refusal:
            if refusal.kind:
                self.flag(refusal.kind, str(refusal), entry.name)
            else:
                self.note(f"{printable(entry.name)}: {refusal}.")
            link = entry.kind in (Kind.LINK, Kind.HARD_LINK, Kind.SPECIAL)
            self.left_out.append(LeftOut(entry.name, str(refusal), link))


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
    plan, paths = CopyPlan(), dict[int, str]()
    for entry in entries:
        with plan.remarking(entry):
            paths[entry.index] = path = _path(entry.name, export)
            if not path and entry.kind is not Kind.FOLDER:
                del paths[entry.index]
                raise _Refused("name", say("it has no name; it was left out"))
            if export and path != _safe(entry.name):
                plan.shortened.append(entry.name)
    pruned = set() if export else _pruned_folders(list(paths.values()))
    kept = [e for e in entries if e.index in paths and (export or not _is_pruned(paths[e.index], pruned))]
    last = {paths[entry.index]: entry for entry in kept if entry.kind is not Kind.FOLDER}
    copied = [path for path, entry in last.items() if entry.kind in (Kind.FILE, Kind.HARD_LINK)]
    above = {folder for path in copied for folder in _folders(path)}
    # By name; hard links after the files that they become copies of.
    for entry in sorted(kept, key=lambda e: (e.kind is Kind.HARD_LINK, paths[e.index])):
        path = paths[entry.index]
        with plan.remarking(entry):
            if entry.kind is Kind.FOLDER:
                plan.folders += [path] if path and export else []
            else:
                _add(plan, entry, path, limits, export, is_last=last[path] is entry, is_folder=path in above)
    plan.folders = [path for path in plan.folders if not plan.sizes.keys() & {path, *_folders(path)}]
    plan.flags += _look_alikes(plan.sizes)[: MAX_REMARKS - len(plan.flags)]
    if pruned:
        names = ", ".join(printable(path, 80) for path in sorted(pruned)[:8])
        plan.note(say("Left out because tools made it: {names}.", names=names))
    _check_limits(name, plan.sizes, limits, packed_bytes)
    return plan


def _path(name: str, export: bool) -> str:
    """Return the path of an entry of this name, made of safe names; of an `export`, with long names shortened."""
    # Old Windows tools write backslashes; read as separators, they cannot smuggle a `..` past the check below.
    raw = name.replace("\\", "/")
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
    return path


def _safe(name: str) -> str:
    """Return an entry's name as a path of printable names."""
    return "/".join(safe_name(part) for part in name.replace("\\", "/").split("/") if part not in ("", "."))


def _add(
    plan: CopyPlan, entry: Entry, path: str, limits: SizeLimits, export: bool, *, is_last: bool, is_folder: bool
) -> None:
    """Add an entry to the files or copies of a plan.

    `is_last` says whether it is the last of its name, `is_folder` whether others need a folder of that name.

    Raises:
        _Refused: it is not copied.
    """
    target, shown = entry.target.replace("\\", "/"), printable(entry.target)
    if entry.kind is Kind.HARD_LINK:
        original = _path(entry.target, export)
        if original not in plan.sizes:
            raise _Refused("link", say("hard link to {target}, which is not in the submission", target=shown))
    if is_folder and entry.kind in (Kind.FILE, Kind.HARD_LINK):
        raise _Refused("collision", say("there is a folder of the same name; it was left out"))
    if not is_last:
        raise _Refused("collision", say("its name occurs again; only the last of that name was kept"))
    if entry.kind is Kind.LINK:
        reached = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        if target.startswith("/") or reached == ".." or reached.startswith("../"):
            raise _Refused("link", say("link out of the submission, to {target}; it was left out", target=shown))
        words = mark("it is a link to {target} and was left out; submit the file itself")
        raise _Refused("", say(words, target=shown))
    if entry.kind is Kind.SPECIAL:
        words = mark("it is not a regular file (but a device, pipe or sparse file); it was left out")
        raise _Refused("special file", say(words))
    if entry.kind is Kind.HARD_LINK:
        plan.copies[path] = original
        plan.sizes[path] = plan.sizes[original]
        return
    if entry.size > limits.file_bytes:
        if entry.packed is not None and entry.size > limits.ratio * max(entry.packed, 1):
            words = mark("{size} bytes packed into {packed}; it was left out")
            raise _Refused("bomb", say(words, size=entry.size, packed=entry.packed))
        words = mark("it has {size} MB, more than {most} MB, and was left out")
        raise _Refused("", say(words, size=entry.size // MB, most=limits.file_bytes // MB))
    plan.files[entry.index] = path
    plan.sizes[path] = entry.size
    if entry.mode & (stat.S_ISUID | stat.S_ISGID):
        plan.flag("setuid", say("the set-user-id bit was removed"), entry.name)
    if entry.mode & stat.S_IXUSR:
        plan.executable.add(path)


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
