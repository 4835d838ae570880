"""Which packages of a class are most alike beyond what the course gives, and in which places. Nothing is run.

Every stretch of what a package's Python does is fingerprinted, without what makes no difference (normal_form.py). A
package is the sum of its files, so that it does not matter how they are cut or called.
"""

from __future__ import annotations

import itertools
import json
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from grader.classroom import discovery
from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.classroom.entry import Entry
from grader.classroom.normal_form import normal_form
from grader.course import Course, named
from grader.errors import GraderError, SubmissionError
from grader.host import tempdir
from grader.host.atomic import write_atomically
from grader.intake.submission import open_submission
from grader.quality import source_files
from grader.sandbox import untrusted
from grader.sanitize import lines, one_line

PAGE, DATA = "similar.html", "similar.json"
# Characters of the normal form. Shorter stretches, about two lines, are alike by chance.
_STRETCH = 25
_LEAST = 300  # stretches of its own; a package with fewer has hardly anything that could be compared
_SHOWN_LEAST = 3 * _STRETCH  # characters of a place that is worth looking at
_PLACES, _PLACE_LINES, _LINE_LENGTH = 30, 60, 160
_CANDIDATES = 20  # places that begin alike, of which the longest is taken


@dataclass(frozen=True)
class Lines:
    """Some lines of a file; `first` counts from 1."""

    path: str
    first: int
    last: int
    text: str


@dataclass(frozen=True)
class Pair:
    """Two submissions, the share of each (0 to 1) that the other has, too, and the longest places side by side."""

    one: str
    other: str
    share_of_one: float
    share_of_other: float
    places: tuple[tuple[Lines, Lines], ...] = ()

    @property
    def share(self) -> float:
        """Return the larger share: a package can be a part of another one."""
        return max(self.share_of_one, self.share_of_other)


@dataclass(frozen=True)
class Alike:
    """The pairs that are most alike; `compared` is the number of all pairs, `usual` their median share."""

    pairs: tuple[Pair, ...]
    compared: int
    usual: float
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Group:
    """Submissions that are much more alike than is usual in their class; `share` is that of the pair most alike."""

    submissions: tuple[str, ...]
    share: float


@dataclass
class _File:
    """One file: its text, the fingerprint at each place of its normal form, and the line of each place."""

    path: str
    text: str
    prints: np.ndarray
    line: np.ndarray


@dataclass
class _Package:
    """A submission's files, and its own fingerprints one after the other: of which file, and where in it.

    `end` is the index after the last fingerprint that is connected to each, side by side in one file.
    """

    files: list[_File]
    prints: np.ndarray = field(init=False)
    file_of: np.ndarray = field(init=False)
    place: np.ndarray = field(init=False)
    end: np.ndarray = field(init=False)

    def leave_out(self, base: np.ndarray) -> None:
        """Keep the fingerprints that `base` does not have."""
        parts = [
            np.stack([np.full(len(file.prints), number), np.arange(len(file.prints)), file.prints], axis=1)
            for number, file in enumerate(self.files)
        ]
        table = np.concatenate([np.empty((0, 3), dtype=np.int64), *parts])
        table = table[~np.isin(table[:, 2], base)]
        self.file_of, self.place, self.prints = table[:, 0], table[:, 1], table[:, 2]
        breaks = np.flatnonzero((np.diff(self.place) != 1) | (np.diff(self.file_of) != 0)) + 1
        ends = np.append(breaks, len(table))
        self.end = ends[np.searchsorted(ends, np.arange(len(table)), side="right")]


