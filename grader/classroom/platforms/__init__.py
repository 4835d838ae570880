"""The learning platforms that the kit knows, one module each (docs/classes.md has their formats).

And names of files by a pattern, for platforms without a module of their own.
"""

from __future__ import annotations

import datetime as dt
import importlib
import pkgutil
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from grader.classroom import ledger, roster
from grader.classroom.identity import Claim
from grader.classroom.ledger import Source
from grader.classroom.platform import (
    Export,
    HandIn,
    Platform,
    entries_of,
    has,
    inside,
    is_archive,
    one_of,
    others,
    stem,
)
from grader.classroom.times import local_time
from grader.errors import GraderError, UsageError
from grader.intake.names import natural


def all_platforms() -> Mapping[str, Platform]:
    """Return every platform by its name: the `PLATFORM` of each module in this package."""
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    return {module.PLATFORM.name: module.PLATFORM for module in modules}


def read(source: Source, pattern: str = "") -> Export:
    """Return the submissions in a folder, and account for all its entries; names are as a `pattern` says, if any.

    Raises:
        GraderError: the folder is one package, or holds no submission.
        UsageError: the pattern is none.
    """
    root = _innermost(source.folder)
    entries = entries_of(root)
    names = {entry.name for entry in entries}
    if "package.xml" in names or "src" in names:
        raise GraderError(f"{root} is a single submission. Grade it with `grader grade {root} --out OUT`.")
    platform = by_pattern(pattern) if pattern else _recognised(root, entries)
    export = ledger.account(platform.read(root, entries), platform, root, source)
    if platform.layout == "plain":
        foreign = (entry.name for entry in entries if _recognised(root, [entry]).layout != "plain")
        export = replace(export, foreign=tuple(foreign))
    if not export.hand_ins and not any(each.sure for each in export.lost):
        raise GraderError(
            f"{root} holds no submission: neither an archive nor a folder. "
            "Name the folder or the archive that the learning platform exported."
        )
    return export


def _recognised(root: Path, entries: Sequence[Path]) -> Platform:
    """Return the platform that wrote the folder; `plain`, which takes any, is asked last."""
    *known, plain = sorted(all_platforms().values(), key=lambda platform: platform.layout == "plain")
    found = next((platform for platform in known if platform.recognises(root, entries)), None)
    return found or plain


def _innermost(root: Path) -> Path:
    """Return the folder with the submissions: an archive often has one folder around them."""
    while (
        len(entries := entries_of(root)) == 1
        and entries[0].is_dir()
        and _recognised(root, entries).layout == "plain"
        and not _is_package(entries[0])
        and any(is_archive(child) or child.is_dir() for child in inside(entries[0]))
        and not (len(below := [each for each in inside(entries[0]) if each.is_dir()]) == 1 and _is_package(below[0]))
    ):
        root = entries[0]
    return root


def _is_package(folder: Path) -> bool:
    return any(has(folder, name) for name in ("package.xml", "src"))


_NAME = "pattern"
_WHO = {"login": "login", "id": "id", "email": "email", "name": "name", "team": "team", "number": "lms_id"}
_FIELDS = dict.fromkeys(_WHO, r"\S+?") | {
    "name": ".+?", "team": ".+?", "number": r"\d[\d-]*", "time": r".*?\d\d.*?", "attempt": r"\d+", "file": ".+",
}  # fmt: skip
_PART = re.compile(r"\{(?P<field>\w*)\}|.", re.DOTALL)
_SIGNS = {"*": ".+?", "[": "(?:", "]": ")?"}
_DIGITS = re.compile(r"(\d{4})\D?(\d\d)\D?(\d\d)\D{0,2}(\d\d)\D?(\d\d)(?:\D?(\d\d))?")
_FORMATS = ("%b %d, %Y %I%M %p", "%B %d, %Y %I%M %p", "%b %d, %Y %I:%M %p", "%d %B, %Y %H%M")  # of Brightspace


@dataclass(frozen=True)
class _Named:
    """What a name says."""

    claims: tuple[Claim, ...]
    when: dt.datetime | None
    attempt: str
    entry: Path

    @property
    def order(self) -> tuple[object, ...]:
        return (self.when.timestamp() if self.when else 0.0, natural(self.attempt))


