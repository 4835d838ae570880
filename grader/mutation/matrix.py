"""The faults that no test noticed, against the tests that could have: a table for a report. Facts in, table out."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from grader.evidence import Mutation

_TESTS_AT_MOST = 12


@dataclass(frozen=True)
class Row:
    """One fault: where it was put, what was changed, and for each column whether that test ran over it and passed."""

    where: str
    words: str
    passed: tuple[bool, ...]
    others: int
    """How many more tests ran over it and passed."""


@dataclass(frozen=True)
class Matrix:
    """The unnoticed faults. The columns are the tests that let most of them pass."""

    tests: tuple[str, ...]
    rows: tuple[Row, ...]


def matrix(mutation: Mutation) -> Matrix:
    """Return the faults that were tried or unreached, and not noticed, in the order of the source."""
    missed = [fault for fault in mutation.faults if fault.outcome in ("unnoticed", "unreached")]
    count = Counter(test for fault in missed for test in fault.tried)
    columns = tuple(sorted(count, key=lambda test: (-count[test], test))[:_TESTS_AT_MOST])
    rows = [
        Row(
            where=f"{fault.path}:{fault.line}",
            words=fault.words,
            passed=tuple(test in fault.tried for test in columns),
            others=len(set(fault.tried) - set(columns)),
        )
        for fault in sorted(missed, key=lambda fault: (fault.path, fault.line, fault.words))
    ]
    return Matrix(columns, tuple(rows))
