"""The mutants as a source of evidence."""

from __future__ import annotations

from grader.evidence import Mutation
from grader.mutation.mutant_run import mutate
from grader.source import Collected, Source, Subject
from grader.student_tests.source import StudentTestRuns, keep_runs, mutants_key, runs_to_keep
from grader.student_tests.suite_run import SuiteRun
from grader.words import say


class Mutants(Source):
    """Mutates the package and runs its own tests on the mutants."""

    name = "mutation"
    uses = frozenset({StudentTestRuns.name})

    def collect(self, subject: Subject) -> Collected:
        """Return which mutants were noticed."""
        settings, ran = subject.settings, subject.earlier[StudentTestRuns.name]
        if (kept := subject.kept.find(Mutation, *mutants_key(subject))) and ran is None:
            return Collected({"mutation": kept[0]}, kept={"mutants": kept[1]})
        assert isinstance(ran, SuiteRun)
        settings.progress(say("mutating the package to see whether its own tests notice"))
        kept_runs = runs_to_keep(subject)
        found = mutate(
            subject.submission.package, subject.install, ran.reach, settings.course, seed=settings.seed,
            seconds=settings.mutation_budget_s, kept_runs=kept_runs, progress=settings.progress,
        )  # fmt: skip
        if not ran.flags:
            subject.kept.keep(found, *mutants_key(subject))
        return Collected({"mutation": found}, kept=keep_runs(kept_runs, "runs on mutants", flagged=bool(ran.flags)))
