"""Render a grading or a refusal as one self-contained HTML file: no network, no script, no other files."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.evidence import Trial
from grader.host.atomic import write_atomically
from grader.report.album import Album
from grader.report.console import WORDS
from grader.report.mutants import matrix
from grader.sanitize import one_line
from grader.scoring.grading import Grading, Refusal, judged, losses, place, points
from grader.scoring.scorecard import Outcome, RequirementScore

if TYPE_CHECKING:
    from markupsafe import Markup

HERE = Path(__file__).parent

# A picture takes a fifth of a second, and a package that fails everything does so for a few reasons.
PICTURES = 6

SIGNS = {
    Outcome.PASSED: "✓",
    Outcome.PARTIAL: "◐",
    Outcome.FAILED: "✗",
    Outcome.NOT_REACHED: "⋯",
    Outcome.ERROR: "!",
    Outcome.NOT_GRADED: "○",
}


@dataclass(frozen=True)
class TrialRow:
    """One trial in the table at the end of the report."""

    name: str
    node: str
    world: str
    pace: str
    sim_seconds: str
    wall_seconds: str
    ended: str


def render(result: Grading | Refusal, *, pictures: bool = True) -> str:
    """Return the report as HTML; without `pictures` it does not reveal the layout of held-out trials."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"code": _code, "points": points, "place": place}
    style = (HERE / "style.css").read_text(encoding="utf-8")
    environment.globals |= {
        "style": style,
        "style_hash": base64.b64encode(hashlib.sha256(style.encode()).digest()).decode("ascii"),
    }
    if isinstance(result, Refusal):
        return environment.get_template("refusal.html.j2").render(refusal=result.shown())
    return environment.get_template("template.html.j2").render(**_facts(result, pictures))


def _facts(grading: Grading, pictures: bool) -> dict[str, Any]:
    """Return what the page of a grading shows."""
    clean = grading.shown()
    album = Album(grading.evidence.trials, most=PICTURES if pictures else 0)
    # Drawn in the order of the page, so that each trial is shown where it first cost points.
    pictures_of = {score.requirement.id: album.of(score.lost) for score in grading.scorecard.requirements}
    graded, every = judged(clean.scorecard)
    return {
        "grading": clean,
        "card": clean.scorecard,
        "evidence": clean.evidence,
        "pictures": pictures_of,
        "drive": album.longest_drive(),
        "mutants": matrix(clean.evidence.mutation) if clean.evidence.mutation else None,
        "trials": [_row(trial) for trial in grading.evidence.trials.values()],
        "graded": graded,
        "every": every,
        "words": WORDS,
        "signs": SIGNS,
        "losses": losses,
        "is_open": is_open,
        "share": share,
    }


def write_html(result: Grading | Refusal, path: Path, *, pictures: bool = True) -> None:
    """Write the report as HTML, whole or not at all."""
    write_atomically(path, render(result, pictures=pictures))


def is_open(score: RequirementScore) -> bool:
    """Return whether a requirement is unfolded at first: if there is something in it to fix or to look at."""
    return score.outcome in (Outcome.FAILED, Outcome.PARTIAL, Outcome.ERROR)


def share(reached: float, maximum: float) -> float:
    """Return the percentage of `maximum` that was reached, 0 for a maximum of 0."""
    return round(100 * reached / maximum, 1) if maximum > 0 else 0.0


def _row(trial: Trial) -> TrialRow:
    return TrialRow(
        name=one_line(trial.name),
        node=one_line(trial.node),
        world=one_line(trial.world),
        pace=one_line(trial.pace),
        sim_seconds=f"{trial.samples[-1].t:.1f}" if trial.samples else "",
        wall_seconds=f"{trial.wall_seconds:.1f}",
        ended=one_line(trial.ended or ("complete" if trial.ready else "the node did not come up")),
    )


def _code(text: str) -> Markup:
    """Return text as escaped HTML, with the parts between backticks as code."""
    from markupsafe import Markup, escape

    parts = re.split(r"`([^`\n]+)`", text)  # the odd parts were between backticks
    return Markup().join(Markup("<code>{}</code>").format(p) if i % 2 else escape(p) for i, p in enumerate(parts))
