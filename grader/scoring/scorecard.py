"""Turn checks' results into points. Pure: results and rubric in, scorecard out."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from decimal import ROUND_HALF_UP, Decimal
from enum import Enum

from grader.evidence import Reason
from grader.scoring.rubric import Check, Criterion, Requirement, Rubric
from grader.words import mark, say

LEAST_LOSS = 0.1
"""Points. A requirement that would lose less than this keeps all; what was seen is said all the same."""

WITHHELD = mark("withheld until a person decides")

# The assignment's levels: the least share of a criterion's points for each.
LEVELS = (("A", 0.90), ("B", 0.75), ("C", 0.60), ("D", 0.0))


class Outcome(Enum):
    """The outcome of a check or a requirement. ERROR is an error of the grader and costs no points.

    WITHHELD is a requirement whose points wait for a person, because of an integrity flag.
    """

    PASSED = "passed"
    PARTIAL = "partial"
    FAILED = "failed"
    NOT_REACHED = "not_reached"
    ERROR = "error"
    NOT_GRADED = "not_graded"
    WITHHELD = "withheld"


@dataclass(frozen=True)
class CheckResult:
    """The result of one check. `fraction` is the earned share of its points, 0 to 1.

    `because` says why it was not reached; `reason` is the same as data. `figures` are what it measured, by name.
    """

    id: str
    outcome: Outcome
    fraction: float
    sentence: str = ""
    seen: str = ""
    expected: str = ""
    try_: str = ""
    because: str = ""
    trial: str = ""
    reason: Reason | None = None
    figures: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RequirementScore:
    """One requirement's points, `points` of `max`. Both are 0 if an error of the grader left it unjudged.

    They are 0, too, if the points that were measured are `withheld` until a person decides on an integrity flag.
    """

    requirement: Requirement
    points: float
    max: float
    outcome: Outcome
    results: tuple[CheckResult, ...]
    withheld: float = 0.0

    @property
    def waits(self) -> str:
        """Return what happens to it where it has no points yet."""
        return say(WITHHELD) if self.outcome is Outcome.WITHHELD else self.requirement.waits

    @property
    def lost(self) -> tuple[CheckResult, ...]:
        """Return the results that cost points or need a person, in order."""
        return tuple(result for result in self.results if result.outcome is not Outcome.PASSED)


@dataclass(frozen=True)
class CriterionScore:
    """One criterion's points; `level` is "" while nothing in it is graded."""

    criterion: Criterion
    points: float
    max: float
    level: str
    requirements: tuple[RequirementScore, ...]

    @property
    def waits(self) -> str:
        """Return what happens to its requirements, where none of them is graded here."""
        return say(" and ").join(dict.fromkeys(score.waits for score in self.requirements))

    @property
    def words(self) -> str:
        """Return the rubric's description of the level reached."""
        return self.criterion.levels.get(self.level, "")


@dataclass(frozen=True)
class Scorecard:
    """The points of one submission."""

    points: float
    max: float
    complete: bool
    criteria: tuple[CriterionScore, ...]

    @property
    def requirements(self) -> tuple[RequirementScore, ...]:
        """Return every requirement's score, in the rubric's order."""
        return tuple(requirement for criterion in self.criteria for requirement in criterion.requirements)


def score(rubric: Rubric, results: Iterable[CheckResult], flagged: Collection[str] = ()) -> Scorecard:
    """Return the scorecard for `results`. Integrity flags concern the requirements `flagged`.

    The rubric decides which checks count: one without exactly one result counts as an error of the grader, and a
    result of any other check is ignored. It decides, too, whether flags withhold points.
    """
    found: dict[str, list[CheckResult]] = {}
    for result in results:
        found.setdefault(result.id, []).append(result)
    held = frozenset(flagged) if rubric.withholds else frozenset()

    def scored(requirement: Requirement) -> RequirementScore:
        score = _score_requirement(requirement, found)
        return _withheld(score) if requirement.id in held else score

    return _total(tuple(_sum_up(each, tuple(map(scored, each.requirements))) for each in rubric.criteria))


def _total(criteria: tuple[CriterionScore, ...]) -> Scorecard:
    return Scorecard(
        points=_tidy(sum(c.points for c in criteria)),
        max=_tidy(sum(c.max for c in criteria)),
        complete=all(score.outcome is not Outcome.ERROR for c in criteria for score in c.requirements),
        criteria=criteria,
    )