def of_class(
    folder: ClassFolder, base: Mapping[str, str], top: int, progress: Callable[[str], None] = lambda _what: None
) -> Alike:
    """Return the `top` pairs of a class that are most alike beyond the Python texts in `base`, which are keyed by path.

    Submissions of the same people are not compared.

    Raises:
        GraderError: there is no such class, or its submissions are no longer where they were.
    """
    facts = folder.facts()
    sources = {entry.source or facts.source for entry in facts.entries if not entry.absent}
    if lost := sorted(source for source in sources if not folder.located(source).exists()):
        raise GraderError(
            f"The submissions are read again, but {lost[0]} is neither there nor near the class. Run this in the "
            "folder in which the class was graded, or put it beside the class."
        )
    texts, notes = {}, []
    with ExitStack() as stack:
        roots = {source: stack.enter_context(discovery.opened(folder.located(source))).folder for source in sources}
        scratch = stack.enter_context(tempdir.folder("similar"))
        for entry in facts.entries:
            if entry.absent:
                notes.append(f"{entry.id} is not compared: the present sources do not have it.")
                continue
            progress(f"reading {entry.id}")
            try:
                root = roots[entry.source or facts.source]
                texts[entry.id], unread = _python_of(root / entry.path, scratch / entry.id, named(facts.course))
                notes += [f"{entry.id} is compared without {one_line(why)}" for why in unread]
                if discovery.content_hash(root / entry.path) != entry.content:
                    notes.append(f"{entry.id} is compared as it is now; it is not what was graded.")
            except SubmissionError as error:
                notes.append(f"{entry.id} is not compared: {one_line(error.what)}")
            tempdir.remove(scratch / entry.id)
    progress("comparing")
    return compare(texts, base, top, together=_of_same_people(facts), notes=notes)


def compare(
    texts: Mapping[str, Mapping[str, str]],
    base: Mapping[str, str],
    top: int,
    together: Callable[[str, str], bool] = lambda _one, _other: False,
    notes: Sequence[str] = (),
) -> Alike:
    """Return the `top` pairs of the packages in `texts` (path to text, by submission) that are most alike."""
    made: dict[str, _File | None] = {}
    given = [file.prints for path, text in base.items() if (file := _file(path, text, made))]
    left_out = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *given]))
    packages, said = {}, list(notes)
    for name, files in texts.items():
        found = {path: _file(path, text, made) for path, text in sorted(files.items())}
        said += [
            f"{name} is compared without {one_line(path)}, which Python cannot parse."
            for path, file in found.items()
            if file is None
        ]
        package = _Package([file for file in found.values() if file])
        package.leave_out(left_out)
        if len(package.prints) >= _LEAST:
            packages[name] = package
        else:
            said.append(f"{name} is not compared: it has hardly any Python beyond what the course gives.")
    pairs = [
        Pair(one, other, _share(packages[one], packages[other]), _share(packages[other], packages[one]))
        for one, other in itertools.combinations(packages, 2)
        if not together(one, other)
    ]
    usual = median(pair.share for pair in pairs) if pairs else 0.0
    best = sorted(pairs, key=lambda pair: -pair.share)[:top]
    shown = tuple(
        Pair(p.one, p.other, p.share_of_one, p.share_of_other, _places(packages[p.one], packages[p.other]))
        for p in best
    )
    return Alike(shown, len(pairs), usual, tuple(said))


def write(folder: ClassFolder, alike: Alike) -> Path:
    """Write similar.html into a class folder and return its path."""
    labels = {entry.id: _label(entry) for entry in folder.facts().entries}
    page = render_page("similar.html.j2", alike=alike, labels=labels, title=folder.facts().title)
    write_atomically(folder.path / PAGE, page)
    pairs = [{"one": pair.one, "other": pair.other, "share": round(pair.share, 4)} for pair in alike.pairs]
    write_atomically(folder.path / DATA, json.dumps({"usual": alike.usual, "pairs": pairs}, indent=2) + "\n")
    return folder.path / PAGE


def render_page(template: str, **shown: Any) -> str:
    """Return one of the pages about a class as HTML; all text in it is escaped."""
    return str(_environment().get_template(template).render(**shown))


