"""Recognise the layout of an export by its names: Moodle, Canvas, Gradescope, GitHub Classroom, or a plain folder.

Nothing is unpacked or run here. The formats are described in docs/classes.md.
"""

from __future__ import annotations

import datetime as dt
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from grader.errors import GraderError
from grader.intake.containers import ARCHIVE_SUFFIXES

MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?P<kind>[a-z]+)_?(?P<file>.*)", re.DOTALL)
CANVAS = re.compile(r"(?P<name>[^_]+)(?P<late>_late)?_(?P<id>\d+)_(?P<file_id>\d+)_(?P<file>.+)", re.I | re.DOTALL)
METADATA = "submission_metadata.yml"

_CLOSED = (".rar", ".7z", ".gz", ".xz", ".bz2", ".zst")
_IGNORED = frozenset({"__MACOSX", "Thumbs.db", "desktop.ini", METADATA})


@dataclass(frozen=True)
class Claim:
    """Something that an export says about who handed in: `kind` is a field of Person, or "any" for one of them."""

    kind: str
    value: str


@dataclass(frozen=True)
class HandIn:
    """One submission as the export has it.

    Attributes:
        path: the archive or the folder.
        label: a short name for people.
        claims: what the export says about who handed it in, the surest first; one tuple for each person.
        submitted: when, None if the export does not say.
        late: whether the export marks it as late.
        repository: the time is that of the last commit of the git repository `path`.
    """

    path: Path
    label: str
    claims: tuple[tuple[Claim, ...], ...] = ()
    submitted: dt.datetime | None = None
    late: bool = False
    repository: bool = False


@dataclass(frozen=True)
class Export:
    """What a folder holds: its layout's name, the submissions, and a remark on each entry that is none."""

    layout: str
    hand_ins: tuple[HandIn, ...]
    notes: tuple[str, ...] = ()


def read(root: Path) -> Export:
    """Return the submissions in the folder `root`.

    Raises:
        GraderError: the folder is one package, or holds no submission.
    """
    root = _innermost(root)
    entries = _entries(root)
    names = {entry.name for entry in entries}
    if "package.xml" in names or "src" in names:
        raise GraderError(f"{root} is a single submission. Grade it with `grader grade {root} --out OUT`.")
    if (root / METADATA).is_file():
        export = _gradescope(root, entries)
    elif any(MOODLE.fullmatch(name) for name in names):
        export = _moodle(entries)
    elif (files := [e for e in entries if e.is_file()]) and all(CANVAS.fullmatch(e.name) for e in files):
        export = _canvas(entries)
    elif any((entry / ".git").exists() for entry in entries):
        export = _repositories(root, entries)
    else:
        export = _plain(entries)
    if not export.hand_ins:
        raise GraderError(
            f"{root} holds no submission: neither an archive nor a folder. "
            "Name the folder or the archive that the learning platform exported."
        )
    return export


def is_archive(path: Path) -> bool:
    """Return whether a file is an archive by its name, also one of a kind that will be refused."""
    return path.is_file() and path.name.lower().endswith((*ARCHIVE_SUFFIXES, *_CLOSED))


def _innermost(root: Path) -> Path:
    """Return the folder with the submissions: an archive often has one folder around them."""
    while (
        len(entries := _entries(root)) == 1
        and entries[0].is_dir()
        and not (root / METADATA).exists()
        and not any(
            MOODLE.fullmatch(entries[0].name) or (entries[0] / name).exists() for name in ("package.xml", "src", ".git")
        )
        and any(is_archive(child) or child.is_dir() for child in _entries(entries[0]))
        and not _holds_package(entries[0])
    ):
        root = entries[0]
    return root


def _holds_package(folder: Path) -> bool:
    """Return whether a folder has a package at most one folder further down: then it is a submission by itself."""
    children = [child for child in _entries(folder) if child.is_dir()]
    return len(children) == 1 and any((children[0] / name).exists() for name in ("package.xml", "src"))


def _entries(root: Path) -> list[Path]:
    return sorted(e for e in root.iterdir() if e.name not in _IGNORED and not e.name.startswith("."))


