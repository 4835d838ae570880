"""Which tests the nightly run names as having become dearer."""

from __future__ import annotations

from helpers.durations import dearer, read

LIST = """
============================= slowest 60 durations =============================
63.70s call     tests/a.py::test_x[one two]
10.00s setup    tests/a.py::test_y
2.50s call     tests/b.py::test_z
"""


def test_the_list_that_pytest_prints_is_read():
    assert read(LIST) == {
        "tests/a.py::test_x[one two] (call)": 63.7,
        "tests/a.py::test_y (setup)": 10.0,
        "tests/b.py::test_z (call)": 2.5,
    }


def test_a_slower_machine_makes_no_test_dearer():
    earlier = read(LIST)
    assert dearer(earlier, {test: 2 * seconds for test, seconds in earlier.items()}) == []


def test_a_test_that_grew_beside_the_others_is_named():
    earlier = read(LIST)
    assert dearer(earlier, earlier | {"tests/a.py::test_y (setup)": 20.0}) == [
        "tests/a.py::test_y (setup): 10 s, now 20 s"
    ]


def test_a_dear_test_that_is_new_is_named():
    earlier = read(LIST)
    assert dearer(earlier, earlier | {"tests/c.py::test_new (call)": 9.0}) == ["tests/c.py::test_new (call): now 9 s"]
