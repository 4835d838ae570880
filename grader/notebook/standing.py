"""Where a learner stands: what checks have answered and the active minutes, as one panel. Runs nothing, sends nothing.

Both are kept in the workspace, in a file for each notebook, `.progress/05.json`, so that two open notebooks do not
overwrite each other's.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
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


class ActiveTime:
    """The time that a learner is active in a notebook: from one event, a cell's begin or end, to the next."""

    def __init__(self) -> None:
        self._last: float | None = None

    def until(self, now: float) -> float:
        """Return the active seconds since the last event; `now` is wall time in seconds that never goes back."""
        passed, self._last = now - (now if self._last is None else self._last), now
        return passed if passed <= PAUSE_S else 0.0


def add_seconds(workspace: Workspace, notebook: str, seconds: float) -> None:
    """Add active time to that of a notebook ("05")."""
    if notebook and seconds > 0.0:
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
    """A requirement in the panel; `state` is "done", "so far", "part", "open" or "elsewhere"."""

    id: str
    title: str
    state: str

    @property
    def sign(self) -> str:
        """Return the sign before its name."""
        return _SIGNS[self.state]

    @property
    def words(self) -> str:
        """Return what the sign says."""
        return f"{self.id} {self.title}: {say(_WORDS[self.state])}"


@dataclass(frozen=True)
class Row:
    """A notebook in the panel: what it teaches, the minutes, and whether it is the one that is open."""

    name: str
    boxes: tuple[Box, ...]
    minutes: str = ""
    here: bool = False

    @property
    def title(self) -> str:
        """Return the notebook's name in words."""
        return self.name.replace("_", " ")

    @property
    def file(self) -> str:
        """Return the notebook's file, beside the one that is open; "" for what no notebook teaches."""
        return f"{self.name}.ipynb" if self.name[:2].isdecimal() else ""


@dataclass(frozen=True, repr=False)
class Standing:
    """The panel. Notebooks display it: as HTML in the colours of the page, or as text."""

    rows: tuple[Row, ...]
    lines: tuple[str, ...]
    glossary: str = ""

    def __repr__(self) -> str:
        width, wide = (max((len(text) for text in column), default=0) for column in self._columns())
        lines = []
        for row in self.rows:
            boxes = "  ".join(f"{box.sign} {box.id}" for box in row.boxes)
            lines.append(f"{'>' if row.here else ' '} {row.title:<{width}}  {row.minutes:>{wide}}  {boxes}".rstrip())
        if any(row.boxes for row in self.rows):
            lines.append(_legend())
        words = say("Words and commands: {page}", page=self.glossary.removeprefix("../")) if self.glossary else ""
        return "\n".join([*lines, *self.lines, *filter(None, [words])])

    def _columns(self) -> tuple[list[str], list[str]]:
        return [row.title for row in self.rows], [row.minutes for row in self.rows]

    def _repr_html_(self) -> str:
        page = say("Glossary and cheat sheet")
        return template("panel.html.j2").render(standing=self, legend=_legend(), glossary_words=page)


def _legend() -> str:
    return say("✓ done · ◐ so far, or in part · ○ open")


def of(workspace: Workspace) -> Standing:
    """Return where the learner of a workspace stands."""
    names, lane = list(checkpoints.table()), lanes.of(workspace)
    here, alone = os.environ.get(NOTEBOOK, ""), ALONE in os.environ
    kept = {name: _read(_file(workspace, name[:2])) for name in names if not alone or name[:2] == here}
    answers = _latest(kept.values())
    asked = lanes.asked_for(lane) if lane else ()
    every = rubric.load(course().rubric).requirements
    # What a shorter lane does not ask for is shown where the learner has asked all the same.
    requirements = [r for r in every if not asked or r.id in asked or r.id in answers]
    spent = {} if alone else minutes(workspace)
    rows = []
    for name in [*names, ""]:
        of_notebook = [r for r in requirements if _taught_in(r, names) == name]
        boxes = tuple(Box(r.id, r.title, _state(r, answers)) for r in of_notebook)
        if name in kept or (not name and boxes and not alone):
            shown = hours(spent[name[:2]]) if name[:2] in spent else ""
            rows.append(Row(name or say("elsewhere"), boxes, shown, bool(name) and name[:2] == here))
    counted = [r for r in requirements if not asked or r.id in asked]
    lines = [] if alone else [_so_far(counted, answers, sum(spent.values()))]
    # A shorter lane asks for these in the notebook that has their points, and not before.
    later = {name for name, notebook in lanes.asked_later(lane).items() if notebook > here} if lane else set()
    due = [r for r in counted if r.id not in later or r.id in answers]
    lines += filter(None, (_behind(rows, answers), _next(rows, names, due)))
    page = (course().notebooks / GLOSSARY).resolve()
    return Standing(tuple(rows), tuple(lines), GLOSSARY if page.is_file() else "")


def hours(minutes: int) -> str:
    """Return a time in words: "38 min", "3 h 10 min"."""
    return say("{h} h {min} min", h=minutes // 60, min=minutes % 60) if minutes >= 60 else say("{n} min", n=minutes)


def _latest(kept: Any) -> dict[str, Mapping[str, Any]]:
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


def _taught_in(requirement: Requirement, names: Sequence[str]) -> str:
    name = requirement.section.partition("#")[0]
    return name if name in names else ""


def _so_far(requirements: Sequence[Requirement], answers: Mapping[str, Mapping[str, Any]], spent: int) -> str:
    known = {r.id for r in requirements}
    reached = sum(float(answer["points"]) for name, answer in answers.items() if name in known)
    worth = points(sum(r.points for r in requirements))
    words = say("{reached} of {worth} points in your last checks.", reached=localized(points(reached)), worth=worth)
    time_ = mark("{time} of work so far, without pauses of more than {n} minutes; this figure stays in your workspace.")
    return words + (" " + say(time_, time=hours(spent), n=round(PAUSE_S / 60)) if spent else "")


def _behind(rows: Sequence[Row], answers: Mapping[str, Any]) -> str:
    """Return what a check in an earlier notebook has found and no later one has found right."""
    position = next((n for n, row in enumerate(rows) if row.here), 0)
    wrong = [
        f"{box.id} ({row.name[:2]})"
        for row in rows[:position]
        for box in row.boxes
        if box.id in answers and box.state in ("open", "part")
    ]
    return say("Left open in earlier notebooks: {names}.", names=", ".join(wrong)) if wrong else ""


def _next(rows: Sequence[Row], names: Sequence[str], requirements: Sequence[Requirement]) -> str:
    row = next((row for row in rows if row.here), None)
    if row is None:
        return ""
    sections = {r.id: r.section.partition("#")[2] for r in requirements}
    for box in sorted(row.boxes, key=lambda box: box.state != "part"):
        if box.state in ("open", "part") and box.id in sections:
            words = mark('Next: {id} {title}, in the section "{section}" of this notebook.')
            return say(words, id=box.id, title=box.title, section=sections[box.id])
    after = next((name for name in names if name > row.name), "")
    return say("Next: notebook {name}.", name=after.replace("_", " ")) if after else ""
