"""Grade a whole class: several submissions at once, never stopped by one, resumed where it was interrupted."""

from __future__ import annotations

import datetime as dt
import math
import os
import socket
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Protocol

from grader import sandbox
from grader.checks import checks_run
from grader.classroom import cluster, discovery, hand_ins, overrides, overview, plan
from grader.classroom.class_folder import CLASS, PLAN, RUBRIC, ClassFacts, ClassFolder, Record, Status
from grader.classroom.class_settings import ClassSettings, Given, settle
from grader.classroom.doubt import Doubt, require_certain
from grader.classroom.entry import Entry
from grader.classroom.ledger import Source
from grader.classroom.one_grading import Ending, Order, Runner
from grader.classroom.plan import Action, Plan, Wanted
from grader.classroom.roster import Person
from grader.classroom.times import HandInTime
from grader.course import find, load, name_of, named
from grader.errors import UsageError
from grader.host import dds_domain, namespaces, provenance, shortage
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
    """What a run's command says. None leaves a setting of the class as it is, and `change` names those to be changed.

    Attributes:
        course: the folder of the course, for a new class.
        added: further sources, read together with the class's own.
        times: when submissions were handed in, where the sources do not say it; the class remembers them.
        only: the submissions to grade; all if it is empty.
        regrade: grade again what another kit has graded.
        fresh: grade everything again, from nothing that is kept.
        despite_doubts: grade even where a doubt about whose the submissions are would stop the class.
        minutes: after which the grading of one submission is ended.
        pattern: how the sources' files are named.
        zero_missing: whether missing, empty and damaged hand-ins get 0.
        scheduler: a Dask scheduler's address, "" for this machine with `jobs` submissions at a time.
    """

    course: Path | None = None
    rubric: Path | None = None
    seed: int | None = None
    deadline: dt.datetime | None = None
    late_rule: str | None = None
    added: tuple[Path, ...] = ()
    times: tuple[HandInTime, ...] = ()
    change: frozenset[str] = frozenset()
    only: frozenset[str] = frozenset()
    regrade: bool = False
    fresh: bool = False
    despite_doubts: bool = False
    pattern: str | None = None
    zero_missing: bool | None = None
    cache: Path | None = None
    mutation_budget_s: float = MUTATION_BUDGET_S
    jobs: int = 0
    minutes: int = 60
    scheduler: str = ""


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
    interrupted: bool = False


class ProgressListener(Protocol):
    """Hears how a run goes on."""

    def planned(self, planned: Plan) -> None:
        """Say what will be done; called once, before anything is graded."""

    def finished(self, record: Record, progress: Progress) -> None:
        """Say that a submission is done."""

    def going_on(self, progress: Progress) -> None:
        """Say what is running; called about once a second."""


