"""Grade a whole class: several submissions at once, never stopped by one, resumed where it was interrupted."""

from __future__ import annotations

import datetime as dt
import hashlib
import os
import socket
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Protocol

from grader import sandbox
from grader.checks import checks_run
from grader.classroom import cluster, discovery, hand_ins, overrides
from grader.classroom.class_folder import CLASS, RUBRIC, ClassFacts, ClassFolder, Record, Status, relative
from grader.classroom.entry import Entry
from grader.classroom.one_grading import Ending, Order, Runner
from grader.classroom.roster import Person
from grader.course import kits_own
from grader.host import provenance, shortage
from grader.host.atomic import write_atomically
from grader.scoring import rubric
from grader.scoring.grading import HandIn
from grader.settings import MUTATION_BUDGET_S

# One grading keeps two cores busy nearly all the time: build, trials and tests beside each other. The memory is an
# estimate with room to spare, not a measurement.
CORES_EACH = 2
MEMORY_EACH = 2 * 1024**3
_ATTEMPTS = 2
_TICK_S = 1.0  # between two looks at what is running, for the progress line


@dataclass(frozen=True)
class Options:
    """How to grade a class. `scheduler` is a Dask scheduler's address, "" for this machine with `jobs` at a time."""

    rubric: Path = rubric.RUBRIC
    seed: int = 0
    cache: Path | None = None
    mutation_budget_s: float = MUTATION_BUDGET_S
    jobs: int = 0
    scheduler: str = ""
    deadline: dt.datetime | None = None
    late_rule: str = ""
    fresh: bool = False


@dataclass(frozen=True)
class Progress:
    """Where a run is. `left_s` is an estimate of the wall time that is left, None before the first result."""

    done: int
    total: int
    running: dict[str, str]
    left_s: float | None


@dataclass(frozen=True)
class Summary:
    """What a run has done. `kept` were graded before; `interrupted` says that it was ended by Ctrl-C."""

    entries: int
    graded: int
    refused: int
    errors: int
    kept: int
    missing: int
    seconds: float
    interrupted: bool = False


class Said(Protocol):
    """Who is told how a run goes on."""

    def finished(self, record: Record, progress: Progress) -> None:
        """Say that a submission is done."""

    def going_on(self, progress: Progress) -> None:
        """Say what is running; called about once a second."""


