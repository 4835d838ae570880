"""Where a learner stands: what checks have answered and the active minutes, as one panel. Runs nothing, sends nothing.

Both are kept in the workspace, in a file for each notebook, `.progress/05.json`, so that two open notebooks do not
overwrite each other's.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.host.tempdir import write_atomically
from grader.notebook import checkpoints, lanes
from grader.notebook.feedback import SIGNS, Answer, template
from grader.notebook.workspace import NOTEBOOK, Workspace, course
from grader.scoring import rubric
from grader.scoring.grading import points
from grader.scoring.rubric import Requirement
from grader.words import localized, mark, say

ALONE = "ROS2_COURSE_ALONE"
"""If set, the panel shows only the current notebook and no minutes, so that a stored one is the same in every run."""
PAUSE_S = 600.0
"""A longer time between two events in a notebook is a pause, and does not count."""
GLOSSARY = "../docs/glossary.md"
"""The page that explains the words and commands of a course, seen from its notebooks, if it has one."""

_SIGNS = {**SIGNS, "elsewhere": "–"}
_WORDS = {
    "done": mark("done"), "so far": mark("done so far; a later notebook brings the rest"),
    "part": mark("part of its points"), "open": mark("open"), "elsewhere": mark("not judged in a notebook"),
}  # fmt: skip


# -- what is kept --------------------------------------------------------------------------------------------------


def add_seconds(workspace: Workspace, notebook: str, seconds: float) -> None:
    """Add the time between two events in a notebook ("05"), a cell's begin or end, to its active time."""
    if notebook and 0.0 < seconds <= PAUSE_S:
        kept = _read(_file(workspace, notebook))
        _write(_file(workspace, notebook), kept | {"seconds": round(kept["seconds"] + seconds, 1)})


def note(workspace: Workspace, answers: Sequence[Answer]) -> None:
    """Keep what a check in the current notebook has answered. An error of the kit changes nothing."""
    notebook = os.environ.get(NOTEBOOK, "")
    judged = [answer for answer in answers if not (answer.ours or answer.elsewhere)]
    if notebook and judged:
        kept, now = _read(_file(workspace, notebook)), time.time()
        new = {each.id: {"state": each.state, "points": float(each.points), "at": now} for each in judged}
        _write(_file(workspace, notebook), kept | {"answers": kept["answers"] | new})


def minutes(workspace: Workspace) -> dict[str, int]:
    """Return the active minutes of each notebook ("05") that was worked in."""
    files = sorted(_folder(workspace).glob("*.json"))
    return {file.stem: found for file in files if (found := round(_read(file)["seconds"] / 60.0))}


def _folder(workspace: Workspace) -> Path:
    """Return the folder of the records; a linked workspace, as of a patient, lies in the learner's own."""
    return (workspace.root.parent if workspace.is_linked else workspace.root) / ".progress"


def _file(workspace: Workspace, notebook: str) -> Path:
    return _folder(workspace) / f"{notebook}.json"


def _read(file: Path) -> dict[str, Any]:
    """Return what is kept of a notebook; what cannot be read counts as nothing."""
    with suppress(OSError, ValueError, TypeError, AttributeError):
        kept = json.loads(file.read_text(encoding="utf-8"))
        answers = {name: answer for name, answer in dict(kept["answers"]).items() if answer["state"] in _SIGNS}
        return {"seconds": float(kept["seconds"]), "answers": answers}
    return {"seconds": 0.0, "answers": {}}


def _write(file: Path, kept: Mapping[str, Any]) -> None:
    """Write the record of a notebook at once; without a place for it, a cell goes on without."""
    with suppress(OSError):
        write_atomically(file, json.dumps(kept, indent=1) + "\n")


# -- what is shown -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Box:
    """A requirement in the panel; `words` say what its sign says."""

    id: str
    state: str
    sign: str
    words: str


@dataclass(frozen=True)
class Row:
    """A notebook in the panel: what it teaches, the minutes, and whether it is the one that is open.

    `file` lies beside the open one; it is "" for what no notebook teaches.
    """

    title: str
    file: str
    boxes: tuple[Box, ...]
    minutes: str
    here: bool


@dataclass(frozen=True, repr=False)
class Standing:
    """The panel. Notebooks display it: as HTML in the colours of the page, or as text."""

    rows: tuple[Row, ...]
    lines: tuple[str, ...]
    glossary: str = ""

    def __repr__(self) -> str:
        width = max((len(row.title) for row in self.rows), default=0)
        wide = max((len(row.minutes) for row in self.rows), default=0)
        lines = []
        for row in self.rows:
            boxes = "  ".join(f"{box.sign} {box.id}" for box in row.boxes)
            lines.append(f"{'>' if row.here else ' '} {row.title:<{width}}  {row.minutes:>{wide}}  {boxes}".rstrip())
        if any(row.boxes for row in self.rows):
            lines.append(_legend())
        words = say("Words and commands: {page}", page=self.glossary.removeprefix("../")) if self.glossary else ""
        return "\n".join([*lines, *self.lines, *filter(None, [words])])

    def _repr_html_(self) -> str:
        page = say("Glossary and cheat sheet")
        return template("panel.html.j2").render(standing=self, legend=_legend(), glossary_words=page)


