"""Show a check's answer in a notebook: as text for terminals and stored outputs, as HTML for the page. Runs nothing."""

from __future__ import annotations

import html
import re
import sys
import textwrap
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from grader.notebook import checkpoints
from grader.notebook.workspace import Workspace
from grader.progress import step as step_of
from grader.words import localized, mark, say, say_count

if TYPE_CHECKING:
    from jinja2 import Template

    from grader.report.figures import Figure

WIDTH = 100

SIGNS = {"done": "✓", "so far": "◐", "part": "◐", "open": "○"}
"""The sign of each state that a requirement may have."""

# Middle tones, readable on both a light and a dark page.
GOOD, PART, BAD, OURS, SOFT = "#2e9150", "#b7791f", "#d0453e", "#8a55c0", "#7c8591"


@dataclass(frozen=True)
class Note:
    """One finding of a check: rows such as ("seen", "..."), in reading order."""

    heading: str
    rows: tuple[tuple[str, str], ...]


def seen_expected_try(*texts: object) -> tuple[tuple[str, str], ...]:
    """Return the rows of a note: what was seen, what was expected, and what to try."""
    return tuple(zip((say("seen"), say("expected"), say("try")), map(str, texts), strict=True))


@dataclass(frozen=True)
class Answer:
    """The result of one requirement: `points` of `worth`, which is "" for what has no points.

    Attributes:
        ours: an error of the kit kept it from being judged.
        so_far: it passed as far as it can in this notebook; later ones bring the rest of what it needs.
        elsewhere: where it is judged, if that is not here.
        sample: what it was judged by here, if the grading tries more.
    """

    id: str
    title: str
    points: str
    worth: str
    passed: bool
    ours: bool = False
    notes: tuple[Note, ...] = ()
    section: str = ""
    so_far: bool = False
    elsewhere: str = ""
    sample: str = ""

    @property
    def headline(self) -> str:
        """Return the first line: requirement, result, points."""
        if self.ours:
            return say("{id} could not be judged", id=self.id)
        worth = localized(self.worth)
        if self.elsewhere:
            words = mark("{id} is {elsewhere}, not here ({worth} points)")
            return say(words, id=self.id, elsewhere=self.elsewhere, worth=worth)
        said = mark("passed so far") if self.so_far else mark("passed") if self.passed else mark("not yet")
        verdict = f"{self.id} {say(said)}"
        if self.so_far and not float(self.points):  # "passed" and "0 of 3" in one line look like a contradiction
            return say("{verdict} (its points come with a later notebook: {worth})", verdict=verdict, worth=worth)
        of = say("{reached} of {max}", reached=localized(self.points), max=worth)
        return f"{verdict} ({'; '.join(filter(None, (of, self.sample)))})" if worth else verdict

    @property
    def state(self) -> str:
        """Return "done", "so far" (a later notebook brings the rest), "part" (of its points) or "open"."""
        if self.passed:
            return "so far" if self.so_far else "done"
        return "part" if float(self.points) > 0 else "open"

    @property
    def mark(self) -> tuple[str, str]:
        """Return the colour and the sign before it."""
        state = "done" if self.state == "so far" and float(self.points) > 0 else self.state
        colours = {"done": GOOD, "so far": PART, "part": PART, "open": BAD}
        colour = SOFT if self.elsewhere else OURS if self.ours else colours[state]
        return colour, "!" if self.ours else SIGNS[state]