def decided(card: Scorecard, points: Mapping[str, float]) -> Scorecard:
    """Return the scorecard with other points, by people, for the requirements that are named."""

    def decide(score: RequirementScore) -> RequirementScore:
        if (given := points.get(score.requirement.id)) is None:
            return score
        worth = score.requirement.points
        outcome = _outcome((), given, worth)
        return replace(score, points=_tidy(given), max=_tidy(worth), outcome=outcome, withheld=0.0)

    return _total(tuple(_sum_up(each.criterion, tuple(map(decide, each.requirements))) for each in card.criteria))


def earned(check: Check, result: CheckResult) -> float:
    """Return the points that a check gives, in hundredths. They are rounded here alone, so that all sums add up."""
    return hundredths(check.points * min(1.0, max(0.0, result.fraction)))


def hundredths(points: float) -> float:
    """Return points with two decimals, half up. Binary errors do not count: 2.675 is 2.68."""
    return float(Decimal(str(round(points, 6))).quantize(Decimal("0.01"), ROUND_HALF_UP))


def level(points: float, maximum: float) -> str:
    """Return the level A to D for `points` of `maximum`, "" if `maximum` is 0."""
    if maximum <= 0:
        return ""
    return next(name for name, least in LEVELS if points >= least * maximum - 1e-9)


def _withheld(score: RequirementScore) -> RequirementScore:
    """Return a score whose points wait for a person. Where there are none, or an error of ours, it stays as it is."""
    if score.outcome not in (Outcome.PASSED, Outcome.PARTIAL):
        return score
    return replace(score, points=0.0, max=0.0, outcome=Outcome.WITHHELD, withheld=score.points)


def _sum_up(criterion: Criterion, scores: tuple[RequirementScore, ...]) -> CriterionScore:
    points, maximum = _tidy(sum(s.points for s in scores)), _tidy(sum(s.max for s in scores))
    return CriterionScore(criterion, points, maximum, level(points, maximum), scores)


def _score_requirement(requirement: Requirement, found: dict[str, list[CheckResult]]) -> RequirementScore:
    if not requirement.checks:
        return RequirementScore(requirement, 0.0, 0.0, Outcome.NOT_GRADED, ())
    results = tuple(_only_result(check.id, found.get(check.id, [])) for check in requirement.checks)
    judged = [(c, r) for c, r in zip(requirement.checks, results, strict=True) if r.outcome is not Outcome.ERROR]
    points = sum(earned(check, result) for check, result in judged)
    maximum = sum(check.points for check, _ in judged)
    if 1e-9 < maximum - points < LEAST_LOSS - 1e-9:
        points, results = maximum, tuple(map(_not_taken, requirement.checks, results))
    return RequirementScore(requirement, _tidy(points), _tidy(maximum), _outcome(results, points, maximum), results)


def _not_taken(check: Check, result: CheckResult) -> CheckResult:
    """Return a result that costs nothing, though points could have been lost by it, and says so."""
    lost = check.points - earned(check, result)
    if result.outcome is Outcome.ERROR or lost < 1e-9:
        return result
    words = say(
        "{lost:.2f} points; a loss below {least:g} of a requirement is shown and not taken", lost=lost, least=LEAST_LOSS
    )
    return replace(result, outcome=Outcome.PASSED, seen="\n".join(filter(None, [result.seen or result.because, words])))


def _only_result(check_id: str, results: list[CheckResult]) -> CheckResult:
    if len(results) == 1:
        return results[0]
    seen = f"the check {check_id} gave {len(results)} results instead of one"
    return CheckResult(check_id, Outcome.ERROR, 0.0, seen=seen)


def _outcome(results: tuple[CheckResult, ...], points: float, maximum: float) -> Outcome:
    outcomes = {result.outcome for result in results}
    if Outcome.ERROR in outcomes:
        return Outcome.ERROR
    if points >= maximum - 1e-9:
        return Outcome.PASSED
    if points > 1e-9:
        return Outcome.PARTIAL
    return Outcome.NOT_REACHED if outcomes == {Outcome.NOT_REACHED} else Outcome.FAILED


def _tidy(points: float) -> float:
    """Return `points` without binary rounding errors: 2.9, not 2.9000000000000004."""
    return round(points, 6)
