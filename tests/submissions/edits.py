"""The known-bad submissions: the reference with one named edit each, as known_bad.yaml lists them.

An edit replaces text in a copy of the reference, or removes files. A text must match exactly once, so an edit that no
longer applies because the reference has changed is an error and not a silent pass.

`python -m submissions.table` (in tests/) grades every edit and prints edit x requirement. The evidence of those that
are the example for a check is recorded in tests/evidence (`python -m submissions.record`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from grader import KIT
from grader.intake.package_edits import Change, copy, put, remove, rename, replace
from grader.yaml_reader import FAST_LOADER

REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"


@dataclass(frozen=True)
class Edit:
    """One mistake. What each field means stands at the top of known_bad.yaml."""

    name: str
    wrong: str
    changes: tuple[Change, ...]
    costs: frozenset[str]
    fails: tuple[str, ...]
    says: tuple[str, ...]
    why: str = ""


def apply(edit: Edit | None, folder: Path) -> Path:
    """Copy the reference below `folder`, make the edit, and return the package's path."""
    package = copy(REFERENCE, folder)
    for change in edit.changes if edit else ():
        change(package)
    return package


def changes(listed: Iterable[dict[str, str]]) -> tuple[Change, ...]:
    """Return changes of a package that are listed as in known_bad.yaml."""
    return tuple(map(_change, listed))


def _change(given: dict[str, str]) -> Change:
    match given:
        case {"file": file, "old": old, "new": new}:
            return replace(file, old, new)
        case {"rename": old, "to": new}:
            return rename(old, new)
        case {"move": old, "to": new}:
            return partial(_move, old, new)
        case {"put": file, "text": text}:
            return put(file, text)
        case _:
            return remove(given["remove"])


def _move(old: str, new: str, package: Path) -> None:
    (package / old).rename(package / new)


def _read(name: str, given: dict[str, Any]) -> Edit:
    costs, fails = (given.pop(key, "").split() for key in ("costs", "fails"))
    made, says = changes(given.pop("changes")), tuple(given.pop("says", ()))
    return Edit(name, changes=made, costs=frozenset(costs), fails=tuple(fails), says=says, **given)


_LISTED = yaml.load(Path(__file__).with_name("known_bad.yaml").read_text(), FAST_LOADER)
EDITS = {name: _read(name, given) for name, given in _LISTED.items()}
FAILS_ON = {check: edit.name for edit in EDITS.values() for check in edit.fails}
"""Check id -> the known-bad submission that does not get all its points."""