def _moodle(entries: Sequence[Path]) -> Export:
    """`Jane Doe_12345_assignsubmission_file_/...`, or the same in front of each file's name."""
    people: dict[str, list[tuple[re.Match[str], Path]]] = {}
    notes = []
    for entry in entries:
        if found := MOODLE.fullmatch(entry.name):
            people.setdefault(found["id"], []).append((found, entry))
        else:
            notes.append(f"{entry.name} is not named as Moodle names a submission; it was left out.")
    hand_ins = []
    for number, parts in people.items():
        files = [entry for found, entry in parts if found["kind"] == "file"] or [entry for _, entry in parts]
        path, remarks = _one_of(_unfolded(files))
        notes += [f"{parts[0][0]['name']}: {remark}" for remark in remarks]
        name = parts[0][0]["name"]
        claims = (Claim("lms_id", number), Claim("name", name), Claim("team", name), Claim("id", name))
        hand_ins.append(HandIn(path, name, (claims,), submitted=None))
    return Export("moodle", tuple(hand_ins), tuple(notes))


def _canvas(entries: Sequence[Path]) -> Export:
    """`doejane_12345_6789_team.zip`, `doejane_LATE_12345_6789_team-1.zip`: later attachments have larger numbers."""
    people: dict[str, list[tuple[re.Match[str], Path]]] = {}
    notes = []
    for entry in entries:
        if found := CANVAS.fullmatch(entry.name):
            people.setdefault(found["id"], []).append((found, entry))
        else:
            notes.append(f"{entry.name} is not named as Canvas names a submission; it was left out.")
    hand_ins = []
    for number, parts in people.items():
        parts.sort(key=lambda part: int(part[0]["file_id"]))
        path, remarks = _one_of([entry for _, entry in parts])
        late = any(found["late"] for found, entry in parts if entry == path)
        name = parts[-1][0]["name"]
        notes += [f"{name}: {remark}" for remark in remarks]
        hand_ins.append(HandIn(path, name, ((Claim("lms_id", number), Claim("joined name", name)),), late=late))
    return Export("canvas", tuple(hand_ins), tuple(notes))


def _gradescope(root: Path, entries: Sequence[Path]) -> Export:
    """`submission_123/`, and `submission_metadata.yml` with names, e-mails and times."""
    try:
        metadata = yaml.load((root / METADATA).read_text(encoding="utf-8"), _RubyLoader)
        described = {str(key): _described(value) for key, value in metadata.items()}
    except (OSError, ValueError, AttributeError, TypeError, KeyError, yaml.YAMLError) as error:
        raise GraderError(f"{root / METADATA} is not as Gradescope writes it ({error!r}). Export once more.") from error
    hand_ins, notes = [], []
    for entry in entries:
        if entry.name in described:
            path, remarks = _one_of(_unfolded([entry])) if _only_archives(entry) else (entry, [])
            notes += [f"{entry.name}: {remark}" for remark in remarks]
            hand_ins.append(replace(described[entry.name], path=path))
        else:
            notes.append(f"{entry.name} is not in {METADATA}; it was left out.")
    missing = sorted(set(described) - {entry.name for entry in entries})
    notes += [f"{name} is in {METADATA} but not in the export." for name in missing]
    return Export("gradescope", tuple(hand_ins), tuple(notes))


class _RubyLoader(yaml.SafeLoader):
    """Reads the YAML that a Ruby program wrote: an object of a type of Ruby's is read as what it consists of."""


def _ruby(loader: yaml.SafeLoader, _suffix: str, node: yaml.Node) -> Any:
    if isinstance(node, yaml.MappingNode):
        return loader.construct_mapping(node, deep=True)
    if isinstance(node, yaml.SequenceNode):
        return loader.construct_sequence(node, deep=True)
    return loader.construct_scalar(node) if isinstance(node, yaml.ScalarNode) else None


_RubyLoader.add_multi_constructor("!", _ruby)


