"""What of the package's code the contract's nodes reach, in numbers; and the modules without the rest."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path, PurePosixPath

from grader.course import Course
from grader.evidence import Reached, SourceFile
from grader.python_ast import Function, first_line
from grader.quality.parsed_module import Module
from grader.quality.reachability import makes_a_node, reachability


def reached_code(
    package: Path,
    modules: Sequence[Module],
    starters: Sequence[Module],
    texts: Mapping[str, str],
    files: list[SourceFile],
    course: Course,
) -> Reached:
    """Return what the nodes reach in the package's modules, which have these texts and counted lines.

    `starters` are programs that the build has left: they lead to modules, and are not measured.
    """
    found = reachability(
        package,
        {module.path: texts[module.path] for module in modules if module.role == "module"},
        {module.path: texts[module.path] for module in [*starters, *modules] if module.role == "script"},
        course=course,
    )
    # Other programs may run beside the contract's, and are not what is measured.
    programs = {*course.nodes, PurePosixPath(course.demonstration).stem}
    known = {module.path: module for module in modules}
    counted = {file.path: file.lines for file in files if not file.problem}
    inside, gaps = [], {}
    for module in modules:
        unreached = found.unreached.get(module.path, frozenset())
        if _is_program(module, programs) or (module.role == "module" and (not unreached or module.code - unreached)):
            inside.append(module)
            gaps[module.path] = unreached
    return Reached(
        nodes={node: sorted(homes) for node, homes in found.homes.items() if _is_there(homes, known)},
        # Lines of constants are few, because those beyond a limit are not counted at all.
        lines={m.path: max(0, counted.get(m.path, 0) - len(m.code & gaps[m.path])) for m in inside},
        gaps={path: ranges for path, lines in gaps.items() if (ranges := _ranges(lines))},
        idle={
            m.path: count
            for m in modules
            if (count := len(m.code & found.unreached.get(m.path, frozenset())))
            and (m in inside or not makes_a_node(m.tree))
        },
    )


def kept(modules: Sequence[Module], reached: Reached) -> list[Module]:
    """Return the modules that are reached, without what is not."""
    return [_without_gaps(module, reached) for module in modules if module.path in reached.lines]


def _is_program(module: Module, programs: set[str]) -> bool:
    return module.role == "launch" or (module.role == "script" and module.stem in programs)


def _is_there(homes: Iterable[str], modules: Mapping[str, Module]) -> bool:
    """Return whether a node's modules hold any code that could make one."""
    trees = [modules[path].tree for path in homes if path in modules]
    return any(isinstance(part, ast.ClassDef | Function) for tree in trees for part in ast.walk(tree))


def _ranges(lines: Iterable[int]) -> list[list[int]]:
    """Return the first and last line of each run of lines."""
    found: list[list[int]] = []
    for line in sorted(lines):
        if found and found[-1][1] == line - 1:
            found[-1][1] = line
        else:
            found.append([line, line])
    return found


def _without_gaps(module: Module, reached: Reached) -> Module:
    """Return a module without the functions and classes that are not reached."""
    if module.path not in reached.gaps:
        return module
    tree = deepcopy(module.tree)
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            body = getattr(node, name, None)
            if isinstance(body, list):
                left = [
                    part
                    for part in body
                    if not isinstance(part, ast.ClassDef | Function) or reached.covers(module.path, first_line(part))
                ]
                setattr(node, name, left)
    return replace(module, tree=tree)
