"""Remove everything that a class keeps of one person, and name what is kept elsewhere."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from grader.classroom import naming, overrides, regrades, similarity
from grader.classroom.class_folder import LOG, PLAN, RUBRIC, SUBMISSIONS, ClassFacts, ClassFolder
from grader.classroom.entry import Entry
from grader.classroom.identity import ANY, Claim, identify
from grader.classroom.roster import Person
from grader.errors import GraderError
from grader.host import tempdir
from grader.host.atomic import write_atomically
from grader.report import for_students
from grader.scoring import rubric
from grader.words import counted


@dataclass(frozen=True)
class Step:
    """Something to be removed, in words, and how."""

    what: str
    do: Callable[[], None]


@dataclass(frozen=True)
class Forgetting:
    """What is to be done to forget a person; `named` finds them and their submissions in text."""

    person: Person
    steps: tuple[Step, ...]
    left: tuple[str, ...]
    named: re.Pattern[str]


def plan(folder: ClassFolder, name: str, exports: Collection[str] = ()) -> Forgetting | None:
    """Return what there is to forget of the person whom `name` means: an id, a number, a login, an e-mail or a name.

    A submission that matches nobody is named by its own id. `exports` are the names of files and folders in the class
    that can be written again. Return None if the class has no such person.

    Raises:
        GraderError: it is not certain who is meant, or the class or its overrides cannot be read.
    """
    facts = folder.facts()
    decided = overrides.of_class(folder, facts, rubric.load(folder.path / RUBRIC))
    owned = overrides.applied(facts, decided).entries
    stranger = next((entry for entry in owned if entry.id == name and not entry.people), None)
    person = Person(name=stranger.label) if stranger else _person(name, facts)
    if person is None:
        return None
    mine = [entry for entry in owned if person in entry.people or entry is stranger]
    alone = [entry for entry in mine if not set(entry.people) - {person}]
    words = naming.words(person) | {word for entry in alone for word in (entry.id, entry.label)}
    named = naming.pattern(words)
    ids = [entry.id for entry in alone]
    steps = [
        *(Step(f"submissions/{each}: reports and evidence", _remover(folder.submission(each))) for each in ids),
        Step(
            f"the lines about {person.label} in class.yaml",
            lambda: folder.write_facts(_without(facts, person, ids, named)),
        ),
        *_people_wrote(folder, person, ids, _everyone(facts)),
        *_lines_of(folder.path / regrades.FILE, naming.pattern(f"submission: {each}," for each in ids)),
        *_lines_of(folder.path / LOG, named),
        *_lines_of(folder.path / PLAN, named),
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
    return Forgetting(person, tuple(steps), tuple(left), named)


def still_named(folder: ClassFolder, named: re.Pattern[str]) -> list[str]:
    """Return the files of the class in which the person still is named; of submissions, the reports."""
    reports = [
        path for level in ("*", f"{for_students.FOLDER}/*") for path in folder.path.glob(f"{SUBMISSIONS}/*/{level}")
    ]
    own = [path for path in folder.path.rglob("*") if SUBMISSIONS not in path.relative_to(folder.path).parts]
    return [
        path.relative_to(folder.path).as_posix()
        for path in sorted((*own, *reports))
        if path.is_file() and named.search(html.unescape(path.read_text(encoding="utf-8", errors="replace")))
    ]


def _everyone(facts: ClassFacts) -> tuple[Person, ...]:
    listed = (person for entry in facts.entries for person in entry.people)
    return tuple(dict.fromkeys((*listed, *facts.missing, *facts.roster, *facts.claimed)))


def _person(name: str, facts: ClassFacts) -> Person | None:
    who = identify([Claim(ANY, name)], _everyone(facts))
    if who.why:
        rivals = ", ".join(f"{p.label} ({p.key[0]} {p.key[1]})" for p in who.rivals)
        raise GraderError(f"{name} may be {rivals}. Name the person by an id, a login or an e-mail.")
    return who.people[0] if len(who.people) == 1 else None


def _without(facts: ClassFacts, person: Person, ids: Collection[str], named: re.Pattern[str]) -> ClassFacts:
    def others(people: Iterable[Person]) -> tuple[Person, ...]:
        return tuple(each for each in people if each != person)

    def silent(text: str) -> bool:
        return not named.search(text)

    kept = [entry for entry in facts.entries if entry.id not in ids]
    doubts = [doubt for doubt in facts.doubts if silent(f"{doubt.entry} {doubt.label} {doubt.what} {doubt.todo}")]
    return replace(
        facts,
        entries=tuple(_entry_without(entry, person) for entry in kept),
        missing=others(facts.missing),
        roster=others(facts.roster),
        claimed=others(facts.claimed),
        ledger=tuple(filter(silent, facts.ledger)),
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


def _lines_of(path: Path, named: re.Pattern[str]) -> Iterator[Step]:
    """Yield a step that removes the lines that name the person from a text file, if there are any."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True) if path.exists() else []
    kept = [line for line in lines if not named.search(line)]
    if kept != lines:
        yield Step(
            f"{counted(len(lines) - len(kept), 'line')} of {path.name}", lambda: write_atomically(path, "".join(kept))
        )


