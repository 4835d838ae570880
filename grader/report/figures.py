"""Choose the trials that a report or a check shows, as pictures (pictures.py draws them) and as replays."""

from __future__ import annotations

import contextlib
import importlib
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from grader import KIT
from grader.evidence import Trial
from grader.report.cause import dearest
from grader.sanitize import one_line
from grader.scoring.grading import Grading, losses
from grader.scoring.scorecard import CheckResult, Outcome

# A picture takes a fifth of a second, and a package that fails everything does so for a few reasons.
PICTURES = 6


@dataclass(frozen=True)
class Figure:
    """A trial as an image source and as a replay, each "" if there is none, and what it shows in words."""

    trial: str
    source: str = ""
    words: str = ""
    replay: str = ""
    id: str = ""
    """A name for links within a page."""


@dataclass
class Album:
    """Figures of `trials`, each made once, and no more than `most` of them with a picture."""

    trials: Mapping[str, Trial]
    most: int = PICTURES
    made: dict[str, Figure | None] = field(default_factory=dict)

    def of(self, result: CheckResult, at: float | None = None) -> Figure | None:
        """Return the figure of the trial in which a check lost points, None if there is nothing to see; `at` is marked.

        A share of the points may rest on several trials, of which only the last is known.
        """
        trial = self.trials.get(result.trial)
        if trial is None or result.outcome not in (Outcome.FAILED, Outcome.PARTIAL):
            return None
        return self.draw(trial, result.seen, at, failed=result.outcome is Outcome.FAILED)

    def draw(self, trial: Trial, seen: str = "", at: float | None = None, *, failed: bool = False) -> Figure | None:
        """Return the figure of a trial. A trial that `failed` is replayed even if the robot did nothing."""
        if trial.name in self.made:
            return self.made[trial.name]
        source = words = played = ""
        pictured = sum(figure is not None and bool(figure.source) for figure in self.made.values())
        # Figures are an extra: whatever a trial holds, the grade must be shown.
        with contextlib.suppress(Exception):
            pictures = _pictures()
            drawable = pictures.drawable(trial)
            if drawable or (failed and len(trial.samples) > 1):
                words = one_line(pictures.describe(trial), 1_000)
            if drawable and pictured < self.most:
                source = pictures.data_uri(trial, at)
        with contextlib.suppress(Exception):
            played = _pictures().replay(trial, seen) if words else ""
        made = Figure(one_line(trial.name), source, words, played, f"trial-{len(self.made)}")
        self.made[trial.name] = made if source or played else None
        return self.made[trial.name]


@cache
def _pictures() -> Any:
    """Return pictures.py. Its matplotlib takes half a second, and would obey a matplotlibrc in the current folder."""
    with contextlib.chdir(KIT):
        return importlib.import_module("grader.report.pictures")


@dataclass(frozen=True)
class Figures:
    """All figures of a page: that of the most expensive loss comes first, the others at their requirement, once each.

    `elsewhere` names, for each requirement, the figures that its losses share with something above.
    """

    first: Figure | None = None
    at: dict[str, list[Figure]] = field(default_factory=lambda: defaultdict(list))
    elsewhere: dict[str, list[Figure]] = field(default_factory=lambda: defaultdict(list))


def choose(grading: Grading) -> Figures:
    """Return the figures of a grading; of one that lost nothing in a trial, the picture of its longest drive."""
    album = Album(grading.evidence.trials, PICTURES)
    candidates = (album.of(loss.result) for loss in dearest(grading.losses))
    first = next((figure for figure in candidates if figure is not None and figure.source), None)
    chosen, above = Figures(first), {first}
    for score in grading.scorecard.requirements:
        found = dict.fromkeys(figure for loss in losses(score) if (figure := album.of(loss.result)))
        chosen.at[score.requirement.id] = [figure for figure in found if figure not in above]
        chosen.elsewhere[score.requirement.id] = [figure for figure in found if figure in above]
        above |= set(found)
    if first is None and not any(chosen.at.values()) and album.trials:
        trial = _pictures().worth_drawing(album.trials.values())
        figure = album.draw(trial) if trial is not None else None
        return replace(chosen, first=figure and replace(figure, replay=""))
    return chosen
