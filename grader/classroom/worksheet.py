"""Moodle's offline grading worksheet in English or German: which column says what, and when something was handed in.

Moodle translates the header, the word before a participant's number and the times (mod/assign/gradingtable.php). The
words here are those of the language packs of Moodle 4.5; what stands first is in the same place in both of them.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Mapping, Sequence

# The strings recordid, lastmodifiedsubmission and lastmodifiedgrade of mod_assign; the others are of Moodle's core.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "identifier": ("identifier", "id"),
    "name": ("full name", "vollständiger name"),
    "submitted": ("last modified (submission)", "zuletzt geändert (abgabe)"),
    "modified": ("last modified (grade)", "zuletzt geändert (bewertung)"),
    "id": ("id number", "id-nummer", "matrikelnummer"),
    "email": ("email address", "e-mail-adresse"),
    "login": ("username", "anmeldename"),
    "team": ("group", "gruppe"),
    "grade": ("grade", "bewertung"),
    "maximum": ("maximum grade", "bestwertung"),
    "feedback": ("feedback comments", "feedback als kommentar"),
}
# The string submissionstatus_submitted of mod_assign; a state is followed by that of the grading.
HANDED_IN = ("submitted for grading", "zur bewertung abgegeben")
NOT_HANDED_IN = ("no submission", "keine abgabe")  # there may be a time, of a page that was only opened
PARTICIPANTS = ("Participant", "Teilnehmer/in")
"""What a participant is called whose name is hidden (the strings participant and hiddenuser)."""
_PARTICIPANT = re.compile(r"(?P<word>.*\D)\s?(?P<number>\d+)", re.DOTALL)
_MONTHS = (
    {"january", "januar"}, {"february", "februar"}, {"march", "märz"}, {"april"}, {"may", "mai"}, {"june", "juni"},
    {"july", "juli"}, {"august"}, {"september"}, {"october", "oktober"}, {"november"}, {"december", "dezember"},
)  # fmt: skip
_CLOCK = re.compile(r"(?P<hour>\d{1,2})[:.h](?P<minute>\d{2})(?::\d{2})?\s*(?P<half>[ap]\.?\s?m\b)?", re.IGNORECASE)


def columns(header: Sequence[str]) -> dict[str, int] | None:
    """Return the places of a worksheet's columns by what they hold, None if the header is not a worksheet's."""
    lowered = [cell.strip().casefold() for cell in header]
    found = {
        what: next(place for place, word in enumerate(lowered) if word in words)
        for what, words in _WORDS.items()
        if not set(words).isdisjoint(lowered)
    }
    trimmed = lowered[0] != "id" and "name" in found
    if found.get("identifier") != 0 or not ("modified" in found or trimmed):
        return None
    if place := next((place for place, word in enumerate(lowered) if word == "status"), None):
        found["status"] = place
    if len(header) > 1 and 1 not in found.values() and lowered[1] != "status":
        found.setdefault("name", 1)  # there is no name where submissions are anonymous
    return found


def participant(cell: str) -> str:
    """Return the number of "Participant 12345" or "Teilnehmer/in12345", "" if there is none."""
    found = _PARTICIPANT.fullmatch(cell.strip())
    return found["number"] if found else cell.strip() if cell.strip().isdecimal() else ""


def time(text: str) -> dt.datetime | None:
    """Return a time as Moodle writes it for people, in the time zone of this machine; None if it cannot be read."""
    clock = _CLOCK.search(text)
    if clock is None:
        return None
    date = text[: clock.start()] + " " + text[clock.end() :]
    words = {word.casefold() for word in re.findall(r"[^\W\d_]+", date)}
    months = [number for number, names in enumerate(_MONTHS, 1) if names & words]
    numbers = [int(number) for number in re.findall(r"\d+", date)]
    if len(months) != 1 or len(numbers) != 2:
        return None
    hour, half = int(clock["hour"]), (clock["half"] or "").lower()
    hour = hour % 12 + 12 * half.startswith("p") if half else hour
    try:
        return dt.datetime(max(numbers), months[0], min(numbers), hour, int(clock["minute"])).astimezone()
    except ValueError:
        return None
