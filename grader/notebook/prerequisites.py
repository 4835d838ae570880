"""What a requirement needs before it can be checked, and advice for a package that lacks it. Runs nothing."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from grader import python_ast
from grader.checks import build_log
from grader.evidence import Build, Kind, Reason
from grader.notebook import checkpoints
from grader.notebook.workspace import course
from grader.words import mark, say

_RUN_IT = mark("look at what the node does and prints: `run_node()`, then `run.output`")
_LAYOUT = "check_structure"
_LAST_OUTPUT = mark("the node ended by itself; its last output says where")
_PROVIDE_IT = mark("complete the exercise that provides it, and run its cell")
_ADVICE = {
    Kind.UNTRIED: mark("make the robot drive first, then check again"),
    Kind.UNWRITTEN: mark("write it, in that folder of the package"),
    Kind.NO_FILE: mark("install it with {files}; {built}"),
    Kind.NO_PROGRAM: mark("install it with {programs}; {built}"),
    Kind.NO_SERVICE: _PROVIDE_IT,
    Kind.NO_ACTION: _PROVIDE_IT,
    Kind.DIED: _LAST_OUTPUT,
    Kind.DIED_EARLY: _LAST_OUTPUT,
}
# Without a place these say too little to act on: the node's output says more.
_NEEDS_PLACE = (Kind.NO_ANSWER, Kind.NO_VERDICT, Kind.SLOW, Kind.WAITED, Kind.DIED, Kind.DIED_EARLY)


class Gap(NamedTuple):
    """What a package lacks, in the three rows of a check's answer."""

    seen: str
    expected: str
    try_: str


def later(check: str, notebook: str, part: str = "later") -> Mapping[str, str] | None:
    """Return what a check waits for in a notebook ("05"), None if it can be judged there, or outside a notebook."""
    row: Mapping[str, str] | None = course().notebook_table[part].get(check)
    return row if row and "" < notebook < row["notebook"] else None


def stand_in(requirement: str, notebook: str) -> Mapping[str, str] | None:
    """Return what is asked in a notebook ("05") in place of a requirement that needs a later node, None if nothing."""
    return later(requirement, notebook, "stand_ins")


def first_gap(package: Path, requirement: str, notebook: str = "") -> Gap | None:
    """Return the first thing that the package lacks for a requirement, None if it can be checked.

    `notebook` is the current one ("05"); the advice depends on it.
    """
    own = bool(notebook) and requirement == course().requirement_of(_LAYOUT)
    needs: Mapping[str, Sequence[str]] = course().notebook_table["needs"]
    so_far = [path for path in course().layout if checkpoints.written_in(path) <= notebook]
    wanted = so_far if own else needs.get(requirement, course().builds)
    last = [row["notebook"] for check, row in course().notebook_table["later"].items() if check.startswith(_LAYOUT)]
    return first_missing(package, wanted, notebook, finished=own and notebook < max(last, default=""))


def first_missing(package: Path, wanted: Sequence[str], notebook: str = "", *, finished: bool = False) -> Gap | None:
    """Return the first of the `wanted` files that the package lacks, or the first module that is not valid Python.

    Where they have to be `finished`, a stub counts as a gap.
    """
    own = (path.name for path in package.iterdir()) if package.is_dir() else ()
    if not any(not name.startswith(".") and name != "__pycache__" for name in own):
        return _lacking(say("your package is empty"), package, "package.xml", notebook)
    folders = (package, *interfaces_beside(package))
    for name in wanted:
        if not any((folder / name).is_file() for folder in folders):
            return _lacking(say("there is no {name}", name=name), package, name, notebook)
    texts = ((name, (package / name).read_text(encoding="utf-8", errors="replace")) for name in wanted)
    if finished and (stub := next((name for name, text in texts if re.search(r"\bTODO\b", text)), "")):
        seen, expected = (
            mark("{stub} is still a stub: it has a `TODO`"),
            mark("the files of the layout so far, each finished"),
        )
        try_ = mark("do the exercise that writes it, replace the `TODO`, and run its cell")
        return Gap(say(seen, stub=stub), say(expected), say(try_))
    modules = [name for name in wanted if name.startswith(f"{course().package}/")]
    return _broken_module(package, modules)


