"""A grading's work as a list of jobs: what each is, what decides its result, and when it may use the cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Generic, TypeVar

from grader.processes.kept import NOTHING_KEPT, Kept
from grader.words import mark

T = TypeVar("T")

# With two trials a core they spoil each other's caches: a whole grading took a fifth more CPU time, and wall time.
_TRIALS_AT_ONCE, _BESIDE_AT_ONCE = min(os.cpu_count() or 1, 4), 2


class Where(Enum):
    """What a job may touch."""

    HOST = mark("reads files, runs nothing of the submission")
    SANDBOX = mark("runs code of the submission in a sandbox without a network")
    NETWORK = mark("runs nodes of the submission in a sandbox, and an observer beside it, in a network of their own")


class Turn(Enum):
    """When a job may use the cores."""

    AT_ONCE = "begins at once"
    CORE = "waits for one of the cores"
    BESIDE = "mostly waits by itself, so it needs no core"


@dataclass(frozen=True)
class Job(Generic[T]):
    """One piece of work.

    Attributes:
        name: what a report calls it.
        where: what it may touch.
        kind: the type of its result.
        work: does it, and returns the result. It is given the result of the job `after`, if it has one.
        decided_by: the hashes and texts that decide the result. What is kept of the same ones is taken instead, unless
            the job `after` has to be done.
        lasting: whether another run is expected to have the same result, so that this one may be kept.
        after: the job before it in the list, by name, whose result it needs.
        turn: when it may use the cores.
        serves: the ids of the requirements that it is for; none of what all need.
        says: what is said when it begins.
    """

    name: str
    where: Where
    kind: type[T]
    work: Callable[..., T]
    decided_by: tuple[str, ...] = ()
    lasting: Callable[[T], bool] = lambda _result: True
    after: str = ""
    turn: Turn = Turn.AT_ONCE
    serves: frozenset[str] = frozenset()
    says: str = ""


@dataclass(frozen=True)
class Done:
    """The results of jobs by their names; `kept` says of those of an earlier grading when that was."""

    results: Mapping[str, Any] = field(default_factory=dict)
    kept: Mapping[str, str] = field(default_factory=dict)


def run(
    jobs: Sequence[Job[Any]], kept: Kept = NOTHING_KEPT, progress: Callable[[str], None] = lambda _what: None
) -> Done:
    """Do the jobs, as many at once as the cores are good for, and return their results; take those that are kept.

    Raises:
        Exception: what the first job that failed has raised; jobs that have not begun by then are left.
    """
    found: dict[str, tuple[Any, str]] = {}
    for job in jobs:
        if (job.after in found or not job.after) and (result := find(job, kept)):
            found[job.name] = result
    results = {name: result for name, (result, _) in found.items()}
    left = [job for job in jobs if job.name not in found]
    begun: dict[str, Future[None]] = {}

    def do(job: Job[Any]) -> None:
        if job.after in begun:
            begun[job.after].result()
        if job.says:
            progress(job.says)
        result = results[job.name] = job.work(*([results[job.after]] if job.after else []))
        if job.lasting(result):
            kept.keep(result, job.name, *job.decided_by)

    with ExitStack() as stack:
        at_once = {Turn.CORE: _TRIALS_AT_ONCE, Turn.BESIDE: _BESIDE_AT_ONCE}
        pools = {turn: stack.enter_context(ThreadPoolExecutor(at_once.get(turn, len(left)) or 1)) for turn in Turn}
        for job in left:
            begun[job.name] = pools[job.turn].submit(do, job)
        for waiting in wait(begun.values(), return_when=FIRST_EXCEPTION).not_done:
            waiting.cancel()
    for future in begun.values():
        if not future.cancelled():
            future.result()
    return Done({job.name: results[job.name] for job in jobs}, {name: when for name, (_, when) in found.items()})


def find(job: Job[T], kept: Kept) -> tuple[T, str] | None:
    """Return what is kept of a job, and the local time of when it was done; None if nothing is."""
    return kept.find(job.kind, job.name, *job.decided_by)
