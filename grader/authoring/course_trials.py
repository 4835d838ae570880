"""Grade the solution of a course by two seeds, and each known-bad edit: do they get the points that they should?"""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader import pipeline
from grader.authoring import check_course
from grader.collect import SOURCES
from grader.course import Course
from grader.errors import SubmissionError
from grader.host import tempdir
from grader.league.cases import FOLDER
from grader.league.source import LeagueCases
from grader.scoring.grading import Grading
from grader.scoring.scorecard import CheckResult, Outcome, Scorecard
from grader.settings import Reuse, Settings

HUNTED = 19
"""How many seeds a hunt makes up, beside seed 0."""
_TESTS_OF_ITS_OWN = ("student tests", "mutation")
_BY_SEED = ("trials", "functions", "hunt")


@dataclass(frozen=True)
class Tried:
    """What the gradings of a course showed: what is wrong, and what the lecturer should know."""

    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()


def made_up(count: int) -> tuple[int, ...]:
    """Return seeds that no earlier run is likely to have had: each turns and fills the trials' worlds anew."""
    return tuple(random.SystemRandom().sample(range(1, 10**6), count))


def run(course: Course, cache: Path, progress: Callable[[str], None], seeds: Sequence[int] = ()) -> Tried:
    """Grade the solution by two seeds and each known-bad edit by one, and return what was not as it should be.

    With `seeds` both are tried with these after seed 0, in what trials and functions serve.
    An edit is graded on all requirements but those of the package's own tests, which are there to notice it.
    """
    settings = Settings(check_course.read_rubric(course), cache, course, reuse=Reuse.KEPT)
    trying = _Trying(settings, progress, seeds)
    problems = list(trying.solution())
    worth = check_course.worth(settings.rubric)
    edits = [check_course.known_bad(path, course, worth) for path in check_course.edits(course)]
    problems += [line for edit in edits for line in trying.edit(edit)]
    own = {path.stem for path in course.files("checks", "check_*.py") if path.is_relative_to(course.folder)}
    earned = [r for r in settings.rubric.requirements if r.id not in trying.lost]
    never = [c.id for r in earned for c in r.checks if c.module in own and c.id not in trying.failed]
    notes = [*trying.notes, *(f"no known-bad edit fails {check}, so nothing shows that it can fail" for check in never)]
    if not edits:
        notes = ["there is no known-bad edit in known_bad/, so nothing shows that a check can fail"]
    return Tried(tuple(check_course.shortened(course.folder, problems)), tuple(notes))


