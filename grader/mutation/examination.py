"""Examine tests that noticed mutants: do they pass when a change keeps the behaviour?

A test that fails on an equivalent mutant is unreliable, dependent on other tests, or checks something other than
behaviour. Further runs tell these apart.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from grader.evidence import EquivalentMutant, Mutant
from grader.mutation.equivalent_mutants import WEAK, equivalent_mutants
from grader.mutation.jobs import Job, JobResult, JobRunner, TestedPackage
from grader.mutation.selection import Selection, Selector
from grader.mutation.source_text import Change

# One equivalent mutant for five mutants, at least six: enough to expose a suite that fails on any change of the source.
_SHARE = 0.2
_AT_LEAST = 6
_PATIENCE = 4.0  # times the usual limits: a busy machine must not decide whether a test is set aside
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

    @property
    def missed(self) -> int:
        """Return how many mutants were tried and not noticed."""
        return sum(mutant.outcome in ("unnoticed", "unreached") for mutant in self.outcomes.values())

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


def examinations(verdicts: Verdicts, noticed: Sequence[JobResult], fill_up: bool) -> list[Job]:
    """Return equivalent mutants for some of the mutants just noticed: in the same function, for the same tests.

    Tests that have passed no equivalent mutant in the file come first, and among them those that noticed most. With
    `fill_up` there are enough to have tried the least number of equivalent mutants after this round.
    """
    times_noticed = Counter(result.noticed_by for result in noticed)
    wanted = max(1, round(_SHARE * len(noticed) + 0.5))
    if fill_up:
        wanted = max(wanted, _AT_LEAST - len(verdicts.equivalent_mutants))
    candidates = list(noticed)
    verdicts.rng.shuffle(candidates)
    candidates.sort(
        key=lambda r: ((r.noticed_by, r.job.changed.path) in verdicts.passed_equivalent, -times_noticed[r.noticed_by])
    )
    jobs: list[Job] = []
    examined: set[tuple[str, str]] = set()
    for number, result in enumerate([*candidates, *candidates]):
        if len(jobs) >= wanted:
            break
        mutant = result.job.changed
        if number < len(candidates) and (result.noticed_by, mutant.path) in examined:
            continue  # another test's turn; this one's again if there is no other
        equivalent = _equivalent_for(verdicts, mutant, skip=number // len(candidates))
        if equivalent is not None:
            examined.add((result.noticed_by, mutant.path))
            jobs.append(Job(equivalent, _up_to_failure(result), examines=mutant))
    return jobs


def judge(verdicts: Verdicts, runner: JobRunner, result: JobResult) -> list[Change]:
    """Record how an examination came out; return the mutants to try again because a test proved unreliable."""
    job = result.job
    assert job.examines is not None
    if not result.noticed_by:
        verdicts.note_equivalent(result)
        verdicts.passed_equivalent |= {(name, job.examines.path) for name in job.tests}
        return []
    if result.noticed_by in verdicts.set_aside or (result.module in verdicts.run_whole and not verdicts.is_whole(job)):
        return []  # known by now; the mutants concerned are tried again anyway
    # A test failed although the behaviour is the same. Does it fail on the original, again, and on another one?
    other = _equivalent_for(verdicts, job.examines, but=job.change)
    original, again, other_one = runner.run(
        [Job(change, job.selections, job.examines, _PATIENCE) for change in (None, job.change, other)]
    )
    if original.noticed_by and result.module not in verdicts.run_whole:
        # The tests depend on each other: from now on all of them run, in their own order.
        verdicts.run_whole.add(result.module)
        return [change for change, mutant in verdicts.outcomes.items() if mutant.by.startswith(result.module)]
    if original.noticed_by:
        verdicts.set_aside |= {original.noticed_by, result.noticed_by}
    elif again.noticed_by and other_one.noticed_by and other is not None:
        verdicts.note_equivalent(again)
        verdicts.note_equivalent(other_one)
        verdicts.convicted.add(again.noticed_by)
        return []
    else:
        verdicts.set_aside.add(result.noticed_by)
    return [change for change, mutant in verdicts.outcomes.items() if mutant.by in verdicts.set_aside]


def _equivalent_for(verdicts: Verdicts, mutant: Change, skip: int = 0, but: Change | None = None) -> Change | None:
    """Return an equivalent mutant in the same function, or else in the same file; `but` is not an answer."""
    source = verdicts.package.sources[mutant.path]
    in_file = [change for change in equivalent_mutants(source) if change != but]
    near = [change for change in in_file if change.function == mutant.function] or in_file
    if not near:
        return None
    verdicts.rng.shuffle(near)
    near.sort(key=lambda change: (change.operator == WEAK, abs(change.line - mutant.line) > 3))
    skip %= len(near)
    return next((change for change in [*near[skip:], *near[:skip]] if source.compiles(change)), None)


def _up_to_failure(result: JobResult) -> tuple[Selection, ...]:
    """Return the tests of the module that noticed, up to the one that failed; the modules before it passed."""
    selection = next(s for s in result.job.selections if s.module == result.module)
    tests = selection.tests
    if result.noticed_by in tests and not result.timed_out:
        tests = tests[: tests.index(result.noticed_by) + 1]
    return (Selection(selection.module, tests),)


def _mutant(change: Change, outcome: str, **facts: Any) -> Mutant:
    return Mutant(change.path, change.line, change.function, change.operator, change.words, outcome, **facts)
