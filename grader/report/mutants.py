"""Which test noticed which fault: the table for a report. Facts in, table out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from grader.evidence import Mutant, Mutation, short_name

_TESTS_AT_MOST = 3

OUTCOMES = {
    "noticed": "noticed by",
    "unnoticed": "not noticed by",
    "unreached": "no test reaches this line",
    "not tried": "not tried",
}


@dataclass(frozen=True)
class Row:
    """One fault: where it was put, what was changed, and the tests that noticed it, or ran over it and passed."""

    where: str
    words: str
    outcome: str
    tests: tuple[str, ...] = ()
    others: int = 0
    """How many more tests ran over it and passed."""

    @property
    def said(self) -> str:
        """Return in words what came of it; the tests are to follow."""
        said = OUTCOMES.get(self.outcome, self.outcome)
        return said if self.tests else said.removesuffix(" by")


@dataclass(frozen=True)
class Matrix:
    """The faults in the order of the source, and for each test that noticed any how many, the most first."""

    rows: tuple[Row, ...]
    noticed_by: tuple[tuple[str, int], ...]

    @property
    def noticed(self) -> int:
        """Return how many faults were noticed."""
        return sum(row.outcome == "noticed" for row in self.rows)

    @property
    def tried(self) -> int:
        """Return how many faults were tried, or need not be because no test reaches them."""
        return sum(row.outcome != "not tried" for row in self.rows)


def matrix(mutation: Mutation) -> Matrix:
    """Return what became of every fault."""
    faults = sorted(mutation.mutants, key=lambda fault: (fault.path, fault.line, fault.words))
    count = Counter(short_name(fault.by) for fault in faults if fault.by)
    return Matrix(tuple(map(_row, faults)), tuple(sorted(count.items(), key=lambda each: (-each[1], each[0]))))


def _row(fault: Mutant) -> Row:
    tests = [fault.by] if fault.by else fault.tried
    shown = tuple(short_name(test) for test in tests[:_TESTS_AT_MOST])
    # The first folder is the same for all.
    path = fault.path.partition("/")[2] or fault.path
    return Row(f"{path}:{fault.line}", fault.words, fault.outcome, shown, len(tests) - len(shown))