class _Trying:
    """Grades packages of one course.

    `lost` are the requirements that the solution does not get in full, `failed` the checks that some edit has failed,
    `notes` say what was not tried.
    """

    def __init__(self, settings: Settings, progress: Callable[[str], None], seeds: Sequence[int]) -> None:
        self.settings, self.progress, self.seeds = settings, progress, seeds
        self.failed: set[str] = set()
        self.lost: set[str] = set()
        self.notes: list[str] = []
        self._by_seed = self._served(_BY_SEED)
        # A league judges what a student makes up. A solution that hands in no cases is not asked for them.
        hands_in = (settings.course.solution / FOLDER).is_dir()
        checked = frozenset(requirement.id for requirement in settings.rubric.requirements if requirement.checks)
        self._everything = checked - (frozenset() if hands_in else self._served((LeagueCases.name,)))

    def solution(self) -> Iterator[str]:
        """Yield where the solution loses points, and what depends on the seed."""
        solution = self.settings.course.solution
        try:
            card = self._graded("the solution", solution, 0, self._everything).scorecard
        except SubmissionError as error:
            yield f"the solution is refused: {error}"
            self.lost = {requirement.id for requirement in self.settings.rubric.requirements}
            return
        self.lost = {score.requirement.id for score in card.requirements if score.lost}
        before = _results(card)
        for name, result in before.items():
            if result.outcome is not Outcome.PASSED:
                yield f"the solution loses points: {name}: {_words(result)}"
        others: dict[str, dict[int, tuple[CheckResult, str]]] = {}
        for seed in self.seeds or (1,) if self._by_seed else ():
            again = self._graded(f"the solution, seed {seed}", solution, seed, self._by_seed)
            for name, result in _results(again.scorecard).items():
                if result.outcome is not before[name].outcome:
                    others.setdefault(name, {})[seed] = result, _chosen(again, [result])
        for name, found in others.items():
            result, chosen = next(iter(found.values()))
            about = f"the trial {result.trial}" if result.trial else "what is asked"
            first = before[name].outcome.value.replace("_", " ")
            then = f"with {_seeds(found)} {_words(result)}{chosen}"
            yield f"{about} depends on the seed: {name}: {first} with seed 0, {then}"

    def edit(self, edit: check_course.KnownBad) -> Iterator[str]:
        """Yield how an edit's losses differ from what it says; what the solution itself loses is not compared."""
        judged = (self._everything - self._served(_TESTS_OF_ITS_OWN) | edit.loses.keys()) - self.lost
        if left := sorted(edit.loses.keys() & self.lost):
            path = edit.path.relative_to(self.settings.course.folder)
            self.notes.append(f"{path} was not tried for {', '.join(left)}, of which the solution itself loses points")
        if not judged & edit.loses.keys():
            return
        with tempdir.folder("known-bad") as folder:
            package = edit.edit.made(self.settings.course.solution, folder)
            try:
                card = self._graded(edit.path.name, package, 0, judged).scorecard
                yield from self._compared(edit, card, judged)
                passed: dict[str, dict[int, str]] = {}
                wanted = {name for name, points in edit.loses.items() if points} & self._by_seed & judged
                for seed in self.seeds if wanted else ():
                    again = self._graded(f"{edit.path.name}, seed {seed}", package, seed, wanted)
                    for score in again.scorecard.requirements:
                        if score.requirement.id in wanted and score.outcome is Outcome.PASSED:
                            passed.setdefault(score.requirement.id, {})[seed] = _chosen(again, score.results)
            except SubmissionError as error:
                yield f"{edit.path}: it is refused, which loses everything: {error}"
                return
        for name, lucky in passed.items():
            luck = f"with {_seeds(lucky)} of {1 + len(self.seeds)}: a package like this passes by luck"
            yield f"{edit.path}: {name} is not lost {luck}{next(iter(lucky.values()))}"

    def _compared(self, edit: check_course.KnownBad, card: Scorecard, judged: Collection[str]) -> Iterator[str]:
        self.failed |= {n for n, r in _results(card).items() if r.outcome in (Outcome.FAILED, Outcome.PARTIAL)}
        for score in card.requirements:
            name, wanted = score.requirement.id, edit.loses.get(score.requirement.id, 0.0)
            lost = score.requirement.points - score.points
            if name in judged and abs(lost - wanted) > 0.005:
                why = "; ".join(f"{result.id}: {_words(result)}" for result in score.lost)
                yield f"{edit.path}: {name} should lose {wanted:g} and loses {lost:g}{f': {why}' if why else ''}"

    def _served(self, sources: Collection[str]) -> frozenset[str]:
        """Return the requirements that these sources of evidence serve."""
        found = (source.serves(self.settings) for source in SOURCES if source.name in sources)
        return frozenset(name for names in found for name in names)

    def _graded(self, what: str, package: Path, seed: int, only: Iterable[str]) -> Grading:
        settings = replace(
            self.settings, seed=seed, requirements=tuple(only), progress=lambda words: self.progress(f"{what}: {words}")
        )
        with tempdir.folder("check-course") as out:
            return pipeline.grade(package, out, settings)


def _results(card: Scorecard) -> dict[str, CheckResult]:
    return {result.id: result for score in card.requirements for result in score.results}


def _chosen(grading: Grading, results: Iterable[CheckResult]) -> str:
    """Return in words what the seed has chosen in the trials of these results, "" if nothing."""
    read = {result.trial for result in results}
    trials = [trial for name, trial in grading.evidence.trials.items() if name in read]
    chosen = [f"{name} {value:g} in {trial.name}" for trial in trials for name, value in trial.choices.items()]
    return f" (seed {grading.seed}: {', '.join(chosen)})" if chosen else ""


def _words(result: CheckResult) -> str:
    return f"{result.outcome.value.replace('_', ' ')}: {result.because or result.seen}"


def _seeds(numbers: Iterable[int]) -> str:
    *others, last = map(str, numbers)
    return f"the seeds {', '.join(others)} and {last}" if others else f"seed {last}"
