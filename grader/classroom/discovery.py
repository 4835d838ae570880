"""From a source, a folder or an archive, to the entries of a class: who handed in what, when. Nothing is run."""

from __future__ import annotations

import datetime as dt
import hashlib
import itertools
import os
import re
import unicodedata
from collections.abc import Hashable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from grader.classroom import ledger, matching, platforms, times
from grader.classroom.class_folder import ClassFacts, Doubt, DoubtKind, Entry
from grader.classroom.ledger import Source
from grader.classroom.matching import Match
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime
from grader.errors import GraderError
from grader.host import tempdir
from grader.intake.containers import MB, SizeLimits
from grader.intake.submission import unpack

# An export of 300 submissions of the largest size that intake takes.
EXPORT_LIMITS = SizeLimits(
    total_bytes=15_000 * MB, file_bytes=2_000 * MB, files=1_000_000, ratio=1_000_000,
    entries=2_000_000, tar_bytes=20_000 * MB,
)  # fmt: skip

_NO_TIME = dt.datetime.min.replace(tzinfo=dt.UTC)
_UNREADABLE = "unreadable: "  # instead of a hash
_MAKE_READABLE = "Make it readable for whoever runs this, and run it again; the others are graded all the same."
_SHORT = 60  # bytes of an id
_LATIN_MARK = re.compile("[\u0300-\u036f]")  # what is left of letters such as that of İpek in small letters

_NEW = ClassFacts()


@contextmanager
def opened(source: Path) -> Iterator[Source]:
    """Yield the folder with a class's submissions; an archive is unpacked into a temporary one.

    Raises:
        GraderError: there is no such source, or it cannot be opened.
        SubmissionError: the archive is damaged or too large.
    """
    if source.is_dir():
        yield Source(source)
    elif source.is_file():
        with tempdir.folder("class") as folder:
            plan = unpack(source, folder / "export", EXPORT_LIMITS, export=True)
            yield Source(folder / "export", tuple(plan.left_out))
    else:
        raise GraderError(f"There is no {source}. Name the folder or the archive with the class's submissions.")


def find(
    root: Path | Source,
    roster: Sequence[Person] = (),
    before: ClassFacts = _NEW,
    added: Sequence[Source] = (),
    known_times: Sequence[HandInTime] = (),
) -> ClassFacts:
    """Return the class as far as its sources, roster and lists tell: each submission with its people.

    The submissions are those in the folder `root` and in those `added` to it.

    Those that the class has had `before` keep their ids, and stay if they are in none of the folders any more. Of
    several submissions of one team the latest counts, if their times are known; otherwise all of them are entries.
    `known_times` are from beside the export; where there is a deadline or a late rule, a submission without a time is a
    doubt.

    Raises:
        GraderError: there is no submission.
    """
    source = root if isinstance(root, Source) else Source(root)
    earlier = before.entries
    exports = [platforms.read(each) for each in (source, *added)]
    matches = matching.match([hand_in for export in exports for hand_in in export.hand_ins], roster)
    drafts = times.added([_draft(found) for found in matches], roster, known_times)
    stay = _retained(earlier, drafts, roster)
    drafts, left_out = _latest(drafts)
    before_now = {(entry.id, entry.content): entry.submitted for entry in earlier}  # the time of the same content
    named = [
        replace(e, submitted=e.submitted or before_now.get((e.id, e.content))) for e in _named(drafts, earlier, stay)
    ]
    entries = tuple(sorted((*named, *stay), key=lambda entry: entry.id))
    handed_in = {person.key for entry in entries for person in entry.people}
    missing = tuple(person for person in roster if person.key not in handed_in)
    ids = {entry.path: entry.id for entry in named}
    doubts = [
        *(doubt for found in matches for doubt in matching.doubts(found, ids.get(found.hand_in.path, ""), missing)),
        *(replace(doubt, entry=ids.get(path, "")) for path, doubt in left_out),
        *(matching.unmatched(entry) for entry in stay if roster and not entry.people),
        *matching.class_doubts(exports, named, roster),
        *ledger.lost(exports, roster, missing),
        *(
            Doubt(DoubtKind.UNREADABLE, e.label, f"{e.label} cannot be read: {why}.", _MAKE_READABLE, e.id)
            for e in named
            if (why := e.content.removeprefix(_UNREADABLE)) != e.content
        ),
        *(times.doubts(entries, known_times, exports[0].layout) if before.deadline or before.late_rule else ()),
    ]
    claimed, strangers = ledger.claimed(known_times, roster, entries, before.claimed)
    doubts += ledger.without(claimed, entries, doubts)
    notes = tuple(note for export in exports for note in export.notes)
    lines = ledger.lines(exports, claimed, strangers, roster, entries, doubts)
    return replace(
        before, layout=exports[0].layout, entries=entries, missing=missing, notes=notes, doubts=tuple(doubts),
        ledger=lines, claimed=claimed,
    )  # fmt: skip


