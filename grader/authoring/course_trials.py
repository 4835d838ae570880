"""Grade the solution of a course by two seeds, and each known-bad edit: do they get the points that they should?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from grader import pipeline
from grader.authoring import check_course
from grader.collect import SOURCES
from grader.course import Course
from grader.errors import SubmissionError
from grader.host import tempdir
from grader.scoring.scorecard import CheckResult, Outcome, Scorecard
from grader.settings import Settings

SEEDS = (0, 1)
_TESTS_OF_ITS_OWN = ("student tests", "mutation")


@dataclass(frozen=True)
class Tried:
    """What the gradings of a course showed: what is wrong, and what the lecturer should know."""

    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()


def run(course: Course, cache: Path, progress: Callable[[str], None]) -> Tried:
    """Grade the solution by two seeds and each known-bad edit, and return what was not as it should be.

    An edit is graded on all requirements but those of the package's own tests, which are there to notice it.
    """
    settings = Settings(check_course.read_rubric(course), cache, course, keep=True)
    trying = _Trying(settings, progress)
    problems = list(trying.solution())
    if problems:
        return Tried(tuple(problems), ("the known-bad edits were not tried: the solution has to get all points first",))
    edits = [check_course.known_bad(path, course, settings.rubric) for path in check_course.edits(course)]
    problems = [line for edit in edits for line in trying.edit(edit)]
    own = {path.stem for path in course.files("checks", "check_*.py") if path.is_relative_to(course.folder)}
    never = [check.id for check in settings.rubric.checks if check.module in own and check.id not in trying.failed]
    notes = [f"no known-bad edit fails {check}, so nothing shows that it can fail" for check in never]
    if not edits:
        notes = ["there is no known-bad edit in known_bad/, so nothing shows that a check can fail"]
    return Tried(tuple(check_course.shortened(course.folder, problems)), tuple(notes))


class _Trying:
    """Grades packages of one course. `failed` are the checks that some edit has failed."""

    def __init__(self, settings: Settings, progress: Callable[[str], None]) -> None:
        self.settings, self.progress = settings, progress
        self.failed: set[str] = set()

    def solution(self) -> Iterator[str]:
        """Yield where the solution loses points, and what depends on the seed."""
        course = self.settings.course
        first, second = SEEDS
        before = _results(self._graded("the solution", course.solution, first))
        for name, result in before.items():
            if result.outcome is not Outcome.PASSED:
                yield f"the solution loses points: {name}: {_words(result)}"
        by_seed = [source.serves(self.settings) for source in SOURCES if source.name in ("trials", "functions")]
        again = self._graded(f"the solution, seed {second}", course.solution, second, frozenset().union(*by_seed))
        for name, result in _results(again).items():
            if result.outcome is not before[name].outcome:
                about = f"the trial {result.trial}" if result.trial else "what is asked"
                yield f"{about} depends on the seed: {name} passes with one of {SEEDS} alone: {_words(result)}"

    def edit(self, edit: check_course.KnownBad) -> Iterator[str]:
        """Yield how an edit's losses differ from what it says."""
        own = [source.serves(self.settings) for source in SOURCES if source.name in _TESTS_OF_ITS_OWN]
        everything = {requirement.id for requirement in self.settings.rubric.requirements if requirement.checks}
        judged = everything - frozenset().union(*own) | edit.loses.keys()
        with tempdir.folder("known-bad") as folder:
            package = edit.made(self.settings.course.solution, folder)
            try:
                card = self._graded(edit.path.name, package, SEEDS[0], judged)
            except SubmissionError as error:
                yield f"{edit.path}: it is refused, which loses everything: {error}"
                return
        self.failed |= {n for n, r in _results(card).items() if r.outcome in (Outcome.FAILED, Outcome.PARTIAL)}
        for score in card.requirements:
            name, wanted = score.requirement.id, edit.loses.get(score.requirement.id, 0.0)
            lost = score.requirement.points - score.points
            if name in judged and abs(lost - wanted) > 0.005:
                why = "; ".join(f"{result.id}: {_words(result)}" for result in score.lost)
                yield f"{edit.path}: {name} should lose {wanted:g} and loses {lost:g}{f': {why}' if why else ''}"

    def _graded(self, what: str, package: Path, seed: int, only: Iterable[str] = ()) -> Scorecard:
        settings = replace(
            self.settings, seed=seed, requirements=tuple(only), progress=lambda words: self.progress(f"{what}: {words}")
        )
        with tempdir.folder("check-course") as out:
            return pipeline.grade(package, out, settings).scorecard


def _results(card: Scorecard) -> dict[str, CheckResult]:
    return {result.id: result for score in card.requirements for result in score.results}


def _words(result: CheckResult) -> str:
    return f"{result.outcome.value.replace('_', ' ')}: {result.because or result.seen}"
