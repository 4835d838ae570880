"""What the results say so far: which mutants were noticed, and which tests cannot be relied on."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from typing import Any

from grader.evidence import EquivalentMutant, Mutant
from grader.mutation.jobs import Job, JobResult, TestedPackage
from grader.mutation.selection import Selection, Selector
from grader.mutation.source_text import Change

_TRIED_AT_MOST = 60


@dataclass
class Verdicts:
    """The outcome of each mutant, and what is known of the tests."""

    package: TestedPackage
    selector: Selector
    rng: random.Random
    outcomes: dict[Change, Mutant] = field(default_factory=dict)
    equivalent_mutants: list[EquivalentMutant] = field(default_factory=list)
    set_aside: set[str] = field(default_factory=set)
    """Tests whose failures do not count."""
    run_whole: set[str] = field(default_factory=set)
    """Modules whose tests depend on each other: all of them run, in their own order."""
    convicted: set[str] = field(default_factory=set)
    """Tests that failed on several equivalent mutants."""
    passed_equivalent: set[tuple[str, str]] = field(default_factory=set)
    """Tests that have passed an equivalent mutant in a file: (test, file)."""

    @property
    def noticed(self) -> int:
        """Return how many mutants were noticed."""
        return sum(mutant.outcome == "noticed" for mutant in self.outcomes.values())

    def selection(self, change: Change) -> tuple[Selection, ...]:
        """Return the tests to run on a mutant, as far as is known."""
        return tuple(self.selector.tests(change, self.set_aside, self.run_whole))

    def counts(self, result: JobResult) -> bool:
        """Return whether a mutant was noticed by a test that is not set aside."""
        return bool(result.noticed_by) and result.noticed_by not in self.set_aside

    def note_not_tried(self, change: Change) -> None:
        """Record that a mutant is still to be tried."""
        self.outcomes[change] = _mutant(change, "not tried")

    def note_mutant(self, result: JobResult) -> None:
        """Record how a mutant came out: unnoticed, not unreached, if only tests that were set aside reach it."""
        change = result.job.changed
        if self.counts(result):
            self.outcomes[change] = _mutant(change, "noticed", by=result.noticed_by, late=result.timed_out)
        elif self.selector.tests(change):
            self.outcomes[change] = _mutant(change, "unnoticed", tried=result.job.tests[:_TRIED_AT_MOST])
        else:
            self.outcomes[change] = _mutant(change, "unreached")

    def note_equivalent(self, result: JobResult) -> None:
        """Record how an equivalent mutant came out."""
        change = result.job.changed
        self.equivalent_mutants.append(
            EquivalentMutant(change.path, change.line, change.words, tests=result.ran, failed=list(result.failed))
        )

    def is_whole(self, job: Job) -> bool:
        """Return whether a job runs the tests of its one module in the module's own order, from the first one on."""
        [selection] = job.selections
        order = [name for name in self.package.reach[selection.module].seconds if name not in self.set_aside]
        return list(selection.tests) == order[: len(selection.tests)]


def _mutant(change: Change, outcome: str, **facts: Any) -> Mutant:
    return Mutant(change.path, change.line, change.function, change.operator, change.words, outcome, **facts)
