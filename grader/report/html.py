"""Render a grading or a refusal as one self-contained HTML file: no network, no script but the kit's own."""

from __future__ import annotations

import base64
import hashlib
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader import words
from grader.evidence import Mutant, Mutation, Trial, short_name
from grader.report import cause, figures
from grader.report.console import SHOWN
from grader.sanitize import one_line, shown
from grader.scoring import scorecard
from grader.scoring.grading import Grading, HandIn, Loss, Refusal, count_graded, losses, place, points, price_of_flags
from grader.scoring.scorecard import Outcome
from grader.words import mark, say

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

HERE = Path(__file__).parent

DEAREST = 3  # requirements at the top of a report, if their losses have no common cause
FIRST_STEPS = 6  # losses on the first two pages of a printed report


def render(result: Grading | Refusal, hand_in: HandIn | None = None, *, pictures: bool = True) -> str:
    """Return the report as HTML; without `pictures` it does not reveal the layout of held-out trials."""
    environment = _environment(words.spoken())
    about = shown(hand_in or HandIn())
    if isinstance(result, Refusal):
        return environment.get_template("refusal.html.j2").render(refusal=result.shown(), hand_in=about)
    return environment.get_template("template.html.j2").render(
        **_facts(result, {decision.requirement: decision.points for decision in about.decisions}),
        hand_in=about,
        figures=figures.choose(result) if pictures else figures.Figures(),
    )


def page_of(template: str, **facts: Any) -> str:
    """Return another page of the kit's, in the same style."""
    return _environment(words.spoken()).get_template(template).render(**facts)


@cache
def _environment(language: str) -> Environment:
    """Return the environment of all pages in a language. It compiles a template once, in a tenth of a second."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
    )  # fmt: skip
    words.install(environment)
    environment.filters |= {"code": _code, "points": points, "place": place, "localized": words.localized}
    style = (HERE / "style.css").read_text(encoding="utf-8")
    script = (HERE / "replay.js").read_text(encoding="utf-8")
    environment.globals |= {
        "style": style,
        "style_hash": digest(style),
        "script": script,
        "script_hash": digest(script),
    }
    environment.globals["language"] = language
    return environment


def _facts(grading: Grading, decided: Mapping[str, float]) -> dict[str, Any]:
    """Return what the page of a grading shows, but for its figures; `decided` are points by people."""
    clean = grading.shown()
    card = scorecard.decided(clean.scorecard, decided)
    graded, every = count_graded(card)
    first = cause.find(grading, decided)
    left = [loss for loss in clean.losses if loss.requirement.id not in decided]
    return {
        "grading": clean,
        "card": card,
        "measured": clean.scorecard,
        "before": {score.requirement.id: score for score in clean.scorecard.requirements},
        "unjudged": [score for score in card.requirements if score.outcome is Outcome.ERROR],
        "evidence": clean.evidence,
        "cause": first,
        "followers": first.by_requirement if first else {},
        "dearest": sorted(
            (score for score in card.requirements if score.max - score.points >= 0.005),
            key=lambda score: score.points - score.max,
        )[:DEAREST],
        "first_steps": _first_steps(left),
        # For each reason why checks were not reached the first requirement that it kept from points.
        "first_said": {loss.result.because: loss.requirement.id for loss in clean.losses[::-1] if loss.result.because},
        "mutants": matrix(clean.evidence.mutation) if clean.evidence.mutation else None,
        "trials": [_cells(trial) for trial in grading.evidence.trials.values()],
        "graded": graded,
        "every": every,
        "price_of_flags": price_of_flags(card),
        "words": {outcome: word for outcome, (word, _, _) in SHOWN.items()},
        "signs": {outcome: sign for outcome, (_, sign, _) in SHOWN.items()},
        "losses": losses,
        "share": share,
    }


def _first_steps(losses: Sequence[Loss]) -> list[Loss]:
    """Return what to fix first: of each requirement the dearest loss that was not kept from being judged."""
    reached = [loss for loss in cause.dearest(losses) if loss.result.outcome is not Outcome.NOT_REACHED]
    return list({loss.requirement.id: loss for loss in reversed(reached)}.values())[::-1][:FIRST_STEPS]


def digest(text: str) -> str:
    """Return the SHA-256 of a style sheet or a script, as a page's policy names it."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def share(reached: float, maximum: float) -> float:
    """Return the percentage of `maximum` that was reached, 0 for a maximum of 0."""
    return round(100 * reached / maximum, 1) if maximum > 0 else 0.0


def _cells(trial: Trial) -> list[str]:
    """Return a trial's row in the table at the end of the page: its names, its pace, two durations, and its end."""
    ended = str(trial.ended or (say("complete") if trial.ready else say("the node did not come up")))
    sim_seconds = say("{t:.1f}", t=trial.samples[-1].t) if trial.samples else ""
    names = [one_line(name) for name in (trial.name, trial.node, trial.world)]
    return [*names, say(one_line(trial.pace)), sim_seconds, say("{t:.1f}", t=trial.wall_seconds), one_line(ended)]


def _code(text: str) -> Markup:
    """Return text as escaped HTML, with the parts between backticks as code."""
    from markupsafe import Markup, escape

    parts = re.split(r"`([^`\n]+)`", text)  # the odd parts were between backticks
    return Markup().join(Markup("<code>{}</code>").format(p) if i % 2 else escape(p) for i, p in enumerate(parts))


# -- the table of mutants, with the tests that noticed each -----------------------------------------------------------
_TESTS_AT_MOST = 3

# In words, without tests that follow and with them.
OUTCOMES = {
    "noticed": (mark("noticed"), mark("noticed by")),
    "unnoticed": (mark("not noticed"), mark("not noticed by")),
    "unreached": (mark("no test reaches this line"),) * 2,
    "not tried": (mark("not tried"),) * 2,
}


@dataclass(frozen=True)
class Row:
    """One mutant: its place, its change, and the tests that noticed it, or else reached it and passed.

    `said` is the outcome in words, to be followed by `tests`; `others` counts the tests beyond those.
    """

    where: str
    words: str
    outcome: str
    said: str
    tests: tuple[str, ...] = ()
    others: int = 0

    @classmethod
    def of(cls, mutant: Mutant) -> Row:
        """Return the row of a mutant."""
        tests = [mutant.by] if mutant.by else mutant.tried
        shown = tuple(short_name(test) for test in tests[:_TESTS_AT_MOST])
        said = say(OUTCOMES.get(mutant.outcome, (mutant.outcome,) * 2)[bool(tests)])
        # All paths begin with the same folder.
        path = mutant.path.partition("/")[2] or mutant.path
        return cls(f"{path}:{mutant.line}", mutant.words, mutant.outcome, said, shown, len(tests) - len(shown))


@dataclass(frozen=True)
class Matrix:
    """The mutants in the order of the source, how many were noticed and tried, and how many by each test."""

    rows: tuple[Row, ...]
    noticed: int
    tried: int
    noticed_by: tuple[tuple[str, int], ...]


def matrix(mutation: Mutation) -> Matrix:
    """Return the table for `mutation`; a mutant that no test reaches did not have to be tried."""
    mutants = sorted(mutation.mutants, key=lambda mutant: (mutant.path, mutant.line, mutant.words))
    outcomes = Counter(mutant.outcome for mutant in mutants)
    count = Counter(short_name(mutant.by) for mutant in mutants if mutant.by)
    noticed_by = sorted(count.items(), key=lambda each: (-each[1], each[0]))
    tried = len(mutants) - outcomes["not tried"]
    return Matrix(tuple(map(Row.of, mutants)), outcomes["noticed"], tried, tuple(noticed_by))
