"""Try faults and decoys: run the tests that reach each, and write down who noticed."""

from __future__ import annotations

import random
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence, Set
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue

from grader.evidence import EquivalentMutant, Mutant, Mutation, short_name
from grader.mutation.equivalent_mutants import WEAK, compiles, equivalent_mutants
from grader.mutation.operators import mutants
from grader.mutation.selection import Selection, Selector, choose
from grader.mutation.source_text import MODULE, Change, Source, is_too_much, parse
from grader.settings import MUTATION_BUDGET_S
from grader.student_tests.suite_run import Reach
from grader.student_tests.warm_worker import Bench, Ran, Request, benches, places, sources

MUTANTS = 40
WORKERS = 2
# Faults are tried in rounds: results count by whole rounds, so that a machine's mood does not move a grade by a little.
ROUND = 10
# One decoy to five faults, and at least six: as many as make a suite that fails on any change of the source give up.
DECOY_SHARE = 0.2
DECOYS_AT_LEAST = 6
_TRIED_AT_MOST = 60
_LONGEST = 60.0  # seconds for the tests of one module on one fault
# What a busy machine may take, by the clock, for the work of a quiet one: times the budget, and seconds at least.
_HARD_LIMIT, _HARD_LIMIT_AT_LEAST = 6.0, 60.0


def mutate(
    package: Path,
    install: Path,
    reach: Sequence[Reach],
    *,
    seed: int = 0,
    count: int = MUTANTS,
    seconds: float = MUTATION_BUDGET_S,
    workers: int = WORKERS,
    progress: Callable[[str], None] = lambda _what: None,
) -> Mutation:
    """Return what the package's own tests noticed of faults in its source.

    Args:
        package: the package's source folder.
        install: its install tree; its modules are what is changed, and those of the source folder alike.
        reach: what each test module's tests reach, from `own_tests.run_modules`.
        seed: decides faults, decoys and their order.
        count: how many faults to put in.
        seconds: the time to spend, as wall time of a quiet machine with `workers` cores.
        workers: how many faults are tried at once.
        progress: told how far it is.
    """
    started = time.monotonic()
    texts = sources(package, install)
    parsed = {name: source for name, text in texts.items() if text is not None and (source := parse(name, text))}
    possible = [change for source in parsed.values() for change in mutants(source)]
    chosen = choose(possible, count, random.Random(f"faults {seed}"))
    beyond = _beyond(texts, count)
    found = _Findings(
        sources=parsed,
        places={name: places(package, install, name, source.text) for name, source in parsed.items()},
        reach={r.module: r for r in reach},
        selector=Selector(parsed, reach),
        chance=random.Random(f"decoys {seed}"),
    )
    found.note_readers({name for r in reach for name in r.readers})
    reached = [change for change in chosen if found.selection(change)]
    quiet_seconds = 0.0
    if reached:
        for change in chosen:
            found.outcomes[change] = _fault(change, "not tried")
        with benches(package, install, min(workers, len(reached)), seconds=_HARD_LIMIT * seconds + 600.0) as crew:
            until = started + max(_HARD_LIMIT * seconds, _HARD_LIMIT_AT_LEAST)
            quiet_seconds = _rounds(found, chosen, _Crew(crew, until), seconds, progress)
    else:
        for change in chosen:
            found.outcomes[change] = _fault(change, "unnoticed" if found.selector.tests(change) else "unreached")
    not_tried = sum(fault.outcome == "not tried" for fault in found.outcomes.values())
    notes = []
    if not_tried and not found.convicted:
        notes.append(f"{not_tried} of {len(chosen)} faults were not tried: the budget of {seconds:g} s was used up")
    if found.blind:
        names = ", ".join(short_name(name) for name in sorted(found.blind)[:3])
        notes.append(f"{names} read the package's source as a text, so what was noticed there did not count")
    return Mutation(
        seed=seed, possible=len(possible) + len(beyond),
        mutants=[found.outcomes[change] for change in chosen] + beyond, equivalent_mutants=found.equivalent_mutants,
        set_aside=sorted(found.set_aside - found.readers), convicted=sorted(found.convicted),
        wall_seconds=round(time.monotonic() - started, 1), quiet_seconds=round(quiet_seconds, 1),
        budget_seconds=seconds, note="; ".join(notes),
    )  # fmt: skip