def content_hash(path: Path) -> str:
    """Return the SHA-256 of an archive's bytes, or of a folder's paths, bytes and `chmod +x`, without git history."""
    if not path.is_dir():
        with path.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    digest = hashlib.sha256()
    for folder, folders, names in os.walk(path):
        folders[:] = sorted(name for name in folders if name != ".git")
        for name in sorted(names):
            file = Path(folder) / name
            digest.update(f"\0{file.relative_to(path)}\0".encode(errors="surrogateescape"))
            if file.is_symlink():
                digest.update(os.fsencode(file.readlink()))
            elif file.is_file():
                digest.update(b"x" if file.stat().st_mode & 0o100 else b"-")
                digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()


def slug(text: str) -> str:
    """Return `text` as small letters, digits and hyphens, "submission" if nothing is left of it.

    Accents are taken from Latin letters; those of other scripts stay what they are.
    """
    found = "".join(map(_plain, unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).casefold())))
    words = unicodedata.normalize("NFC", "-".join(re.findall(r"[^\s-]+", found)))
    return words.encode()[:_SHORT].decode(errors="ignore").strip("-") or "submission"


def _plain(char: str) -> str:
    """Return a letter without its accents if it is a Latin one, a digit or a letter as it is, and else a hyphen."""
    plain = unicodedata.normalize("NFKD", char).encode("ascii", "ignore").decode()
    if plain:
        return "".join(each if each.isalnum() else "-" for each in plain)
    kind = unicodedata.category(char)[0]
    return char if kind in "LN" or (kind == "M" and not _LATIN_MARK.match(char)) else "" if kind == "M" else "-"


def _draft(found: Match) -> Entry:
    """Return a hand-in as an entry without an id; one that cannot be read is graded again once it can be."""
    hand_in = found.hand_in
    try:
        content = content_hash(hand_in.path)
    except OSError as error:
        content = f"{_UNREADABLE}{error.strerror}"
    people, matched = tuple(found.people), tuple(found.people.values())
    return Entry(
        "", hand_in.label, hand_in.path, content, people, hand_in.submitted, hand_in.late,
        number=found.account.value, matched=matched,
    )  # fmt: skip


def _retained(earlier: Sequence[Entry], present: Sequence[Entry], roster: Sequence[Person]) -> tuple[Entry, ...]:
    """Return the `earlier` entries that are neither `present` nor replaced by other hand-ins of the same people.

    A later export is often partial: of one group, or of the late ones only. Whoever handed in earlier keeps the grade.
    """
    known = {(entry.label, entry.number) for entry in present}
    handed_in = {person.key for entry in present for person in entry.people}
    of_roster = {person.key: person for person in roster}
    stay = []
    for entry in earlier:
        matched = dict(zip(entry.people, entry.matched, strict=False))
        people = tuple(person for person in entry.people if person.key not in handed_in)
        if (entry.label, entry.number) not in known and (people or not entry.people):
            stay.append(
                replace(
                    entry,
                    people=tuple(of_roster.get(person.key, person) for person in people),
                    matched=tuple(matched[person] for person in people if person in matched),
                    absent=True,
                )
            )
    return tuple(stay)


