"""Choose the trials that a report or a check shows, as pictures (pictures.py draws them) and as replays."""

from __future__ import annotations

import contextlib
import importlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
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
class Picture:
    """The picture of a trial: an image source, and its content in words."""

    trial: str
    source: str
    words: str


@dataclass
class Album:
    """Pictures of `trials`, each drawn once and no more than `most` of them; a trial that cannot be drawn has None."""

    trials: Mapping[str, Trial]
    most: int
    drawn: dict[str, Picture | None] = field(default_factory=dict)

    def of(self, results: Iterable[CheckResult]) -> list[Picture]:
        """Return the pictures of the trials in which checks lost points, without those returned before."""
        names = dict.fromkeys(r.trial for r in results if r.outcome in (Outcome.FAILED, Outcome.PARTIAL))
        new = [self.draw(self.trials[name]) for name in names if name in self.trials and name not in self.drawn]
        return [picture for picture in new if picture is not None]

    def longest_drive(self) -> Picture | None:
        """Return the picture of the longest drive, None if there is none or it was returned before."""
        if not self.most or not self.trials:
            return None
        trial = _pictures().worth_drawing(self.trials.values())
        return None if trial is None or trial.name in self.drawn else self.draw(trial)

    def draw(self, trial: Trial, at: float | None = None) -> Picture | None:
        """Return the picture of a trial, None if there is nothing to see in it or enough is drawn; `at` is marked."""
        if trial.name in self.drawn:
            return self.drawn[trial.name]
        self.drawn[trial.name] = None
        if sum(picture is not None for picture in self.drawn.values()) < self.most:
            # A picture is an extra: if drawing fails, the grade must still be shown.
            with contextlib.suppress(Exception):
                pictures = _pictures()
                if pictures.drawable(trial):
                    words = one_line(pictures.describe(trial), 1_000)
                    self.drawn[trial.name] = Picture(one_line(trial.name), pictures.data_uri(trial, at), words)
        return self.drawn[trial.name]


@cache
def _pictures() -> Any:
    """Return pictures.py. Its matplotlib takes half a second, and would obey a matplotlibrc in the current folder."""
    with contextlib.chdir(KIT):
        return importlib.import_module("grader.report.pictures")


@dataclass(frozen=True)
class Figure:
    """A trial in the page: a name for links, a description, and what there is of image source and replay."""

    id: str
    trial: str
    words: str
    source: str = ""
    replay: str = ""


@dataclass(frozen=True)
class Figures:
    """All figures of a page: that of the most expensive loss comes first, the others at their requirement, once each.

    `elsewhere` names, for each requirement, the figures that its losses share with something above.
    """

    first: Figure | None = None
    at: dict[str, list[Figure]] = field(default_factory=lambda: defaultdict(list))
    elsewhere: dict[str, list[Figure]] = field(default_factory=lambda: defaultdict(list))


def choose(grading: Grading) -> Figures:
    """Return the figures of a grading."""
    album = Album(grading.evidence.trials, most=PICTURES)
    made: dict[str, Figure | None] = {}

    def figure(result: CheckResult) -> Figure | None:
        trial = grading.evidence.trials.get(result.trial)
        if trial is None or result.outcome not in (Outcome.FAILED, Outcome.PARTIAL):
            return None
        if trial.name not in made:
            made[trial.name] = _figure(f"trial-{len(made)}", trial, result.seen, result.outcome, album)
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


def of_trial(trial: Trial, seen: str, at: float) -> Figure | None:
    """Return the figure of a trial in which a promise was broken, None if there is nothing to see."""
    album = Album({trial.name: trial}, most=1)
    album.draw(trial, at)
    return _figure("trial", trial, seen, Outcome.FAILED, album)


def _figure(name: str, trial: Trial, seen: str, outcome: Outcome, album: Album) -> Figure | None:
    """Return the figure of a trial, None if there is nothing to see."""
    picture = album.draw(trial)
    played = words = ""
    # As with a picture: whatever a trial holds, the grade must be shown.
    with contextlib.suppress(Exception):
        from grader.report.recording import replay

        pictures = _pictures()
        # A share of the points may rest on several trials, of which only the last is known.
        if pictures.drawable(trial) or (outcome is Outcome.FAILED and len(trial.samples) > 1):
            words = one_line(pictures.describe(trial), 1_000)
            played = replay(trial, seen)
    if picture is None and not played:
        return None
    return Figure(name, one_line(trial.name), words, picture.source if picture else "", played)
