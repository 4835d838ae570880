"""Find the one person of a class whom an export, a sheet or a decision means.

A platform's own number comes first, then id, e-mail and login, then the exact name. What contradicts itself, and a
name that several people have, means none of them: it is refused, with everyone whom it may mean. The order of the
people decides nothing.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

from grader.classroom.roster import Person, first_name_first

ANY, SHORT = "any", "short name"
"""Kinds of claims beside the fields of Person: one of them all, and Canvas's name of a person in a file's name."""

_UNIQUE = ("lms_id", "id", "email", "login")  # the surest first
_SHORTEST_LOGIN = 3  # a shorter word may be anything
_CALLED = {"lms_id": "number", "email": "e-mail", "overrides": "a decision in"}
# What Moodle calls the people without a group, in its language packs (string defaultteam of mod_assign).
_NO_TEAM = (
    "Default group", "Standard-Gruppe", "Groupe par d\u00e9faut", "Grupo predeterminado", "Gruppo di default",
    "Grupo predefinido", "Standaard groep", "Grup per defecte", "Talde lehenetsia",
)  # fmt: skip
# Apostrophes, which many leave out or write otherwise, and what Moodle takes out of a file's name (PARAM_FILE).
_DROPPED = str.maketrans("", "", "'`\u00b4\u2018\u2019\u02bc\u02b9\u2032\uff07" + '&<>"|:\\/')
_SPACE, _TEAM_SPACE = re.compile(r"[\s_]+"), re.compile(r"[\s_-]+")
_WORD = ("L", "M", "Nd", "Pc")  # [[:word:]] in Ruby, which is all that Canvas keeps of a name


@dataclass(frozen=True)
class Claim:
    """Something that is said of one person: `kind` is a field of Person, ANY or SHORT; `lms` gave a number."""

    kind: str
    value: str
    lms: str = ""

    @property
    def means(self) -> str:
        """Return the kind in words, such as "Canvas's number"."""
        whose = f"{self.lms.capitalize()}'s " if self.lms else ""
        return f"{whose}{_CALLED.get(self.kind, self.kind)}"

    @property
    def text(self) -> str:
        """Return the claim for people, such as "Canvas's number 123"."""
        return f"{self.means} {self.value}"


@dataclass(frozen=True)
class Identified:
    """Whom claims mean.

    Attributes:
        people: one person, or the members of a team; empty if that is not certain.
        by: the claim that decided.
        rivals: everyone whom it may be, where that is not certain.
        why: the reason why it is not certain, "" if nothing fits at all.
    """

    people: tuple[Person, ...] = ()
    by: Claim | None = None
    rivals: tuple[Person, ...] = ()
    why: str = ""


def identify(claims: Sequence[Claim], people: Sequence[Person]) -> Identified:
    """Return whom the claims mean; all of them are about one person, or about one team."""
    sure = _sure(claims, people)
    called = {person: claim for person in people for claim in claims if _is_called(person, claim)}
    if len(called) > 1:  # Weiss and Weiß: no platform changes other letters than capitals
        exactly = [who for who, c in called.items() if not Counter(_letters(who.name)) - Counter(_letters(c.value))]
        called = {who: called[who] for who in exactly} or called
    teams, team = _team(claims, people)
    if len(sure) > 1:
        return _refused(sure, " and ".join(sorted(f"{claim.text} is {who.label}'s" for who, claim in sure.items())))
    for person, claim in sure.items():
        own_name = person in called or any(_agrees(person, other) for other in claims)
        if called and person not in called:
            return _refused((person, *called), f"{claim.text} is {person.label}'s, but the name is not")
        if person in team or (own_name and not team) or (not team and not _needs_name(person, claim, claims)):
            return Identified((person,), claim)
        if not team or own_name or claim.kind != "lms_id" or _is_permanent(person, claim):
            other = f"the team {teams[0]} is without them" if team else "the name is not"
            return _refused((person, *team), f"{claim.text} is {person.label}'s, but {other}")
    if len(called) > 1:
        return _refused(called, f"{len(called)} people of the class have this name")
    for person, claim in called.items():
        if team and person not in team:
            return _refused((person, *team), f"it names {person.label} and the team {teams[0]}")
        if wrong := next((other for other in claims if _contradicts(person, other)), None):
            zeros = _but_for_zeros(person, wrong)
            return _refused([person], f"the name is {person.label}'s, but {wrong.text} is {zeros or 'not'}")
        return Identified((person,), claim)
    if len(teams) > 1:
        return _refused(team, f"the teams {' and '.join(teams)} have this name")
    if team:
        return Identified(team, next(claim for claim in claims if _team([claim], people)[1]))
    shortened = {who: claim for who in people for claim in claims if _but_for_zeros(who, claim)}
    if shortened:
        said = (f"{claim.value} is {who.label}'s {_but_for_zeros(who, claim)}" for who, claim in shortened.items())
        return _refused(shortened, " and ".join(sorted(said)))
    if logins := _logins(claims, people):
        ((login, who),) = logins.items()
        return _refused([who], f"its name fits nobody of the roster, but has the login {login} of {who.label} in it")
    return _refused(who for who in people if any(_resembles(who, claim) for claim in claims))


def is_no_team(name: str) -> bool:
    """Return whether Moodle calls the people so who are in no group."""
    return key(name) in map(key, _NO_TEAM)


@cache  # a class compares each claim with everyone
def key(text: str) -> str:
    """Return a name in the form in which names are compared: all letters of every script, without apostrophes."""
    return _SPACE.sub(" ", _plain(first_name_first(text).replace(",", " ")).translate(_DROPPED)).strip()


def _sure(claims: Sequence[Claim], people: Sequence[Person]) -> dict[Person, Claim]:
    """Return everyone whom a number, an id, an e-mail or a login means, each with the surest of them."""
    return {
        person: Claim(kind, claim.value, claim.lms)
        for kind in reversed(_UNIQUE)
        for claim in reversed(claims)
        for person in people
        if claim.kind in (kind, ANY) and _has(person, kind, claim)
    }


def _has(person: Person, kind: str, claim: Claim) -> bool:
    own = getattr(person, kind)
    return bool(own) and _plain(own) == _plain(claim.value) and (kind != "lms_id" or _same_lms(person, claim))


def _same_lms(person: Person, claim: Claim) -> bool:
    return not claim.lms or person.lms in ("", claim.lms)


def _is_permanent(person: Person, claim: Claim) -> bool:
    """Return whether a number is one person's for ever: Canvas's is, Moodle gives others for each assignment."""
    return claim.kind != "lms_id" or person.lms == claim.lms == "canvas"


def _needs_name(person: Person, claim: Claim, claims: Iterable[Claim]) -> bool:
    """Return whether a number alone is not enough, because there are two names that could be compared."""
    named = any(other.kind in ("name", SHORT) for other in claims)
    return named and bool(person.name) and not _is_permanent(person, claim)


def _contradicts(person: Person, claim: Claim) -> bool:
    """Return whether the person has another number, id, e-mail or login than the claim says."""
    own = getattr(person, claim.kind) if claim.kind in _UNIQUE else ""
    return bool(own) and not _has(person, claim.kind, claim) and (claim.kind != "lms_id" or _same_lms(person, claim))


def _but_for_zeros(person: Person, claim: Claim) -> str:
    """Return the id or login that is the claim's but for zeros at the beginning, which spreadsheets take away."""
    said = _plain(claim.value)
    for kind in ("id", "login"):
        own = getattr(person, kind)
        if claim.kind in (kind, ANY) and _plain(own) != said and _plain(own).lstrip("0") == said.lstrip("0") != "":
            return f"{kind} {own} but for zeros at its beginning"
    return ""