def _latest(drafts: list[Entry]) -> tuple[list[Entry], list[tuple[Path, Doubt]]]:
    """Return what counts, the latest of each team's submissions where the times tell, and a doubt on each choice."""
    groups: dict[Hashable, list[Entry]] = {}
    for number, draft in enumerate(drafts):
        team = next((person.team for person in draft.people if person.team), "")
        who: Hashable = ("team", team) if team else frozenset(person.key for person in draft.people) or number
        groups.setdefault(who, []).append(draft)
    kept: list[Entry] = []
    doubts = []
    for several in groups.values():
        if len(several) == 1:
            kept += several
            continue
        labels = [draft.label for draft in several]
        names = {d.path: d.label if labels.count(d.label) == 1 else d.path.name for d in several}
        same = len({draft.content for draft in several}) == 1
        if same or all(draft.submitted for draft in several):
            last = max(several, key=lambda draft: (draft.submitted or _NO_TIME, draft.path))
            others = ", ".join(sorted(names[draft.path] for draft in several if draft is not last))
            which = "One" if same else "The latest"
            kept.append(replace(last, notes=(f"{which} of {len(several)} submissions; not: {others}.",)))
            why = "they are the same" if same else f"it is the latest, of {last.submitted:%Y-%m-%d %H:%M}"
            what, todo = f"{names[last.path]} counts, not {others}: {why}.", ""
        else:
            last = several[0]
            all_ = ", ".join(sorted(names.values()))
            what = f"{all_} are of the same people, and not all have a time: the best counts."
            kept += [replace(draft, notes=(what,)) for draft in several]
            todo = "Give their times with --times, or remove what should not count from the source."
        doubts.append((last.path, Doubt(DoubtKind.SEVERAL, last.label, what, todo)))
    return kept, doubts


def _named(drafts: Sequence[Entry], earlier: Sequence[Entry], stay: Sequence[Entry]) -> Iterator[Entry]:
    """Give each entry an id that no other has: its team's, its person's or its label's.

    An entry of an `earlier` run keeps its id, so that results and decisions stay with it, as do those that `stay`.
    Where several would have one id, each of them has its mark appended: no order decides who is who.
    """
    kept = {(entry.label, _mark(entry)): entry.id for entry in earlier}
    own = [kept.pop((draft.label, _mark(draft)), "") for draft in drafts]
    taken = {*filter(None, own), *(entry.id for entry in stay)}
    wanted = [_wanted(draft) for draft in drafts]
    for draft, name, before in zip(drafts, wanted, own, strict=True):
        marked = f"{name}-{_mark(draft)}"
        choices = itertools.chain([name, marked], (f"{marked}-{number}" for number in itertools.count(2)))
        free = (choice for choice in choices if choice not in taken and wanted.count(choice) <= (choice == name))
        found = before or next(free)
        taken.add(found)
        yield replace(draft, id=found)


def _wanted(draft: Entry) -> str:
    teams = {person.team for person in draft.people if person.team}
    one = draft.people[0] if len(draft.people) == 1 else Person()
    return slug(next(iter(teams)) if len(teams) == 1 else one.login or one.id or one.name or draft.label)


def _mark(entry: Entry) -> str:
    """Return what tells a submission from others of one name: the platform's number, its label, or a hash."""
    if entry.number or slug(entry.label) != _wanted(entry):
        return slug(entry.number or entry.label)
    said = (entry.label, *sorted(person.key for person in entry.people))
    return hashlib.sha256(repr(said).encode()).hexdigest()[:6]
