"""Which packages of a class are most alike beyond what the course gives. Nothing is run.

Winnowing (Schleimer, Wilkerson and Aiken, 2003) over Python's tokens, in which all names are the same, and all
literals: of each window of stretches the one with the least hash is a fingerprint of the package.
"""

from __future__ import annotations

import io
import itertools
import json
import keyword
import tokenize
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from zlib import crc32

from grader.classroom import discovery
from grader.classroom.class_folder import ClassFacts, ClassFolder
from grader.course import named
from grader.errors import SubmissionError
from grader.host import tempdir
from grader.host.atomic import write_atomically
from grader.intake.submission import open_submission
from grader.quality import source_files
from grader.sandbox import untrusted
from grader.sanitize import one_line

DATA, GIVEN = "similar.json", "_given"
_STRETCH, _WINDOW = 20, 8  # tokens, about three lines; what has 27 tokens in common is found
_LEAST = 20  # fingerprints of its own; a package with fewer has hardly anything that could be compared
Texts = Mapping[str, str]  # by path
Stretch = tuple[int, str, int, int]  # of tokens: their hash, the file, and the lines in which they begin and end


@dataclass(frozen=True)
class Pair:
    """Two submissions, the share of each (0 to 1) that the other has, too, and in words where `one` has most of it."""

    one: str
    other: str
    share_of_one: float
    share_of_other: float
    places: str = ""

    @property
    def share(self) -> float:
        """Return the larger share: a package can be a part of another one."""
        return max(self.share_of_one, self.share_of_other)


def read(folder: ClassFolder, progress: Callable[[str], None]) -> tuple[dict[str, Texts], list[str]]:
    """Return the Python texts of a class by submission, and remarks on what is not compared."""
    facts, texts = folder.facts(), dict[str, Texts]()
    sources = {entry.source or facts.source for entry in facts.entries if not entry.absent}
    notes = [f"{e.id} is not compared: the present sources do not have it." for e in facts.entries if e.absent]
    with ExitStack() as stack:
        roots = {source: stack.enter_context(discovery.opened(folder.located(source))).folder for source in sources}
        scratch = stack.enter_context(tempdir.folder("similar"))
        for entry in (entry for entry in facts.entries if not entry.absent):
            progress(f"reading {entry.id}")
            source = roots[entry.source or facts.source] / entry.path
            try:
                package = open_submission(source, scratch / entry.id, named(facts.course)).package
            except SubmissionError as error:
                notes.append(f"{entry.id} is not compared: {one_line(error.what)}")
                continue
            files = source_files.find(package, named(facts.course))
            found = {f.path: "" if f.problem else untrusted.read_python(package / f.path) or "" for f in files}
            texts[entry.id] = {path: text for path, text in found.items() if _signs(text)}
            notes += [
                f"{entry.id} is compared without {one_line(path)}." for path in found.keys() - texts[entry.id].keys()
            ]
            if discovery.content_hash(source) != entry.content:
                notes.append(f"{entry.id} is compared as it is now; it is not what was graded.")
            tempdir.remove(scratch / entry.id)
    return texts, notes


def compare(texts: Mapping[str, Texts], base: Texts, facts: ClassFacts | None = None) -> list[Pair]:
    """Return all pairs but those of the same people, the most alike first; who has little beyond `base` is in none."""
    given = {mark for text in base.values() for mark, *_ in _stretches(text)}
    prints = {name: {e[0]: e for e in _winnowed(files) if e[0] not in given} for name, files in texts.items()}
    people = {entry.id: {person.key for person in entry.people} for entry in facts.entries} if facts else {}
    pairs = []
    for one, other in itertools.combinations([name for name, own in prints.items() if len(own) >= _LEAST], 2):
        if not people.get(one, set()) & people.get(other, set()):
            both = prints[one].keys() & prints[other].keys()
            of_one, of_other = (len(both) / len(prints[name]) for name in (one, other))
            pairs.append(Pair(one, other, of_one, of_other, _places([prints[one][mark] for mark in both])))
    return sorted(pairs, key=lambda pair: -pair.share)


def write(folder: ClassFolder, pairs: Sequence[Pair]) -> None:
    """Write into a class folder which pairs are nearer to all than to the median share, for the class page."""
    least = (1 + median(pair.share for pair in pairs)) / 2 if pairs else 1.0
    write_atomically(folder.path / DATA, json.dumps([asdict(p) for p in pairs if p.share >= least], indent=2) + "\n")


def near(folder: ClassFolder) -> tuple[Pair, ...]:
    """Return the pairs that `write` has written."""
    try:
        return tuple(Pair(**pair) for pair in json.loads((folder.path / DATA).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return ()


def archive(texts: Mapping[str, Texts], base: Texts, path: Path) -> None:
    """Write a zip that Dolos and JPlag read: a folder for each submission, and one for what the course gives."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as made:
        for name, files in {**texts, GIVEN: base}.items():
            parts = (f"# {one_line(path)}\n{text}" for path, text in sorted(files.items()))
            made.writestr(f"{name}/{name}.py", "\n\n".join(parts))


def _signs(text: str) -> list[tuple[str, int]]:
    """Return what is compared of Python's tokens, with their lines; nothing of what Python cannot read."""
    found = []
    try:
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.OP or keyword.iskeyword(token.string):
                found.append((token.string, token.start[0]))
            elif token.type != tokenize.COMMENT and token.string.strip():
                found.append(("V" if token.type == tokenize.NAME else "L", token.start[0]))
    except (tokenize.TokenError, SyntaxError):
        return []
    return found


def _stretches(text: str, path: str = "") -> list[Stretch]:
    signs = _signs(text)
    parts = [signs[at : at + _STRETCH] for at in range(len(signs) - _STRETCH + 1)]
    return [(crc32(" ".join(sign for sign, _ in part).encode()), path, part[0][1], part[-1][1]) for part in parts]


def _winnowed(files: Texts) -> list[Stretch]:
    every = [_stretches(text, path) for path, text in sorted(files.items())]
    return [min(file[at : at + _WINDOW]) for file in every for at in range(max(1, len(file) - _WINDOW + 1)) if file]


def _places(both: list[Stretch]) -> str:
    """Return the three longest runs of lines with these stretches in words, "driver.py 10 to 48, ..."."""
    runs: list[tuple[str, int, int]] = []
    for _, path, first, last in sorted(both, key=lambda each: each[1:]):
        follows = bool(runs) and runs[-1][0] == path and first <= runs[-1][2] + 2
        _, begin, end = runs.pop() if follows else (path, first, last)
        runs.append((path, begin, max(end, last)))
    runs.sort(key=lambda run: run[1] - run[2])
    return ", ".join(f"{one_line(path)} {first} to {last}" for path, first, last in runs[:3])
