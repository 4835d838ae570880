"""What a report says about a requirement, as lines of text for other programs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from grader.classroom.gradebook import Row
from grader.sanitize import prose
from grader.scoring.rubric import FLAGS, Rubric
from grader.words import counted

_SEEN = 160  # characters of what was seen


def losses(requirement: dict[str, Any]) -> Iterator[str]:
    """Return what was seen, expected and what to try, for each check of a requirement that did not pass."""
    for check in requirement.get("checks", ()):
        if check["outcome"] == "passed":
            continue
        yield f"{check['sentence'] or check['id']}: {check['outcome'].replace('_', ' ')}"
        for name in ("seen", "expected", "try", "because"):
            for number, line in enumerate(str(check.get(name) or "").splitlines()):
                yield f"  {'' if number else name:<9} {line}"


def comment(row: Row, rubric: Rubric, before: str = "") -> str:
    """Return a comment for a platform without a person behind it: it says what integrity flags do, if there are any."""
    do = "withhold points until a person decides" if rubric.withholds else "take no points by themselves"
    flags = f"{counted(row.flags, 'integrity flag', 'integrity flags')} (flags: {FLAGS[rubric.withholds]}): they {do}"
    return "; ".join(filter(None, [before, row.comment, flags if row.flags else ""]))


def short(row: Row, report: dict[str, Any] | None) -> list[str]:
    """Return a short comment: the total, what people decided, the first cause, and what was seen where points went."""
    lines = [f"{row.total} of {row.max} points" if row.final and row.total is not None else "no grade"]
    lines += [prose(row.comment)] if row.comment else []
    cause = (report or {}).get("cause", {})
    if cause.get("sentence"):
        lines.append(f"First cause: {prose(cause['sentence'], _SEEN)} ({cause['points']:g} points)")
    measured = {each["id"]: each for each in (report or {}).get("requirements", ())}
    unreached = []
    for each in row.requirements:
        if each.points is None or each.points >= each.max:
            continue
        said = measured.get(each.id, {})
        if said.get("outcome") == "not_reached" and not each.override:
            unreached.append(each)
        else:
            seen = "" if each.override else prose(str(said.get("seen", "")), _SEEN)
            lines.append(f"{each.id}: {f'{seen}, ' if seen else ''}{each.max - each.points} of {each.max} points lost")
    if unreached:
        lost = sum(each.max for each in unreached)
        lines.append(f"not reached: {', '.join(each.id for each in unreached)}, {lost} points lost")
    return lines