def interfaces_beside(package: Path) -> list[Path]:
    """Return the package beside this one that has interfaces of the contract which this one lacks; [] if none does."""
    wanted = [path for path in map(course().interface_file, course().interfaces) if not (package / path).is_file()]
    others = sorted(path.parent for path in package.parent.glob("*/package.xml") if path.parent != package)
    return [folder for folder in others if any((folder / path).is_file() for path in wanted)][:1]


def first_error(found: Build) -> str:
    """Return why a build failed: the first error of its log, and what to do about it if that is known."""
    if found.timed_out:
        return say("`colcon build` ran out of time")
    if found.exit_code == 0:
        return say("`colcon build` succeeded but installed no package; does CMakeLists.txt end with ament_package()?")
    error = build_log.find_error(found.log_tail)
    said = error.said or say("`colcon build` ended with exit status {found.exit_code}", found=found)
    return f"{said} ({error.cure})" if error.cure else said


def advice(reason: Reason | None) -> str:
    """Return what to do about the reason why a check could not be judged."""
    if reason is None:
        return say(_RUN_IT)
    if reason.requirements:
        first = reason.requirements[0]
        return say('fix {first} first: `check("{first}")` says more', first=first)
    if reason.cure:
        return reason.cure
    if reason.launch:
        words = mark("start the file yourself, with the YAML files beside it: `!ros2 launch {package} ...`")
        return say(words, package=course().package)
    if reason.kind in _NEEDS_PLACE and not reason.place:
        return say(_RUN_IT)
    built = course().requirement_of("check_build")
    by_cmake = "CMakeLists.txt" in course().layout
    return say(
        _ADVICE.get(reason.kind, _RUN_IT),
        built=say('`check("{built}")` says more', built=built),
        files=say("install(DIRECTORY launch config ...) in CMakeLists.txt")
        if by_cmake
        else say("data_files in setup.py"),
        programs=say("install(PROGRAMS ...) in CMakeLists.txt") if by_cmake else say("entry_points in setup.py"),
    )


def _lacking(seen: str, package: Path, name: str, notebook: str) -> Gap:
    """Return the gap for a file that is not there, or under nearly its name."""
    there = [file.relative_to(package).as_posix() for file in package.rglob("*")]
    meant = difflib.get_close_matches(name, there, n=1, cutoff=0.9)
    try_ = say("did you mean {meant[0]}?", meant=meant) if meant else how_to_get(name, notebook)
    return Gap(seen, say("{name} in the package's folder", name=name), try_)


def how_to_get(name: str, notebook: str) -> str:
    """Return what to do about a missing file: which notebook writes it, or how else to get it."""
    writer = checkpoints.written_in(name)
    if not writer:
        return say("write it; the handout shows the package's layout")
    if writer == notebook:
        return say("write it in this notebook's exercise, and run that cell")
    if writer < notebook:
        words = mark('notebook {writer} writes it; `start_at("{notebook}")` lays out what the earlier notebooks leave')
        return say(words, writer=writer, notebook=notebook)
    return say("notebook {writer} writes it", writer=writer)


def _broken_module(package: Path, names: Sequence[str]) -> Gap | None:
    """Return the first of these modules that is not valid Python."""
    for name in names:
        try:
            python_ast.tree_of((package / name).read_bytes())
        except python_ast.UNPARSABLE as error:
            line = getattr(error, "lineno", None)
            text = (getattr(error, "text", "") or "").strip()
            where = say("{name}, line {line}", name=name, line=line) if line else name
            problem = f"{where}: {getattr(error, 'msg', error)}" + (f": `{text}`" if text else "")
            return Gap(problem, say("valid Python"), say("look at that line, and at the end of the line before it"))
    return None