@cache
def _environment() -> Any:
    """Return the environment of all pages: it compiles a template once, which takes a tenth of a second."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip


def groups(folder: ClassFolder) -> tuple[Group, ...]:
    """Return which submissions `write` found to be nearer to all than to the usual share, linked pairs in one group."""
    try:
        data = json.loads((folder.path / DATA).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ()
    least = (1 + data["usual"]) / 2
    joined: list[tuple[set[str], float]] = []
    for pair in data["pairs"]:
        if pair["share"] >= least:
            members, share = {pair["one"], pair["other"]}, pair["share"]
            for other in [each for each in joined if each[0] & members]:
                joined.remove(other)
                members, share = members | other[0], max(share, other[1])
            joined.append((members, share))
    found = (Group(tuple(sorted(members)), share) for members, share in joined)
    return tuple(sorted(found, key=lambda group: -group.share))


def _label(entry: Entry) -> str:
    people = ", ".join(one_line(person.label) for person in entry.people)
    return f"{entry.id} ({people})" if people else entry.id


def _of_same_people(facts: ClassFacts) -> Callable[[str, str], bool]:
    people = {entry.id: {person.key for person in entry.people} for entry in facts.entries}
    return lambda one, other: bool(people[one] & people[other])


def _python_of(source: Path, into: Path, course: Course) -> tuple[dict[str, str], list[str]]:
    """Return the texts of a submission's modules and Python programs, by path, and which were not read and why."""
    found: dict[str, str] = {}
    unread = []
    submission = open_submission(source, into, course)
    for package in filter(None, (submission.package, submission.interfaces)):
        for file in source_files.find(package, course):
            path = f"{package.name}/{file.path}"
            text = None if file.problem else untrusted.read_python(package / file.path)
            if text is None:
                unread.append(f"{path}, which {file.problem or 'is in an encoding that is hardly ever used'}.")
            else:
                found[path] = text
    return found, unread


def _file(path: str, text: str, made: dict[str, _File | None]) -> _File | None:
    """Return a file with its fingerprints, which are made once for each text, or None if Python cannot parse it."""
    if text not in made:
        parts = normal_form(text)
        whole = "".join(part for part, _ in parts or ())
        marks = [hash(whole[at : at + _STRETCH]) for at in range(len(whole) - _STRETCH + 1)]
        line = np.repeat([line for _, line in parts or ()], [len(part) for part, _ in parts or ()])
        made[text] = None if parts is None else _File(path, text, np.array(marks, dtype=np.int64), line)
    known = made[text]
    return known and replace(known, path=path)


def _share(one: _Package, other: _Package) -> float:
    """Return how much of `one` is in `other`, too, from 0 to 1."""
    return float(np.isin(one.prints, other.prints).mean())


def _places(one: _Package, other: _Package) -> tuple[tuple[Lines, Lines], ...]:
    """Return the longest places that two packages have in common, each place of `one` once."""
    return tuple(
        (_lines(one, first, length), _lines(other, second, length))
        for length, first, second in sorted(_runs(one, other), reverse=True)[:_PLACES]
    )


def _runs(one: _Package, other: _Package) -> Iterator[tuple[int, int, int]]:
    """Yield what two packages have in common: its length, and where it begins in the lists of their fingerprints."""
    at: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for index, marks in _long_stretches(other):
        at[marks].append(index)
    after = 0
    for first, marks in _long_stretches(one):
        if first >= after and (begins := at.get(marks, [])[:_CANDIDATES]):
            length, second = max((_length(one, first, other, begin), begin) for begin in begins)
            yield length, first, second
            after = first + length


def _long_stretches(package: _Package) -> Iterator[tuple[int, tuple[int, ...]]]:
    """Yield where each stretch begins that is long enough to be shown, and fingerprints that tell it apart."""
    prints, last = package.prints.tolist(), _SHOWN_LEAST - _STRETCH
    for index, end in enumerate(package.end.tolist()):
        if end - index > last:
            yield index, tuple(prints[index : index + last + 1 : _STRETCH])


def _length(one: _Package, first: int, other: _Package, second: int) -> int:
    """Return how many fingerprints follow each other in both without a gap, within one file each.

    It takes no longer than its result is: a file may repeat itself.
    """
    most = min(int(one.end[first]) - first, int(other.end[second]) - second)
    length, step = 0, _STRETCH
    while length < most:
        upto = min(most, length + step)
        here, there = (each[at + length : at + upto] for each, at in ((one.prints, first), (other.prints, second)))
        if len(differ := np.flatnonzero(here != there)):
            return length + int(differ[0])
        length, step = upto, 2 * step
    return length


def _lines(package: _Package, index: int, length: int) -> Lines:
    file, place = package.files[int(package.file_of[index])], int(package.place[index])
    first, last = int(file.line[place]), int(file.line[place + length + _STRETCH - 2])
    rows = file.text.splitlines()[first - 1 : last]
    cut = [*rows[:_PLACE_LINES], f"... {len(rows) - _PLACE_LINES} more lines"] if len(rows) > _PLACE_LINES else rows
    return Lines(one_line(file.path), first, last, "\n".join(lines(row, _LINE_LENGTH) for row in cut))
