"""Find the first cause of a submission's losses in what the checks said. Nothing is judged anew."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from grader.checks.first_cause import OF_TRIALS, what_it_said, with_cure
from grader.evidence import Kind, Reason, Trial
from grader.sanitize import prose
from grader.scoring.grading import Grading, Loss, foremost, points
from grader.scoring.scorecard import CheckResult, Outcome
from grader.words import mark, say

_LIMIT = 400  # characters of a sentence
_BUILD = mark("The package does not build")


@dataclass(frozen=True)
class Cause:
    """What losses have in common, as a sentence that is safe to show, and the losses."""

    sentence: str
    losses: tuple[Loss, ...]

    @property
    def lost(self) -> float:
        """Return the points that follow from it."""
        return sum(loss.lost for loss in self.losses)

    @property
    def by_requirement(self) -> dict[str, float]:
        """Return the points that follow from it in each requirement."""
        return _by_requirement(self.losses)

    def explains(self, result: CheckResult) -> bool:
        """Return whether the check could not be reached because of it."""
        return result.outcome is Outcome.NOT_REACHED and any(loss.result.id == result.id for loss in self.losses)

    def __str__(self) -> str:
        return say("{cause}; {lost} points follow from it", cause=self.sentence, lost=points(self.lost))


def find(grading: Grading, decided: Collection[str] = ()) -> Cause | None:
    """Return the cause of most of the lost points, None if there is none that several requirements share.

    A cause must cost more than any single requirement that it does not explain. Those `decided` by people do not count.
    """
    groups: dict[str | Reason, list[Loss]] = {}
    losses = [loss for loss in grading.losses if loss.requirement.id not in decided]
    for loss in losses:
        if why := _why(loss, grading):
            groups.setdefault(why, []).append(loss)
    if not groups:
        return None
    why, found = max(groups.items(), key=lambda group: round(sum(loss.lost for loss in group[1]), 6))
    if why in {score.requirement.id for score in grading.scorecard.requirements}:
        found += [loss for loss in losses if loss.requirement.id == why and loss not in found]
    explained = {id(loss) for loss in found}
    others = _by_requirement(loss for loss in losses if id(loss) not in explained)
    own = _by_requirement(found)
    if len(own) < 2 or round(sum(own.values()), 6) <= round(max(others.values(), default=0.0), 6):
        return None
    words = prose(_sentence(why, found, grading), _LIMIT)
    return Cause(words, tuple(found))


def dearest(losses: Iterable[Loss]) -> list[Loss]:
    """Return the losses that cost points, the most expensive first; those of the same cost in the rubric's order."""
    return sorted((loss for loss in losses if loss.lost > 0), key=lambda loss: -loss.lost)


def _by_requirement(losses: Iterable[Loss]) -> dict[str, float]:
    lost: dict[str, float] = {}
    for loss in losses:
        lost[loss.requirement.id] = lost.get(loss.requirement.id, 0.0) + loss.lost
    return lost


def _why(loss: Loss, grading: Grading) -> str | Reason | None:
    """Return what to group a loss by: the reason of a build or a start that failed, or a requirement's id."""
    result, evidence, reason = loss.result, grading.evidence, loss.result.reason
    if result.outcome not in (Outcome.NOT_REACHED, Outcome.FAILED):
        return None
    if reason is not None and reason.kind is Kind.NOT_BUILT:
        return _BUILD
    trial = evidence.trials.get(result.trial)
    if trial is not None and not trial.ready:
        return _why_not_started(trial, reason)
    if reason is None:
        return None if result.outcome is Outcome.FAILED else result.because
    return reason.requirements[0] if len(reason.requirements) == 1 else _common(reason)


def _why_not_started(trial: Trial, reason: Reason | None) -> str | Reason | None:
    """Return what the package's text shows, else the exception and its place, else how the trial ended."""
    if reason is not None and reason.fault is not None:
        return with_cure(reason.fault)
    return what_it_said(trial) or (trial.ended and _common(trial.ended))


def _common(reason: Reason) -> Reason:
    """Return what a reason has in common with others like it: trials wait longer for a node that may still come."""
    return replace(reason, seconds=0.0, fault=None)


def _sentence(why: str | Reason, found: Sequence[Loss], grading: Grading) -> str:
    for score in grading.scorecard.requirements:
        first = foremost(score)
        if score.requirement.id == why and first is not None:
            return f"{why} {score.requirement.title}: {first.seen or first.because}".rstrip(".")
    if why == _BUILD:
        seen = next((loss.result.seen for loss in found if loss.result.outcome is Outcome.FAILED), "")
        return f"{say(_BUILD)}: {seen.splitlines()[0]}" if seen else say(_BUILD)
    trials = grading.evidence.trials
    started = {trial.node for trial in trials.values() if trial.ready}
    tried = {trials[loss.result.trial].node for loss in found if loss.result.trial in trials}
    graphs = [trial.graph for trial in trials.values() if trial.graph is not None]
    running = {name.rpartition("/")[2] for graph in graphs for name in graph.nodes}
    if tried and not started and all(name.startswith("launch_ros") for name in running):
        return say("No node started: {why}", why=why)
    # A node that started by itself was not what kept a launch file from starting both.
    nodes = sorted(tried - started)
    if nodes:
        return say("{nodes} did not start: {why}", nodes=say(" and ").join(nodes), why=why)
    words = why if isinstance(why, str) else found[0].result.because or str(why)
    if isinstance(why, Reason) and why.kind in OF_TRIALS:
        words = f"{why} ({why.cure})"
    return words[:1].upper() + words[1:]
