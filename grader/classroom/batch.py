"""Grade a whole class: several submissions at once, never stopped by one, resumed where it was interrupted."""

from __future__ import annotations

import datetime as dt
import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from grader import sandbox
from grader.checks import checks_run
from grader.classroom import cluster, discovery, hand_ins, overrides, overview, plan
from grader.classroom.class_folder import CLASS, PLAN, RUBRIC, ClassFacts, ClassFolder, Entry, Record, Status
from grader.classroom.ledger import Source
from grader.classroom.one_grading import Ending, Order, Runner, Workforce
from grader.classroom.plan import Action, Options, Plan, settle
from grader.classroom.roster import Person
from grader.classroom.times import clock
from grader.course import find, load, name_of, named
from grader.errors import GraderError, UsageError
from grader.host import dds_domain, namespaces, provenance, shortage
from grader.host.tempdir import write_atomically
from grader.progress import Progress
from grader.sanitize import printable
from grader.scoring import rubric

# One grading keeps two cores busy nearly all the time: build, trials and tests beside each other. The memory is an
# estimate with room to spare, not a measurement.
CORES_EACH = 2
MEMORY_EACH = 2 * 1024**3
_PAGE_S = 30.0  # between two writings of the class page, which takes a second for a class of 300
_TICK_S = 1.0  # between two looks at what is running, for the progress line


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


class Console:
    """Shows on standard error how a run goes on: a line for each submission, and on a terminal one that changes.

    The lines are in the class's log, too, with the time of each.
    """

    def __init__(self, log: Path) -> None:
        self._progress = Progress()
        self._path, self._logs = log, False

    def planned(self, planned: Plan) -> None:
        """Say what will be done."""
        self._logs = True  # not before: the class is locked by now
        for line in plan.summary(planned):
            self.say(printable(line, 1000))

    def finished(self, record: Record, done: int, total: int) -> None:
        """Say that a submission is done, the how many of how many it is."""
        words = {Status.GRADED: "graded", Status.REFUSED: "cannot be graded", Status.ERROR: "ERROR of the grader"}
        why = f": {printable(' '.join(record.why.split()))}" if record.why else ""
        self.say(f"{done:>4}/{total}  {record.id:<20} {words[record.status]}, {record.seconds:.0f} s{why}")

    def going_on(self, done: int, total: int, running: Mapping[str, str]) -> None:
        """Say what is running, by submission."""
        names = ", ".join(f"{name} {what}".strip() for name, what in sorted(running.items()))
        self._progress.show(f"[{clock(self._progress.seconds)}] {done}/{total}; {names}")

    def say(self, text: str) -> None:
        """Show a line that stays, and log it."""
        self._progress.keep(text)
        self.log(text)

    def log(self, text: str) -> None:
        """Write a line into the class's log only."""
        if self._logs:
            with self._path.open("a", encoding="utf-8") as log:
                log.write(f"{dt.datetime.now().astimezone().isoformat(sep=' ', timespec='seconds')}  {text}\n")

    def clear(self) -> None:
        """Remove the line that changes."""
        self._progress.done()


