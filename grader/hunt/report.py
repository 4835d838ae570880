"""Tell what a hunt has found: a case in words, as a file to keep, and as a page with its replay."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from grader.course import Course
from grader.hunt.search import Finding
from grader.report import html
from grader.report.figures import Album
from grader.sanitize import one_line
from grader.trials import case as cases
from grader.trials.case import Case, Step
from grader.trials.promises import Run
from grader.words import mark, say

_WORDS = {
    "call": mark("{service} {with_}"),
    "goal": mark("a goal {distance:g} m away, {where}"),
    "cancel": mark("the goal cancelled"),
    "obstacle": mark("{name}, round, {cm:g} cm wide, {where}, {distance:.2f} m away{moving}"),
    "remove": mark("{name} gone"),
    "limits": mark("scans that go from {least:g} to {most:g} m"),
    "readings": mark("{share} reading {kind}"),
    "silence": mark("no more messages of {name}"),
    "hear": mark("messages of {name} again"),
    "set": mark("{with_}"),
    "battery": mark("the battery at {percent:g} %"),
    "interrupt": mark("Ctrl-C"),
}
_KINDS = {
    "too near": mark("less than range_min"),
    "least": mark("exactly range_min"),
    "most": mark("exactly range_max"),
    "too far": mark("more than range_max"),
    "none": mark("nothing at all"),
    "true": mark("what is there"),
}


def in_words(case: Case) -> str:
    """Return a case in one sentence: "at 0.3 s set_speed 0.25; at 0.5 s something round of 3 cm, ..."."""
    said, t = [], 0.0
    if case.heading:
        said.append(say("the robot faces {n:g} degrees", n=case.heading))
    for step in case.steps:
        if step.do in ("wait", "arrive"):
            t += step.to if step.do == "wait" else 0.0
        elif words := _in_words(step):
            said.append(say("at {t:.1f} s {words}", t=t, words=words))
    return "; ".join(said)


def _in_words(step: Step) -> str:
    if step.do not in _WORDS:
        return ""
    to: Any = step.to
    fields: dict[str, Any] = {**to} if isinstance(to, dict) else {"name": to, "percent": to}
    if step.do == "call":
        fields["with_"] = " ".join(f"{value}" for name, value in to.items() if name != "service")
    elif step.do == "set":
        fields["with_"] = ", ".join(f"{name} = {value}" for name, value in to.items())
    elif step.do == "readings":
        every = to.get("every", 1)
        fields["kind"] = say(_KINDS.get(to["kind"], to["kind"]))
        fields["share"] = say("all beams") if every == 1 else say("every beam in {n}", n=every)
    if "bearing" in fields:
        fields["where"] = _where(to["bearing"])
    if step.do == "obstacle":
        fields["cm"] = round(200 * to["radius"], 1)
        fields["moving"] = say(", moving at {speed:g} m/s", speed=to["speed"]) if to.get("speed") else ""
    return say(_WORDS[step.do], **fields).strip()


def _where(bearing: float) -> str:
    if abs(bearing) < 1 or abs(bearing) > 179:
        return say("straight ahead") if abs(bearing) < 1 else say("right behind")
    words = mark("{n:g} degrees to the left") if bearing > 0 else mark("{n:g} degrees to the right")
    return say(words, n=abs(bearing))


def rows(finding: Finding) -> list[tuple[str, str]]:
    """Return what is said of a finding, as rows of a name and a text."""
    return [
        (say("done"), in_words(finding.case)),
        (say("seen"), one_line(finding.broken.seen, 500)),
        (say("promised"), finding.promise.words),
    ]


def save(finding: Finding, folder: Path) -> Path:
    """Write the case, a page with its replay, and a test of it into a folder; return the case's file."""
    folder.mkdir(parents=True, exist_ok=True)
    name = "-".join([*finding.promise.serves[:1], finding.promise.name])
    file = folder / f"{name}.yaml"
    head = {"breaks": finding.promise.name, "seen": finding.broken.seen}
    text = yaml.dump(head, sort_keys=False, allow_unicode=True, width=100) + finding.case.text
    file.write_text(text, encoding="utf-8")
    file.with_suffix(".html").write_text(page(finding), encoding="utf-8")
    test = test_of(file)
    test.unlink(missing_ok=True)
    if text := as_test(finding):
        test.write_text(text, encoding="utf-8")
    return file


def test_of(file: Path) -> Path:
    """Return where the test of a case lies, if there is one, by the case's file."""
    return file.with_name(f"test_found_{file.stem.partition('-')[2] or file.stem}.py")


def as_test(finding: Finding) -> str:
    """Return the finding as a test that the package can have itself, "" if there is no such test."""
    write = finding.promise.as_test
    run = Run(finding.case, finding.trial)
    return write(run, finding.promise, finding.broken, in_words(finding.case)) if write else ""


def read(file: Path, course: Course) -> tuple[Case, str]:
    """Return the case in a file, and the name of the promise that it breaks, "" if the file has none.

    Raises:
        GraderError: as by `case.read`.
    """
    case = cases.read(file, course)
    return case, str(yaml.safe_load(file.read_text(encoding="utf-8")).get("breaks", ""))


def page(finding: Finding) -> str:
    """Return the finding as one self-contained HTML page: what was done, seen and promised, the picture, the replay."""
    figure = Album({}).draw(finding.trial, finding.broken.seen, finding.broken.t, failed=True)
    return html.page_of(
        "found.html.j2",
        title=say("Not kept: {promise}", promise=say(finding.promise.sentence)),
        rows=rows(finding),
        figure=figure,
        case=finding.case.text,
    )
