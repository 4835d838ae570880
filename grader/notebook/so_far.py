"""Which part of a requirement can be checked in a notebook, while the package lacks what later notebooks bring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from grader.notebook import checkpoints
from grader.notebook.workspace import course


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


def waiting() -> Mapping[str, Later]:
    """Return the checks that the course's package cannot pass before a notebook, by their ids in the rubric."""
    return {check: Later(**row) for check, row in course().notebook_table["later"].items()}


def stand_ins() -> Mapping[str, StandIn]:
    """Return what is asked in place of requirements that need a node of a later notebook, by their ids."""
    return {name: StandIn(**row) for name, row in course().notebook_table["stand_ins"].items()}


def later(check: str, notebook: str) -> Later | None:
    """Return what a check waits for in a notebook ("05"), None if it can be judged there, or outside a notebook."""
    found = waiting().get(check)
    return found if found is not None and "" < notebook < found.notebook else None


def stand_in(requirement: str, notebook: str) -> StandIn | None:
    """Return what is asked in a notebook ("05") in place of a requirement's own checks, None if nothing is."""
    found = stand_ins().get(requirement)
    return found if found is not None and "" < notebook < found.notebook else None


def layout(notebook: str) -> list[str]:
    """Return the part of the contract's layout that is there after a notebook ("05")."""
    return [path for path in course().layout if checkpoints.written_in(path) <= notebook]
