"""The mutants as a source of evidence."""

from __future__ import annotations

from grader.mutation.mutant_run import mutate
from grader.source import Collected, Phase, Subject


class Mutants:
    """Mutates the package and runs its own tests on the mutants. Uses every core, so it comes last."""

    name = "mutation"
    phase = Phase.ALONE
    serves = frozenset({"T3"})

    def collect(self, subject: Subject) -> Collected:
        """Return which mutants were noticed."""
        settings = subject.settings
        settings.progress("mutating the package to see whether its own tests notice")
        found = mutate(
            subject.submission.package, subject.install, subject.earlier["student tests"].reach, seed=settings.seed,
            seconds=settings.mutation_budget_s, progress=settings.progress,
        )  # fmt: skip
        return Collected({"mutation": found})