class Pattern:
    """How files are named, such as `{login}_{time}_{attempt}`; `*` is anything, `[ ]` is around what may be absent."""

    def __init__(self, text: str) -> None:
        """Read a pattern.

        Raises:
            UsageError: it is none, or says nothing of a person.
        """
        fields = re.findall(r"\{(\w*)\}", text)
        found = re.search(r"\*([^{}*\[\]]*)\{login\}", text)
        self._separator = found[1] if found else ""
        regex = ""
        for part in _PART.finditer(text):
            name = part["field"]
            regex += f"(?P<{name}>{_FIELDS.get(name, '')})" if name else _SIGNS.get(part[0], re.escape(part[0]))
        try:
            self._regex = re.compile(regex, re.DOTALL | re.IGNORECASE)
        except re.error:
            raise _refusal(text) from None
        if not set(fields) <= set(_FIELDS) or not set(fields) & set(_WHO):
            raise _refusal(text)

    def read(self, entry: Path) -> _Named | None:
        """Return what a name says, with its suffix or without; None if it is not as the pattern has it."""
        bare = entry.name if entry.is_dir() else stem(entry) if is_archive(entry) else entry.stem
        for name in dict.fromkeys((bare, entry.name)):
            found = self._regex.fullmatch(name)
            said = {field: text.strip() for field, text in found.groupdict().items() if text} if found else {}
            when = _time(said["time"]) if "time" in said else None
            if said and ("time" not in said or when):
                return _Named(tuple(self._claims(said)), when, said.get("attempt", ""), entry)
        return None

    def _claims(self, said: Mapping[str, str]) -> Iterator[Claim]:
        for field, kind in _WHO.items():
            value = said.get(field, "")
            if field == "login" and self._separator:
                # Of `Lab_3_jane_doe` any end may be the login: which one, the roster says.
                parts = value.split(self._separator)
                yield from (Claim(kind, self._separator.join(parts[at:])) for at in range(len(parts) - 1, -1, -1))
            elif value:
                # Behind a hyphen Brightspace has the number of the submission.
                yield Claim(kind, value.partition("-")[0], _NAME) if kind == "lms_id" else Claim(kind, value)


def by_pattern(text: str) -> Platform:
    """Return what reads an export by a pattern; it writes no grades.

    Raises:
        UsageError: the pattern is none.
    """
    pattern = Pattern(text)

    def recognises(_root: Path, entries: Sequence[Path]) -> bool:
        return 2 * sum(pattern.read(entry) is not None for entry in entries) > len(entries)  # most of them

    return Platform(_NAME, _NAME, "", recognises, partial(_read, pattern), lambda _delivery: [])


def _read(pattern: Pattern, _root: Path, entries: Sequence[Path]) -> Export:
    people: dict[tuple[Claim, ...], list[_Named]] = {}
    odd = []
    for entry in (member for each in entries for member in _members(pattern, each)):
        if found := pattern.read(entry):
            people.setdefault(found.claims, []).append(found)
        else:
            odd.append(entry)
    hand_ins, notes = others(odd)
    for claims, parts in people.items():
        attempts: dict[tuple[object, ...], list[_Named]] = {}
        for part in sorted(parts, key=lambda part: part.order):
            attempts.setdefault(part.order, []).append(part)
        label = next((claim.value for claim in claims if claim.kind == "name"), claims[0].value)
        *earlier, last = attempts.values()
        for attempt in attempts.values() if last[0].when else [last]:
            path, remarks = one_of(label, [part.entry for part in attempt])
            notes += remarks
            hand_ins.append(HandIn(path, label, (claims,), attempt[0].when))
        if earlier and not last[0].when:
            left = ", ".join(part.entry.name for attempt in earlier for part in attempt)
            notes.append(f"{label}: attempt {last[0].attempt} is graded, the last one, not {left}.")
    return Export(_NAME, tuple(hand_ins), tuple(notes))


def _members(pattern: Pattern, entry: Path) -> Sequence[Path]:
    """Return an entry, or the folders in that of a team, which ILIAS writes for its members."""
    children = inside(entry) if entry.is_dir() and pattern.read(entry) is None else []
    return children if children and all(pattern.read(child) for child in children) else [entry]


def _time(text: str) -> dt.datetime | None:
    """Return a time in a file's name, in the time zone of this machine; None for other text."""
    try:
        if found := _DIGITS.fullmatch(text):
            year, month, day, hour, minute, second = (int(part or 0) for part in found.groups())
            return dt.datetime(year, month, day, hour, minute, second).astimezone()
    except ValueError:
        return None
    for form in _FORMATS:
        try:
            return dt.datetime.strptime(text, form).astimezone()
        except ValueError:
            continue
    return local_time(text) or roster.worksheet_time(text)


def _refusal(text: str) -> UsageError:
    return UsageError(
        f'--pattern "{text}" does not say how files are named.',
        f"Write the name with {', '.join(f'{{{field}}}' for field in _FIELDS)} in it, each once and "
        " at least one of the person; * stands for anything, [ ] is around what may be absent.",
    )
