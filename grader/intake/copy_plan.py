"""Decide which entries of a container are copied, and under which names. Pure: it touches no files."""

from __future__ import annotations

import posixpath
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from grader.evidence import Flag
from grader.intake.containers import MB, Container, Entry, Kind, SizeLimits, largest, refused
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
        files: the entries to copy, by their paths; the `target` of a hard link is the path that it is a copy of.
        folders: folders of an export to be made even if nothing is in them.
        flags, notes: remarks for the instructor and for everyone, in limited number: an archive must not fill a report.
        left_out: all entries that tools have not made and that are not copied.
    """

    files: dict[str, Entry] = field(default_factory=dict)
    folders: list[str] = field(default_factory=list)
    flags: list[Flag] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)

    def left_of(self, limits: SizeLimits) -> SizeLimits:
        """Return what is left of the limits for archives inside."""
        used = sum(entry.size for entry in self.files.values())
        return replace(limits, total_bytes=limits.total_bytes - used, files=limits.files - len(self.files))

    @contextmanager
    def remarking(self, entry: Entry) -> Iterator[None]:
        """Leave the entry out, with a flag or a note, if it is refused in the block."""
        try:
            yield
        except _Refused as refusal:
            name, (kind, why) = printable(entry.name), refusal.args
            if kind:
                self.flags.append(Flag(kind, why, name))
            else:
                self.notes.append(f"{name}: {why}.")
            self.left_out.append(LeftOut(entry.name, why, entry.kind not in (Kind.FILE, Kind.FOLDER)))


class _Refused(Exception):
    """An entry is left out; its arguments are the kind of a flag, "" for a note (an innocent entry), and the reason."""


def plan_copy(container: Container, limits: SizeLimits, *, export: bool = False) -> CopyPlan:
    """Return which entries of a container to copy, and where.

    Their order makes no difference, but for those of the very same name: the last of them counts, as for `unzip` and
    `tar`. In an instructor's `export` of several hand-ins, what tools have made is kept, and long names are shortened.

    Raises:
        SubmissionError: together they are more than `limits` allow.
    """
    plan, paths = CopyPlan(), dict[int, str]()
    for entry in container.entries:
        with plan.remarking(entry):
            path = _path(entry.name, export)
            if not path and entry.kind is not Kind.FOLDER:
                raise _Refused("name", say("it has no name; it was left out"))
            paths[entry.index] = path
    made = set() if export else _made_by_tools(list(paths.values()))
    kept = [e for e in container.entries if e.index in paths and (export or not _is_made(paths[e.index], made))]
    last = {paths[entry.index]: entry for entry in kept if entry.kind is not Kind.FOLDER}
    copied = [path for path, entry in last.items() if entry.kind in (Kind.FILE, Kind.HARD_LINK)]
    above = {folder for path in copied for folder in _folders(path)}
    # By name; hard links after the files that they become copies of.
    for entry in sorted(kept, key=lambda e: (e.kind is Kind.HARD_LINK, paths[e.index])):
        path = paths[entry.index]
        if entry.kind is Kind.FOLDER:
            plan.folders += [path] * (export and bool(path))
            continue
        with plan.remarking(entry):
            copied_entry = _copied(entry, path, plan.files, limits, export)
            if path in above:
                raise _Refused("collision", say("there is a folder of the same name; it was left out"))
            if entry is not last[path]:
                raise _Refused("collision", say("its name occurs again; only the last of that name was kept"))
            plan.files[path] = copied_entry
            if entry.kind is Kind.FILE and entry.mode & (stat.S_ISUID | stat.S_ISGID):
                words = say("the set-user-id bit was removed")
                plan.flags.append(Flag("setuid", words, printable(entry.name)))
    plan.folders = [path for path in plan.folders if not plan.files.keys() & {path, *_folders(path)}]
    plan.flags = [*plan.flags, *_look_alikes(plan.files)][:MAX_REMARKS]
    if made:
        names = ", ".join(printable(path, 80) for path in sorted(made)[:8])
        plan.notes.append(say("Left out because tools made it: {names}.", names=names))
    del plan.notes[MAX_REMARKS:]
    _check_limits(container, {path: entry.size for path, entry in plan.files.items()}, limits)
    return plan


def _path(name: str, export: bool) -> str:
    """Return the path of an entry of this name, made of safe names; of an `export`, with long names shortened."""
    # Old Windows tools write backslashes; read as separators, they cannot smuggle a `..` past the check below.
    raw = name.replace("\\", "/")
    if raw.startswith("/") or (len(raw) > 1 and raw[1] == ":" and raw[0].isalpha()):
        raise _Refused("absolute path", say("its path is absolute; it was left out"))
    parts = [safe_name(part) for part in raw.split("/") if part not in ("", ".")]
    if ".." in parts:
        raise _Refused("traversal", say("its path leads out of the submission with '..'; it was left out"))
    parts = [shortened(part) for part in parts] if export else parts
    path = "/".join(parts)
    times = 3 if export else 1  # a submission of full depth lies in folders of the export
    longest = max((len(part.encode()) for part in parts), default=0)
    if len(parts) > times * MAX_DEPTH or len(path.encode()) > times * MAX_PATH_BYTES or longest > MAX_NAME_BYTES:
        raise _Refused("", say("its name is too long or too deep; it was left out"))
    return path


def _copied(entry: Entry, path: str, files: Mapping[str, Entry], limits: SizeLimits, export: bool) -> Entry:
    """Return what to copy of an entry that is not a folder; of a hard link, a copy of one of the `files`."""
    target, shown = entry.target.replace("\\", "/"), printable(entry.target)
    if entry.kind is Kind.HARD_LINK:
        original = _path(entry.target, export)
        if original not in files:
            raise _Refused("link", say("hard link to {target}, which is not in the submission", target=shown))
        return replace(entry, target=original, size=files[original].size)
    if entry.kind is Kind.LINK:
        reached = posixpath.normpath(posixpath.join(posixpath.dirname(path), target))
        if target.startswith("/") or reached == ".." or reached.startswith("../"):
            raise _Refused("link", say("link out of the submission, to {target}; it was left out", target=shown))
        raise _Refused("", say("it is a link to {target} and was left out; submit the file itself", target=shown))
    if entry.kind is Kind.SPECIAL:
        words = mark("it is not a regular file (but a device, pipe or sparse file); it was left out")
        raise _Refused("special file", say(words))
    if entry.size > limits.file_bytes:
        if entry.packed is not None and entry.size > limits.ratio * max(entry.packed, 1):
            words = mark("{size} bytes packed into {packed}; it was left out")
            raise _Refused("bomb", say(words, size=entry.size, packed=entry.packed))
        words = mark("it has {size} MB, more than {most} MB, and was left out")
        raise _Refused("", say(words, size=entry.size // MB, most=limits.file_bytes // MB))
    return entry


def _made_by_tools(paths: Collection[str]) -> set[str]:
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
    return {path for path in found if found.isdisjoint(_folders(path))}


def _is_source(path: str, venv: str) -> bool:
    """Return whether `path` is the package.xml of a package that was written, not installed, below `venv`."""
    installed = {"share", "site-packages"} & set(path.split("/"))
    return path.startswith(venv + "/") and path.endswith("/package.xml") and not installed


def _is_made(path: str, made: set[str]) -> bool:
    last = path.rpartition("/")[2]
    return not made.isdisjoint((path, *_folders(path))) or tool_folder(last) or tool_file(last)


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


def _check_limits(container: Container, sizes: Mapping[str, int], limits: SizeLimits) -> None:
    name, count, total, packed = container.name, len(sizes), sum(sizes.values()), container.packed_bytes
    advice = mark("Submit the package folder only, without recordings, build trees and virtual environments.")
    if count > limits.files:
        words = mark("{name} contains {count} files, more than {most}.")
        raise refused(name, words, advice, count=count, most=limits.files)
    if total > limits.total_bytes:
        words = mark("{name} contains {size} MB, more than {most} MB. The largest files are {largest}.")
        most = limits.total_bytes // MB
        raise refused(name, words, advice, size=total // MB, most=most, largest=largest(sizes))
    if packed is not None and total > limits.ratio_applies_above_bytes and total > limits.ratio * packed:
        words = mark("{name} unpacks to {times} times its size, like a decompression bomb.")
        raise refused(name, words, advice, times=total // max(packed, 1))
