"""The mutants as a source of evidence."""

from __future__ import annotations

from grader.evidence import Flag, Mutation, short_name
from grader.mutation.mutant_run import WORKERS, life_s, mutate
from grader.processes.jobs import Job, Turn, Where
from grader.source import Asked, Collected, Source, Subject
from grader.student_tests.source import OWN_TESTS, own_tests
from grader.student_tests.suite_run import SuiteRun
from grader.student_tests.warm_worker import SharedWorkers
from grader.words import mark, say

_MUTANTS = mark("mutants")


class Mutants(Source):
    """Mutates the package and runs its own tests on the mutants."""

    name = "mutation"

    def ask(self, subject: Subject) -> Asked:
        """Return the job of trying the mutants, after that of the own tests."""
        settings = subject.settings
        workers = SharedWorkers(WORKERS, life_s(settings.mutation_budget_s))
        subject.closing.callback(workers.close)

        def run(ran: SuiteRun) -> Mutation:
            try:
                return mutate(
                    subject.submission.package, subject.install, ran.reach, settings.course, seed=settings.seed,
                    seconds=settings.mutation_budget_s, progress=settings.progress, start=workers.start,
                )  # fmt: skip
            finally:
                workers.close()  # while they wait they look for requests all the time

        def collected(found: Mutation) -> Collected:
            return Collected({"mutation": found}, (_told_apart(found),) if found.convicted else ())

        job = Job(
            _MUTANTS, Where.SANDBOX, Mutation, run, after=OWN_TESTS, turn=Turn.CHAIN,
            lasting=lambda found: not found.convicted, serves=self.serves(settings),
            decided_by=(subject.handed_in, subject.seen_by_nodes, str(settings.mutation_budget_s)),
            says=say("mutating the package to see whether its own tests notice"),
        )  # fmt: skip
        return Asked([own_tests(subject, workers.start), job], lambda results: collected(results[_MUTANTS]))


def _told_apart(mutation: Mutation) -> Flag:
    """Return the flag for tests that tell mutants by something else than what the package does."""
    names = ", ".join(short_name(name) for name in mutation.convicted[:3])
    words = f"{names} failed on changes that keep what the package does, so they tell mutants by its text"
    return Flag("mutants told apart", words, where=mutation.convicted[0].partition("::")[0], concerns=["mutation"])
