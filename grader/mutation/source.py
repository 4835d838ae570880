"""The mutants as a source of evidence: the package's own tests run on them round by round, and notice them or not."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path

from grader.course import Course
from grader.evidence import Flag, Mutant, Mutation, short_name
from grader.mutation.examination import Verdicts, examinations, judge
from grader.mutation.jobs import Job, JobResult, JobRunner, TestedPackage
from grader.mutation.operators import mutants
from grader.mutation.selection import Selector, choose
from grader.mutation.source_text import MODULE, Change, is_too_complex, parse
from grader.processes import jobs
from grader.processes.jobs import Where
from grader.settings import MUTATION_BUDGET_S
from grader.source import Asked, Collected, Source, Subject
from grader.student_tests import package_modules
from grader.student_tests.module_results import ModuleReach
from grader.student_tests.source import OWN_TESTS, SuiteRun, own_tests
from grader.student_tests.warm_worker import WorkerPool, start_workers
from grader.words import mark, say

_MUTANTS = mark("mutants")
MUTANTS = 50  # that tests reach; the others take no time. docs/course.md says how well these stand for all
_ENOUGH, _MISSED = 30, 1
"""After so many mutants the others are not tried if at most so many were missed. A suite that notices 85 % of all gets
here one time in twenty; docs/course.md says what that is worth."""
# Results count by whole rounds, so that a slow machine does not change a grade by a little.
ROUND = 10
# What a busy machine may take, by the clock, for the work of a quiet one: a factor on the budget, and at least seconds.
_HARD_LIMIT, _HARD_LIMIT_AT_LEAST = 3.0, 60.0


class Mutants(Source):
    """Mutates the package and runs its own tests on the mutants."""

    name = "mutation"

    def ask(self, subject: Subject) -> Asked:
        """Return the job of trying the mutants, after that of the own tests."""
        settings, package = subject.settings, subject.submission.package
        # To start two workers takes two seconds of CPU time, so the own tests have the same.
        closing = ExitStack()
        workers = closing.enter_context(start_workers(package, subject.install))
        subject.closing.callback(closing.close)

        def run(ran: SuiteRun) -> Mutation:
            with closing:  # while workers wait they look for requests all the time
                return mutate(
                    package, subject.install, ran.reach, settings.course, seed=settings.seed,
                    seconds=settings.mutation_budget_s, progress=settings.progress, workers=workers,
                )  # fmt: skip

        def collected(found: Mutation) -> Collected:
            return Collected({"mutation": found}, (_told_apart(found),) if found.convicted else ())

        job = jobs.Job(
            _MUTANTS, Where.SANDBOX, Mutation, run, after=OWN_TESTS,
            lasting=lambda found: not found.convicted, serves=self.serves(settings),
            decided_by=(subject.handed_in, subject.seen_by_nodes, str(settings.mutation_budget_s)),
            says=say("mutating the package to see whether its own tests notice"),
        )  # fmt: skip
        return Asked([own_tests(subject, workers), job], lambda results: collected(results[_MUTANTS]))


def _told_apart(mutation: Mutation) -> Flag:
    """Return the flag for tests that tell mutants by something else than what the package does."""
    names = ", ".join(short_name(name) for name in mutation.convicted[:3])
    words = f"{names} failed on changes that keep what the package does, so they tell mutants by its text"
    return Flag("mutants told apart", words, where=mutation.convicted[0].partition("::")[0], concerns=["mutation"])


def mutate(
    package: Path,
    install: Path,
    reach: Sequence[ModuleReach],
    course: Course,
    *,
    seed: int = 0,
    count: int = MUTANTS,
    seconds: float = MUTATION_BUDGET_S,
    workers: WorkerPool | None = None,
    progress: Callable[[str], None] = lambda _what: None,
) -> Mutation:
    """Return which mutants of a package its own tests notice.

    Args:
        package: the package's source folder.
        install: its install tree; modules are changed there and in the source folder alike.
        reach: what each test module's tests reach, from `student_tests.source.run_suite`.
        course: the assignment, of which names and parameters are changed, too.
        seed: decides equivalent mutants, and the order in a round. Which mutants are tried it does not decide.
        count: how many mutants to try that tests reach.
        seconds: the time to spend, as wall time of a quiet machine with as many cores as workers.
        workers: what runs the tests, by default workers of their own.
        progress: called with a sentence after each round.
    """
    started = time.monotonic()
    texts = package_modules.texts(package, install)
    sources = {name: source for name, text in texts.items() if text is not None and (source := parse(name, text))}
    possible = [change for source in sources.values() for change in mutants(source, course)]
    selector = Selector(reach)
    chosen = choose(possible, count, lambda change: bool(selector.tests(change)))
    chosen = [change for change in chosen if sources[change.path].compiles(change)]
    unreadable = _of_unreadable_modules(texts, len(chosen))
    copies = {name: package_modules.copies(package, install, [name]) for name in sources}
    paths = {name: [path for path, text in copies[name].items() if text == s.text] for name, s in sources.items()}
    tested = TestedPackage(sources, paths, {r.module: r for r in reach})
    verdicts = Verdicts(tested, selector, random.Random(f"decoys {seed}"))
    reached = [change for change in chosen if verdicts.selection(change)]
    quiet_seconds = 0.0
    if reached:
        for change in chosen:
            verdicts.note_not_tried(change)
        until = started + max(_HARD_LIMIT * seconds, _HARD_LIMIT_AT_LEAST)
        with nullcontext(workers) if workers else start_workers(package, install) as pool:
            quiet_seconds = _rounds(verdicts, chosen, JobRunner(pool, tested, until), seconds, progress)
    else:
        for change in chosen:
            verdicts.note_mutant(JobResult(Job(change, ())))
    found = [verdicts.outcomes[change] for change in chosen if change in verdicts.outcomes]
    places = package_modules.handed_in(package, texts)
    return Mutation(
        seed=seed,
        mutants=[replace(each, path=places.get(each.path, each.path)) for each in (*found, *unreadable)],
        equivalent_mutants=verdicts.equivalent_mutants,
        set_aside=sorted(verdicts.set_aside), convicted=sorted(verdicts.convicted),
        wall_seconds=round(time.monotonic() - started, 1), quiet_seconds=round(quiet_seconds, 1),
        note=_note(verdicts, seconds),
    )  # fmt: skip


def _note(verdicts: Verdicts, seconds: float) -> str:
    not_tried = sum(mutant.outcome == "not tried" for mutant in verdicts.outcomes.values())
    if not not_tried or verdicts.convicted:
        return ""
    return f"{not_tried} of {len(verdicts.outcomes)} mutants were not tried: the budget of {seconds:g} s was used up"


def _of_unreadable_modules(texts: Mapping[str, str | None], count: int) -> list[Mutant]:
    """Return mutants, unreached, that stand in for modules that may run and cannot be parsed.

    There are as many as if each module were as long as the others: hiding a module must not be worth more than
    showing it.
    """
    hidden = [name for name, text in texts.items() if text is None or is_too_complex(text)]
    words = "the module cannot be read, so it cannot be mutated"
    each = max(1, round(count / max(1, len(texts))))
    return [Mutant(name, 1, MODULE, "module", words, "unreached") for name in hidden for _ in range(each)]


def _rounds(
    verdicts: Verdicts, chosen: Sequence[Change], runner: JobRunner, seconds: float, progress: Callable[[str], None]
) -> float:
    """Try the mutants round by round while the budget lasts; return the seconds spent.

    Each round also examines tests that noticed mutants in the one before. Mutants that no test reaches take no time
    but keep their places: a budget that runs out cuts off both kinds.
    """
    waiting = list(chosen)
    noticed: list[JobResult] = []
    tried = 0
    while (waiting or noticed) and not verdicts.convicted:
        batch, waiting = waiting[:ROUND], waiting[ROUND:]
        asked = [Job(change, verdicts.selection(change)) for change in batch]
        asked += examinations(verdicts, noticed, fill_up=not batch or verdicts.noticed <= ROUND)
        verdicts.rng.shuffle(asked)
        before = runner.seconds_spent
        results = runner.run(asked)
        noticed, again = _judge_round(verdicts, runner, results)
        for change in again:
            verdicts.note_not_tried(change)
        waiting += again
        tried += len(batch)
        if not again and verdicts.missed <= _MISSED and verdicts.noticed + verdicts.missed >= _ENOUGH:
            for change in waiting:
                del verdicts.outcomes[change]
            waiting = []
        words = mark("mutants: {tried} of {n} tried, {noticed} noticed")
        progress(say(words, tried=min(tried, len(chosen)), n=len(chosen), noticed=verdicts.noticed))
        # Another round costs about as much as this one.
        needed = runner.seconds_spent + (runner.seconds_spent - before)
        if needed > seconds * runner.size or not all(result.tried for result in results):
            waiting = []
    return runner.seconds_spent / runner.size


def _judge_round(
    verdicts: Verdicts, runner: JobRunner, results: Sequence[JobResult]
) -> tuple[list[JobResult], list[Change]]:
    """Record a round's results; return those of noticed mutants, and the mutants to try again."""
    again: list[Change] = []
    noticed: list[JobResult] = []
    # Examinations first: they decide whether what a test noticed in this round counts.
    for result in sorted((r for r in results if r.tried), key=lambda result: result.job.examines is None):
        if result.job.examines is not None:
            again += [] if verdicts.convicted else judge(verdicts, runner, result)
        elif verdicts.selection(result.job.changed) != result.job.selections:
            again.append(result.job.changed)  # other tests are to be run by now
        else:
            verdicts.note_mutant(result)
            if verdicts.counts(result):
                noticed.append(result)
    again = list(dict.fromkeys(again))
    return [result for result in noticed if result.job.changed not in again], again