def _legend() -> str:
    return say("✓ done · ◐ so far, or in part · ○ open")


def of(workspace: Workspace) -> Standing:
    """Return where the learner of a workspace stands."""
    names, lane = list(checkpoints.table()), lanes.of(workspace)
    here, alone = os.environ.get(NOTEBOOK, ""), ALONE in os.environ
    shown = [name for name in names if not alone or name[:2] == here]
    answers = _latest(_read(_file(workspace, name[:2])) for name in shown)
    asked = lanes.asked_for(lane) if lane else ()
    every = rubric.load(course().rubric).requirements
    # What a shorter lane does not ask for is shown where the learner has asked all the same.
    requirements = [r for r in every if not asked or r.id in asked or r.id in answers]
    spent = {} if alone else minutes(workspace)
    rows = []
    for name in shown if alone else [*shown, ""]:
        boxes = tuple(_box(r, answers) for r in requirements if _taught_in(r, names) == name)
        if name:
            time_ = hours(spent[name[:2]]) if name[:2] in spent else ""
            rows.append(Row(name.replace("_", " "), f"{name}.ipynb", boxes, time_, name[:2] == here))
        elif boxes:
            rows.append(Row(say("elsewhere"), "", boxes, "", here=False))
    counted = [r for r in requirements if not asked or r.id in asked]
    # A shorter lane asks for these in the notebook that has their points, and not before.
    later = {name for name, notebook in lanes.asked_later(lane).items() if notebook > here} if lane else set()
    due = [r for r in counted if r.id not in later or r.id in answers]
    lines = ["" if alone else _so_far(counted, answers, sum(spent.values())), _next(names, here, due, answers)]
    page = (course().notebooks / GLOSSARY).resolve()
    return Standing(tuple(rows), tuple(filter(None, lines)), GLOSSARY if page.is_file() else "")


def hours(minutes: int) -> str:
    """Return a time in words: "38 min", "3 h 10 min"."""
    return say("{h} h {min} min", h=minutes // 60, min=minutes % 60) if minutes >= 60 else say("{n} min", n=minutes)


def _latest(kept: Iterable[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Return the last answer to each requirement; one that is done stays so if an earlier notebook asks less of it."""
    found: dict[str, Mapping[str, Any]] = {}
    asked = [item for record in kept for item in record["answers"].items()]
    for name, answer in sorted(asked, key=lambda item: float(item[1]["at"])):
        if not (answer["state"] == "so far" and name in found and found[name]["state"] == "done"):
            found[name] = answer
    return found


def _state(requirement: Requirement, answers: Mapping[str, Mapping[str, Any]]) -> str:
    if not requirement.can_be_checked:
        return "elsewhere"
    return str(answers[requirement.id]["state"]) if requirement.id in answers else "open"


def _box(requirement: Requirement, answers: Mapping[str, Mapping[str, Any]]) -> Box:
    state = _state(requirement, answers)
    words = f"{requirement.id} {requirement.title}: {say(_WORDS[state])}"
    return Box(requirement.id, state, _SIGNS[state], words)


def _taught_in(requirement: Requirement, names: Sequence[str]) -> str:
    name = requirement.section.partition("#")[0]
    return name if name in names else ""


def _so_far(requirements: Sequence[Requirement], answers: Mapping[str, Mapping[str, Any]], spent: int) -> str:
    reached = sum(float(answers[r.id]["points"]) for r in requirements if r.id in answers)
    worth = points(sum(r.points for r in requirements))
    words = say("{reached} of {worth} points in your last checks.", reached=localized(points(reached)), worth=worth)
    time_ = mark("{time} of work so far, without pauses of more than {n} minutes; this figure stays in your workspace.")
    return words + (" " + say(time_, time=hours(spent), n=round(PAUSE_S / 60)) if spent else "")


def _next(
    names: Sequence[str], here: str, requirements: Sequence[Requirement], answers: Mapping[str, Mapping[str, Any]]
) -> str:
    """Return what is next in the open notebook, begun things first, or the notebook after it; "" outside of one."""
    open_one = next((name for name in names if name[:2] == here), None)
    if open_one is None:
        return ""
    left = [r for r in requirements if _taught_in(r, names) == open_one and _state(r, answers) in ("open", "part")]
    if left:
        first = min(left, key=lambda r: _state(r, answers) != "part")
        words = mark('Next: {id} {title}, in the section "{section}" of this notebook.')
        return say(words, id=first.id, title=first.title, section=first.section.partition("#")[2])
    after = next((name for name in names if name > open_one), "")
    return say("Next: notebook {name}.", name=after.replace("_", " ")) if after else ""