def jobs_here() -> int:
    """Return how many gradings this machine can run at once: by cores, free memory and what keeps them apart."""
    here = min((os.cpu_count() or 1) // CORES_EACH, shortage.free_memory() // MEMORY_EACH)
    return max(1, int(min(here, kept_apart())))


def kept_apart() -> float:
    """Return how many gradings can be kept apart: without namespaces each needs DDS domains that no other has."""
    apart = namespaces.confinement() is namespaces.Confinement.NAMESPACES
    return math.inf if apart else len([*dds_domain.LOW, *dds_domain.HIGH]) // dds_domain.EACH


def look(source: Path | None, out: Path, people: Sequence[Person] | None, options: Options) -> Plan:
    """Return what `run` would do. Nothing is graded and nothing is written.

    Raises:
        GraderError: as `run`.
        SubmissionError: an archive of the class cannot be opened.
    """
    with _prepared(source, ClassFolder(out), people, options) as prepared:
        return prepared.plan


def run(
    source: Path | None, out: Path, people: Sequence[Person] | None, options: Options, listener: ProgressListener
) -> Summary:
    """Grade the submissions in `source` into the class folder `out`, and return what was done.

    Source and people are those of the class's first run where they are None. What `out` holds already with the same
    input, rubric and seed is not graded again. Ctrl-C ends the running gradings and returns; the same call goes on
    from what was finished.

    Raises:
        GraderError: there are no submissions, the folder cannot be written, the class has other settings than those
            given, whose its submissions are is too doubtful, or this machine cannot grade at all.
        SubmissionError: an archive of the class cannot be opened.
    """
    if not options.scheduler:
        sandbox.require()
        if options.jobs > (most := kept_apart()):
            raise UsageError(
                f"Without namespaces this machine can keep {most} gradings apart, not {options.jobs}: each needs DDS "
                f"domains of its own. Choose --jobs {most} or less."
            )
    folder = ClassFolder(out)
    if source is None:
        folder.facts()  # before anything is written
    with folder.locked(), _prepared(source, folder, people, options) as prepared:
        plan.write(prepared.plan, folder.path / PLAN)
        listener.planned(prepared.plan)
        if not options.despite_doubts:
            require_certain(prepared.doubts)
        facts = prepared.facts
        folder.write_facts(facts)
        write_atomically(folder.path / RUBRIC, prepared.rubric)
        todo = prepared.todo
        workforce = (
            cluster.workforce(options.scheduler, facts.kit, facts.course)
            if options.scheduler
            else local(options.jobs or jobs_here())
        )
        with workforce as grade:
            page = overview.LivePage(folder)
            loop = _Loop(folder, grade, listener, len(facts.entries), page)
            interrupted = loop.run(todo)
            page.write()
    records = [folder.current(entry, facts) for entry in facts.entries]
    states = [record.status for record in records if record is not None]
    return Summary(
        entries=len(facts.entries),
        graded=states.count(Status.GRADED),
        refused=states.count(Status.REFUSED),
        errors=states.count(Status.ERROR),
        kept=len(prepared.plan.of(Action.KEEP)),
        missing=len(prepared.plan.of(Action.NOTHING)),
        interrupted=interrupted,
    )


@dataclass(frozen=True)
class _Prepared:
    """All that is known before anything is graded; `rubric` is its text, `doubts` are those that no run had before."""

    facts: ClassFacts
    doubts: Sequence[Doubt]
    rubric: str
    todo: list[Job]
    plan: Plan


@contextmanager
def _prepared(
    source: Path | None, folder: ClassFolder, people: Sequence[Person] | None, options: Options
) -> Iterator[_Prepared]:
    """Yield what will be done; the sources are open meanwhile."""
    remembered = (folder.path / CLASS).exists()
    before = folder.facts() if remembered else None
    course = named(before.course) if before else find(options.course)
    if options.course and load(options.course).folder != course.folder:
        raise UsageError(
            f"{folder.path} is a class of {course.folder}.", "Leave out --course, or choose another --out."
        )
    path = options.rubric or (folder.path / RUBRIC if remembered else course.rubric)
    whole = rubric.load(path, checks_run.known(course))
    given = Given(
        source=str(source) if source else None,
        roster=None if people is None else tuple(people),
        rubric=rubric.text(path) if options.rubric or not remembered else None,
        seed=options.seed,
        deadline=options.deadline,
        late=options.late_rule,
        pattern=options.pattern,
        added=tuple(map(str, options.added)),
        change=options.change,
    )
    settings = settle(folder, given)
    earlier = before.entries if before else ()
    with _opened(folder, settings.sources, earlier) as roots:
        first, *added = roots.values()
        timed = settings.deadline is not None or bool(settings.late)
        claimed = before.claimed if before else ()
        found = discovery.find(
            first, settings.roster, earlier, added, options.times, timed, settings.pattern, claimed
        )  # fmt: skip
        zero_missing = options.zero_missing
        if zero_missing is None:
            zero_missing = before is not None and before.zero_missing
        facts = ClassFacts(
            title=whole.title,
            source=settings.source,
            layout=found.layout,
            rubric=settings.rubric_hash,
            kit=provenance.kit_hash(course.layers),
            version=provenance.environment()["ros2-course-kit"],
            commit=provenance.commit(),
            seed=settings.seed,
            entries=tuple(_recorded(entry, roots) for entry in found.entries),
            missing=found.missing,
            notes=found.notes,
            doubts=found.doubts,
            deadline=settings.deadline,
            late_rule=settings.late,
            made=dt.datetime.now().astimezone(),
            roster=settings.roster,
            added=settings.added,
            course=name_of(course),
            pattern=settings.pattern,
            ledger=found.ledger,
            claimed=found.claimed,
            zero_missing=zero_missing,
        )
        decided = overrides.of_class(folder, facts, whole)
        now = overrides.applied(facts, decided)
        if unknown := sorted(options.only - {entry.id for entry in facts.entries}):
            names = ", ".join(entry.id for entry in facts.entries)
            raise UsageError(f"The class has no submission {', '.join(unknown)}.", f"It has {names}.")
        jobs = [
            _job(entry, hand_ins.hand_in(known, now, decided), decided.on(entry.id).package, settings, facts, options)
            for entry, known in zip(found.entries, now.entries, strict=True)
        ]
        records = {entry.id: folder.record(entry.id) for entry in found.entries}
        wanted = Wanted(options.only, options.regrade, options.fresh)
        actions = {job.entry.id: plan.decide(job.entry, records[job.entry.id], job.record, wanted) for job in jobs}
        todo = [job for job in jobs if actions[job.entry.id].action is Action.GRADE]
        several = 1 if options.scheduler else options.jobs or jobs_here()
        maximum = Decimal(str(sum(requirement.points for requirement in whole.requirements)))
        new = [each for each in now.doubts if before is None or each not in before.doubts]
        recorded = filter(None, records.values())
        planned = plan.make(now, decided, actions, recorded, maximum, several, options.minutes, new)
        yield _Prepared(facts, new, settings.rubric, todo, planned)


@contextmanager
def _opened(folder: ClassFolder, sources: Sequence[str], earlier: Sequence[Entry]) -> Iterator[Mapping[str, Source]]:
    """Yield the sources' folders. One that an earlier run has read may be gone by now, if another is there."""
    read = {entry.source for entry in earlier}
    present = [each for each in sources if folder.located(each).exists() or each not in read]
    with ExitStack() as stack:
        yield {each: stack.enter_context(discovery.opened(folder.located(each))) for each in present or sources}


def _recorded(entry: Entry, roots: Mapping[str, Source]) -> Entry:
    """Return the entry as class.yaml keeps it: its source, and its path in there."""
    for source, root in roots.items():
        if entry.path.is_relative_to(root.folder) and not entry.absent:
            return replace(entry, source=source, path=entry.path.relative_to(root.folder))
    return entry


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


class _Local:
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
def local(jobs: int) -> Iterator[Workforce]:
    """Yield what grades up to `jobs` submissions at a time on this machine."""
    workforce = _Local(jobs)
    try:
        yield workforce
    finally:
        workforce.stop()


class _Loop:
    """Hands jobs out, keeps the results, and tries once more, alone, what failed for reasons of ours."""

    def __init__(
        self, folder: ClassFolder, workforce: Workforce, listener: ProgressListener, total: int, page: overview.LivePage
    ) -> None:
        self._folder = folder
        self._page = page
        self._workforce = workforce
        self._listener = listener
        self._total = total
        self._done = 0
        self._seconds: list[float] = []
        self._graded = False
        self._begun: dict[str, float] = {}  # of what is running, by id

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
                self._begun[job.entry.id] = time.monotonic()
                running[self._workforce.submit(job.order)] = job
            ended, _ = wait(running, timeout=_TICK_S, return_when=FIRST_COMPLETED)
            for future in [each for each in running if each in ended]:  # in the order in which they began
                job = running.pop(future)
                del self._begun[job.entry.id]
                ending = future.result()
                if ending.status is Status.ERROR and attempt < _ATTEMPTS:
                    again.append(job)
                else:
                    self._keep(job, ending, attempt, len(waiting) + len(again), slots)
            self._listener.going_on(self._progress(len(waiting) + len(again), slots))
        return again

    def _keep(self, job: Job, ending: Ending, attempt: int, waiting: int, slots: int) -> None:
        record = replace(
            job.record, status=ending.status, why=ending.why, seconds=round(ending.seconds, 1), attempts=attempt
        )
        self._folder.keep(Path(job.order.out), record)
        self._done += 1
        self._seconds.append(ending.seconds)
        self._graded |= ending.status is Status.GRADED
        self._listener.finished(record, self._progress(waiting, slots))
        self._page.write_if_due()

    def _progress(self, waiting: int, slots: int) -> Progress:
        """Return where the run is; the time that is left is known once something was graded."""
        left_s = None
        if self._graded:
            each = sum(self._seconds) / len(self._seconds)
            now = time.monotonic()
            rest = sum(max(0.0, each - (now - begun)) for begun in self._begun.values())
            left_s = (waiting * each + rest) / min(slots, max(waiting + len(self._begun), 1))
        return Progress(done=self._done, total=self._total, running=self._workforce.doing(), left_s=left_s)


def _job(
    entry: Entry, known: HandIn, package: str, settings: ClassSettings, facts: ClassFacts, options: Options
) -> Job:
    order = Order(
        id=entry.id,
        source=str(entry.path.resolve()),
        out="",
        rubric=settings.rubric,
        seed=settings.seed,
        cache=str(options.cache.resolve()) if options.cache else "",
        mutation_budget_s=options.mutation_budget_s,
        hand_in=asdict(known),
        fresh=options.fresh,
        course=facts.course,
        package=package,
        limit_s=60.0 * options.minutes,
    )
    record = Record(
        id=entry.id,
        status=Status.ERROR,
        content=entry.content,
        rubric=settings.rubric_hash,
        kit=facts.kit,
        seed=settings.seed,
        mutation_budget_s=options.mutation_budget_s,
        host=socket.gethostname(),
        package=package,
    )
    return Job(entry, order, record)
