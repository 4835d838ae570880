"""The table of mutants in a report, with the tests that noticed each."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from grader.evidence import Mutant, Mutation, short_name
from grader.words import mark, say

_TESTS_AT_MOST = 3

# In words, without tests that follow and with them.
OUTCOMES = {
    "noticed": (mark("noticed"), mark("noticed by")),
    "unnoticed": (mark("not noticed"), mark("not noticed by")),
    "unreached": (mark("no test reaches this line"),) * 2,
    "not tried": (mark("not tried"),) * 2,
}


@dataclass(frozen=True)
class Row:
    """One mutant: its place, its change, and the tests that noticed it, or else reached it and passed.

    `others` counts the tests beyond those in `tests`.
    """

    where: str
    words: str
    outcome: str
    tests: tuple[str, ...] = ()
    others: int = 0

    @property
    def said(self) -> str:
        """Return the outcome as text, to be followed by the tests."""
        return say(OUTCOMES.get(self.outcome, (self.outcome,) * 2)[bool(self.tests)])


@dataclass(frozen=True)
class Matrix:
    """The mutants in the order of the source, and how many each test noticed, the most first."""

    rows: tuple[Row, ...]
    noticed_by: tuple[tuple[str, int], ...]

    @property
    def noticed(self) -> int:
        """Return how many mutants were noticed."""
        return sum(row.outcome == "noticed" for row in self.rows)

    @property
    def tried(self) -> int:
        """Return how many mutants were tried, or did not have to be because no test reaches them."""
        return sum(row.outcome != "not tried" for row in self.rows)


def matrix(mutation: Mutation) -> Matrix:
    """Return the table for `mutation`."""
    mutants = sorted(mutation.mutants, key=lambda mutant: (mutant.path, mutant.line, mutant.words))
    count = Counter(short_name(mutant.by) for mutant in mutants if mutant.by)
    return Matrix(tuple(map(_row, mutants)), tuple(sorted(count.items(), key=lambda each: (-each[1], each[0]))))


def _row(mutant: Mutant) -> Row:
    tests = [mutant.by] if mutant.by else mutant.tried
    shown = tuple(short_name(test) for test in tests[:_TESTS_AT_MOST])
    # All paths begin with the same folder.
    path = mutant.path.partition("/")[2] or mutant.path
    return Row(f"{path}:{mutant.line}", mutant.words, mutant.outcome, shown, len(tests) - len(shown))
