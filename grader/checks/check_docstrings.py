"""Q2: docstrings, and ament_pep257's rules for them."""

from collections import defaultdict
from dataclasses import replace

from grader.checks.judge import Judge
from grader.checks.package_text import label, public_definitions, share_read
from grader.checks.wording import listing
from grader.evidence import Definition
from grader.words import MOST_SHOWN, mark, say

NEEDS = ("quality", "linters", "what ran")

_FULL = 0.9
_SHARED = 3  # that many things may have the same docstring, for some are much the same
_REPEATED = mark(" (it has the same docstring as others, which counts once)")


def test_public_things_have_docstrings(judge: Judge) -> None:
    """Public modules, classes and functions have docstrings: full marks at 90 %, none at 0 %, linear between."""
    things = _with_docstrings_of_their_own(judge)
    bare = [thing for thing in things if not thing.documented]
    share = min(1.0, (1 - len(bare) / len(things)) / _FULL)
    names = [label(thing) + (say(_REPEATED) if thing.words else "") for thing in bare[:MOST_SHOWN]]
    head = say("{n} of {n2} have a docstring; it is missing at", n=len(things) - len(bare), n2=len(things))
    try_ = say("say in one sentence what a caller gets, with units and frames")
    share_read(judge, share, [head, *names] if bare else [], try_)


def test_docstrings_follow_ament_pep257(judge: Judge) -> None:
    """The docstrings of public modules, classes and functions follow ament_pep257's rules."""
    things = _with_docstrings_of_their_own(judge)
    clean = sum(thing.documented and not thing.violations for thing in things)
    # One good docstring does not earn the points of a package full of them.
    wanted = max(sum(thing.documented for thing in things), _FULL * len(things))
    violations = [violation for thing in things if thing.documented for violation in thing.violations]
    seen = say("{clean} of {n} have a docstring that follows every rule", clean=clean, n=len(things))
    said = [seen, *([listing(violations)] if violations else [])]
    try_ = say("run `ament_pep257` in the package's folder; it reports the same")
    share_read(judge, min(1.0, clean / wanted), said, try_)


def _with_docstrings_of_their_own(judge: Judge) -> list[Definition]:
    """Return the public things; a docstring that is the same on many of different names counts at the first alone."""
    things = public_definitions(judge)
    having: dict[str, list[Definition]] = defaultdict(list)
    for thing in things:
        having[thing.words].append(thing)
    # Methods that replace each other, and every `main`, do the same thing.
    names = {words: {thing.name.rpartition(".")[2] for thing in same} for words, same in having.items()}
    shared = {words for words, of in names.items() if words and len(of) > _SHARED}
    return [
        replace(thing, documented=False) if thing.words in shared and thing is not having[thing.words][0] else thing
        for thing in things
    ]
