"""Moodle's offline grading worksheet in any language: which column says what, and when something was handed in.

Moodle translates the header, the word before a participant's number and the times (mod/assign/gradingtable.php). The
words here are those of the language packs of Moodle 4.5; what stands first is in the same place in all of them.
"""

from __future__ import annotations

import datetime as dt
import functools
import re
from collections.abc import Mapping, Sequence

from babel import Locale

# The strings recordid, lastmodifiedsubmission and lastmodifiedgrade of mod_assign; the others are of Moodle's core.
_WORDS: Mapping[str, tuple[str, ...]] = {
    "identifier": (
        "identifier", "id", "identifiant", "identificador", "identificativo", "identificatie", "identifikatzailea",
    ),
    "name": (
        "full name", "vollst\u00e4ndiger name", "nom complet", "nombre completo", "nome completo", "volledige naam",
        "izen osoa",
    ),
    "submitted": (
        "last modified (submission)", "zuletzt ge\u00e4ndert (abgabe)", "derni\u00e8re modification (travail remis)",
        "\u00faltima modificaci\u00f3n (entrega)", "fecha de entrega", "ultima modifica (consegna)",
        "\u00faltima atualiza\u00e7\u00e3o (submiss\u00e3o)", "\u00faltima modifica\u00e7\u00e3o (envio)",
        "laatst gewijzigd (inzending)", "darrera modificaci\u00f3 (tramesa)", "azken aldaketa (bidalketa)",
    ),
    "modified": (
        "last modified (grade)", "zuletzt ge\u00e4ndert (bewertung)", "derni\u00e8re modification (note)",
        "\u00faltima modificaci\u00f3n (calificaci\u00f3n)", "fecha de calificaci\u00f3n",
        "ultima modifica (valutazione)", "\u00faltima atualiza\u00e7\u00e3o (avalia\u00e7\u00e3o)",
        "\u00faltima modifica\u00e7\u00e3o (nota)", "laatst gewijzigd (beoordeling)",
        "darrera modificaci\u00f3 (qualificaci\u00f3)", "azken aldaketa (kalifikazioa)",
        "\u00faltima modificaci\u00f3n (cualificaci\u00f3n)",
    ),
    "id": (
        "id number", "id-nummer", "matrikelnummer", "num\u00e9ro d\u2019identification", "n\u00famero de id",
        "codice identificativo", "n\u00famero de identifica\u00e7\u00e3o (id)", "nummer (id)", "n\u00famero id",
        "id zenbakia",
    ),
    "email": (
        "email address", "e-mail-adresse", "adresse de courriel", "direcci\u00f3n de correo", "indirizzo email",
        "e-mail", "e-mailadres", "adre\u00e7a electr\u00f2nica", "helbide elektronikoa", "enderezo de correo",
    ),
    "login": (
        "username", "anmeldename", "nom d\u2019utilisateur", "nombre de usuario", "nome de utilizador",
        "gebruikersnaam", "nom d'usuari", "erabiltzaile-izena", "nome de usuario",
    ),
    "team": ("group", "gruppe", "groupe", "grupo", "gruppo", "groep", "grup", "taldea"),
    "grade": (
        "grade", "bewertung", "note", "calificaci\u00f3n", "valutazione", "avalia\u00e7\u00e3o", "cijfer",
        "qualificaci\u00f3", "kalifikazioa", "cualificaci\u00f3n",
    ),
    "maximum": (
        "maximum grade", "bestwertung", "note maximale", "calificaci\u00f3n m\u00e1xima", "valutazione massima",
        "nota m\u00e1xima", "maximaal cijfer", "qualificaci\u00f3 m\u00e0xima", "gehieneko kalifikazioa",
        "cualificaci\u00f3n m\u00e1xima",
    ),
    "feedback": (
        "feedback comments", "feedback als kommentar", "feedback par commentaires", "commenti", "feedback tekstvak",
        "comentarios de retroalimentaci\u00f3n", "coment\u00e1rios de feedback", "comentaris de retroacci\u00f3.",
        "feedback-iruzkinak", "comentarios",
    ),
}  # fmt: skip
# The string submissionstatus_submitted of mod_assign; a state is followed by that of the grading.
HANDED_IN = (
    "submitted for grading", "zur bewertung abgegeben", "remis pour \u00e9valuation", "enviado para calificar",
    "consegnato per la valutazione", "enviado para avalia\u00e7\u00e3o", "ingezonden voor beoordeling",
)  # fmt: skip
NOT_HANDED_IN = ("no submission", "keine abgabe")  # there may be a time, of a page that was only opened
_STATUS = ("status", "statut", "estado", "stato", "estat", "egoera")
PARTICIPANTS = (
    "Participant", "Teilnehmer/in", "Participante", "Partecipante", "Deelnemer", "Partaidea",
)  # fmt: skip
"""What a participant is called whose name is hidden (the strings participant and hiddenuser)."""
_PARTICIPANT = re.compile(r"(?P<word>.*\D)\s?(?P<number>\d+)", re.DOTALL)
# The languages of Europe in which months are called by names; others write them as numbers, year first.
_LANGUAGES = (
    "bg", "ca", "cs", "da", "de", "el", "en", "es", "et", "fi", "fr", "gl", "hr", "hu", "id", "it", "lt", "lv", "nb",
    "nl", "pl", "pt", "ro", "ru", "sk", "sl", "sv", "tr", "uk",
)  # fmt: skip
_MOST_MEANINGS = 3  # a word for more months is a preposition, as "de" in Catalan
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
    if place := next((place for place, word in enumerate(lowered) if word in _STATUS), None):
        found["status"] = place
    if len(header) > 1 and 1 not in found.values() and lowered[1] not in _STATUS:
        found.setdefault("name", 1)  # in whatever language; there is no name where submissions are anonymous
    return found


def participant(cell: str) -> str:
    """Return the number of "Participant 12345" or "Teilnehmer/in12345", "" if there is none."""
    found = _PARTICIPANT.fullmatch(cell.strip())
    return found["number"] if found else cell.strip() if cell.strip().isdecimal() else ""


def time(text: str) -> dt.datetime | None:
    """Return a time as Moodle writes it for people, in the time zone of this machine; None if it cannot be read.

    A month that two languages call by one name (listopad) is not guessed.
    """
    clock = _CLOCK.search(text)
    if clock is None:
        return None
    date = text[: clock.start()] + " " + text[clock.end() :]
    numbers = [int(number) for number in re.findall(r"\d+", date)]
    months = {month for word in re.findall(r"[^\W\d_]+", date) for month in _months().get(word.casefold(), ())}
    try:
        if len(months) == 1 and len(numbers) == 2:
            year, day, (month,) = max(numbers), min(numbers), months
        elif not months and len(numbers) == 3 and numbers[0] > 31:
            year, month, day = numbers
        else:
            return None
        hour, half = int(clock["hour"]), (clock["half"] or "").lower()
        hour = hour % 12 + 12 * half.startswith("p") if half else hour
        return dt.datetime(year, month, day, hour, int(clock["minute"])).astimezone()
    except ValueError:
        return None


@functools.cache
def _months() -> Mapping[str, frozenset[int]]:
    """Return the months that a word may mean, in any of the languages."""
    found: dict[str, frozenset[int]] = {}
    for language in _LANGUAGES:
        for names in Locale(language).months.values():
            for number, name in names["wide"].items():
                for word in re.findall(r"[^\W\d_]+", name.casefold()):
                    found[word] = found.get(word, frozenset()) | {number}
    return {word: numbers for word, numbers in found.items() if len(numbers) <= _MOST_MEANINGS}
