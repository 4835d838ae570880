"""Remove everything that a class keeps of one person, and name what is kept elsewhere."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from grader.classroom import regrades, similarity
from grader.classroom.class_folder import LOG, PLAN, SUBMISSIONS, ClassFacts, ClassFolder
from grader.classroom.entry import Entry
from grader.classroom.identity import ANY, Claim, identify
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.host import tempdir
from grader.host.atomic import write_atomically

_SHORTEST = 3  # characters of a name or a number that is looked for in text


@dataclass(frozen=True)
class Step:
    """Something to be removed, in words, and how."""

    what: str
    do: Callable[[], None]


@dataclass(frozen=True)
class Forgetting:
    """What is to be done to forget a person; `words` are all that names them, their submissions among it."""

    person: Person
    steps: tuple[Step, ...]
    left: tuple[str, ...]
    words: frozenset[str]


def plan(folder: ClassFolder, name: str, exports: Collection[str] = ()) -> Forgetting:
    """Return what there is to forget of the person whom `name` means: an id, a number, a login, an e-mail or a name.

    A submission that matches nobody is named by its own id. `exports` are the names of files and folders in the class
    that can be written again.

    Raises:
        GraderError: the class has no such person, or it is not certain who is meant.
    """
    facts = folder.facts()
    stranger = next((entry for entry in facts.entries if entry.id == name and not entry.people), None)
    person = Person(name=stranger.label) if stranger else _person(name, facts)
    mine = [entry for entry in facts.entries if person in entry.people or entry is stranger]
    alone = [entry for entry in mine if not set(entry.people) - {person}]
    words = {value for value in (person.id, person.name, person.email, person.login) if len(value) >= _SHORTEST}
    words |= {word for entry in alone for word in (entry.id, entry.label)}
    ids = [entry.id for entry in alone]
    steps = [
        *(Step(f"submissions/{each}: reports and evidence", _remover(folder.submission(each))) for each in ids),
        Step(
            f"the lines about {person.label} in class.yaml",
            lambda: folder.write_facts(_without(facts, person, ids, words)),
        ),
        *_people_wrote(folder, person, ids),
        *_lines_of(folder.path / regrades.FILE, [f"submission: {each}," for each in ids]),
        *_lines_of(folder.path / LOG, words),
        *_lines_of(folder.path / PLAN, words),
    ]
    if _shown_as_similar(folder, {entry.id for entry in mine}):
        steps += [
            Step(f"{page}; `grader similar` writes it again", _remover(folder.path / page))
            for page in (similarity.PAGE, similarity.DATA)
        ]
    steps += [Step(each, _remover(folder.path / each)) for each in exports if (folder.path / each).exists()]
    left = [
        f"{entry.id} stays: it is the submission of {', '.join(p.label for p in entry.people if p != person)}, too"
        for entry in mine
        if entry not in alone
    ]
    left += [f"{source} has what was handed in" for source in dict.fromkeys((facts.source, *facts.added))]
    return Forgetting(person, tuple(steps), tuple(left), frozenset(words))


def still_named(folder: ClassFolder, words: Collection[str]) -> list[str]:
    """Return the files of the class in which one of the words still is; of submissions, the reports."""
    reports = folder.path.glob(f"{SUBMISSIONS}/*/*")
    own = [path for path in folder.path.rglob("*") if SUBMISSIONS not in path.relative_to(folder.path).parts]
    texts = [word.encode() for word in words]
    return [
        path.relative_to(folder.path).as_posix()
        for path in sorted((*own, *reports))
        if path.is_file() and any(_whole(text, path.read_bytes()) for text in texts)
    ]


def _whole(word: bytes, text: bytes) -> bool:
    return word in text and re.search(rb"(?<!\w)" + re.escape(word) + rb"(?!\w)", text) is not None


def _person(name: str, facts: ClassFacts) -> Person:
    listed = (person for entry in facts.entries for person in entry.people)
    people = tuple(dict.fromkeys((*listed, *facts.missing, *facts.roster)))
    who = identify([Claim(ANY, name)], people)
    if len(who.people) == 1:
        return who.people[0]
    if who.rivals:
        rivals = ", ".join(f"{p.label} ({p.key[0]} {p.key[1]})" for p in who.rivals)
        raise GraderError(f"{name} may be {rivals}. Name the person by an id, a login or an e-mail.")
    raise GraderError(f"The class has nobody called {name}. Name the person by an id, a login, an e-mail or the name.")


def _without(facts: ClassFacts, person: Person, ids: Collection[str], words: Collection[str]) -> ClassFacts:
    def others(people: Iterable[Person]) -> tuple[Person, ...]:
        return tuple(each for each in people if each != person)

    def silent(text: str) -> bool:
        return not any(_whole(word.encode(), text.encode()) for word in words)

    kept = [entry for entry in facts.entries if entry.id not in ids]
    doubts = [doubt for doubt in facts.doubts if silent(f"{doubt.entry} {doubt.label} {doubt.what} {doubt.todo}")]
    return replace(
        facts,
        entries=tuple(_entry_without(entry, person) for entry in kept),
        missing=others(facts.missing),
        roster=others(facts.roster),
        notes=tuple(filter(silent, facts.notes)),
        doubts=tuple(replace(doubt, people=others(doubt.people)) for doubt in doubts),
    )


def _entry_without(entry: Entry, person: Person) -> Entry:
    if person not in entry.people:
        return entry
    at = entry.people.index(person)
    matched = (*entry.matched[:at], *entry.matched[at + 1 :])
    return replace(entry, people=(*entry.people[:at], *entry.people[at + 1 :]), matched=matched)


def _remover(path: Path) -> Callable[[], None]:
    def remove() -> None:
        if path.is_dir():
            tempdir.remove(path)
        else:
            path.unlink(missing_ok=True)

    return remove


def _lines_of(path: Path, words: Collection[str]) -> Iterator[Step]:
    """Yield a step that takes the lines with one of the words out of a text file, if there are any."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    kept = [line for line in lines if not any(_whole(word.encode(), line.encode()) for word in words)]
    if kept != lines:
        yield Step(f"{len(lines) - len(kept)} lines of {path.name}", lambda: write_atomically(path, "".join(kept)))


