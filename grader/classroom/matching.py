"""Match the submissions of an export with the people of a roster, and say by what, or why not."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader.classroom.class_folder import Doubt, DoubtKind, Entry, too_many
from grader.classroom.identity import SHORT, Claim, Identified, identify, is_no_team
from grader.classroom.platform import Export, HandIn, is_archive
from grader.classroom.roster import IDENTITY, Person
from grader.words import some

GO_ON = "--despite-doubts"
"""The option that grades a class in spite of a doubt that stops it."""
_BY_NAME = ("name", SHORT)
_SHOWN = 10
_OF_A_PACKAGE = ("package.xml", "CMakeLists.txt")


@dataclass(frozen=True)
class Match:
    """Whose a submission is: its people, each with what decided, and those of its submitters who are not known."""

    hand_in: HandIn
    people: Mapping[Person, Claim]
    unknown: tuple[Identified, ...] = ()

    @property
    def account(self) -> Claim:
        """Return the platform's number for who handed in; its value is "" if there is none."""
        sure = self.people or not self.hand_in.others
        claims = (claim for person in self.hand_in.claims for claim in person if sure)
        return next((claim for claim in claims if claim.kind == "lms_id"), Claim("lms_id", ""))


def match(hand_ins: Sequence[HandIn], roster: Sequence[Person]) -> list[Match]:
    """Return whose each submission is: people of the roster with all their team, or whom the export itself names."""
    taken = {claim for hand_in in hand_ins if not hand_in.others for claim in _numbers(hand_in.claims)}
    if not roster:
        return [Match(h, {}, (_several(h),)) if h.others else Match(h, _claimed(h)) for h in hand_ins]
    found = [_match_one_way(each, roster, taken) if each.others else _match(each, roster) for each in hand_ins]
    matches = _without_namesakes(found)
    teams = [{person.team for person in each.people if person.team} for each in matches]
    members = [{who: Claim("team", who.team) for who in roster if who.team in of} for of in teams]
    return [replace(each, people={**of, **each.people}) for each, of in zip(matches, members, strict=True)]


def _match_one_way(hand_in: HandIn, roster: Sequence[Person], taken: Container[Claim]) -> Match:
    """Return the match of an entry whose name can be read in several ways: the only one that fits somebody.

    The number of a person who handed in under a name that can be read in one way is `taken`.
    """
    ways = [replace(hand_in, claims=(claims,)) for claims in (*hand_in.claims, *hand_in.others)]
    fits = [found for way in ways if (found := _match(way, roster)).people]
    if len(fits) == 1 and not any(claim in taken for claim in _numbers(fits[0].hand_in.claims)):
        return fits[0]
    if not fits:
        return _match(replace(hand_in, others=()), roster)
    return Match(hand_in, {}, (_several(hand_in, [person for found in fits for person in found.people]),))


def _several(hand_in: HandIn, rivals: Sequence[Person] = ()) -> Identified:
    numbers = " or ".join(claim.text for claim in _numbers((*hand_in.claims, *hand_in.others)))
    why = f"{hand_in.path.name} can be read in {1 + len(hand_in.others)} ways, as that of {numbers}"
    return Identified(rivals=tuple(dict.fromkeys(rivals)), why=why)


def _numbers(claims: Iterable[Iterable[Claim]]) -> list[Claim]:
    return [claim for person in claims for claim in person if claim.kind == "lms_id"]


def doubts(found: Match, entry: str, missing: Sequence[Person]) -> list[Doubt]:
    """Return what is doubtful about whose a submission is, which has the id `entry` in the class.

    A submission that matches nobody may be that of anyone without one, unless their numbers say otherwise.
    """
    own = found.account
    anyone = any(not person.lms_id or not own.value or person.lms != own.lms for person in missing)
    whole = [_doubt(found.hand_in.label, unknown, entry, bool(found.people)) for unknown in found.unknown]
    stops = bool(found.hand_in.others)
    return [replace(doubt, anyone=anyone and not doubt.people, stops=stops) for doubt in whole]


def class_doubts(exports: Sequence[Export], entries: Sequence[Entry], roster: Sequence[Person]) -> Iterator[Doubt]:
    """Yield what is doubtful about the exports as a whole, and about entries that hold no package."""
    unmatched = [entry for entry in entries if not entry.people]
    layouts = ", ".join(dict.fromkeys(export.layout for export in exports))
    if roster and too_many(unmatched, entries):
        yield Doubt(
            DoubtKind.MOST_UNMATCHED,
            layouts,
            f"{len(unmatched)} of {len(entries)} submissions fit nobody of the roster "
            f"(layout: {layouts}): {some(sorted(entry.label for entry in unmatched), _SHOWN)}.",
            "Is it the roster of this class, and has it the numbers of this assignment? "
            f"Go on with {GO_ON} if it is; who is not matched gets a line of their own.",
            stops=True,
        )
    groups = [] if roster else [name for export in exports for each in export.hand_ins if (name := _group(each))]
    if groups and (too_many(groups, entries) or any(map(is_no_team, groups))):
        yield Doubt(
            DoubtKind.GROUPS,
            layouts,
            f"{len(groups)} of {len(entries)} submissions have names of groups, so no grade reaches a person: "
            f"{some(sorted(groups), _SHOWN)}.",
            "If they are groups, give a roster with a column team, such as the grading worksheet.",
        )
    for entry in entries:
        if _is_text(entry.path):
            yield Doubt(
                DoubtKind.LEFT_OUT,
                entry.label,
                f"{entry.label} handed in {entry.path.name}, which holds neither a package nor an archive.",
                "Ask for the package, or decide: in overrides.yaml, "
                f"submissions: {{{entry.id}: {{adjust: {{total: 0, why: ..., by: ...}}}}}}.",
                entry.id,
            )