def _beyond(texts: Mapping[str, str | None], count: int) -> list[Mutant]:
    """Return faults, unnoticed, for modules that may run and cannot be read: no fault can be put into them.

    There are as many as if each module were as long as the others, for what is hidden must not be worth more than
    what is shown.
    """
    hidden = [name for name, text in texts.items() if text is None or is_too_much(text)]
    words = "the module cannot be read, so no fault can be put into it"
    each = max(1, round(count / max(1, len(texts))))
    return [Mutant(name, 1, MODULE, "module", words, "unreached") for name in hidden for _ in range(each)]


@dataclass
class _Findings:
    """What is known so far."""

    sources: dict[str, Source]
    places: dict[str, list[str]]
    reach: dict[str, Reach]
    selector: Selector
    chance: random.Random
    outcomes: dict[Change, Mutant] = field(default_factory=dict)
    equivalent_mutants: list[EquivalentMutant] = field(default_factory=list)
    set_aside: set[str] = field(default_factory=set)
    whole: set[str] = field(default_factory=set)
    convicted: set[str] = field(default_factory=set)
    vouched: set[tuple[str, str]] = field(default_factory=set)
    """Tests that have passed a decoy in a file: (test, file)."""

    readers: set[str] = field(default_factory=set)
    """Tests that read the source, set aside for that."""

    @property
    def blind(self) -> set[str]:
        """Return the readers that would have been a witness: a linter's test reaches no line."""
        return self.readers & {
            n for r in self.reach.values() for lines in r.lines.values() for t in lines.values() for n in t
        }

    def note_readers(self, names: Set[str]) -> list[Change]:
        """Set tests aside that read the source; return the faults that only they are known to have noticed."""
        fresh = names - self.readers - {""}
        self.readers |= fresh
        self.set_aside |= fresh
        return [change for change, fault in self.outcomes.items() if fault.by in fresh]

    def selection(self, change: Change) -> list[Selection]:
        return self.selector.tests(change, self.set_aside, self.whole)


@dataclass(frozen=True)
class _Job:
    """One change and the tests to run on it; `twin` names the fault whose witness a decoy examines."""

    change: Change | None
    selections: tuple[Selection, ...]
    twin: Change | None = None
    patience: float = 1.0


@dataclass(frozen=True)
class _Result:
    job: _Job
    by: str
    module: str
    late: bool
    ran: int
    seconds: float
    failed: tuple[str, ...]
    tried: bool = True
    readers: frozenset[str] = frozenset()


class _Crew:
    """The benches, and the work that they do at the same time."""

    def __init__(self, crew: Sequence[Bench], until: float) -> None:
        self._until = until
        self._idle: SimpleQueue[Bench] = SimpleQueue()
        for bench in crew:
            self._idle.put(bench)
        self._pool = ThreadPoolExecutor(len(crew))
        self.workers = len(crew)
        self.spent = 0.0
        self._lock = threading.Lock()

    def run(self, found: _Findings, jobs: Sequence[_Job]) -> list[_Result]:
        """Return the jobs' results, in the jobs' order."""
        return list(self._pool.map(lambda job: self._one(found, job), jobs))

    def _one(self, found: _Findings, job: _Job) -> _Result:
        if time.monotonic() > self._until:
            return _Result(job, "", "", late=False, ran=0, seconds=0.0, failed=(), tried=False)
        bench = self._idle.get()
        try:
            result = _try(bench, found, job)
        finally:
            self._idle.put(bench)
        with self._lock:
            self.spent += result.seconds
        return result


