"""The mutants as a source of evidence."""

from __future__ import annotations

from grader.evidence import Flag, Mutation, short_name
from grader.mutation.mutant_run import mutate
from grader.source import Collected, Source, Subject
from grader.student_tests.source import StudentTestRuns, mutants_key
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
        found = mutate(
            subject.submission.package, subject.install, ran.reach, settings.course, seed=settings.seed,
            seconds=settings.mutation_budget_s, progress=settings.progress,
        )  # fmt: skip
        flags = [_told_apart(found)] if found.convicted else []
        if not (ran.flags or flags):
            subject.kept.keep(found, *mutants_key(subject))
        return Collected({"mutation": found}, tuple(flags))


def _told_apart(mutation: Mutation) -> Flag:
    """Return the flag for tests that tell mutants by something else than what the package does."""
    names = ", ".join(short_name(name) for name in mutation.convicted[:3])
    words = f"{names} failed on changes that keep what the package does, so they tell mutants by its text"
    return Flag("mutants told apart", words, where=mutation.convicted[0].partition("::")[0], concerns=["mutation"])