def _people_wrote(folder: ClassFolder, person: Person, ids: Collection[str]) -> Iterator[Step]:
    """Yield a step that cuts the person and the submissions out of overrides.yaml; all other text stays as it is."""
    path = folder.overrides
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    names = {person.id, person.lms_id, person.login, person.email, person.name} - {""}
    kept = cut(cut(text, "people", names), "submissions", ids)
    if kept != text:
        yield Step("what overrides.yaml says of them", lambda: write_atomically(path, kept))


def cut(text: str, section: str, names: Collection[str]) -> str:
    """Return a YAML text without these keys of a section, a block of "name: value" lines."""
    root = yaml.compose(f"{text}\n", yaml.SafeLoader)
    pairs = root.value if isinstance(root, yaml.MappingNode) else []
    blocks = [value for key, value in pairs if key.value == section and isinstance(value, yaml.MappingNode)]
    lines = text.splitlines(keepends=True)
    gone: set[int] = set()
    for block in blocks:
        for key, value in block.value:
            if key.value in names:
                first, end = key.start_mark.line, value.end_mark.line + (value.flow_style is not False)
                end = min(end, len(lines))
                while end - 1 > first and re.fullmatch(
                    rf" {{0,{key.start_mark.column}}}#.*|\s*", lines[end - 1].rstrip()
                ):
                    end -= 1  # a block ends where the next one begins, after the comments before that
                gone |= set(range(first, end))
    return "".join(line for number, line in enumerate(lines) if number not in gone)


def _shown_as_similar(folder: ClassFolder, ids: Collection[str]) -> bool:
    try:
        pairs = json.loads((folder.path / similarity.DATA).read_text(encoding="utf-8"))["pairs"]
    except (OSError, ValueError):
        return (folder.path / similarity.PAGE).exists()
    return any({pair["one"], pair["other"]} & set(ids) for pair in pairs)
