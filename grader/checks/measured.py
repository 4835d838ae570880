"""What of a package is measured: the files of which code ran in the nodes' trials, and the contract's functions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from grader.course import Course
from grader.course.model import role
from grader.evidence import Evidence, SourceFile, reading_limits


@dataclass(frozen=True)
class Measured:
    """Which of a package's Python files count for its quality and its tests. Paths are those of SourceFile.

    Attributes:
        whole: files of which a function ran in a node's trials, and that of the contract's functions.
        imported: files that ran only by being imported: there, what stands outside of functions counts.
        idle: the package's other modules and programs. They neither earn nor cost.
        of_node: a node's own files by its name: those whose functions ran in its trials and in no other node's, or all
            whose functions ran if that leaves none. A node that is not there is left out.
        functions: the first and last lines of the functions in each file.
        by_notes: whether trials have shown what runs; otherwise everything handed in counts.
    """

    whole: frozenset[str] = frozenset()
    imported: frozenset[str] = frozenset()
    idle: list[str] = field(default_factory=list)
    of_node: Mapping[str, frozenset[str]] = field(default_factory=dict)
    functions: Mapping[str, list[list[int]]] = field(default_factory=dict)
    by_notes: bool = False

    def covers(self, path: str, line: int) -> bool:
        """Return whether what stands on a line counts."""
        if path in self.imported:
            return not any(first <= line <= last for first, last in self.functions.get(path, ()))
        return path in self.whole

    def lines(self, files: Iterable[SourceFile]) -> int:
        """Return how many lines of code count, over which the density of findings is taken."""
        counted = [
            SourceFile(file.path, file.outside if file.path in self.imported else file.lines, file.problem)
            for file in files
            if file.path in self.whole | self.imported
        ]
        return reading_limits.counted_lines(counted)


def measure(evidence: Evidence, course: Course) -> Measured:
    """Return what counts of a package, whose text has been read.

    Where a node did not come up, the contract's module for it counts as it was handed in. Where no trial has noted what
    runs, every module and the nodes' programs do.
    """
    files = evidence.quality.files if evidence.quality is not None else []
    noted = _noted(evidence, course)
    handed_in = {node: found for node in course.nodes if (found := _file_of(node, files, course))}
    inside = course.functions.module.partition("/")[2] if course.functions else ""
    home = frozenset([file.path for file in files if inside and file.path.endswith(f"/{inside}")][:1])
    if noted:
        ran = {node: frozenset(path for path, lines in notes.items() if lines) for node, notes in noted.items()}
        of_node = {node: _own(node, ran, home) for node in ran if ran[node]}
        of_node |= {
            node: frozenset({file.path}) for node, file in handed_in.items() if node not in noted and _has(file)
        }
        whole = home.union(*ran.values(), *of_node.values())
        imported = frozenset(path for notes in noted.values() for path in notes) - whole
    else:
        whole = frozenset(file.path for file in files if _may_run(file.path, course)) | home
        of_node = {node: frozenset({file.path}) for node, file in handed_in.items() if _has(file)}
        imported = frozenset()
    idle = [f.path for f in files if f.lines and f.path not in whole | imported and _may_run(f.path, course)]
    functions = {file.path: file.functions for file in files}
    return Measured(whole, imported, sorted(idle), of_node, functions, bool(noted))


def _noted(evidence: Evidence, course: Course) -> dict[str, dict[str, list[int]]]:
    """Return what ran in the trials of each node that has noted it: the first lines of functions by path."""
    found: dict[str, dict[str, list[int]]] = {}
    for trial in evidence.trials.values():
        if trial.ran is not None and trial.ran.of_functions and trial.node in course.nodes:
            notes = found.setdefault(trial.node, {})
            for path, lines in trial.ran.functions.items():
                notes[path] = [*notes.get(path, []), *lines]
    return found


def _own(node: str, ran: Mapping[str, frozenset[str]], home: frozenset[str]) -> frozenset[str]:
    others = frozenset[str]().union(*(paths for name, paths in ran.items() if name != node))
    return (ran[node] - others - home) or (ran[node] - home) or ran[node]


def _file_of(node: str, files: Sequence[SourceFile], course: Course) -> SourceFile | None:
    """Return the file of the contract's module for a node, or the one that is called like it; None if it is missing."""
    named = [file for file in files if PurePosixPath(file.path).stem == node and _may_run(file.path, course)]

    def rank(file: SourceFile) -> tuple[bool, bool, int, str]:
        is_module = role(file.path, course.package) == "module"
        return not _has(file), file.path != course.nodes[node].module, not is_module, file.path

    return min(named, key=rank, default=None)


def _has(file: SourceFile) -> bool:
    """Return whether a file has any code that could make a node; one that cannot be read may have some."""
    return bool(file.functions or file.problem)


def _may_run(path: str, course: Course) -> bool:
    """Return whether a file could be run by a node: a module, or a node's program."""
    what = role(path, course.package)
    return what == "module" or (what == "script" and PurePosixPath(path).stem in course.nodes)
