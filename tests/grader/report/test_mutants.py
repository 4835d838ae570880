"""The table of faults: which test noticed which, and which let it pass."""

from __future__ import annotations

from grader.evidence import Mutant, Mutation
from grader.report.html import Matrix, Row, matrix

PLACE = ("a.py", 7, "drive", "sign", "`-` became `+`")


def test_each_fault_stands_beside_the_tests_that_noticed_it_or_let_it_pass():
    faults = [
        Mutant("b.py", 1, "f", "name", "the name changed", "unreached"),
        Mutant("a.py", 9, "f", "sign", "nine", "unnoticed", tried=["test/x.py::one", "test/x.py::two"]),
        Mutant("a.py", 7, "f", "sign", "seven", "noticed", by="test/x.py::TestIt::three[a::b]"),
        Mutant("a.py", 8, "f", "sign", "eight", "not tried"),
    ]
    found = matrix(Mutation(0, 9, faults))
    assert found == Matrix(
        rows=(
            Row("a.py:7", "seven", "noticed", ("three[a::b]",)),
            Row("a.py:8", "eight", "not tried"),
            Row("a.py:9", "nine", "unnoticed", ("one", "two")),
            Row("b.py:1", "the name changed", "unreached"),
        ),
        noticed_by=(("three[a::b]", 1),),
    )
    assert (found.noticed, found.tried) == (1, 3)
    assert [row.said for row in found.rows] == [
        "noticed by",
        "not tried",
        "not noticed by",
        "no test reaches this line",
    ]


def test_more_tests_than_a_line_holds_are_counted():
    tried = [f"t::test_{number:02}" for number in range(30)]
    [row] = matrix(Mutation(0, 9, [Mutant(*PLACE, "unnoticed", tried=tried)])).rows
    assert row.tests == ("test_00", "test_01", "test_02")
    assert row.others == 27


def test_the_test_that_noticed_most_comes_first():
    faults = [Mutant(*PLACE, "noticed", by=f"t::{name}") for name in ("b", "c", "a", "c")]
    assert matrix(Mutation(0, 9, faults)).noticed_by == (("c", 2), ("a", 1), ("b", 1))
