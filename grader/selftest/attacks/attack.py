"""An attack as data: a small edit of a package, what it tries, and the right outcome."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.course import kits_own
from grader.selftest.package_edits import Change, put, replace

PACKAGE = kits_own().package

Pack = Callable[[Path, Path], Path]
"""Packs a package into a submission below a folder, and returns the submission."""


@dataclass(frozen=True)
class Attack:
    """One attempt to gain points that were not earned, or to reach what does not belong to the submission.

    In texts, `@SECRET@`, `@TOKEN@`, `@PORT@`, `@RESULTS@`, `@NEIGHBOUR@` and `@KIT@` are replaced by the values of this
    host (honeytokens.py).

    Attributes:
        name: its name on the command line.
        tries: what it tries, as a sentence.
        changes: its edits of the package.
        needs: the requirements to grade in order to see its effect.
        costs: the requirements that may lose points by it; all others must keep theirs.
        stopped: what stops it.
        number: its number in the list of known attacks on autograders; 0 for one that the kit has added.
        weak: edits that the package has with and without the attack, so that there is something to gain.
        flag: the kind of integrity flag that it must raise, "" where there is nothing to be seen of it.
        proof: text that must be in the evidence, to show that it was really carried out.
        pack: how it is packed, if it is not submitted as a folder.
        refused: words of the refusal, if it is not graded at all.
        not_applicable: why it cannot be tried on this grader; then it is not run.
        build_seconds: time limit for its build, if not the usual one.
    """

    name: str
    tries: str
    changes: tuple[Change, ...]
    needs: tuple[str, ...]
    costs: frozenset[str]
    stopped: str = ""
    number: int = 0
    weak: tuple[Change, ...] = ()
    flag: str = ""
    proof: str = ""
    pack: Pack | None = None
    refused: str = ""
    not_applicable: str = ""
    build_seconds: float = 0.0


def attack(name: str, tries: str, *changes: Change, needs: str = "", costs: str = "", **others: Any) -> Attack:
    """Return an attack; `needs` and `costs` are requirements separated by spaces, `others` its other attributes."""
    return Attack(name, tries, changes, tuple(needs.split()), frozenset(costs.split()), **others)


def node(payload: str, executable: str = "robot_controller", *, before: str = "") -> Change:
    """Return a change that runs `payload` when a node starts, and then the node.

    The payload may use os, sys, subprocess, threading and time. Its output is in the trial's evidence. A payload that
    fails prints the exception, and the node starts nevertheless.
    """
    indented = "".join(f"    {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "#!/usr/bin/env python3\nimport os\nimport subprocess\nimport sys\nimport threading\nimport time\n"
        f"{before}\n\ndef attack():\n{indented}\n\ntry:\n    attack()\n"
        "except Exception as error:\n    print('ATTACK', type(error).__name__, error, flush=True)\n\n"
        f"from {PACKAGE}.{executable} import main\nsys.exit(main())\n"
    )
    return put(f"scripts/{executable}", text, executable=True)


def cmake(text: str) -> Change:
    """Return a change that adds commands to CMakeLists.txt before its end."""
    return replace("CMakeLists.txt", "\nament_package()", f"\n{text.strip()}\n\nament_package()")


def fill_in(package: Path, values: Mapping[str, str]) -> None:
    """Replace the placeholders, by name, by their values on this host, in every file of the package."""
    for path in package.rglob("*"):
        if path.is_file() and not path.is_symlink():
            old = new = path.read_bytes()
            for name, value in values.items():
                new = new.replace(f"@{name}@".encode(), os.fsencode(value))
            if new != old:
                path.write_bytes(new)
