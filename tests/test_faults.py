"""The faults by which the tests are tried (`python -m faults.table`) fit the code as it is."""

from __future__ import annotations

from collections import Counter

import pytest
from faults import FAULTS, Fault

from grader import KIT


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_has_one_place_and_leaves_a_program(fault: Fault):
    text = (KIT / fault.file).read_text()
    assert text.count(fault.old) == 1
    assert fault.new not in text or fault.new in fault.old
    compile(text.replace(fault.old, fault.new), fault.file, "exec")


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_test_that_noticed_a_fault_is_there_still(fault: Fault):
    """Whoever removes it runs `make faults FAULT`, or names another."""
    file, name = fault.seen_by.split("::")
    assert f"def {name}(" in (KIT / file).read_text()


def test_there_are_forty_from_all_rooms():
    rooms = Counter("/".join(fault.file.split("/")[: 1 if fault.file.startswith("sim") else 2]) for fault in FAULTS)
    of_trials = sum(rooms[f"grader/{room}"] for room in ("checks", "trials", "courses"))
    others = {name: rooms[f"grader/{name}"] for name in ("intake", "sandbox", "classroom", "notebook", "ros2")}
    assert of_trials == 10
    assert others | {"sim": rooms["sim"]} == dict.fromkeys([*others, "sim"], 5)
