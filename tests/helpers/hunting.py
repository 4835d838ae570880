"""Hunts without nodes: a function makes the trial of each case."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from hypothesis import strategies as st

from grader.evidence import Command, Sample, Trial
from grader.hunt.search import Runner
from grader.trials.case import Case, Step
from grader.trials.observers import Observers
from grader.trials.plan import TrialPlan
from grader.trials.promises import Broken, Making, Promise, Run
from helpers import judging

NODE = "robot_controller"
Makes = Callable[[Case], Trial]


class FakeObservers:
    """Makes the trial of each case by a function, and remembers the cases in `ran`."""

    def __init__(self, make: Makes) -> None:
        self._make = make
        self.ran: list[Case] = []

    def run(self, plan: TrialPlan) -> Trial:
        """Return the trial of a plan's case."""
        assert plan.case is not None
        case = Case.of(plan.case)
        self.ran.append(case)
        return self._make(case)


@contextmanager
def running(make: Makes, threads: int = 2) -> Iterator[tuple[Runner, list[Case]]]:
    """Yield a runner of cases, and the cases that it has run."""
    observers = FakeObservers(make)
    with ThreadPoolExecutor(threads) as pool:
        yield Runner(cast(Observers, observers), pool), observers.ran


def replacing(make: Makes) -> Any:
    """Return what may stand in the place of `grader.hunting.runner`, for any package."""

    @contextmanager
    def runner(_package: Path, _settings: object) -> Iterator[Runner]:
        with running(make) as (found, _):
            yield found

    return runner


def waiting(*ticks: int) -> Case:
    """Return a case that waits for so many ticks of 0.1 s, each a step of its own."""
    return Case(NODE, tuple(Step("wait", n / 10) for n in ticks))


WAITS = Making(("F1",), st.lists(st.integers(1, 50), min_size=1, max_size=8).map(lambda ticks: waiting(*ticks)))


def driven(v: float, **facts: Any) -> Trial:
    """Return a trial of 1 s with one command, at 0.5 s."""
    samples = [Sample(t / 20, 0, 0, 0, 0, 0, 0, 0, 0, 9.0) for t in range(21)]
    return judging.trial("case-1", NODE, commands=[Command(0.5, v, 0.0)], samples=samples, **facts)


def _is_slow(run: Run) -> Broken | None:
    return next((Broken(c.t, f"{c.v:g} m/s at {c.t:g} s") for c in run.trial.commands if c.v > 0.5), None)


SLOW = Promise("is_slow", "It is slow.", _is_slow, ("F1",))


def moves(_case: Case) -> Trial:
    """Return a trial in which the robot moves before it is asked to."""
    return driven(0.25)


def stands(_case: Case) -> Trial:
    return driven(0.0)