def _logins(claims: Iterable[Claim], people: Iterable[Person]) -> dict[str, Person]:
    """Return the one login that is a word of a file's name, with its owner; nothing if there are several."""
    names = [_plain(claim.value) for claim in claims if claim.kind == ANY]
    found = {
        who.login: who
        for who in people
        if len(who.login) >= _SHORTEST_LOGIN
        and any(re.search(rf"(?<![^\W_]){re.escape(_plain(who.login))}(?![^\W_])", name) for name in names)
    }
    return found if len(found) == 1 else {}


def _is_called(person: Person, claim: Claim) -> bool:
    """Return whether the claim is the person's whole name; Moodle writes that of their group before it."""
    if not person.name or claim.kind not in ("name", ANY, SHORT):
        return False
    if claim.kind == SHORT:
        first, _, last = person.name.strip().rpartition(" ")
        return _squeezed(person.sortable or last + first) == _squeezed(claim.value)
    names = (person.name, *(f"{group}-{person.name}" for group in ((person.team,) if person.team else _NO_TEAM)))
    return key(claim.value) in map(key, names)


def _agrees(person: Person, claim: Claim) -> bool:
    """Return whether a name may be that of a person whom a number means: a group may stand before it."""
    if claim.kind == SHORT:
        return _resembles(person, claim)
    if claim.kind != "name" or not person.name:
        return False
    said, own = key(claim.value), key(person.name)
    return said == own or said.endswith(f"-{own}") or own.endswith(f"-{said}")


def _team(claims: Sequence[Claim], people: Sequence[Person]) -> tuple[list[str], tuple[Person, ...]]:
    """Return the teams that the claims name, and everyone in them."""
    said = {_team_key(claim.value) for claim in claims if claim.kind == "team"}
    found = tuple(person for person in people if person.team and _team_key(person.team) in said)
    return sorted({person.team for person in found}), found


def _team_key(text: str) -> str:
    return _TEAM_SPACE.sub(" ", key(text.replace(",", " "))).strip()


def _resembles(person: Person, claim: Claim) -> bool:
    """Return whether a name is so like the person's that a human should look: its words in another order."""
    own, said = _words(person.name), _words(claim.value)
    if claim.kind == SHORT:
        return _squeezed(claim.value) in (_squeezed("".join(own[n:] + own[:n])) for n in range(len(own)))
    named = claim.kind in ("name", ANY) and own
    return bool(named) and sorted(own) in (sorted(said), sorted(said[-len(own) :]))


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[\s,._-]+", key(text.replace(",", " "))) if word]


def _squeezed(text: str) -> str:
    return _plain(_letters(text))


def _letters(text: str) -> str:
    """Return the letters of a name, as Canvas keeps them."""
    return "".join(c for c in unicodedata.normalize("NFC", text.lower()) if unicodedata.category(c).startswith(_WORD))


def _plain(text: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).strip().casefold())


def _refused(rivals: Iterable[Person], why: str = "") -> Identified:
    return Identified(rivals=tuple(sorted(dict.fromkeys(rivals), key=lambda person: person.key)), why=why)
