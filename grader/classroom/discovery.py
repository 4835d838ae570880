"""From a source, a folder or an archive, to the entries of a class: who handed in what, when. Nothing is run."""

from __future__ import annotations

import datetime as dt
import hashlib
import itertools
import os
import re
import unicodedata
from collections.abc import Hashable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.classroom import commit_time, platforms, retention
from grader.classroom.doubt import Doubt, DoubtKind
from grader.classroom.entry import Entry, MatchedBy
from grader.classroom.platform import Claim, HandIn, claims_of
from grader.classroom.roster import IDENTITY, Person
from grader.errors import GraderError
from grader.host import tempdir
from grader.intake.copy_plan import MB, SizeLimits
from grader.intake.unpack import unpack

# An export of 300 submissions of the largest size that intake takes.
EXPORT_LIMITS = SizeLimits(total_bytes=15_000 * MB, file_bytes=2_000 * MB, files=1_000_000, ratio=1_000_000)

_SLUG = re.compile(r"[^a-z0-9]+")
_SHORT = 60
_APOSTROPHE = re.compile("['`\u2018\u2019\u02bc]")
_BETWEEN_WORDS = re.compile(r"[\s,._-]+")


@dataclass(frozen=True)
class Found:
    """All that was found in a source.

    Attributes:
        layout: the name of the export's layout.
        entries: the submissions that count.
        missing: the people of the roster without a submission, also those whose submission is in doubt.
        notes: remarks on the export.
        doubts: what a person should look at before anything is graded.
    """

    layout: str
    entries: tuple[Entry, ...]
    missing: tuple[Person, ...] = ()
    notes: tuple[str, ...] = field(default=())
    doubts: tuple[Doubt, ...] = ()

    def require_certain(self) -> None:
        """Refuse to go on where a doubt stops the class.

        Raises:
            DoubtfulClass: with all that stops it, and what to do.
        """
        if stops := [doubt for doubt in self.doubts if doubt.stops]:
            raise DoubtfulClass("\n".join(doubt.text for doubt in stops))


class DoubtfulClass(GraderError):
    """Whose submissions these are is so doubtful that nothing was graded."""


@contextmanager
def opened(source: Path) -> Iterator[Path]:
    """Yield the folder with a class's submissions; an archive is unpacked into a temporary one.

    Raises:
        GraderError: there is no such source, or it cannot be opened.
        SubmissionError: the archive is damaged or too large.
    """
    if source.is_dir():
        yield source
    elif source.is_file():
        with tempdir.folder("class") as folder:
            unpack(source, folder / "export", EXPORT_LIMITS)
            yield folder / "export"
    else:
        raise GraderError(f"There is no {source}. Name the folder or the archive with the class's submissions.")


def find(root: Path, roster: Sequence[Person] = (), earlier: Sequence[Entry] = (), added: Sequence[Path] = ()) -> Found:
    """Return the submissions in the folder `root` and in those `added` to it, each with its people.

    Those of an `earlier` run keep their ids, and stay if they are in none of the folders any more. Of several
    submissions of one team the latest counts, if the export gives the times; the others are left out with a note.
    Otherwise all of them are entries.

    Raises:
        GraderError: there is no submission.
    """
    exports = [platforms.read(each) for each in (root, *added)]
    notes = [note for export in exports for note in export.notes]
    drafts = [_draft(hand_in, roster) for export in exports for hand_in in export.hand_ins]
    stay = retention.retained(earlier, drafts, roster)
    drafts, left_out = _latest(drafts)
    entries = tuple(sorted((*_named(drafts, earlier, stay), *stay), key=lambda entry: entry.id))
    doubts = [_unmatched(entry) for entry in entries if roster and not entry.people]
    notes += [doubt.what for doubt in doubts]
    handed_in = {person.key for entry in entries for person in entry.people}
    missing = tuple(person for person in roster if person.key not in handed_in)
    return Found(exports[0].layout, entries, missing, (*notes, *left_out), tuple(doubts))


def _unmatched(entry: Entry) -> Doubt:
    return Doubt(
        DoubtKind.UNMATCHED,
        entry.label,
        f"{entry.label} fits nobody of the roster; it is graded as {entry.id}.",
        f"Add the person to the roster, or write into overrides.yaml: submissions: {entry.id}: people: [ID].",
        entry.id,
    )


def content_hash(path: Path) -> str:
    """Return the SHA-256 of an archive's bytes, or of a folder's paths, bytes and `chmod +x`, without git history."""
    digest = hashlib.sha256()
    if path.is_dir():
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
    else:
        with path.open("rb") as stream:
            while block := stream.read(MB):
                digest.update(block)
    return digest.hexdigest()