def _rounds(
    found: _Findings, chosen: Sequence[Change], crew: _Crew, seconds: float, progress: Callable[[str], None]
) -> float:
    """Try the faults round by round while the budget lasts; return how much of it was spent, in seconds.

    Each round examines witnesses of the one before. Faults that no test reaches cost nothing, yet they keep their
    places: a budget that runs out cuts off both kinds.
    """
    waiting = list(chosen)
    noticed: list[tuple[Change, _Result]] = []
    tried = 0
    while (waiting or noticed) and not found.convicted:
        batch, waiting = waiting[:ROUND], waiting[ROUND:]
        jobs = [_Job(change, tuple(found.selection(change))) for change in batch]
        jobs += _examinations(found, noticed, last=not batch)
        noticed = []
        found.chance.shuffle(jobs)
        before = crew.spent
        # Decoys first: what they say of a test decides whether what it noticed in this round counts.
        results = sorted(crew.run(found, jobs), key=lambda result: result.job.twin is None)
        # A test may read the source only where it runs without coverage.
        again = found.note_readers({name for result in results for name in result.readers})
        for result in (result for result in results if result.tried):
            if result.job.twin is not None:
                again += [] if found.convicted else _note_decoy(found, crew, result)
            elif _is_stale(found, result.job):
                again.append(_changed(result.job))
            else:
                _note_fault(found, result)
                if result.by and result.by not in found.set_aside:
                    noticed.append((_changed(result.job), result))
        again = list(dict.fromkeys(again))
        for change in again:
            found.outcomes[change] = _fault(change, "not tried")
        waiting += again
        noticed = [(change, result) for change, result in noticed if change not in again]
        tried += len(batch)
        progress(f"faults: {min(tried, len(chosen))} of {len(chosen)} tried, {_noticed(found)} noticed")
        # Another round costs about as much as this one.
        needed = crew.spent + (crew.spent - before)
        if needed > seconds * crew.workers or not all(result.tried for result in results):
            waiting = []
    return crew.spent / crew.workers


def _noticed(found: _Findings) -> int:
    return sum(fault.outcome == "noticed" for fault in found.outcomes.values())