def jobs_here() -> int:
    """Return how many gradings this machine can run at once: by cores, free memory and what keeps them apart."""
    here = min((os.cpu_count() or 1) // CORES_EACH, shortage.free_memory() // MEMORY_EACH)
    return max(1, int(min(here, kept_apart())))


def kept_apart() -> float:
    """Return how many gradings can be kept apart: without namespaces each needs DDS domains that no other has."""
    apart = namespaces.confinement() is namespaces.Confinement.NAMESPACES
    return math.inf if apart else len([*dds_domain.LOW, *dds_domain.HIGH]) // dds_domain.EACH


def look(source: Path | None, out: Path, people: Sequence[Person] | None, options: Options) -> Plan:
    """Return what `run` would do, or raise as it does. Nothing is graded and nothing is written."""
    with _prepared(source, ClassFolder(out), people, options) as (planned, *_):
        return planned


def run(source: Path | None, out: Path, people: Sequence[Person] | None, options: Options, console: Console) -> Summary:
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
    with folder.locked(), _prepared(source, folder, people, options) as (planned, facts, text, todo):
        plan.write(planned, folder.path / PLAN)
        console.planned(planned)
        stops = [doubt.text for doubt in planned.new if doubt.stops]
        if stops and not options.despite_doubts:
            raise GraderError("Nothing was graded.", "\n".join(stops))
        folder.write_facts(facts)
        write_atomically(folder.path / RUBRIC, text)
        workforce = (
            cluster.workforce(options.scheduler, facts.kit, facts.course)
            if options.scheduler
            else local(options.jobs or jobs_here())
        )
        with workforce as grade:
            interrupted = _grade(folder, grade, console, len(facts.entries), todo)
    records = [folder.current(entry, facts) for entry in facts.entries]
    states = [record.status for record in records if record is not None]
    return Summary(
        entries=len(facts.entries),
        graded=states.count(Status.GRADED),
        refused=states.count(Status.REFUSED),
        errors=states.count(Status.ERROR),
        kept=len(planned.of(Action.KEEP)),
        missing=len(planned.of(Action.NOTHING)),
        interrupted=interrupted,
    )


@contextmanager
def _prepared(
    source: Path | None, folder: ClassFolder, people: Sequence[Person] | None, options: Options
) -> Iterator[tuple[Plan, ClassFacts, str, list[tuple[Order, Record]]]]:
    """Yield the plan, the class, its rubric's text and what is to be graded, each with the record that it will have.

    The sources are open meanwhile.
    """
    before = folder.facts() if source is None or (folder.path / CLASS).exists() else None
    course = named(before.course) if before else find(options.course)
    if options.course and load(options.course).folder != course.folder:
        raise UsageError(
            f"{folder.path} is a class of {course.folder}.", "Leave out --course, or choose another --out."
        )
    path = options.rubric or (folder.path / RUBRIC if before else course.rubric)
    whole = rubric.load(path, checks_run.known(course))
    given = whole.sha256 if options.rubric or before is None else None
    settled, remarks = settle(folder, before, source, people, given, options)
    # A source that an earlier run has read may be gone by now, if another is there.
    read, sources = {entry.source for entry in settled.entries}, (settled.source, *settled.added)
    present = [each for each in sources if folder.located(each).exists() or each not in read] or sources
    with ExitStack() as stack:
        roots = {each: stack.enter_context(discovery.opened(folder.located(each))) for each in present}
        first, *added = roots.values()
        found = discovery.find(first, settled.roster, settled, added, options.times)
        facts = replace(
            found,
            entries=tuple(_recorded(entry, roots) for entry in found.entries),
            notes=(*remarks, *found.notes),
            rubric=whole.sha256,
            title=whole.title,
            kit=provenance.kit_hash(course.folder),
            version=provenance.environment()["ros2-course-kit"],
            commit=provenance.commit(),
            course=name_of(course),
            zero_missing=found.zero_missing if options.zero_missing is None else options.zero_missing,
        )
        decided = overrides.of_class(folder, facts, whole)
        now = overrides.applied(facts, decided)
        if unknown := sorted(set(options.only) - {entry.id for entry in facts.entries}):
            names = ", ".join(entry.id for entry in facts.entries)
            raise UsageError(f"The class has no submission {', '.join(unknown)}.", f"It has {names}.")
        text = path.read_text(encoding="utf-8")
        records = {entry.id: folder.record(entry.id) for entry in found.entries}
        actions, todo = {}, []
        for entry, known in zip(found.entries, now.entries, strict=True):
            package = decided.on(entry.id).package
            record = Record(
                entry.id, Status.ERROR, "", entry.content, facts.rubric, facts.kit, facts.seed, package=package
            )
            actions[entry.id] = plan.decide(entry, records[entry.id], record, options)
            if actions[entry.id].action is Action.GRADE:
                order = Order(
                    entry.id, str(entry.path.resolve()), "", text, facts.seed,
                    asdict(hand_ins.hand_in(known, now, decided)), options.fresh, facts.course, package,
                    60.0 * options.minutes,
                )  # fmt: skip
                todo.append((order, record))
        several = 1 if options.scheduler else options.jobs or jobs_here()
        new = [each for each in now.doubts if before is None or each not in before.doubts]
        planned = plan.make(now, decided, actions, filter(None, records.values()), new, several, options.minutes)
        yield planned, facts, text, todo


def _recorded(entry: Entry, roots: Mapping[str, Source]) -> Entry:
    """Return the entry as class.yaml keeps it: its source, and its path in there."""
    for source, root in roots.items():
        if entry.path.is_relative_to(root.folder) and not entry.absent:
            return replace(entry, source=source, path=entry.path.relative_to(root.folder))
    return entry


@contextmanager
def local(jobs: int) -> Iterator[Workforce]:
    """Yield what grades up to `jobs` submissions at a time on this machine."""
    runner = Runner(lambda name, what: workforce.doing.update({name: what}))
    workforce = Workforce(jobs, runner.grade, runner.stop)
    try:
        yield workforce
    finally:
        workforce.stop()


def _grade(
    folder: ClassFolder, workforce: Workforce, console: Console, total: int, jobs: list[tuple[Order, Record]]
) -> bool:
    """Grade all jobs, and once more, alone, what failed for reasons of ours; return whether Ctrl-C interrupted that."""
    done, written = total - len(jobs), time.monotonic()
    overview.attempt(folder)
    try:
        for last, slots in ((False, workforce.slots), (True, 1)):
            waiting, again, running = jobs[::-1], jobs[:0], dict[Future[Ending], tuple[Order, Record]]()
            while waiting or running:
                while waiting and len(running) < slots:
                    order, record = waiting.pop()
                    order = replace(order, out=str(folder.working(order.id).resolve()))
                    begun = dt.datetime.now().astimezone().isoformat(timespec="seconds")
                    running[workforce.submit(order)] = order, replace(record, started=begun)
                ended, _ = wait(running, timeout=_TICK_S, return_when=FIRST_COMPLETED)
                for future in [each for each in running if each in ended]:  # in the order in which they began
                    (order, record), ending = running.pop(future), future.result()
                    if ending.status is Status.ERROR and not last:
                        again.append((order, record))
                        continue
                    seconds = round(ending.seconds, 1)
                    record = replace(record, status=ending.status, why=ending.why, seconds=seconds)
                    folder.keep(Path(order.out), record)
                    done += 1
                    console.finished(record, done, total)
                if ended and time.monotonic() > written + _PAGE_S:
                    overview.attempt(folder)
                    written = time.monotonic()
                console.going_on(done, total, dict(workforce.doing))
            jobs = again
    except KeyboardInterrupt:
        workforce.stop()
        return True
    finally:
        overview.attempt(folder)
    return False
