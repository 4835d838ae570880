"""What the checks of the package's text share: the facts about it, and the price of files that could not be read."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TypeVar

from grader.checks.judge import Failed, Judge, NotReached
from grader.evidence import Definition, Finding, Kind, Quality, Reason, SourceFile, reading_limits
from grader.words import MOST_SHOWN, mark, say, some

# A function above complexity 10, a repeated block or a bad habit takes some ten lines.
_LINES_PER_FINDING = 10
_FUNCTIONS_ALONE = 0.2

Placed = TypeVar("Placed", Definition, Finding)


def within_bounds(judge: Judge) -> Quality:
    """Return the facts about a package of which every file was read, and which has a module of the contract."""
    quality = judge.quality()
    words = reading_limits.beyond(quality.files)
    seen = say("{words}, so the package was not read completely", words=some(words))
    judge.expect(not words, seen, say("remove the files that the nodes do not need"))
    _require_modules(judge)
    return quality


def readable(judge: Judge) -> Quality:
    """Return the facts about a package with some Python in it that can be read."""
    files = judge.quality().files
    if not reading_limits.beyond(files) and not any(file.lines for file in files if not file.problem):
        problems = some([f"{file.path} {file.problem}" for file in files if file.problem])
        see = say("see {requirement}", requirement=judge.course.requirement_of("check_build") or say("the contract"))
        seen = say("no Python to read: {problems}", problems=problems) if problems else say("no Python in it")
        raise Failed(seen, see)
    return within_bounds(judge)


def weighed(judge: Judge) -> Quality:
    """Return the facts about a package that can be read, and let the nodes that are there decide what they weigh.

    Each node has the same share. The functions alone are a fifth: a beginning, and none of the work that the nodes are.
    """
    quality = readable(judge)
    weigh(judge)
    return quality


def weigh(judge: Judge) -> None:
    """Let the check's points count for as much as there is of the contract's nodes.

    Raises:
        NotReached: none of the contract's modules is there.
    """
    nodes, there = judge.course.nodes, _require_modules(judge)
    missing = [node for node in nodes if node not in there]
    if missing and there:
        words = mark("{names}: not there, and each of the {n} nodes counts the same of these points")
        judge.weigh(len(there) / len(nodes), say(words, names=", ".join(missing), n=len(nodes)))
    elif missing:
        judge.weigh(
            _FUNCTIONS_ALONE, say("none of the nodes is there; the functions alone are a fifth of these points")
        )


def _require_modules(judge: Judge) -> list[str]:
    """Return the contract's nodes that are there; one may have no code yet if there are the functions.

    Raises:
        NotReached: there are neither.
    """
    there = judge.measured().of_node
    found = [node for node in judge.course.nodes if node in there]
    if not found and not judge.quality().functions.defined:
        raise NotReached(Reason(Kind.NO_MODULES, said=", ".join(judge.course.modules)))
    return found


def public_definitions(judge: Judge) -> list[Definition]:
    """Return what is public in the measured modules, classes and functions, of which there is at least one."""
    found = measured(judge, weighed(judge).definitions)
    judge.expect(bool(found), say("the modules define nothing public"), say("public names have no leading underscore"))
    return found


def measured(judge: Judge, things: Sequence[Placed]) -> list[Placed]:
    """Return the things that stand on lines which count."""
    return [thing for thing in things if judge.measured().covers(thing.path, thing.line)]


def label(definition: Definition) -> str:
    """Return "path:line kind name"."""
    return f"{definition.path}:{definition.line} {definition.kind} {definition.name.rpartition('/')[2]}"


def unread_files(judge: Judge) -> list[SourceFile]:
    """Return the files that count and could not be read."""
    return [file for file in judge.quality().files if file.problem and file.path in judge.measured().whole]


def unread_lines(unread: list[SourceFile]) -> list[str]:
    """Return a line of feedback for each of the first unread files."""
    words = mark("{file.path} {file.problem}; a file that cannot be read counts against the package")
    return [say(words, file=file) for file in unread[:MOST_SHOWN]]


def readable_first(unread: list[SourceFile], try_: str) -> str:
    """Return which line of an unread file to fix before anything else, `try_` if that is not known or all are read."""
    lines = ((file, re.search(r"\bline (\d+)", file.problem)) for file in unread)
    first = next(((file, line[1]) for file, line in lines if line), None)
    return say("fix line {line} of {file.path} first", file=first[0], line=first[1]) if first else try_


def unread_share(judge: Judge, unread: list[SourceFile]) -> float:
    """Return the share of the lines that count which are in unread files."""
    known = [file for file in judge.quality().files if not file.problem]
    hidden = sum(max(1, file.lines) for file in unread)
    return hidden / max(1, hidden + judge.measured().lines(known))


def share_read(judge: Judge, share: float, words: Sequence[str], try_: str) -> None:
    """Give a share, and at most that of the lines that could be read; `words` are the lines of feedback about it."""
    unread = unread_files(judge)
    if share < 1 or unread:
        share = min(share, 1 - unread_share(judge, unread))
        judge.share(share, "\n".join([*words, *unread_lines(unread)]), readable_first(unread, try_))


def charge(judge: Judge, count: int, most: int, words: list[str], try_: str) -> None:
    """Charge one part in `most` for each finding, and for each finding that unread files may hide.

    `words` are the lines of feedback about the `count` findings.
    """
    unread = unread_files(judge)
    if count or unread:
        seen = "\n".join([*(words if count else []), *unread_lines(unread)])
        hidden = sum(max(1, math.ceil(file.lines / _LINES_PER_FINDING)) for file in unread)
        judge.share(1 - (count + hidden) / most, seen, readable_first(unread, try_))
