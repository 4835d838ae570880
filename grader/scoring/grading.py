"""What a report is made of: one grading's scorecard, the evidence below it, and where it was made."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from grader import sanitize
from grader.evidence import Evidence
from grader.scoring.rubric import Check, Criterion, Requirement
from grader.scoring.scorecard import CheckResult, Outcome, RequirementScore, Scorecard

# What a reader should see first of a requirement's lost checks: what the student can mend, then what needs us.
_FIRST = (Outcome.FAILED, Outcome.PARTIAL, Outcome.ERROR, Outcome.NOT_GRADED, Outcome.NOT_REACHED)


@dataclass(frozen=True)
class Loss:
    """A check that did not pass, with its requirement."""

    requirement: Requirement
    check: Check
    result: CheckResult

    @property
    def heading(self) -> str:
        """Return the check's sentence, "" where it is the same as what was expected."""
        sentence = self.result.sentence or self.result.id
        return "" if sentence == self.result.expected else sentence

    @property
    def price(self) -> str:
        """Return in words what the loss costs."""
        if self.result.outcome is Outcome.ERROR:
            return "a fault of the grader: costs no points"
        lost = self.check.points * (1.0 - min(1.0, max(0.0, self.result.fraction)))
        lost = math.ceil(lost * 100 - 1e-6) / 100  # with the points, which are rounded down, it makes up the whole
        return f"{points(lost)} of {points(self.check.points)} points lost"


@dataclass(frozen=True)
class Grading:
    """One submission, graded. `environment` names what graded it ("kit", "rclpy", ...); wall time in seconds."""

    scorecard: Scorecard
    evidence: Evidence
    environment: dict[str, str]
    submission: str
    seed: int
    wall_seconds: float

    @property
    def worth(self) -> float:
        """Return the points of the whole rubric, graded yet or not."""
        return sum(score.criterion.points for score in self.scorecard.criteria)

    @property
    def unjudged(self) -> tuple[RequirementScore, ...]:
        """Return the requirements that an error of ours left without a full verdict."""
        return tuple(s for s in self.scorecard.requirements if s.outcome is Outcome.ERROR)

    @property
    def losses(self) -> tuple[Loss, ...]:
        """Return the checks that cost points or need a human, in the rubric's order."""
        return tuple(loss for score in self.scorecard.requirements for loss in losses(score))

    def shown(self) -> Grading:
        """Return the same grading with all text that a submission had a hand in fit to be shown.

        The trials are left out: their thousands of samples are numbers, and what is said of them is said in few words.
        """
        evidence = replace(self.evidence, trials={}, intake=replace(self.evidence.intake, files=[]))
        return sanitize.shown(replace(self, evidence=evidence), trusted=(Criterion, Requirement))


def losses(score: RequirementScore) -> tuple[Loss, ...]:
    """Return the checks of one requirement that did not pass, in the rubric's order."""
    pairs = zip(score.requirement.checks, score.results, strict=True)
    return tuple(Loss(score.requirement, c, r) for c, r in pairs if r.outcome is not Outcome.PASSED)


def foremost(score: RequirementScore) -> CheckResult | None:
    """Return the lost check of a requirement that a reader should see first, None if nothing was lost."""
    return min(score.lost, key=lambda result: _FIRST.index(result.outcome), default=None)


def judged(scorecard: Scorecard) -> tuple[int, int]:
    """Return how many of the rubric's requirements have checks, and how many there are."""
    outcomes = [score.outcome for score in scorecard.requirements]
    return sum(outcome is not Outcome.NOT_GRADED for outcome in outcomes), len(outcomes)


def points(value: float) -> str:
    """Return points as a reader wants them, "2.5" or "3". Rounded down, so that almost full never reads as full."""
    hundredths = math.floor(value * 100 + 1e-6)
    return f"{hundredths / 100:.2f}".rstrip("0").rstrip(".")


def place(section: str) -> str:
    """Return the words for a rubric's section: "05_moving_safely#Stop" is notebook 05_moving_safely, section Stop."""
    notebook, _, title = section.partition("#")
    return f'notebook {notebook}, section "{title}"' if title else f"notebook {notebook}"
