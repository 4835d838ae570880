"""Find text that is written for whoever grades, a program above all: "ignore all previous instructions"."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from pathlib import Path

from grader.evidence import Finding
from grader.sanitize import printable

_MAX_BYTES = 256 * 1024  # of a file
_MAX_TOTAL = 4 * 1024 * 1024
_MAX_FOUND = 20
_MAX_WORDS = 120  # characters shown

_READER = (
    r"(?:ai|a\s+i|llm|(?:auto\s?|ai\s+)?grad(?:er|ing\s+(?:system|model|script|agent|bot))|language\s+model"
    r"|chat\s?gpt|gpt|claude|gemini|copilot)"
)
# A robot ignores previous commands and goals, and a README may say to ignore a step: only these are meant for a model.
_ADDRESSED = re.compile(
    rf"""\b(?:
      (?:ignore|disregard|forget|override)\s+(?:all\s+|any\s+|every\s+|each\s+)?(?:of\s+)?(?:the\s+|your\s+|my\s+)?
        (?:previous|prior|preceding|earlier|system|original)\s+(?:instructions?|prompts?|guidelines|rubrics?)
    | (?:ignore|disregard|forget|override)\s+(?:all|any|your)\s+(?:of\s+)?(?:the\s+|your\s+)?
        (?:instructions?|prompts?|guidelines|rubrics?)
    | (?:dear|hey|hello|hi|attention|note\s+(?:to|for)|message\s+(?:to|for)|instructions?\s+(?:to|for)|if\s+you\s+are)
        \s*:?\s*(?:any|an|a|the|all)?\s*{_READER}s?\b
    | (?:auto\s?)?grader\s*[:,]\s*(?:please|give|award|assign|ignore|you|this|mark|set|do)
    | (?:give|award|grant|assign)\s+(?:(?:this|the|my|our)\s+\w+\s+|me\s+|us\s+|it\s+)?
        (?:the\s+|a\s+)?(?:full|maximum|max|perfect|highest|top|100)\s*%?\s*(?:points|marks|score|grade)\b
    | you\s+are\s+(?:now\s+)?(?:an?\s+|the\s+)?{_READER}\b
    | (?:mark|grade|rate|score)\s+(?:this|the|my|our|every)\s*(?:\w+\s+){{0,2}}as\s+(?:passed|correct|perfect)
    )""",
    re.IGNORECASE | re.VERBOSE,
)
_MARKS = re.compile(r"""[#*>|/`'"_~\\<!{}()\[\]-]""")
# Invisible in every editor, and read by a model: the "tag" characters repeat ASCII, the others join words.
_TAGS = {0xE0000 + code: code for code in range(0x20, 0x7F)}
_INVISIBLE = dict.fromkeys((0x200B, 0x200C, 0x200D, 0x2060, 0xFEFF, 0xAD, *range(0x202A, 0x202F), 0xE0001, 0xE007F))


def addressed_to_a_grader(package: Path, paths: Sequence[str]) -> list[Finding]:
    """Return the places in the package's texts, hidden ones too, that speak to whoever grades them."""
    found: list[Finding] = []
    left = _MAX_TOTAL
    for path in paths:
        if left <= 0 or len(found) >= _MAX_FOUND:
            break
        with (package / path).open("rb") as stream:
            data = stream.read(_MAX_BYTES)
        left -= len(data)
        if b"\0" not in data:
            found += _in_text(printable(path), data.decode("utf-8", "replace"))
    return found[:_MAX_FOUND]


def _in_text(path: str, text: str) -> Iterator[Finding]:
    plain = unicodedata.normalize("NFKC", text.translate(_TAGS | _INVISIBLE))
    for match in _ADDRESSED.finditer(_MARKS.sub(" ", plain)):
        line = plain.count("\n", 0, match.start()) + 1
        words = " ".join(plain[match.start() : match.end() + _MAX_WORDS].split())
        yield Finding(path, line, "addressed", printable(words, _MAX_WORDS))