def slug(text: str) -> str:
    """Return `text` as lower case letters, digits and hyphens, "submission" if nothing is left of it."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().lower()
    return _SLUG.sub("-", plain).strip("-")[:_SHORT].rstrip("-") or "submission"


def _draft(hand_in: HandIn, roster: Sequence[Person]) -> Entry:
    matched: dict[Person, MatchedBy] = {}
    for claims in hand_in.claims:
        for person in _match(claims, roster) if roster else _claimed(claims):
            matched.setdefault(person, MatchedBy(claims[0].kind, claims[0].value))
    teams = {person.team for person in matched if person.team}
    for person in roster:
        if person.team in teams:
            matched.setdefault(person, MatchedBy("team", person.team))
    submitted = commit_time.last_commit(hand_in.path) if hand_in.repository else hand_in.submitted
    return Entry(
        id="",
        label=hand_in.label,
        path=hand_in.path,
        content=content_hash(hand_in.path),
        people=tuple(matched),
        matched=tuple(matched.values()),
        submitted=submitted,
        late=hand_in.late,
        number=next((claim.value for claim in claims_of(hand_in) if claim.kind == "lms_id"), ""),
    )


def _match(claims: Iterable[Claim], roster: Sequence[Person]) -> list[Person]:
    """Return the people whom the first fitting claim names: one person, or a team's members."""
    for claim in claims:
        kinds = ("team", "id", "login", "email", "name", "lms_id") if claim.kind == "any" else (claim.kind,)
        for kind in kinds:
            fits = [person for person in roster if _fits(person, kind, claim.value)]
            if len(fits) == 1 or (fits and kind == "team"):
                return fits
    return []


def _fits(person: Person, kind: str, value: str) -> bool:
    if kind == "joined name":  # Canvas: "doejane" for Jane Doe
        words = slug(person.name).split("-")
        return "".join([*words[-1:], *words[:-1]]) == slug(value).replace("-", "")
    own = getattr(person, kind)
    return bool(own) and (
        own.casefold() == value.casefold() or (kind in ("name", "team") and _words(own) == _words(value))
    )


def _words(text: str) -> list[str]:
    """Return the words of a name in any script, sorted, since some write the last name first; no apostrophes."""
    letters = _APOSTROPHE.sub("", unicodedata.normalize("NFC", text).casefold())
    return sorted(filter(None, _BETWEEN_WORDS.split(letters)))


def _claimed(claims: Iterable[Claim]) -> list[Person]:
    """Return the person whom the claims describe, for a class without a roster; none for a name alone."""
    known = {claim.kind: claim.value for claim in reversed(list(claims))}
    kinds = ("lms_id",) if "lms_id" in known else IDENTITY  # beside its number, Moodle's "id" and "team" are guesses
    identity = {kind: known[kind] for kind in kinds if kind in known}
    name = known.get("name") or known.get("joined name", "")
    return [Person(**identity, name=name)] if identity else []


def _latest(drafts: list[Entry]) -> tuple[list[Entry], list[str]]:
    """Leave of each team's submissions only the latest, where the times tell; return them and what was left out."""
    groups: dict[Hashable, list[Entry]] = {}
    for number, draft in enumerate(drafts):
        team = next((person.team for person in draft.people if person.team), "")
        who: Hashable = ("team", team) if team else tuple(person.key for person in draft.people) or number
        groups.setdefault(who, []).append(draft)
    kept, notes = [], []
    for several in groups.values():
        times = [draft.submitted for draft in several if draft.submitted is not None]
        if len(several) == 1:
            kept += several
        elif len({draft.content for draft in several}) == 1 or len(times) == len(several):
            last = max(several, key=lambda draft: draft.submitted or dt.datetime.min.replace(tzinfo=dt.UTC))
            others = [draft.label for draft in several if draft is not last]
            kept.append(replace(last, notes=(f"The latest of {len(several)} submissions; not: {', '.join(others)}.",)))
            notes.append(f"{last.label} is graded for its team, not {', '.join(others)}: earlier, or the same.")
        else:
            note = f"One of {len(several)} submissions of the same people; the gradebook takes the best."
            kept += [replace(draft, notes=(note,)) for draft in several]
    return kept, notes


def _named(drafts: Sequence[Entry], earlier: Sequence[Entry], stay: Sequence[Entry]) -> Iterator[Entry]:
    """Give each entry an id that no other has: its team's, its person's or its label's.

    An entry of an `earlier` run keeps its id, so that results and decisions stay with it, as do those that `stay`.
    Where several would have one id, each of them has its mark appended: no order decides who is who.
    """
    kept = {(entry.label, _mark(entry)): entry.id for entry in earlier}
    ids: list[str] = []
    wanted = [_wanted(draft) for draft in drafts]
    taken = {name for draft in drafts if (name := kept.get((draft.label, _mark(draft))))} | {each.id for each in stay}
    for draft, name in zip(drafts, wanted, strict=True):
        marked = f"{name}-{_mark(draft)}"
        choices = (
            choice
            for choice in itertools.chain([name], [marked], (f"{marked}-{number}" for number in itertools.count(2)))
            if choice not in taken and wanted.count(choice) <= (choice == name)
        )
        before = kept.pop((draft.label, _mark(draft)), "")
        ids.append(before or next(choices))
        taken.add(ids[-1])
    return (replace(draft, id=name) for draft, name in zip(drafts, ids, strict=True))


def _wanted(draft: Entry) -> str:
    teams = {person.team for person in draft.people if person.team}
    one = draft.people[0] if len(draft.people) == 1 else None
    return slug(next(iter(teams)) if len(teams) == 1 else (one.login or one.id or one.name) if one else draft.label)


def _mark(entry: Entry) -> str:
    """Return what tells a submission from others of one name: the platform's number, its label, or a hash."""
    if entry.number or slug(entry.label) != _wanted(entry):
        return slug(entry.number or entry.label)
    said = (entry.label, *sorted(person.key for person in entry.people))
    return hashlib.sha256(repr(said).encode()).hexdigest()[:6]
