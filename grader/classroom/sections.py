"""sections.html: the sections of the course in which a class lost points, to be read where the losses are listed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

from grader import KIT

NOTEBOOKS = KIT / "notebooks"
_HEADING = re.compile(r"^(#{1,6})\s+(.*?)\s*#*$", re.MULTILINE)


@dataclass(frozen=True)
class Section:
    """A section of a notebook as the page shows it: prose as HTML, and code."""

    id: str
    title: str
    parts: tuple[tuple[str, str], ...]


def read(places: Iterable[str], notebooks: Path = NOTEBOOKS) -> dict[str, Section]:
    """Return the sections "notebook#title", by that name; those that the kit does not have are left out."""
    markdown = MarkdownIt("commonmark", {"html": False})
    found = {}
    for number, name in enumerate(dict.fromkeys(places), 1):
        cells = tuple(_cells(name, notebooks))
        if cells:
            parts = tuple((kind, markdown.render(text) if kind == "markdown" else text) for kind, text in cells)
            found[name] = Section(f"section{number}", name.replace("#", ": ", 1), parts)
    return found


def _cells(name: str, notebooks: Path) -> Iterator[tuple[str, str]]:
    """Yield the kind and the text of a section's cells, from its heading to the next one that is as high."""
    notebook, _, title = name.partition("#")
    try:
        cells = json.loads((notebooks / f"{notebook}.ipynb").read_text(encoding="utf-8"))["cells"]
    except (OSError, ValueError, KeyError):
        return
    level = 0
    for cell in cells:
        text = "".join(cell["source"])
        if cell["cell_type"] != "markdown":
            if level:
                yield "code", text
            continue
        begin = 0 if level else -1
        for heading in _HEADING.finditer(text):
            if level and len(heading[1]) <= level:
                if text[begin : heading.start()].strip():
                    yield "markdown", text[begin : heading.start()]
                return
            if not level and heading[2] == title:
                level, begin = len(heading[1]), heading.start()
        if level:
            yield "markdown", text[begin:]
