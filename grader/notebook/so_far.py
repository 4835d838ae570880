"""Which part of a requirement can be checked in a notebook, while the package lacks what later notebooks bring."""

from __future__ import annotations

from dataclasses import dataclass

from grader.contract.layout import LAYOUT
from grader.notebook import checkpoints


@dataclass(frozen=True)
class Later:
    """What a check waits for: the notebook ("08") that brings it, and in words."""

    notebook: str
    words: str


@dataclass(frozen=True)
class StandIn:
    """A check of another requirement, asked before `notebook` in place of the own ones, and what it shows."""

    notebook: str
    requirement: str
    check: str
    words: str


LATER = {
    "check_build::test_launch_and_config_are_installed": Later("08", "launch and config files"),
    "check_graph::test_controller_shows_the_contracts_interfaces": Later(
        "07", "the controller's topics, services and action"
    ),
    "check_habits::test_contract_numbers_are_parameters": Later("07", "the use of `fusion_rate`"),
    "check_interfaces::test_nodes_use_the_contracts_types": Later("07", "nodes that use the types"),
    "check_structure::test_layout_matches_the_contract": Later("10", "the last file of the contract's layout"),
    "check_structure::test_conversions_are_in_utils_and_used": Later(
        "04", "the conversions, and a node that uses them"
    ),
}
"""Checks that the course's package cannot pass before a notebook, by their ids in the rubric."""

STAND_INS = {
    "F6": StandIn(
        "05", "F12", "check_fusion::test_fuses_the_closest_valid_reading",
        "your sensor processor took only valid readings; its points come in notebook 05, for the robot that drives",
    ),
    "I7": StandIn(
        "05", "F13", "check_fusion::test_publishes_nothing_before_the_first_scan",
        "the stamps of your sensor processor follow /clock; its point comes in notebook 05, with the timer of the "
        "controller",
    ),
}  # fmt: skip
"""Requirements that need a node of a later notebook, by their ids."""


def later(check: str, notebook: str) -> Later | None:
    """Return what a check waits for in a notebook ("05"), None if it can be judged there, or outside a notebook."""
    found = LATER.get(check)
    return found if found is not None and "" < notebook < found.notebook else None


def stand_in(requirement: str, notebook: str) -> StandIn | None:
    """Return what is asked in a notebook ("05") in place of a requirement's own checks, None if nothing is."""
    found = STAND_INS.get(requirement)
    return found if found is not None and "" < notebook < found.notebook else None


def layout(notebook: str) -> list[str]:
    """Return the part of the contract's layout that is there after a notebook ("05")."""
    return [path for path in LAYOUT if checkpoints.written_in(path) <= notebook]