def _group(hand_in: HandIn) -> str:
    """Return the name of a submission if it looks like that of a group where a person's may be, else ""."""
    claims = {claim.kind: claim.value for person in hand_in.claims for claim in person}
    name = claims.get("team", "") if claims.keys() & {"name", SHORT} else ""
    return name if name[-1:].isdecimal() or is_no_team(name) else ""


def unmatched(entry: Entry) -> Doubt:
    """Return the doubt about an entry of an earlier run that matched nobody then."""
    return _doubt(entry.label, Identified(), entry.id, others=False)


def _match(hand_in: HandIn, roster: Sequence[Person]) -> Match:
    found = [identify(claims, roster) for claims in hand_in.claims]
    people = {person: each.by for each in found if each.by is not None for person in each.people}
    nobody = () if hand_in.claims else (Identified(),)
    return Match(hand_in, people, (*nobody, *(each for each in found if not each.people)))


def _without_namesakes(found: list[Match]) -> list[Match]:
    """Take a person from all submissions that have only the name in common with them, if several accounts have it."""
    accounts: dict[Person, set[str]] = {}
    for each in found:
        for person, by in each.people.items():
            if by.kind in _BY_NAME and each.account.value:
                accounts.setdefault(person, set()).add(each.account.value)
    several = {person: " and ".join(sorted(of)) for person, of in accounts.items() if len(of) > 1}
    matches = []
    for each in found:
        refused = [who for who, by in each.people.items() if who in several and by.kind in _BY_NAME]
        why = (f"accounts {several[who]} have the name of {who.label}" for who in refused)
        unknown = (Identified(rivals=(who,), why=said) for who, said in zip(refused, why, strict=True))
        people = {who: by for who, by in each.people.items() if who not in refused}
        matches.append(replace(each, people=people, unknown=(*each.unknown, *unknown)))
    return matches


def _claimed(hand_in: HandIn) -> dict[Person, Claim]:
    """Return the people whom the claims describe, for a class without a roster; none for a name alone."""
    found = {}
    for claims in hand_in.claims:
        known = {claim.kind: claim for claim in reversed(claims)}
        surest = next((known[kind] for kind in ("lms_id", *IDENTITY) if kind in known), None)
        if surest is not None and ("team" not in known or surest.kind == "lms_id"):
            name = known.get("name", known.get(SHORT, Claim("", ""))).value
            identity = {kind: known[kind].value for kind in IDENTITY if kind in known}
            found[Person(**identity, name=name, lms=surest.lms)] = surest
    return found


def _doubt(label: str, unknown: Identified, entry: str, others: bool) -> Doubt:
    rivals = unknown.rivals
    names = " or ".join(f"{kind} {value}" if kind != "name" else value for kind, value in (who.key for who in rivals))
    assign = f"write into overrides.yaml: submissions: {{{entry}: {{people: [ID]}}}}."
    if unknown.why:
        kind, what = DoubtKind.AMBIGUOUS, f"{label} is not certain: {unknown.why}."
        todo = f"If it is that of {names or 'one of them'}, {assign}"
    elif rivals:
        kind, what = DoubtKind.UNMATCHED, f"{label} fits nobody of the roster; the name resembles {names}."
        todo = f"If it is theirs, {assign}"
    else:
        kind, what = DoubtKind.UNMATCHED, f"{label} fits nobody of the roster."
        todo = f"Add the person to the roster, or {assign}"
    if others:
        what = what.replace(label, f"One of the people of {label}", 1)
    return Doubt(kind, label, what, todo, entry, rivals)


def _is_text(path: Path) -> bool:
    """Return whether somebody handed in words: one file that is no archive, or a folder without code and archives."""
    if not path.is_dir():
        return path.is_file() and not is_archive(path)
    try:
        files = [file for file in path.rglob("*") if file.is_file() and ".git" not in file.relative_to(path).parts]
    except OSError:
        return False
    return bool(files) and not any(
        is_archive(file) or file.suffix == ".py" or file.name in _OF_A_PACKAGE for file in files
    )