def jobs_here() -> int:
    """Return how many gradings this machine bears at once: by its cores and its free memory, at least one."""
    return max(1, min((os.cpu_count() or 1) // CORES_EACH, shortage.free_memory() // MEMORY_EACH))


def run(source: Path, out: Path, people: Sequence[Person], options: Options, said: Said) -> Summary:
    """Grade the submissions in `source` into the class folder `out`, and return what was done.

    What `out` holds already with the same input, rubric, seed and kit is not graded again. Ctrl-C ends the running
    gradings and returns; the same call goes on from what was finished.

    Raises:
        GraderError: there are no submissions, the folder cannot be written, or this machine cannot grade at all.
        SubmissionError: the archive of the class cannot be opened.
    """
    started = time.monotonic()
    whole = rubric.load(options.rubric, checks_run.known(kits_own()))
    if not options.scheduler:
        sandbox.require()
    folder = ClassFolder(out)
    with folder.locked(), discovery.opened(source) as root:
        earlier = folder.facts().entries if (folder.path / CLASS).exists() else ()
        found = discovery.find(root, people, earlier)
        text = options.rubric.read_text(encoding="utf-8")
        rubric_hash = hashlib.sha256(text.encode()).hexdigest()
        kit = provenance.kit_hash()
        facts = ClassFacts(
            title=whole.title,
            source=str(source),
            layout=found.layout,
            rubric=rubric_hash,
            kit=kit,
            version=provenance.environment()["ros2-course-kit"],
            commit=provenance.commit(),
            seed=options.seed,
            entries=relative(found.entries, root),
            missing=found.missing,
            notes=found.notes,
            deadline=options.deadline,
            late_rule=options.late_rule,
            made=dt.datetime.now().astimezone(),
        )
        decided = overrides.of_class(folder, facts, whole)
        folder.write_facts(facts)
        write_atomically(folder.path / RUBRIC, text)
        known = (hand_ins.hand_in(entry, facts, decided) for entry in facts.entries)
        planned = [
            _planned(entry, each, text, rubric_hash, kit, options)
            for entry, each in zip(found.entries, known, strict=True)
        ]
        todo = [job for job in planned if options.fresh or not _done(folder, job)]
        workforce = (
            cluster.workforce(options.scheduler, kit) if options.scheduler else here(options.jobs or jobs_here())
        )
        with workforce as grade:
            loop = _Loop(folder, grade, said, len(planned))
            interrupted = loop.run(todo)
    records = [folder.current(entry, facts) for entry in found.entries]
    states = [record.status for record in records if record is not None]
    return Summary(
        entries=len(found.entries),
        graded=states.count(Status.GRADED),
        refused=states.count(Status.REFUSED),
        errors=states.count(Status.ERROR),
        kept=len(planned) - len(todo),
        missing=len(found.missing),
        seconds=time.monotonic() - started,
        interrupted=interrupted,
    )


@dataclass(frozen=True)
class Job:
    """One submission to grade, and the record of it as far as it is known beforehand."""

    entry: Entry
    order: Order
    record: Record


class Workforce(Protocol):
    """Whatever grades: this machine's processes or a cluster."""

    slots: int

    def submit(self, order: Order) -> Future[Ending]:
        """Begin a grading into the folder `order.out`; the future never raises for the submission's sake."""

    def doing(self) -> dict[str, str]:
        """Return what is going on, by the ids of the submissions that are being graded."""

    def stop(self) -> None:
        """End everything at once."""


class _Here:
    """Grades on this machine."""

    def __init__(self, jobs: int) -> None:
        self.slots = jobs
        self._doing: dict[str, str] = {}
        self._runner = Runner(self._heard)
        self._threads = ThreadPoolExecutor(jobs)

    def submit(self, order: Order) -> Future[Ending]:
        return self._threads.submit(self._grade, order)

    def doing(self) -> dict[str, str]:
        return dict(self._doing)

    def stop(self) -> None:
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._runner.stop()
        self._threads.shutdown(wait=True)

    def _grade(self, order: Order) -> Ending:
        self._doing[order.id] = ""
        try:
            return self._runner.grade(order)
        finally:
            del self._doing[order.id]

    def _heard(self, name: str, what: str) -> None:
        self._doing[name] = what


@contextmanager
def here(jobs: int) -> Iterator[Workforce]:
    """Yield what grades up to `jobs` submissions at a time on this machine."""
    workforce = _Here(jobs)
    try:
        yield workforce
    finally:
        workforce.stop()


class _Loop:
    """Hands jobs out, keeps the results, and tries once more, alone, what failed for reasons of ours."""

    def __init__(self, folder: ClassFolder, workforce: Workforce, said: Said, total: int) -> None:
        self._folder = folder
        self._workforce = workforce
        self._said = said
        self._total = total
        self._done = 0
        self._seconds: list[float] = []

    def run(self, jobs: list[Job]) -> bool:
        """Grade all jobs; return whether that was interrupted by Ctrl-C."""
        self._done = self._total - len(jobs)
        try:
            again = self._round(jobs, self._workforce.slots, attempt=1)
            self._round(again, 1, attempt=_ATTEMPTS)
        except KeyboardInterrupt:
            self._workforce.stop()
            return True
        return False

    def _round(self, jobs: list[Job], slots: int, attempt: int) -> list[Job]:
        """Grade the jobs, at most `slots` at a time, and return those that failed and may be tried again."""
        waiting, again = list(reversed(jobs)), []
        running: dict[Future[Ending], Job] = {}
        while waiting or running:
            while waiting and len(running) < slots:
                job = waiting.pop()
                out = self._folder.working(job.entry.id)
                begun = dt.datetime.now().astimezone().isoformat(timespec="seconds")
                job = replace(
                    job, order=replace(job.order, out=str(out.resolve())), record=replace(job.record, started=begun)
                )
                running[self._workforce.submit(job.order)] = job
            ended, _ = wait(running, timeout=_TICK_S, return_when=FIRST_COMPLETED)
            for future in [each for each in running if each in ended]:  # in the order in which they began
                job = running.pop(future)
                ending = future.result()
                if ending.status is Status.ERROR and attempt < _ATTEMPTS:
                    again.append(job)
                else:
                    self._keep(job, ending, attempt, len(waiting) + len(running) + len(again), slots)
            self._said.going_on(self._progress(len(waiting) + len(running) + len(again), slots))
        return again

    def _keep(self, job: Job, ending: Ending, attempt: int, left: int, slots: int) -> None:
        record = replace(
            job.record, status=ending.status, why=ending.why, seconds=round(ending.seconds, 1), attempts=attempt
        )
        self._folder.keep(Path(job.order.out), record)
        self._done += 1
        if ending.status is Status.GRADED:  # what cannot be graded takes no time worth counting
            self._seconds.append(ending.seconds)
        self._said.finished(record, self._progress(left, slots))

    def _progress(self, left: int, slots: int) -> Progress:
        mean = sum(self._seconds) / len(self._seconds) if self._seconds else None
        return Progress(
            done=self._done,
            total=self._total,
            running=self._workforce.doing(),
            left_s=None if mean is None else mean * left / min(slots, max(left, 1)),
        )


def _planned(entry: Entry, known: HandIn, text: str, rubric_hash: str, kit: str, options: Options) -> Job:
    order = Order(
        id=entry.id,
        source=str(entry.path.resolve()),
        out="",
        rubric=text,
        seed=options.seed,
        cache=str(options.cache.resolve()) if options.cache else "",
        mutation_budget_s=options.mutation_budget_s,
        hand_in=asdict(known),
        fresh=options.fresh,
    )
    record = Record(
        id=entry.id,
        status=Status.ERROR,
        content=entry.content,
        rubric=rubric_hash,
        kit=kit,
        seed=options.seed,
        mutation_budget_s=options.mutation_budget_s,
        host=socket.gethostname(),
    )
    return Job(entry, order, record)


def _done(folder: ClassFolder, job: Job) -> bool:
    """Return whether the submission is graded already, with everything the same."""
    record = folder.record(job.entry.id)
    return record is not None and record.key == job.record.key and record.status is not Status.ERROR
