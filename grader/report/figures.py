"""Choose the figures of a report: the picture and the replay of each trial in which points were lost."""

from __future__ import annotations

import contextlib
from collections.abc import Collection
from dataclasses import dataclass

from grader.evidence import Trial
from grader.report import replay
from grader.report.album import Album
from grader.report.cause import dearest
from grader.sanitize import one_line
from grader.scoring.grading import Grading, losses
from grader.scoring.scorecard import CheckResult, Outcome

# A picture takes a fifth of a second, and a package that fails everything does so for a few reasons.
PICTURES = 6


@dataclass(frozen=True)
class Figure:
    """A trial in the page: a name for links, a description, and what there is of image source, replay and MCAP file."""

    id: str
    trial: str
    words: str
    source: str = ""
    replay: str = ""
    bag: str = ""


@dataclass(frozen=True)
class Figures:
    """All figures of a page: that of the most expensive loss comes first, the others at their requirement, once each.

    `elsewhere` names, for each requirement, the figures that its losses share with something above.
    """

    first: Figure | None
    at: dict[str, list[Figure]]
    elsewhere: dict[str, list[Figure]]


def choose(grading: Grading, bags: Collection[str]) -> Figures:
    """Return the figures of a grading. `bags` are the trials that have an MCAP file beside the report."""
    album = Album(grading.evidence.trials, most=PICTURES)
    made: dict[str, Figure | None] = {}

    def figure(result: CheckResult) -> Figure | None:
        trial = grading.evidence.trials.get(result.trial)
        if trial is None or result.outcome not in (Outcome.FAILED, Outcome.PARTIAL):
            return None
        if trial.name not in made:
            made[trial.name] = _figure(f"trial-{len(made)}", trial, result, album, trial.name in bags)
        return made[trial.name]

    candidates = (figure(loss.result) for loss in dearest(grading.losses))
    first = next((each for each in candidates if each is not None and each.source), None)
    found = {
        score.requirement.id: [made_of for loss in losses(score) if (made_of := figure(loss.result)) is not None]
        for score in grading.scorecard.requirements
    }
    above = {first.id} if first else set()
    at: dict[str, list[Figure]] = {}
    elsewhere: dict[str, list[Figure]] = {}
    for name, several in found.items():
        once = {one.id: one for one in several}
        at[name] = [one for key, one in once.items() if key not in above]
        elsewhere[name] = [one for key, one in once.items() if key in above]
        above |= set(once)
    if first is None and not any(at.values()) and (picture := album.longest_drive()):
        first = Figure("longest", picture.trial, picture.words, picture.source)
    return Figures(first, at, elsewhere)


def no_figures(grading: Grading) -> Figures:
    """Return no figures, for trials that students may not see."""
    names = [score.requirement.id for score in grading.scorecard.requirements]
    return Figures(None, {name: [] for name in names}, {name: [] for name in names})


def failed_trials(grading: Grading) -> list[Trial]:
    """Return the trials that can be replayed and in which points were lost."""
    lost = [loss.result for loss in grading.losses if loss.result.outcome in (Outcome.FAILED, Outcome.PARTIAL)]
    names = dict.fromkeys(result.trial for result in lost)
    return [trial for name in names if (trial := grading.evidence.trials.get(name)) and len(trial.samples) > 1]


def _figure(name: str, trial: Trial, result: CheckResult, album: Album, has_bag: bool) -> Figure | None:
    """Return the figure of a trial, None if there is nothing to see."""
    picture = album.draw(trial)
    played = words = ""
    # As with a picture: whatever a trial holds, the grade must be shown.
    with contextlib.suppress(Exception):
        from grader.report import pictures

        # A share of the points may rest on several trials, of which only the last is known.
        if pictures.drawable(trial) or (result.outcome is Outcome.FAILED and len(trial.samples) > 1):
            words = one_line(pictures.describe(trial), 1_000)
            played = replay.data(trial, result.seen)
    if picture is None and not played:
        return None
    bag = f"evidence/trials/{trial.name}.mcap" if has_bag else ""
    return Figure(name, one_line(trial.name), words, picture.source if picture else "", played, bag)
