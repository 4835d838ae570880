"""A notebook exported to HTML, as JupyterLab's menu does, and looked at in a browser: hints and answers stay folded."""

from __future__ import annotations

import html
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path

import pytest
from nbconvert import HTMLExporter

from grader.authoring import book, editions, notebook_source

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

pytestmark = [
    pytest.mark.slow,  # a browser
    pytest.mark.skipif(BROWSER is None, reason="needs a browser: apt-get install chromium"),
]


@dataclass
class Fold:
    """A `<details>`: whether the page shows it open, and its two texts."""

    is_open: bool
    summary: str = ""
    text: str = ""


@dataclass
class Page(HTMLParser):
    """The folds of a page, in the order of their ends."""

    folds: list[Fold] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()
        self._open: list[Fold] = []
        self._in_summary = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "details":
            self._open.append(Fold("open" in dict(attrs)))
        self._in_summary = self._in_summary or tag == "summary"

    def handle_endtag(self, tag: str) -> None:
        if tag == "details":
            self.folds.append(self._open.pop())
        self._in_summary = self._in_summary and tag != "summary"

    def handle_data(self, data: str) -> None:
        for fold in self._open:
            if self._in_summary:
                fold.summary += data
            else:
                fold.text += data


def in_browser(page: str, folder: Path) -> str:
    """Return the page as the browser understands it: misplaced tags are moved, and unclosed ones closed."""
    (folder / "page.html").write_text(page, encoding="utf-8")
    command = [
        str(BROWSER),
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        f"--user-data-dir={folder}",
        "--dump-dom",
    ]
    ran = subprocess.run(
        [*command, f"file://{folder}/page.html"], capture_output=True, text=True, check=True, timeout=120
    )
    return ran.stdout


def letters(text: str) -> str:
    """Return the letters of a text, without Markdown's signs, addresses of links, tags and the languages of blocks."""
    plain = re.sub(r"```\w*|</?\w+[^>]*>|\]\([^)]*\)", "", text)
    return re.sub(r"[^a-z]", "", html.unescape(plain).lower())


@pytest.mark.parametrize("name", notebook_source.names())
def test_each_hint_and_answer_is_folded_with_its_whole_text(name: str, tmp_path: Path):
    notebook = book.read_stored(editions.student_file(name))
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    written = re.findall(r"<details[^>]*>\s*<summary>(.*?)</summary>(.*?)</details>", text, re.DOTALL)
    page = Page()
    page.feed(in_browser(HTMLExporter().from_notebook_node(notebook)[0], tmp_path))
    assert len(written) > 0
    assert [(fold.is_open, letters(fold.summary), letters(fold.text)) for fold in page.folds] == [
        (False, letters(summary), letters(body)) for summary, body in written
    ]
