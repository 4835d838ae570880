"""One grading: the scorecard, the evidence it rests on, and the environment that made it; or a refusal to grade."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from grader import sanitize
from grader.evidence import Evidence, Flag
from grader.scoring.rubric import Check, Criterion, Requirement
from grader.scoring.scorecard import CheckResult, Outcome, RequirementScore, Scorecard, earned, hundredths
from grader.words import localized, say, say_count

# The order in which a reader should see lost checks: what the student can fix first, then what needs the maintainers.
_FIRST = (Outcome.FAILED, Outcome.PARTIAL, Outcome.ERROR, Outcome.NOT_GRADED, Outcome.NOT_REACHED)


@dataclass(frozen=True)
class Loss:
    """A check that did not pass, with its requirement."""

    requirement: Requirement
    check: Check
    result: CheckResult

    @property
    def heading(self) -> str:
        """Return the check's sentence, "" if that is the same as what was expected."""
        sentence = self.result.sentence or self.result.id
        return "" if sentence == self.result.expected else sentence

    @property
    def lost(self) -> float:
        """Return the points that it costs."""
        return 0.0 if self.result.outcome is Outcome.ERROR else self.check.points - earned(self.check, self.result)

    @property
    def price(self) -> str:
        """Return the cost of the loss as text."""
        if self.result.outcome is Outcome.ERROR:
            return say("an error of the grader: costs no points")
        return say("{lost} of {max} points lost", lost=points(self.lost), max=points(self.check.points))


@dataclass(frozen=True)
class Decision:
    """The points that a person gives for a requirement, instead of the grader's."""

    requirement: str
    points: float
    why: str
    by: str


@dataclass(frozen=True)
class Final:
    """The figure that counts in the end.

    Attributes:
        people: whose it is; empty if it is everybody's.
        points: after lateness and decisions, None for no grade.
        max: of the whole rubric.
        grade: by the rubric's scale, "" without one.
        because: sentences that say what came between the points measured and these.
    """

    people: tuple[str, ...]
    points: float | None
    max: float
    grade: str = ""
    because: tuple[str, ...] = ()


@dataclass(frozen=True)
class HandIn:
    """What a class knows of a submission, for the report. Text is "" where it is not known.

    Attributes:
        people: who handed it in.
        team: of these people.
        name: of what was handed in: its path in the class's source.
        submitted, deadline: local times with their zone.
        late: by how much it is late, and what the class's rule says of that.
        decisions: points by people.
        comments: by people.
        finals: one that is everybody's, or one for each where a member of a team has an exception; none if the points
            measured are final.
    """

    people: tuple[str, ...] = ()
    team: str = ""
    name: str = ""
    submitted: str = ""
    deadline: str = ""
    late: str = ""
    decisions: tuple[Decision, ...] = ()
    comments: tuple[str, ...] = ()
    finals: tuple[Final, ...] = ()

    @property
    def who(self) -> str:
        """Return whose it is in a few words: the team's name, or the people's; "" where nobody is known."""
        return self.team or ", ".join(self.people)

    def on(self, requirement: str) -> Decision | None:
        """Return the decision on a requirement."""
        return next((decision for decision in self.decisions if decision.requirement == requirement), None)