def _examinations(found: _Findings, noticed: Sequence[tuple[Change, _Result]], last: bool) -> list[_Job]:
    """Return decoys for some of the faults just noticed: same function, same tests, but the behaviour is kept.

    First come the tests that no decoy has examined in this file, those that noticed most before the others.
    """
    credits = Counter(result.by for _, result in noticed)
    wanted = max(1, round(DECOY_SHARE * len(noticed) + 0.5))
    if last or _noticed(found) <= ROUND:
        wanted = max(wanted, DECOYS_AT_LEAST - len(found.equivalent_mutants))
    pairs = list(noticed)
    found.chance.shuffle(pairs)
    pairs.sort(key=lambda pair: ((pair[1].by, pair[0].path) in found.vouched, -credits[pair[1].by]))
    jobs: list[_Job] = []
    examined: set[tuple[str, str]] = set()
    for number, (fault, result) in enumerate([*pairs, *pairs]):
        if len(jobs) >= wanted:
            break
        if number < len(pairs) and (result.by, fault.path) in examined:
            continue  # another test's turn; this one's again when there is nobody else
        decoy = _decoy_for(found, fault, skip=number // len(pairs))
        if decoy is not None:
            examined.add((result.by, fault.path))
            jobs.append(_Job(decoy, _up_to(result), twin=fault))
    return jobs


def _decoy_for(found: _Findings, fault: Change, skip: int = 0, but: Change | None = None) -> Change | None:
    """Return a decoy in the fault's function, or else near it in its file."""
    there = [decoy for decoy in equivalent_mutants(found.sources[fault.path]) if decoy != but]
    near = [decoy for decoy in there if decoy.function == fault.function] or there
    if not near:
        return None
    found.chance.shuffle(near)
    near.sort(key=lambda decoy: (decoy.operator == WEAK, abs(decoy.line - fault.line) > 3))
    skip %= len(near)
    source = found.sources[fault.path]
    return next((decoy for decoy in [*near[skip:], *near[:skip]] if compiles(source, decoy)), None)


def _up_to(result: _Result) -> tuple[Selection, ...]:
    """Return the tests of a job up to the one that noticed. Modules before its own have nothing to answer for."""
    selection = next(s for s in result.job.selections if s.module == result.module)
    tests = selection.tests
    if result.by in tests and not result.late:
        tests = tests[: tests.index(result.by) + 1]
    return (Selection(selection.module, tests),)


def _note_fault(found: _Findings, result: _Result) -> None:
    change = _changed(result.job)
    tests = [name for selection in result.job.selections for name in selection.tests]
    if result.by and result.by not in found.set_aside:
        found.outcomes[change] = _fault(change, "noticed", by=result.by, late=result.late)
    elif found.selector.tests(change):
        found.outcomes[change] = _fault(change, "unnoticed", tried=tests[:_TRIED_AT_MOST])
    else:
        found.outcomes[change] = _fault(change, "unreached")


def _note_decoy(found: _Findings, crew: _Crew, result: _Result) -> list[Change]:
    """Write down how a decoy came out; return the faults to be tried again because a test proved unreliable."""
    job = result.job
    assert job.twin is not None
    if not result.by:
        found.equivalent_mutants.append(_decoy(result))
        found.vouched |= {(name, job.twin.path) for selection in job.selections for name in selection.tests}
        return []
    if result.by in found.set_aside or (result.module in found.whole and not _is_whole(found, job)):
        return []  # known by now; the faults concerned are to be tried again anyway
    # A test failed although nothing that matters was changed. Is it chance, or the company it ran in?
    patient = 4.0
    calm, again, other = crew.run(
        found,
        [
            _Job(None, job.selections, job.twin, patient),
            _Job(job.change, job.selections, job.twin, patient),
            _Job(_decoy_for(found, job.twin, but=job.change), job.selections, job.twin, patient),
        ],
    )
    if calm.by and result.module not in found.whole:
        # They need each other: from now on all of them run, in their own order.
        found.whole.add(result.module)
        return [c for c, fault in found.outcomes.items() if fault.by.startswith(result.module)]
    if calm.by:
        found.set_aside |= {calm.by, result.by}
    elif again.by and other.by and other.job.change is not None:
        found.equivalent_mutants += [_decoy(again), _decoy(other)]
        found.convicted.add(again.by)
        return []
    else:
        found.set_aside.add(result.by)
    return [change for change, fault in found.outcomes.items() if fault.by in found.set_aside]


def _changed(job: _Job) -> Change:
    assert job.change is not None
    return job.change


def _is_stale(found: _Findings, job: _Job) -> bool:
    """Return whether a fault would be tried with other tests by now."""
    return tuple(found.selection(_changed(job))) != job.selections


def _is_whole(found: _Findings, job: _Job) -> bool:
    """Return whether a job runs the tests of its module in the module's own order, from the first one on."""
    [selection] = job.selections
    order = [name for name in found.reach[selection.module].seconds if name not in found.set_aside]
    return list(selection.tests) == order[: len(selection.tests)]


def _decoy(result: _Result) -> EquivalentMutant:
    change = _changed(result.job)
    return EquivalentMutant(change.path, change.line, change.words, tests=result.ran, failed=list(result.failed))


def _fault(change: Change, outcome: str, by: str = "", late: bool = False, tried: Sequence[str] = ()) -> Mutant:
    return Mutant(
        change.path, change.line, change.function, change.operator, change.words, outcome, by, late, list(tried)
    )


def _try(bench: Bench, found: _Findings, job: _Job) -> _Result:
    """Run a job's tests, module by module, until one notices."""
    files = {}
    if job.change is not None:
        text = found.sources[job.change.path].apply(job.change)
        files = dict.fromkeys(found.places[job.change.path], text)
    seconds, count = 0.0, 0
    readers: frozenset[str] = frozenset()
    for selection in job.selections:
        known = found.reach[selection.module].seconds
        limits = {name: job.patience * min(2.0 + 8 * known.get(name, 0.0), _LONGEST) for name in selection.tests}
        ran = bench.run(
            Request(
                selection.module, files=files, select=selection.tests, first_failure=True, limits=limits,
                limit=10.0 * job.patience, total=job.patience * min(20.0 + 8 * sum(known.values()), _LONGEST),
            )
        )  # fmt: skip
        if not bench.alive:
            # A test that puts an end to the process which runs it has reported nothing.
            return _Result(job, "", "", late=False, ran=count, seconds=seconds, failed=())
        seconds += ran.quiet_seconds
        count += len(ran.tests)
        readers |= ran.readers | (frozenset(known) if "" in ran.readers else frozenset())
        by = _witness(ran, selection)
        if by:
            failed = tuple(test.id for test in ran.tests if test.outcome in ("failed", "error")) or (by,)
            return _Result(job, by, selection.module, bool(ran.late), count, seconds, failed, readers=readers)
    return _Result(job, "", "", late=False, ran=count, seconds=seconds, failed=(), readers=readers)


def _witness(ran: Ran, selection: Selection) -> str:
    """Return who noticed: a test, or the module as a whole when it could not even be read or ended too soon."""
    noticed = ran.noticed
    if noticed and noticed not in selection.tests:
        return f"{selection.module} ({noticed})"
    return noticed
