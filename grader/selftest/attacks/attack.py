"""An attack as data: a small edit of a package, what it tries, and the right outcome."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from dataclasses import replace as replace_fields
from pathlib import Path, PurePosixPath
from typing import Any

from grader.course import Course
from grader.intake.package_edits import Change, append, put, replace
from grader.scoring.rubric import Rubric
from grader.trials import catalog

BEHAVIOUR, BUILD = "BEHAVIOUR", "BUILD"
"""Stand in an attack for the first requirement that a trial serves, and for the one that the package builds."""

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
        needs: the requirements to grade in order to see its effect: BEHAVIOUR, BUILD, or ids of a course.
        costs: the requirements that may lose points by it; all others must keep theirs.
        stopped: what stops it.
        number: its number in the list of known attacks on autograders; 0 for one that the kit has added.
        weak: edits that the package has with and without the attack, so that there is something to gain.
        gains: the points that requirements may gain by it at most, where only a flag, or nothing, stands against it.
        flag: the kind of integrity flag that it must raise, "" where there is nothing to be seen of it.
        flag_needs_cgroup: whether it is seen only where a sandbox has a cgroup.
        proof: text that must be in the evidence, to show that it was really carried out.
        pack: how it is packed, if it is not submitted as a folder.
        refused: words of the refusal, if it is not graded at all.
        not_without_namespaces: why no sandbox without namespaces (docs/containers.md) stops it, "" if they do.
        build_seconds: time limit for its build, if not the usual one.
        from_inside: whether it is graded by somebody who stands in it and names no course.
    """

    name: str
    tries: str
    changes: tuple[Change, ...]
    needs: tuple[str, ...]
    costs: frozenset[str]
    stopped: str = ""
    number: int = 0
    weak: tuple[Change, ...] = ()
    gains: Mapping[str, float] = field(default_factory=dict)
    flag: str = ""
    flag_needs_cgroup: bool = False
    proof: str = ""
    pack: Pack | None = None
    refused: str = ""
    not_without_namespaces: str = ""
    build_seconds: float = 0.0
    from_inside: bool = False

    def on(self, course: Course, rubric: Rubric) -> Attack:
        """Return the attack with the requirements of a course."""
        tried = {name for plan in catalog.trials(course).values() for name in plan.serves}
        first = next((r.id for r in rubric.requirements if r.id in tried), "")
        ids = {BEHAVIOUR: first, BUILD: course.requirement_of("check_build")}
        needs = tuple(dict.fromkeys(ids.get(name, name) for name in self.needs))
        return replace_fields(self, needs=needs, costs=frozenset(ids.get(name, name) for name in self.costs))


def attack(name: str, tries: str, *changes: Change, needs: str = "", costs: str = "", **others: Any) -> Attack:
    """Return an attack; `needs` and `costs` are requirements separated by spaces, `others` its other attributes."""
    return Attack(name, tries, changes, tuple(needs.split()), frozenset(costs.split()), **others)


def node(payload: str, executable: str = "", *, before: str = "") -> Change:
    """Return a change that runs `payload` when a node starts, by default the package's first, and then the node.

    The payload may use os, sys, subprocess, threading and time. Its output is in the trial's evidence. A payload that
    fails prints the exception, and the node starts nevertheless.
    """
    indented = "".join(f"    {line}\n" if line else "\n" for line in payload.strip().splitlines())
    text = (
        "import os\nimport subprocess\nimport sys\nimport threading\nimport time\n"
        f"{before}\n\ndef attack():\n{indented}\n\ntry:\n    attack()\n"
        "except Exception as error:\n    print('ATTACK', type(error).__name__, error, flush=True)\n"
    )

    def change(package: Path) -> None:
        module = module_of_node(package, executable)
        script = f"scripts/{PurePosixPath(module).stem}"
        if (package / script).is_file():
            imports = f"\nfrom {package.name}.{PurePosixPath(module).stem} import main\nsys.exit(main())\n"
            put(script, f"#!/usr/bin/env python3\n{text}{imports}", executable=True)(package)
        else:
            append(module, f"\n\n{text}")(package)

    return change


def append_to_node(text: str) -> Change:
    """Return a change that adds text to the end of the first node's module."""
    return lambda package: append(module_of_node(package), text)(package)


def module_of_node(package: Path, executable: str = "") -> str:
    """Return the path of a node's module in a package, by default of the first one that has a `main`."""
    modules = sorted((package / package.name).glob(f"{executable or '*'}.py"))
    found = next(path for path in modules if executable or "\ndef main(" in path.read_text())
    return found.relative_to(package).as_posix()


def at_build(script: str) -> Change:
    """Return a change that runs a shell script when the package is built, and shows at the end what it said.

    Of a build's log only the tail is kept.
    """

    def change(package: Path) -> None:
        if (package / "CMakeLists.txt").is_file():
            cmake(_BY_CMAKE.format(script.strip()))(package)
        else:
            append("setup.py", _BY_SETUP.format(script.strip()))(package)

    return change


_BY_CMAKE = """execute_process(COMMAND sh -c [[{}]]
  OUTPUT_FILE ${{CMAKE_BINARY_DIR}}/said.txt ERROR_FILE ${{CMAKE_BINARY_DIR}}/said_too.txt)
install(CODE "file(READ ${{CMAKE_BINARY_DIR}}/said.txt said)\nfile(READ ${{CMAKE_BINARY_DIR}}/said_too.txt too)
message(STATUS \\"ATTACK \\${{said}} \\${{too}}\\")")"""
_BY_SETUP = """
import subprocess
import sys
said = subprocess.run(['sh', '-c', {!r}], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout
print('ATTACK', said, file=sys.stderr, flush=True)  # colcon reads what is on standard output
"""


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
