"""What of a package counts for its tests. Replaced by what ran in the nodes' trials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from grader.course import Course
from grader.evidence import Evidence


@dataclass(frozen=True)
class Measured:
    """Which of a package's Python files count, and which are each node's own."""

    whole: frozenset[str] = frozenset()
    of_node: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def covers(self, path: str, _line: int) -> bool:
        """Return whether what stands on a line counts."""
        return path in self.whole


def measure(evidence: Evidence, course: Course) -> Measured:
    """Return what counts of a package."""
    files = {file.path for file in evidence.quality.files} if evidence.quality else set()
    if evidence.tests is not None:
        files |= {file.path for file in evidence.tests.coverage}
        files |= {path for module in evidence.tests.modules for path in (*module.reached, *module.tested)}
    files |= {mutant.path for mutant in (evidence.mutation.mutants if evidence.mutation else ())}
    return Measured(frozenset(files), {name: frozenset({node.module}) for name, node in course.nodes.items()})
