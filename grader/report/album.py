"""Choose the trials that a report or a check shows as pictures. Drawing them is the job of pictures.py."""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from grader import KIT
from grader.evidence import Trial
from grader.sanitize import one_line
from grader.scoring.scorecard import CheckResult, Outcome


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
        _load_matplotlib()
        from grader.report import pictures

        trial = pictures.worth_drawing(self.trials.values())
        return None if trial is None or trial.name in self.drawn else self.draw(trial)

    def draw(self, trial: Trial) -> Picture | None:
        """Return the picture of a trial, None if there is nothing to see in it or enough is drawn."""
        if trial.name in self.drawn:
            return self.drawn[trial.name]
        self.drawn[trial.name] = None
        if sum(picture is not None for picture in self.drawn.values()) < self.most:
            # A picture is an extra: if drawing fails, the grade must still be shown.
            with contextlib.suppress(Exception):
                _load_matplotlib()
                from grader.report import pictures

                if pictures.drawable(trial):
                    words = one_line(pictures.describe(trial), 1_000)
                    self.drawn[trial.name] = Picture(one_line(trial.name), pictures.data_uri(trial), words)
        return self.drawn[trial.name]


def _load_matplotlib() -> None:
    """Import matplotlib, which takes half a second, and would obey a matplotlibrc in the current folder."""
    if "matplotlib" not in sys.modules:
        with contextlib.chdir(KIT):
            importlib.import_module("matplotlib")
