"""Render a grading as text for a terminal; the CLI prints it."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TextIO

from grader.processes.jobs import Job, Where
from grader.report.cause import Cause, find
from grader.scoring.grading import Grading, Loss, count_graded, place, points, price_of_flags
from grader.scoring.scorecard import CriterionScore, Outcome, RequirementScore
from grader.words import mark, say

WIDTH = 100
BAR = 20

RED, DIM, CYAN, MAGENTA = "31", "2", "36", "35"
SHOWN = {
    Outcome.PASSED: (mark("passed"), "✓", "32"),  # green
    Outcome.PARTIAL: (mark("PARTIAL"), "◐", "33"),  # yellow
    Outcome.FAILED: (mark("FAILED"), "✗", RED),
    Outcome.NOT_REACHED: (mark("not reached"), "⋯", DIM),
    Outcome.ERROR: (mark("ERROR"), "!", MAGENTA),  # not the student's concern
    Outcome.NOT_GRADED: (mark("to be graded"), "○", MAGENTA),
    Outcome.WITHHELD: (mark("withheld"), "⏸", MAGENTA),
}
"""How each outcome is shown: its word, its sign on a page, and its colour in a terminal."""


def wants_colour(stream: TextIO, environ: Mapping[str, str]) -> bool:
    """Return whether to use colours on `stream`: a terminal that knows them, without NO_COLOR in `environ`."""
    return stream.isatty() and not environ.get("NO_COLOR") and environ.get("TERM") != "dumb"


def render(grading: Grading, *, colour: bool = False, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """Return the report as text without a final newline.

    Characters that `encoding` lacks are escaped, so that printing the text cannot fail.
    """
    return _text(_Page(grading, colour, width).lines(), encoding)


def jobs(listed: Sequence[tuple[Job[Any], str]]) -> str:
    """Return the jobs of a grading by what they touch, with whether each is kept, and the requirements it is for."""
    lines = []
    for where in Where:
        rows = [(job, since) for job, since in listed if job.where is where]
        lines += [f"{say(where.value)}:"] if rows else []
        for job, since in rows:
            state = say("kept since {when}", when=since) if since else say("to do")
            after = say("after {job}", job=say(job.after)) if job.after else ""
            serves = " ".join(sorted(job.serves, key=lambda id_: (id_[0], len(id_), id_)))
            told = "; ".join(filter(None, [state, after, serves]))
            lines.append(f"  {say(job.name):<38}  {told}")
    return "\n".join(lines)


def render_checks(grading: Grading, *, colour: bool = False, width: int = WIDTH, encoding: str = "utf-8") -> str:
    """Return the judged requirements and their losses, without totals: the answer to `grader check`."""
    page = _Page(grading, colour, width)
    scores = [s for s in page.grading.scorecard.requirements if s.outcome is not Outcome.NOT_GRADED]
    return _text([*page.unchanged(), *page.first_cause(), *map(page.requirement, scores), *page.lost()], encoding)


def _text(lines: Iterable[str], encoding: str) -> str:
    return "\n".join(lines).encode(encoding, "backslashreplace").decode(encoding)


class _Page:
    """The lines of one report."""

    def __init__(self, grading: Grading, colour: bool, width: int) -> None:
        self.grading = grading.shown()
        self.cause: Cause | None = find(grading)
        self.colour = colour
        self.width = width

    def lines(self) -> Iterator[str]:
        yield from self.head()
        yield from self.first_cause()
        yield from self.flags()
        for criterion in self.grading.scorecard.criteria:
            yield ""
            yield from self.criterion(criterion)
        yield from self.lost()
        yield ""
        yield from self.total()

    def head(self) -> Iterator[str]:
        intake = self.grading.evidence.intake
        found = say("package {name}", name=intake.package) if intake.package else say("no package found")
        yield from self.wrap(f"{self.grading.submission}: {found}")
        if intake.others:
            because = say(", because {because}", because=intake.chosen_because) if intake.chosen_because else ""
            graded = say("graded: {path}{because}", path=intake.package_path, because=because)
            yield from self.wrap(graded, indent=2)
            yield from self.wrap(say("not graded: {others}", others=", ".join(intake.others)), indent=2)
            yield from self.wrap(say("`--package-path PATH` grades another"), indent=2)
        for note in intake.notes:
            yield from self.wrap(say("note: {note}", note=note), indent=2)
        yield from self.unchanged()

    def unchanged(self) -> Iterator[str]:
        if self.grading.unchanged:
            yield from self.wrap(f"{self.grading.unchanged} {say('`--fresh` collects everything anew.')}")

    def first_cause(self) -> Iterator[str]:
        if self.cause is not None:
            yield from self.wrap(say("First cause: {cause}", cause=self.cause))

    def flags(self) -> Iterator[str]:
        if self.grading.evidence.flags:
            yield ""
            yield self.paint(say("Integrity: an instructor should look at this."), RED)
        for flag in self.grading.evidence.flags:
            seen_in = self.grading.seen_in(flag)
            yield from self.wrap(f"{flag.kind}: {flag.what}{f' ({seen_in})' if seen_in else ''}", indent=2)
        if self.grading.evidence.flags:
            yield from self.wrap(price_of_flags(self.grading.scorecard), indent=2)

    def criterion(self, score: CriterionScore) -> Iterator[str]:
        if score.max:
            share = score.points / score.max
            filled = int(share * BAR + 1e-9)  # rounded down: a full bar means full points
            bar = self.paint("#" * filled, CYAN) + "." * (BAR - filled)
            of = points(score.points).rjust(5) + " / " + points(score.max)
            yield f"{score.criterion.title:<20} {of:<13}{bar}  {score.level}"
        else:
            worth = say("({worth} points)", worth=points(score.criterion.points))
            yield f"{score.criterion.title:<20} {score.waits} {worth}"
        judged = [each for each in score.requirements if each.outcome is not Outcome.NOT_GRADED]
        yield from map(self.requirement, judged)
        if judged:
            yield from self.not_graded(score)

    def requirement(self, score: RequirementScore) -> str:
        of = "" if not score.max else points(score.points).rjust(5) + " / " + points(score.max)
        if score.outcome is Outcome.WITHHELD:
            of = "–".rjust(5) + " / " + points(score.requirement.points)
        word, _, colour = SHOWN[score.outcome]
        word = self.paint(f"{say(word):<12}", colour)
        return f"  {word} {score.requirement.id:<4} {score.requirement.title:<34} {of}".rstrip()

    def not_graded(self, score: CriterionScore) -> Iterator[str]:
        left = [s.requirement for s in score.requirements if s.outcome is Outcome.NOT_GRADED]
        for waits in dict.fromkeys(requirement.waits for requirement in left):
            yield from self.wrap(f"{waits}: {', '.join(r.id for r in left if r.waits == waits)}", indent=2)

    def lost(self) -> Iterator[str]:
        waiting: dict[tuple[str, str], list[str]] = {}
        for loss in self.grading.losses:
            result = loss.result
            if result.outcome is Outcome.NOT_REACHED:
                because = result.because or result.seen or say("a requirement that it depends on failed")
                why = because, result.try_
                if self.cause is not None and self.cause.explains(result):
                    why = say("of the first cause, above"), ""
                waiting.setdefault(why, []).append(loss.requirement.id)
                continue
            yield ""
            yield from self.block(loss)
        for score in self.grading.scorecard.requirements:
            for result in score.results:
                if result.outcome is Outcome.PASSED and result.fraction < 1 and result.seen:
                    yield ""
                    yield self.paint(say("not taken"), DIM) + f"  {score.requirement.id}  {result.sentence}"
                    yield from self.rows({say("seen"): result.seen})
        for (because, try_), names in waiting.items():
            yield ""
            yield self.paint(say("not reached"), DIM) + f"  {', '.join(dict.fromkeys(names))}"
            yield from self.rows({say("because"): because, say("try"): try_})

    def block(self, loss: Loss) -> Iterator[str]:
        result = loss.result
        word, _, colour = SHOWN[result.outcome]
        word = self.paint(say(word), colour)
        yield f"{word}  {loss.requirement.id}  {loss.heading or loss.requirement.title} ({loss.price})"
        rows = {say("seen"): result.seen, say("expected"): result.expected, say("try"): result.try_}
        rows[say("because")] = result.because
        if result.outcome is not Outcome.ERROR and loss.requirement.section:
            rows[say("learn")] = place(loss.requirement.section)
        yield from self.rows(rows)

    def rows(self, rows: Mapping[str, str]) -> Iterator[str]:
        for name, value in rows.items():
            if value:
                first, *more = self.wrap(value, indent=18)
                yield f"        {name:<10}{first.lstrip()}"
                yield from more

    def total(self) -> Iterator[str]:
        card, worth = self.grading.scorecard, points(self.grading.worth)
        graded, every = count_graded(card)
        said = say("{reached} of {max}", reached=points(card.points), max=points(card.max))
        so_far = say(" graded so far; {worth} when all is", worth=worth) if graded < every else ""
        yield f"{say('Points'):<10}{said}{so_far}"
        if graded < every:
            yield " " * 10 + say("{graded} of {every} requirements are graded so far", graded=graded, every=every)
        if any(score.withheld for score in card.requirements):
            yield from self.wrap(price_of_flags(self.grading.scorecard), indent=10)
        if not card.complete:
            names = ", ".join(score.requirement.id for score in self.grading.unjudged)
            words = say("Incomplete: an error of the grader left {names} without a full verdict.", names=names)
            yield from self.wrap(words, indent=10)

    def wrap(self, text: str, indent: int = 0) -> Iterable[str]:
        """Return the lines of `text`, indented and no longer than the width."""
        wrapped = [part for line in text.split("\n") for part in textwrap.wrap(line, self.width - indent) or [""]]
        # CI systems execute a line that begins like this, even if the words come from a submission.
        wrapped = [f"| {part}" if part.startswith(("::", "##")) else part for part in wrapped]
        return [" " * indent + line if line else "" for line in wrapped]

    def paint(self, text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if self.colour else text