@dataclass(frozen=True, repr=False)
class Checked:
    """The answer of `check`. Notebooks display it; `passed` is for programs."""

    answers: tuple[Answer, ...]
    pictures: tuple[Figure, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Return whether every requirement that is judged here passed, at least so far."""
        return all(answer.passed for answer in self.answers if not answer.elsewhere)

    def __repr__(self) -> str:
        return "\n".join([*self.notes, *(line for answer in self.answers for line in _lines(answer))])

    def _repr_html_(self) -> str:
        return template("answers.html.j2").render(checked=self, soft=SOFT, cell=_CELL)


def template(name: str) -> Template:
    """Return a template of this folder; its filters `text` and `code` escape."""
    from jinja2 import Environment, FileSystemLoader

    environment = Environment(loader=FileSystemLoader(Path(__file__).parent))
    environment.filters |= {"text": html.escape, "code": _code}
    return environment.get_template(name)


def _lines(answer: Answer) -> list[str]:
    lines = [answer.headline]
    several = len(answer.notes) > 1
    for note in answer.notes:
        if several and note.heading:
            lines.append(f"  {note.heading}")
        for name, value in note.rows:
            wrapped = [part for line in value.split("\n") for part in textwrap.wrap(line, WIDTH - 14) or [""]]
            lines += [f"    {name if i == 0 else '':<10}{part}".rstrip() for i, part in enumerate(wrapped)]
    return lines


_CELL = "text-align:left;vertical-align:top;padding:.1em .8em .1em 0;border:0"


def _code(text: str) -> str:
    """Return text as escaped HTML, with the parts between backticks as code."""
    parts = re.split(r"`([^`\n]+)`", text)
    return "".join(f"<code>{html.escape(p)}</code>" if i % 2 else html.escape(p) for i, p in enumerate(parts))


def welcome(notebook: str, workspace: Workspace) -> str:
    """Return the message of `begin`: the number of files in the package, and those missing from earlier notebooks."""
    package = workspace.package
    present = {str(path.relative_to(package)) for path in package.rglob("*") if path.is_file()}
    present = {path for path in present if "__pycache__" not in path and not path.startswith(".")}
    missing = [path for path in checkpoints.writers_before(notebook) if path not in present]
    holds = mark("Your package, {package}, holds {files}. Cells now work in that folder.")
    lines = [say(holds, package=workspace.shown(package), files=_files(len(present)))]
    if missing:
        shown = ", ".join(missing[:4]) + (", ..." if len(missing) > 4 else "")
        lines.append(say("Missing from earlier notebooks ({files}): {shown}", files=_files(len(missing)), shown=shown))
        do = mark('Work through those notebooks first, or let the course lay the files out: start_at("{notebook}")')
        lines.append(say(do, notebook=notebook))
    return "\n".join(lines)


def _files(count: int) -> str:
    return say_count("{n} file", "{n} files", count) if count else say("no files")


def in_a_kernel() -> bool:
    """Return whether this process is a notebook's kernel."""
    return "IPython" in sys.modules and hasattr(sys.modules["IPython"].get_ipython(), "kernel")


class Progress:
    """One line about the current step and how long it has taken; it is empty at the end, so nothing of it is stored.

    Shown below the cell that runs in a notebook, and nowhere else.
    """

    def __init__(self) -> None:
        self._handle: Any = None
        self._step = ""
        self._began = 0.0
        self._ended = threading.Event()
        self._clock = threading.Thread(target=self._tick, daemon=True)

    def say(self, step: str) -> None:
        """Show the current step; how far it is may follow in brackets, and the seconds are then counted on."""
        if threading.current_thread() is not threading.main_thread() or not in_a_kernel():
            return  # no cell is running this code
        if step_of(step) != step_of(self._step):
            self._began = time.monotonic()
        self._step = step
        if self._handle is None:
            from IPython.display import display

            # Empty at first and at the end: tools that compare outputs (nbval) see only this.
            self._handle = display({}, raw=True, display_id=True)  # type: ignore[no-untyped-call]
            self._clock.start()
        self._show()

    def more(self, far: str) -> None:
        """Show how far the current step is."""
        self.say(f"{step_of(self._step)} ({far})")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._handle is not None:
            self._ended.set()
            self._clock.join()
            self._handle.update({}, raw=True)

    def _tick(self) -> None:
        while not self._ended.wait(1.0):
            self._show()

    def _show(self) -> None:
        seconds = time.monotonic() - self._began
        counted = f" ({seconds:.0f} s)" if seconds >= _COUNTED_S else ""
        self._handle.update({"text/plain": f"{self._step[:90]} ...{counted}"}, raw=True)


_COUNTED_S = 2.0  # a shorter step needs no clock
