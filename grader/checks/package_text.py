"""What the checks of the package's text share: the facts about it, and the price of files that could not be read."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import PurePosixPath

from grader.checks.judge import Failed, Judge, NotReached
from grader.course.model import JUDGED, role
from grader.evidence import Definition, Kind, Quality, Reason, SourceFile, reading_limits
from grader.words import MOST_SHOWN, say, say_count, some

# A function above complexity 10, a repeated block or a bad habit takes some ten lines.
_LINES_PER_FINDING = 10
_FUNCTIONS_ALONE = 0.2

Count = Callable[[Callable[[Definition], bool]], float]
"""Counts the definitions for which something holds; some may weigh less than 1."""


def within_bounds(judge: Judge) -> Quality:
    """Return the facts about a package of which every file was read, and which has a module of the contract."""
    quality = judge.quality()
    words = reading_limits.beyond(quality.files)
    seen = say("{words}, so the package was not read completely", words=some(words))
    judge.expect(not words, seen, say("remove the files that the nodes do not need"))
    judge.expect_readable()
    _require_modules(judge)
    return quality


def readable(judge: Judge) -> Quality:
    """Return the facts about a package with some Python in it that can be read."""
    files = judge.quality().files
    if not reading_limits.beyond(files) and not any(file.lines for file in files if not file.problem):
        problems = [f"{file.path} {file.problem}" for file in files if file.problem]
        see = say("see {requirement}", requirement=judge.course.requirement_of("check_build") or say("the contract"))
        raise Failed(
            say("no Python to read: {problems}", problems=some(problems)) if problems else say("no Python in it"), see
        )
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
    if missing and judge.unread_nodes.issuperset(missing):
        judge.expect_readable()  # which has said so
    elif missing and len(missing) < len(nodes):
        absent = say_count(
            "{names} is not there", "{names} are not there", len(missing), names=say(" and ").join(missing)
        )
        judge.weigh(1 - len(missing) / len(nodes), say("{absent}, and {judge.each_node}", absent=absent, judge=judge))
    elif missing:
        none = {1: say("the node is not there"), 2: say("neither node is there")}.get(
            len(nodes), say("none of the nodes is there")
        )
        functions = judge.course.functions
        alone = PurePosixPath(functions.module).stem if functions else "functions"
        judge.weigh(
            _FUNCTIONS_ALONE, say("{none}; the {alone} alone are a fifth of these points", none=none, alone=alone)
        )


def _require_modules(judge: Judge) -> list[str]:
    """Return the contract's nodes that are there; one may have no code yet if there are the functions.

    Raises:
        NotReached: there are neither.
    """
    quality = judge.quality()
    if quality.reached is None:
        return [node for node in judge.course.nodes if node not in judge.unread_nodes]
    # A node that cannot be read is there; what it costs is another matter.
    package = judge.course.package
    hidden = [file.path for file in quality.files if file.problem and role(file.path, package) == "module"]
    unread = {PurePosixPath(path).stem for path in hidden}
    there = (quality.reached.nodes.keys() | unread) - judge.unread_nodes
    found = [node for node in judge.course.nodes if node in there]
    if not found and not quality.functions.defined:
        raise NotReached(Reason(Kind.NO_MODULES, said=", ".join(judge.course.modules)))
    return found


def public_definitions(judge: Judge) -> list[Definition]:
    """Return the package's public modules, classes and functions, of which there is at least one."""
    found = weighed(judge).definitions
    judge.expect(bool(found), say("the modules define nothing public"), say("public names have no leading underscore"))
    return found


def lowest_share(judge: Judge, things: Sequence[Definition], share: Callable[[Count], float]) -> tuple[float, str]:
    """Return the share of all things, or of those that the nodes use if it is lower; then also words that say so.

    `share` gets a function that counts the things for which something holds. Things that only tests call, or nothing,
    may add to what is wrong, and cannot make up for it.
    """
    whole = share(lambda holds: sum(map(holds, things)))
    used = used_by_nodes(judge, things)
    if not used:
        return whole, ""
    weight = weights(judge, Counter(thing.path for thing in used))
    # A cap on a file's weight keeps it from making up for others; what is wrong in it counts in full.
    of_nodes = min(
        share(lambda holds: sum(map(holds, used))),
        share(lambda holds: sum(weight[thing.path] for thing in used if holds(thing))),
    )
    if of_nodes < whole:
        return of_nodes, say(
            "the nodes use {n} of the {n2}; the others do not make up for these", n=len(used), n2=len(things)
        )
    return whole, ""


def used_by_nodes(judge: Judge, things: Sequence[Definition]) -> list[Definition]:
    """Return the things that the nodes use."""
    reached = judge.quality().reached
    return [thing for thing in things if reached is not None and reached.covers(thing.path, thing.line)]


def every(_: Definition) -> bool:
    """Hold for every definition, to count all of them."""
    return True


def weights(judge: Judge, sizes: Mapping[str, float]) -> dict[str, float]:
    """Return what counts for how much in each file that the nodes reach: no file weighs more than the nodes' together.

    `sizes` says how much there is of it in each file: lines, or definitions.
    """
    reached = judge.quality().reached
    of_nodes = {path for paths in reached.nodes.values() for path in paths} if reached else set()
    most = sum(sizes.get(path, 0.0) for path in of_nodes) or math.inf
    return {path: min(size, most) / size for path, size in sizes.items() if size}


def label(definition: Definition) -> str:
    """Return "path:line kind name"."""
    return f"{definition.path}:{definition.line} {definition.kind} {definition.name.rpartition('/')[2]}"


def unread_files(judge: Judge) -> list[SourceFile]:
    """Return the files that could not be read and should have been; tests and setup.py need not be."""
    package = judge.course.package
    return [file for file in judge.quality().files if file.problem and role(file.path, package) in JUDGED]


def unread_lines(unread: list[SourceFile]) -> list[str]:
    """Return a line of feedback for each of the first unread files."""
    return [
        say("{file.path} {file.problem}; a file that cannot be read counts against the package", file=file)
        for file in unread[:MOST_SHOWN]
    ]


def readable_first(unread: list[SourceFile], try_: str) -> str:
    """Return which line of an unread file to fix before anything else, `try_` if that is not known or all are read."""
    lines = ((file, re.search(r"\bline (\d+)", file.problem)) for file in unread)
    first = next(((file, line[1]) for file, line in lines if line), None)
    return say("fix line {line} of {file.path} first", file=first[0], line=first[1]) if first else try_


def unread_share(judge: Judge, unread: list[SourceFile]) -> float:
    """Return the share of the package's lines, tests left out, that are in unread files."""
    package = judge.course.package
    known = [file for file in judge.quality().files if not file.problem and role(file.path, package) in JUDGED]
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
        judge.share(1 - (count + hidden) / most, seen, readable_first(unread, try_))
