"""Write a class without names: gradebook, pages and reports by aliases, and a key beside them that says who is who."""

from __future__ import annotations

import hashlib
import html
import re
import shutil
import unicodedata
from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from grader import report, sanitize
from grader.classroom import cells, hand_ins, naming, overview
from grader.classroom.class_folder import GRADEBOOK, SUBMISSIONS, ClassFolder
from grader.classroom.gradebook import Gradebook, Row
from grader.classroom.overrides import Decisions
from grader.classroom.platforms import plain
from grader.classroom.roster import Person
from grader.classroom.sections import Section
from grader.course import named
from grader.errors import UsageError
from grader.evidence import Trial
from grader.host import tempdir
from grader.report import for_students
from grader.scoring.rubric import Criterion, Requirement, Rubric

FOLDER = "anonymous"
_T = TypeVar("_T", bound=Hashable)
_HIDDEN = "…"
_OURS = (Criterion, Person, Requirement, Rubric, Section, Trial)  # hold nothing that a student wrote, or an alias


def key_of(out: Path) -> Path:
    """Return where the key of an anonymous class is."""
    return out.with_name(f"{out.name}_key.csv")


def write(folder: ClassFolder, book: Gradebook, out: Path) -> list[str]:
    """Write gradebook.csv, index.html, and each submission's report into the folder `out`; the key goes beside it.

    Where a course holds something back, the reports are those for students. What people decided about one person,
    comments, doubts and evidence are left out. Return a remark on each file that still names a person. Nothing of fewer
    than three characters is hidden, and no nickname.

    Raises:
        UsageError: `out` is there, and is something else.
    """
    if out.exists() and not (out / GRADEBOOK).is_file():
        raise UsageError(f"{out} is there already, and is not an anonymous class.", "Choose another --out.")
    facts = folder.facts()
    # By hashes, for an alias by the order of names would say something about them.
    people = _numbered("person", {row.person: repr(row.person.key) for row in book.rows})
    submissions = _numbered("hand-in", {entry.id: entry.content + entry.id for entry in facts.entries})
    # By casefolded words: the login "alng" and "AlNg" of a name without its space are one word.
    aliases: dict[str, str] = {}
    for person, alias in people.items():
        aliases |= {person.team.casefold(): _HIDDEN} | {word.casefold(): alias for word in naming.words(person)}
    for entry in facts.entries:
        own = [word.casefold() for word in (entry.id, entry.number, *naming.forms(entry.label))]
        aliases |= {word: submissions[entry.id] for word in own if word not in aliases or word == own[0]}
    for name in (*(each.id for each in book.rubric.requirements), *(each.id for each in book.rubric.checks)):
        aliases.pop(name.casefold(), None)
    hide = _hider(aliases, {part: alias for person, alias in people.items() for part in person.name.split()})
    nameless = _without_names(book, people)
    shown = sanitize.changed(replace(nameless, decisions=Decisions()), hide, _OURS)
    summary = overview.summarise(folder, nameless, for_student=True)
    secret = any(requirement.held_back for requirement in book.rubric.requirements)
    bare = replace(
        facts, source=_HIDDEN, added=(), entries=(), missing=(), roster=(), notes=(), doubts=(), ledger=(), claimed=()
    )
    bare = replace(bare, seed=0) if secret else bare  # as in a student's report
    tempdir.remove(out)
    out.mkdir(parents=True)
    plain.write(shown, out / GRADEBOOK)
    overview.write_pages(sanitize.changed(replace(summary, facts=bare, groups=()), hide, _OURS), shown, out)
    for entry in facts.entries:
        if (folder.submission(entry.id) / report.PAGE).is_file():
            rows = [row for row in nameless.every if row.submission == entry.id]
            known = replace(
                hand_ins.hand_in(entry, facts, book.decisions, rows),
                people=tuple(row.person.name for row in rows), team="", name=submissions[entry.id], comments=(),
            )  # fmt: skip
            place = out / SUBMISSIONS / submissions[entry.id]
            place.mkdir(parents=True)
            result = hand_ins.read_back(folder.submission(entry.id), book.rubric, named(facts.course))
            result = replace(result, submission=submissions[entry.id])  # which was the name of a file
            report.write(sanitize.changed(result, hide, _OURS), place, hand_in=sanitize.changed(known, hide, _OURS))
            for path in (place / for_students.FOLDER).glob("*"):
                path.replace(place / path.name)
            shutil.rmtree(place / for_students.FOLDER, ignore_errors=True)
    table = sorted(
        (people[r.person], submissions.get(r.submission, ""), r.submission, *plain.who(r)) for r in book.rows
    )
    cells.write(key_of(out), [("anonymous", "hand-in", "submission", *plain.PERSON), *table])
    known_words = naming.pattern(filter(_long, aliases))
    left = {path.relative_to(out): known_words.search(_text(path)) for path in sorted(out.rglob("*")) if path.is_file()}
    return [f'{path} still has "{found[0]}"; look at it before it goes out' for path, found in left.items() if found]


def _numbered(kind: str, by: Mapping[_T, str]) -> dict[_T, str]:
    """Return "person-001" and so on, in the order of the hashes of what is in `by`."""
    ordered = sorted(by, key=lambda each: hashlib.sha256(by[each].encode()).digest())
    return {each: f"{kind}-{number:03}" for number, each in enumerate(ordered, 1)}


def _hider(aliases: Mapping[str, str], parts: Mapping[str, str]) -> Callable[[str, str], str]:
    """Return what replaces the casefolded `aliases` in a text, whatever their case; `parts` of names as written."""
    folded = {word: alias for word, alias in aliases.items() if _long(word)}
    exact = {part: alias for part, alias in parts.items() if _long(part) and part.casefold() not in folded}
    found = naming.pattern([*folded, *exact])
    begins = {re.split(r"[\W_]+", word.casefold())[0] for word in (*folded, *exact)}

    def hide(text: str, _field: str = "") -> str:
        text = unicodedata.normalize("NFC", text)
        if begins.isdisjoint(re.split(r"[\W_]+", text.casefold())):  # most texts, and the pattern is slow
            return text
        return found.sub(lambda match: folded.get(match[0].casefold(), exact.get(match[0], match[0])), text)

    return hide


def _long(word: str) -> bool:
    return len(word) >= naming.SHORTEST


def _text(path: Path) -> str:
    return html.unescape(path.read_text(encoding="utf-8"))


def _without_names(book: Gradebook, people: Mapping[Person, str]) -> Gradebook:
    def bare(row: Row) -> Row:
        alias = people.get(row.person, _HIDDEN)
        return replace(row, person=Person(id=alias, name=alias), private=(), comments=())

    return replace(
        book,
        rows=tuple(sorted(map(bare, book.rows), key=lambda row: row.person.id)),
        every=tuple(map(bare, book.every)),
        teams={name: bare(row) for name, row in book.teams.items()},
    )