def _people_wrote(
    folder: ClassFolder, person: Person, ids: Collection[str], everyone: tuple[Person, ...]
) -> Iterator[Step]:
    """Yield a step that cuts the person and the submissions out of overrides.yaml; all other text stays as it is."""
    path = folder.overrides
    text = path.read_text(encoding="utf-8") if path.exists() else ""

    def means(name: str) -> bool:
        return identify([Claim(ANY, name)], everyone).people == (person,)

    kept = _unassigned(cut(cut(text, "people", means), "submissions", ids.__contains__), means)
    if kept != text:
        yield Step("what overrides.yaml says of them", lambda: write_atomically(path, kept))


def cut(text: str, section: str, unwanted: Callable[[str], bool]) -> str:
    """Return a YAML text without the unwanted keys of a section, a block of "name: value" lines."""
    lines = text.splitlines(keepends=True)
    gone: set[int] = set()
    for key, value in _section(text, section):
        if unwanted(key.value):
            first, end = key.start_mark.line, value.end_mark.line + (not _in_lines(value))
            end = min(end, len(lines))
            while end - 1 > first and re.fullmatch(rf" {{0,{key.start_mark.column}}}#.*|\s*", lines[end - 1].rstrip()):
                end -= 1  # a block ends where the next one begins, after the comments before that
            gone |= set(range(first, end))
    return "".join(line for number, line in enumerate(lines) if number not in gone)


def _unassigned(text: str, unwanted: Callable[[str], bool]) -> str:
    """Return overrides.yaml with the `people:` of each submission as a list without the unwanted ones."""
    places = []
    for _, decided in _section(text, "submissions"):
        for key, value in decided.value if isinstance(decided, yaml.MappingNode) else []:
            several: list[yaml.Node] = value.value if isinstance(value, yaml.SequenceNode) else [value]
            kept = [text[each.start_mark.index : each.end_mark.index] for each in several if not unwanted(each.value)]
            if key.value == "people" and len(kept) < len(several):
                # A list in lines begins below its key, and ends where the next key begins.
                end = several[-1].end_mark.index if _in_lines(value) else value.end_mark.index
                places.append((key.end_mark.index, end, f": [{', '.join(kept)}]"))
    for begin, end, people in reversed(places):
        text = text[:begin] + people + text[end:]
    return text


def _in_lines(node: yaml.Node) -> bool:
    """Return whether a mapping or a list has a line for each item."""
    return isinstance(node, yaml.CollectionNode) and node.flow_style is False


def _section(text: str, name: str) -> list[tuple[yaml.ScalarNode, yaml.Node]]:
    """Return the keys and values of a section of a YAML text, [] if it has none."""
    root = yaml.compose(f"{text}\n", yaml.SafeLoader)
    pairs = root.value if isinstance(root, yaml.MappingNode) else []
    blocks = [value for key, value in pairs if key.value == name and isinstance(value, yaml.MappingNode)]
    return [pair for block in blocks for pair in block.value]


def _shown_as_similar(folder: ClassFolder, ids: Collection[str]) -> bool:
    try:
        pairs = json.loads((folder.path / similarity.DATA).read_text(encoding="utf-8"))["pairs"]
    except (OSError, ValueError):
        return (folder.path / similarity.PAGE).exists()
    return any({pair["one"], pair["other"]} & set(ids) for pair in pairs)
