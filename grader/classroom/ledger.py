"""Account for every entry of an export, and for everyone of whom a list says that they handed in.

Nobody's hand-in disappears: what cannot be accounted for is a doubt that stops the class.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader.classroom.class_folder import Doubt, DoubtKind, Entry
from grader.classroom.identity import identify
from grader.classroom.platform import Export, HandIn, Lost, Platform, entries_of, named, without_suffix
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime
from grader.errors import GraderError
from grader.intake.copy_plan import LeftOut
from grader.intake.names import safe_name, shortened
from grader.sanitize import printable
from grader.words import counted, some

_SYSTEM = re.compile(r"\._|\.(DS_Store|directory|localized|git\w*|venv|vscode|idea)$")
_SHOWN = 3
_MOST_DOUBTS = 20
_Gone = dict[str, list[tuple[LeftOut, tuple[str, ...]]]]
"""What was left out, each with its path in the folder with the submissions, by the first part of that."""


@dataclass(frozen=True)
class Source:
    """A folder with a class's submissions: one that was given, or what an archive unpacked to.

    `left_out` are the entries of the archive that are not in the folder.
    """

    folder: Path
    left_out: tuple[LeftOut, ...] = ()


def account(export: Export, platform: Platform, root: Path, source: Source) -> Export:
    """Return the export with its ledger, and with all that it has lost. `root` is the folder with its entries."""
    entries = {entry.name for entry in entries_of(root)} - set(platform.own)
    used = {hand_in.path.relative_to(root).parts[0] for hand_in in export.hand_ins}
    chosen = [note for note in export.notes if "is graded" in note]
    beside = {name for name in entries - used if _is_named(name, chosen)}
    odd = sorted(entries - used - beside)
    hidden = sorted(each.name for each in root.iterdir() if each.name.startswith(".") and not _SYSTEM.match(each.name))
    loose = [
        Lost(
            name,
            f"{printable(name)} is neither an archive nor a folder.",
            named(Path(name).stem),
            not _is_named(name, export.notes),
        )
        for name in odd
    ]
    loose += [
        Lost(name, f"{printable(name)} is hidden.", named(without_suffix(name[1:])), sure=False) for name in hidden
    ]
    gone = _groups(source, root.relative_to(source.folder).parts)
    left = [*odd, *hidden, *(top for top in gone if top not in entries)]
    within = sum(len(several) for top, several in gone.items() if top in entries)
    every = counted(len(entries) + len(left) - len(odd), "entry", "entries")
    ledger = f"{every} = {len(entries & used)} with a hand-in"
    ledger += f" + {len(beside)} beside one of the same people" if beside else ""
    ledger += f" + {len(left)} left out: {some([printable(name, 80) for name in left], _SHOWN)}" if left else ""
    ledger += f"; inside them {within} left out" if within else ""
    lost = (*export.lost, *_unpacked(export, platform, root, gone), *loose)
    return replace(export, ledger=ledger, lost=lost)


def _is_named(name: str, notes: Sequence[str]) -> bool:
    """Return whether a remark names an entry, and not a longer name with that at its end."""
    return any(f" {name}{end}" in f" {note}" for note in notes for end in (" is ", ",", "."))


def _groups(source: Source, inside: Sequence[str]) -> _Gone:
    """Return what unpacking left out, by its topmost name below the folders `inside` which the submissions are."""
    groups: _Gone = {}
    for each in source.left_out:
        raw = [part for part in each.name.replace("\\", "/").split("/") if part not in ("", ".", "..")]
        parts = tuple(shortened(safe_name(part)) for part in raw if not part.endswith(":")) or ("?",)
        below = parts[len(inside) :] if parts[: len(inside)] == tuple(inside) else parts
        groups.setdefault((below or parts)[0], []).append((each, below or parts))
    return groups


def _unpacked(export: Export, platform: Platform, root: Path, groups: _Gone) -> Iterator[Lost]:
    """Yield what unpacking an archive has left out, together for each whose it may be.

    A link inside a hand-in is left out of every submission; it is lost if there is nothing else, or an archive.
    """
    shadows = _shadows(platform, groups)
    for top, several in groups.items():
        shadow = shadows.get(top)
        same = shadow.claims if shadow else None
        known = [each for each in export.hand_ins if each.path.is_relative_to(root / top) or each.claims == same]
        if known and all(gone.link and without_suffix(path[-1]) == path[-1] for gone, path in several):
            continue
        hand_in = known[0] if known else shadow
        label = hand_in.label if hand_in else without_suffix(top)
        what = "; ".join(f"{printable(gone.name, 120)}: {gone.why}" for gone, _ in several[:_SHOWN])
        more = f"; and {len(several) - _SHOWN} more" if len(several) > _SHOWN else ""
        yield Lost(
            label,
            f"{'A part of the hand-in' if known else 'The hand-in'} of {label} was left out: {what}{more}.",
            hand_in.claims if hand_in else named(without_suffix(top)),
        )


def _shadows(platform: Platform, groups: _Gone) -> dict[str, HandIn]:
    """Return what the platform would read of hand-ins with these names, if they were there."""
    with tempfile.TemporaryDirectory(prefix="names-") as folder:
        root = Path(folder)
        for top, several in groups.items():
            path = root / top
            if any(len(below) > 1 for _, below in several):
                path.mkdir()
                path = path / several[0][1][-1]
            path.touch()
        entries = entries_of(root)
        if not entries or not platform.recognises(root, entries):
            return {}
        try:
            found = platform.read(root, entries).hand_ins
        except GraderError:
            return {}
        return {each.path.relative_to(root).parts[0]: each for each in found}


def lost(exports: Sequence[Export], roster: Sequence[Person], missing: Collection[Person]) -> Iterator[Doubt]:
    """Yield a doubt on each hand-in, or part of one, that an export has or lists and no submission has."""
    for each in (each for export in exports for each in export.lost):
        found = [identify(claims, roster) for claims in each.claims]
        people = tuple(person for who in found for person in who.people or who.rivals)
        if each.sure or set(people) & set(missing):
            yield Doubt(
                DoubtKind.LOST,
                each.label,
                each.what,
                "Export once more, or unpack the archive by hand, give it another name there and name the folder as "
                "the source. Until then whoever it may concern has no grade.",
                people=people,
                anyone=each.sure and not people,
                stops=True,
            )


def claimed(
    times: Sequence[HandInTime], roster: Sequence[Person], entries: Sequence[Entry], earlier: Sequence[Person]
) -> tuple[tuple[Person, ...], int]:
    """Return everyone of whom a list says that they handed in, and how many lines of lists fit nobody.

    Those of `earlier` runs' lists are among them.
    """
    everyone = roster or tuple(dict.fromkeys(person for entry in entries for person in entry.people))
    known = {person.key: person for person in everyone}
    found: list[Person] = []
    strangers = 0
    for time in times:
        who = identify(time.claims, everyone)
        if len(who.people) == 1:
            found.append(who.people[0])
        elif not roster and not who.rivals:
            lms = next((claim.lms for claim in time.claims if claim.lms), "")
            found.append(Person(**{claim.kind: claim.value for claim in time.claims}, lms=lms))
        else:
            strangers += 1
    before = [known.get(person.key, person) for person in earlier if not roster or person.key in known]
    return tuple(dict.fromkeys((*found, *before))), strangers


def without(claimed: Sequence[Person], entries: Sequence[Entry], doubts: Sequence[Doubt]) -> Iterator[Doubt]:
    """Yield a doubt on everyone who handed in by a list, and has no submission.

    It stops the class, unless the submission may be one of those that another doubt is about.
    """
    have = {person.key for entry in entries for person in entry.people}
    doubtful = {person.key for doubt in doubts for person in doubt.people}
    lacking = [who for who in claimed if who.key not in have and who.key not in doubtful]
    stops = len(lacking) > sum(doubt.anyone for doubt in doubts)
    todo = "Export once more, or see whether it is there under another name. Until then there is no grade."
    if len(lacking) > _MOST_DOUBTS:
        names = some([person.label for person in lacking], _SHOWN)
        what = f"{len(lacking)} people handed in by the list, and the export has nothing of theirs: {names}."
        yield Doubt(DoubtKind.LOST, names, what, todo, people=tuple(lacking), stops=stops)
        return
    for person in lacking:
        what = f"{person.label} handed in by the list, and the export has nothing of theirs."
        yield Doubt(DoubtKind.LOST, person.label, what, todo, people=(person,), stops=stops)


def lines(
    exports: Sequence[Export], claimed: Sequence[Person], strangers: int, roster: Sequence[Person],
    entries: Sequence[Entry], doubts: Sequence[Doubt],
) -> tuple[str, ...]:  # fmt: skip
    """Return how entries and people add up."""
    said = [f"{export.layout}: {export.ledger}" for export in exports]
    have = {person.key for entry in entries for person in entry.people}
    waiting = {person.key for doubt in doubts for person in (roster if doubt.anyone else doubt.people)} - have
    if roster:
        here = sum(person.key in have for person in roster)
        open_ = sum(person.key in waiting for person in roster)
        rest = len(roster) - here - open_
        every = counted(len(roster), "person", "people")
        said.append(f"roster: {every} = {here} with a hand-in + {open_} in doubt + {rest} without")
    if claimed or strangers:
        here = sum(person.key in have for person in claimed)
        total = counted(len(claimed) + strangers, "person", "people")
        rest = len(claimed) - here
        more = f" + {strangers} of nobody in the roster" if strangers else ""
        said.append(f"list: {total} handed in = {here} with a hand-in + {rest} without{more}")
    return tuple(said)
