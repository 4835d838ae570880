"""What a course's folder `hunts/` holds: how cases are made up, and what the node under test promises in each."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from typing import Any

from hypothesis.strategies import SearchStrategy, one_of

from grader import tracebacks
from grader.checks import first_cause
from grader.course import Course
from grader.course.reader import modules
from grader.errors import UsageError
from grader.evidence import Command, Kind, Sample, Trial
from grader.trials.case import Case
from grader.words import mark, say

_MAKES, _PROMISES = "hunt_makes", "hunt_promises"
NODE = "NODE"
"""The name in a module of `hunts/` of the node that its promises are about."""
AS_TEST = "as_test"
"""The name in such a module of what writes a found case as a test of that node; see `Writes`."""
_OURS = (Kind.OBSERVER_CRASHED, Kind.SLOW)  # it may be this machine's doing that a trial ended so


@dataclass(frozen=True)
class Broken:
    """A promise that was not kept: when, in simulated s, what was seen, and the values that the words have."""

    t: float
    seen: str
    fields: Mapping[str, Any] = field(default_factory=dict, compare=False)


def broken(t: float, words: str, **fields: Any) -> Broken:
    """Return that a promise was not kept at `t`; `words` (say `mark(...)`) are filled with the fields and with t."""
    return Broken(t, say(words, t=t, **fields), fields)


@dataclass(frozen=True)
class Run:
    """A case with the trial that came of it. Times are simulated seconds since the trial began."""

    case: Case
    trial: Trial

    @cached_property
    def end(self) -> float:
        """Return the time of the last sample."""
        return self.trial.samples[-1].t if self.trial.samples else 0.0

    def times(self, step: str) -> list[tuple[float, Any]]:
        """Return when the steps of this name were done, and with what; those that were not reached are left out."""
        marks = self.trial.marks
        named = ((marks.get(f"{number} {each.do}"), each.to) for number, each in enumerate(self.case.steps))
        return [
            (t, to) for (t, to), each in zip(named, self.case.steps, strict=True) if each.do == step and t is not None
        ]

    def commands(self, start: float, end: float) -> list[Command]:
        """Return the commands with start < t <= end."""
        return [command for command in self.trial.commands if start + 1e-9 < command.t <= end + 1e-9]

    def sample(self, t: float) -> Sample:
        """Return the sample nearest to a time."""
        return min(self.trial.samples, key=lambda sample: abs(sample.t - t))


Judges = Callable[[Run], Broken | None]


@dataclass(frozen=True)
class Promise:
    """What a node promises in every case: the function returns where a run breaks it, None where it does not.

    `serves` are the requirements that say so; a promise without any belongs to every hunt. It is about cases of
    the `node`, "" for any, of which `as_test` writes a test.
    """

    name: str
    sentence: str
    judge: Judges
    serves: tuple[str, ...] = ()
    node: str = ""
    as_test: Writes | None = None

    @property
    def words(self) -> str:
        """Return its sentence, with the requirements that say so."""
        words = say(self.sentence)
        return f"{words} ({', '.join(self.serves)})" if self.serves else words


Writes = Callable[[Run, Promise, Broken, str], str]
"""Writes a found case, with what was done in words, as the text of a test; "" for a case that it cannot write."""


@dataclass(frozen=True)
class Making:
    """How cases are made up for some requirements: a Hypothesis strategy of Case."""

    serves: tuple[str, ...]
    cases: SearchStrategy[Case]


@dataclass(frozen=True)
class Hunts:
    """All that a course can hunt for."""

    makings: tuple[Making, ...] = ()
    promises: tuple[Promise, ...] = ()

    @property
    def requirements(self) -> tuple[str, ...]:
        """Return the ids of the requirements that can be hunted for."""
        names = {name for making in self.makings for name in making.serves}
        return tuple(sorted(names, key=lambda name: (name.rstrip("0123456789"), len(name), name)))

    def of(self, requirements: Iterable[str]) -> tuple[Making, tuple[Promise, ...]]:
        """Return a making of cases for some requirements together, and what is promised in them.

        Raises:
            UsageError: the course has no hunt for one of them, or none at all.
        """
        if not self.makings:
            raise UsageError(say("This course has no hunts: no module of its folder hunts/ makes up cases."))
        wanted = tuple(requirements) or self.requirements
        for name in wanted:
            if name not in self.requirements:
                words = say("No hunt is for {name!r}.", name=name)
                raise UsageError(words, say("There are {known}.", known=", ".join(self.requirements)))
        strategies = [making.cases for making in self.makings if {*making.serves} & {*wanted}]
        promises = [promise for promise in self.promises if not promise.serves or {*promise.serves} & {*wanted}]
        return Making(wanted, one_of(strategies)), (*promises, LIVES)


def makes(*serves: str) -> Callable[[Callable[[], SearchStrategy[Case]]], Callable[[], SearchStrategy[Case]]]:
    """Make the decorated function, which returns a Hypothesis strategy of Case, a source of cases."""

    def add(function: Callable[[], SearchStrategy[Case]]) -> Callable[[], SearchStrategy[Case]]:
        setattr(function, _MAKES, serves)
        return function

    return add


def promise(*serves: str) -> Callable[[Judges], Judges]:
    """Make the decorated function a promise of these requirements; its docstring says what is promised."""

    def add(function: Judges) -> Judges:
        setattr(function, _PROMISES, serves)
        return function

    return add


@cache
def hunts(course: Course) -> Hunts:
    """Return all that a course can hunt for, after importing its modules."""
    makings, promises, writes = [], [], {}
    for module in modules(course.folder / "hunts"):
        for name, item in vars(module).items():
            if getattr(item, "__module__", "") != module.__name__:
                continue
            if hasattr(item, _MAKES):
                makings.append(Making(getattr(item, _MAKES), item()))
            elif hasattr(item, _PROMISES):
                sentence = (inspect.getdoc(item) or name).partition("\n")[0]
                promises.append(Promise(name, sentence, item, getattr(item, _PROMISES), getattr(module, NODE, "")))
        if hasattr(module, AS_TEST):
            writes[getattr(module, NODE)] = getattr(module, AS_TEST)
    return Hunts(tuple(makings), tuple(replace(each, as_test=writes.get(each.node)) for each in promises))


def unjudged(trial: Trial) -> bool:
    """Return whether a trial ended early in a way that breaks no promise."""
    return trial.ended is not None and trial.ended.kind in _OURS


def _lives(run: Run) -> Broken | None:
    trial, ended = run.trial, run.trial.ended
    if trial.foreign:
        return broken(
            0.0, mark("it publishes {topics}, which only the simulator does"), topics=", ".join(trial.foreign)
        )
    if trial.stopped:
        return broken(run.end, mark("the node exceeded its limit of {limit} at {t:.2f} s"), limit=trial.stopped)
    if trial.dropped:
        return broken(run.end, mark("the node sent more messages than could be kept"))
    if ended is not None:
        return None if unjudged(trial) else Broken(run.end, f"{ended}{first_cause.last_output(trial)}")
    output = trial.process.output_tail if trial.process else ""
    if tracebacks.BEGIN in output and run.trial.process is not None and run.trial.process.by != "interrupt":
        return broken(run.end, mark("a traceback: {said}"), said=tracebacks.last_words(output))
    unanswered = [call for call in trial.calls if call.problem is not None]
    return Broken(unanswered[0].t, str(unanswered[0].problem)) if unanswered else None


LIVES = Promise(
    "lives",
    mark("The node lives on, answers, raises nothing, and leaves the sensors' topics to the simulator."),
    _lives,
)


def judged(promise: Promise, run: Run) -> Broken | None:
    """Return where a run breaks a promise, None if it does not, or is about another node."""
    return promise.judge(run) if promise.node in ("", run.case.node) else None


def first_broken(promises: Iterable[Promise], run: Run) -> tuple[Promise, Broken] | None:
    """Return the promise that was broken first in a run, None if all were kept or the case cannot be run."""
    if run.trial.script_error:
        return None
    found = [(each, fault) for each in promises if (fault := judged(each, run)) is not None]
    return min(found, key=lambda pair: pair[1].t, default=None)