@dataclass(frozen=True)
class Grading:
    """One graded submission.

    Attributes:
        environment: versions by name: "python", "pymunk", ...
        wall_seconds: how long the grading took.
        rubric, rubric_title: the SHA-256 of the rubric's file, and its title.
        checks: a hash of the code that judged the evidence.
        commit: of the kit, "" if it has no repository.
        graded: when the evidence was collected and judged for the first time, local time with its zone.
        rescored: when it was judged again, "" if it was not.
        held_back: names that students must not read: of trials, checks and worlds.
        concerns: the requirements that rest on a source of evidence, for the sources that integrity flags concern.
        withholds: whether the rubric withholds the points that flags concern.
    """

    scorecard: Scorecard
    evidence: Evidence
    environment: dict[str, str]
    submission: str
    seed: int
    wall_seconds: float
    rubric: str = ""
    checks: str = ""
    rubric_title: str = ""
    commit: str = ""
    graded: str = ""
    rescored: str = ""
    held_back: tuple[str, ...] = ()
    concerns: Mapping[str, Sequence[str]] = field(default_factory=dict)
    withholds: bool = False

    @property
    def worth(self) -> float:
        """Return the points of the whole rubric, including requirements that are not graded yet."""
        return sum(score.criterion.points for score in self.scorecard.criteria)

    @property
    def unchanged(self) -> str:
        """Return in a sentence what was not run again, because an earlier grading had collected it; "" if nothing."""
        kept = self.evidence.kept
        if not kept:
            return ""
        trials = sum(what.startswith("trial ") for what in kept)
        named = [say_count("{n} trial", "{n} trials", trials)] if trials else []
        named += [say(what) for what in kept if not what.startswith("trial ")]
        when, what = min(kept.values()), ", ".join(named)
        return say("Nothing has changed since {when}, so earlier results are used for: {what}.", when=when, what=what)

    @property
    def unjudged(self) -> tuple[RequirementScore, ...]:
        """Return the requirements that an error of the grader left without a full verdict."""
        return tuple(s for s in self.scorecard.requirements if s.outcome is Outcome.ERROR)

    def concerned(self, flag: Flag) -> list[str]:
        """Return the requirements that a flag concerns, in the rubric's order."""
        names = {name for source in flag.concerns for name in self.concerns.get(source, ())}
        return [s.requirement.id for s in self.scorecard.requirements if s.requirement.id in names]

    def seen_in(self, flag: Flag) -> str:
        """Return where a flag was raised and which requirements it concerns, "" if neither is known."""
        trial = say("trial {trial}", trial=flag.trial) if flag.trial else ""
        ids = ", ".join(self.concerned(flag))
        return "; ".join(filter(None, [flag.where, trial, say("concerns {ids}", ids=ids) if ids else ""]))

    @property
    def losses(self) -> tuple[Loss, ...]:
        """Return the checks that cost points or need a human, in the rubric's order."""
        return tuple(loss for score in self.scorecard.requirements for loss in losses(score))

    def shown(self) -> Grading:
        """Return the same grading with all text that may come from a submission made safe to show, without trials."""
        evidence = replace(self.evidence, trials={}, intake=replace(self.evidence.intake, files=[]))
        return sanitize.shown(replace(self, evidence=evidence), trusted=(Criterion, Requirement))


@dataclass(frozen=True)
class Refusal:
    """One submission that could not be graded, so neither points nor evidence.

    Attributes:
        because: why not.
        try_: what to do next.
        notes: what else was noticed of it.
        environment: versions by name.
        source: a fingerprint of the place that it was read from.
        wall_seconds: until it was refused.
        refused: when, local time with its zone.
        rubric_title: the title of the rubric by which it would have been graded.
    """

    submission: str
    because: str
    try_: str
    notes: list[str]
    environment: dict[str, str]
    seed: int
    source: str
    wall_seconds: float
    refused: str = ""
    rubric_title: str = ""

    def shown(self) -> Refusal:
        """Return the same with all text that may come from a submission made safe to show."""
        return sanitize.shown(self)


def losses(score: RequirementScore) -> tuple[Loss, ...]:
    """Return the checks of one requirement that did not pass, in the rubric's order."""
    pairs = zip(score.requirement.checks, score.results, strict=True)
    found = (Loss(score.requirement, c, r) for c, r in pairs if r.outcome is not Outcome.PASSED)
    return tuple(loss for loss in found if loss.lost >= 0.005 or loss.result.outcome is not Outcome.PARTIAL)


def foremost(score: RequirementScore) -> CheckResult | None:
    """Return the lost check that a reader of this requirement should see first, None if nothing was lost."""
    return min(score.lost, key=lambda result: _FIRST.index(result.outcome), default=None)


def price_of_flags(card: Scorecard) -> str:
    """Return in a sentence what integrity flags do to the points."""
    if ids := ", ".join(s.requirement.id for s in card.requirements if s.outcome is Outcome.WITHHELD):
        return say("The points of {ids} are withheld until a person decides.", ids=ids)
    return say("A flag takes no points by itself.")


def count_graded(scorecard: Scorecard) -> tuple[int, int]:
    """Return how many of the rubric's requirements have points, or lack them by an error, and how many there are."""
    outcomes = [score.outcome for score in scorecard.requirements]
    return sum(each not in (Outcome.NOT_GRADED, Outcome.WITHHELD) for each in outcomes), len(outcomes)


def at_hand_in(requirements: Iterable[Requirement]) -> str:
    """Return a line about those requirements that are held back, with their points; "" if there are none."""
    found = [requirement for requirement in requirements if requirement.held_back]
    worth = points(sum(requirement.points for requirement in found))
    ids = ", ".join(r.id for r in found)
    return say("Judged at hand-in, not here: {ids} ({worth} points).", ids=ids, worth=worth) if found else ""


def points(value: float) -> str:
    """Return points as text, such as "2.5" or "3", with two decimals at most."""
    return localized(f"{hundredths(value):.2f}".rstrip("0").rstrip("."))


def place(section: str) -> str:
    """Return a rubric's section as text: notebook 05_moving_safely, section "Stop" for "05_moving_safely#Stop"."""
    notebook, _, title = section.partition("#")
    if not title:
        return say("notebook {notebook}", notebook=notebook)
    return say('notebook {notebook}, section "{title}"', notebook=notebook, title=title)
