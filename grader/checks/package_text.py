"""What the checks of the package's text share: the facts about it, and the price of files that could not be read."""

from __future__ import annotations

import math

from grader.checks.findings import MOST_SHOWN, some
from grader.checks.judge import Failed, Judge
from grader.contract.layout import JUDGED, role
from grader.evidence import Definition, Quality, SourceFile, reading_limits

# A function above complexity 10, a repeated block or a bad habit takes some ten lines.
_LINES_PER_FINDING = 10


def within_bounds(judge: Judge) -> Quality:
    """Return the facts about a package of which every file was read."""
    quality = judge.quality()
    words = reading_limits.beyond(quality.files)
    seen = f"{some(words)}, so the package was not read completely"
    judge.expect(not words, seen, "remove the files that the nodes do not need")
    return quality


def readable(judge: Judge) -> Quality:
    """Return the facts about a package with some Python in it that can be read."""
    quality = within_bounds(judge)
    if not any(file.lines for file in quality.files if not file.problem):
        problems = [f"{file.path} {file.problem}" for file in quality.files if file.problem]
        raise Failed(f"no Python to read: {some(problems)}" if problems else "no Python in it", "see I1")
    return quality


def public_definitions(judge: Judge) -> list[Definition]:
    """Return the package's public modules, classes and functions, of which there is at least one."""
    found = readable(judge).definitions
    judge.expect(bool(found), "the modules define nothing public", "public names have no leading underscore")
    return found


def label(definition: Definition) -> str:
    """Return "path:line kind name"."""
    return f"{definition.path}:{definition.line} {definition.kind} {definition.name.rpartition('/')[2]}"


def unread_files(judge: Judge) -> list[SourceFile]:
    """Return the files that could not be read and should have been; tests and setup.py need not be."""
    return [file for file in judge.quality().files if file.problem and role(file.path) in JUDGED]


def unread_lines(unread: list[SourceFile]) -> list[str]:
    """Return a line of feedback for each of the first unread files."""
    return [
        f"{file.path} {file.problem}; a file that cannot be read counts against the package"
        for file in unread[:MOST_SHOWN]
    ]


def unread_share(judge: Judge, unread: list[SourceFile]) -> float:
    """Return the share of the package's lines, tests left out, that are in unread files."""
    known = [file for file in judge.quality().files if not file.problem and role(file.path) in JUDGED]
    hidden = sum(max(1, file.lines) for file in unread)
    return hidden / max(1, hidden + reading_limits.counted_lines(known))


def charge(judge: Judge, count: int, most: int, words: list[str], try_: str) -> None:
    """Charge one part in `most` for each finding, and for each finding that unread files may hide.

    `words` are the lines of feedback about the `count` findings.
    """
    unread = unread_files(judge)
    if count or unread:
        seen = "\n".join([*(words if count else []), *unread_lines(unread)])
        hidden = sum(max(1, math.ceil(file.lines / _LINES_PER_FINDING)) for file in unread)
        judge.share(1 - (count + hidden) / most, seen, try_)