def _described(value: dict[str, Any]) -> HandIn:
    kinds = {":sid": "id", ":email": "email", ":name": "name"}
    people = [
        tuple(Claim(kind, str(person[key]).strip()) for key, kind in kinds.items() if person.get(key))
        for person in value[":submitters"]
    ]
    label = ", ".join(str(person.get(":name") or person.get(":email") or "") for person in value[":submitters"])
    return HandIn(Path(), label, tuple(people), _time(value.get(":created_at")))


def _time(value: object) -> dt.datetime | None:
    """Return a time as Ruby writes it: YAML knows "2026-11-20 22:58:01 Z", but not "2026-11-20 22:58:01.5 +0100"."""
    if isinstance(value, str):
        day, clock, *zone = value.replace("T", " ").split()
        clock, _, fraction = clock.partition(".")
        offset = zone[0].replace("Z", "+00:00") if zone and zone[0] != "UTC" else "+00:00"
        value = dt.datetime.fromisoformat(f"{day} {clock}.{fraction[:6]:0<6}{offset}")
    if isinstance(value, dt.datetime):
        return value if value.tzinfo else value.replace(tzinfo=dt.UTC)
    return None


def _repositories(root: Path, entries: Sequence[Path]) -> Export:
    """`assignment-login/`, clones of GitHub Classroom's repositories. All the names begin with the assignment's."""
    clones = [entry for entry in entries if (entry / ".git").exists()]
    notes = [f"{e.name} is not a git repository; it was left out." for e in entries if e.is_dir() and e not in clones]
    names = [clone.name for clone in clones]
    prefix = f"{root.name.removesuffix('-submissions')}-" if root.name.endswith("-submissions") else ""
    if not prefix or not all(name.startswith(prefix) for name in names):
        common = os.path.commonprefix(names) if len(names) > 1 else names[0]  # noqa: RUF071  # characters are meant
        prefix = common[: common.rfind("-") + 1]
    hand_ins = [
        HandIn(clone, clone.name.removeprefix(prefix), _any(clone.name.removeprefix(prefix)), repository=True)
        for clone in clones
    ]
    return Export("git", tuple(hand_ins), tuple(notes))


def _plain(entries: Sequence[Path]) -> Export:
    """Archives and folders, each named after a team or a person."""
    kept = [entry for entry in entries if entry.is_dir() or is_archive(entry)]
    notes = [
        f"{entry.name} is neither an archive nor a folder; it was left out." for entry in entries if entry not in kept
    ]
    return Export("plain", tuple(HandIn(e, _stem(e), _any(_stem(e))) for e in kept), tuple(notes))


def _stem(path: Path) -> str:
    suffix = next(
        (s for s in sorted((*ARCHIVE_SUFFIXES, *_CLOSED), key=len, reverse=True) if path.name.lower().endswith(s)), ""
    )
    return path.name[: len(path.name) - len(suffix)] if suffix and path.is_file() else path.name


def _any(name: str) -> tuple[tuple[Claim, ...], ...]:
    return ((Claim("any", name),),)


def _unfolded(paths: Sequence[Path]) -> list[Path]:
    """Return the paths; a folder that has nothing but files, one of them an archive, stands for its files."""
    found = []
    for path in paths:
        found += list(_entries(path)) if path.is_dir() and _only_archives(path) else [path]
    return found


def _only_archives(folder: Path) -> bool:
    children = _entries(folder) if folder.is_dir() else []
    return bool(children) and all(child.is_file() for child in children) and any(map(is_archive, children))


def _one_of(paths: Sequence[Path]) -> tuple[Path, list[str]]:
    """Return the one path to grade, the last archive or else the last folder, and a remark on the others."""
    ranked = sorted(paths, key=lambda path: (is_archive(path), path.is_dir()))
    chosen = ranked[-1]
    others = [path.name for path in paths if path != chosen]
    return chosen, [f"{chosen.name} is graded, not {', '.join(others)}."] if others else []


def claims_of(hand_in: HandIn) -> Iterator[Claim]:
    """Return all that an export says about a submission's people."""
    return (claim for person in hand_in.claims for claim in person)
