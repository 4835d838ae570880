"""The table of what no test noticed."""

from __future__ import annotations

from grader.evidence import Fault, Mutation
from grader.mutation.matrix import Matrix, Row, matrix

PLACE = ("a.py", 7, "drive", "sign", "`-` became `+`")


def test_each_unnoticed_fault_stands_against_the_tests_that_ran_over_it():
    faults = [
        Fault("b.py", 1, "f", "name", "the name changed", "unreached"),
        Fault("a.py", 9, "f", "sign", "nine", "unnoticed", tried=["t::one"]),
        Fault("a.py", 7, "f", "sign", "seven", "unnoticed", tried=["t::one", "t::two"]),
        Fault("a.py", 8, "f", "sign", "eight", "noticed", by="t::three"),
        Fault("a.py", 8, "f", "sign", "later", "not tried"),
    ]
    assert matrix(Mutation(0, 9, faults)) == Matrix(
        tests=("t::one", "t::two"),
        rows=(
            Row("a.py:7", "seven", (True, True), 0),
            Row("a.py:9", "nine", (True, False), 0),
            Row("b.py:1", "the name changed", (False, False), 0),
        ),
    )


def test_more_tests_than_a_page_holds_are_counted():
    tried = [f"t::test_{number:02}" for number in range(30)]
    found = matrix(Mutation(0, 9, [Fault(*PLACE, "unnoticed", tried=tried)]))
    assert len(found.tests) == 12
    assert found.rows[0].others == 18
