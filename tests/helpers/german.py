"""A course in German, for tests of what its students read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from grader import words
from grader.course.reader import VARIABLE
from helpers.course import COURSE


@pytest.fixture
def german_course(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the kit's own course in German, which `grader.course.find` finds."""
    folder = tmp_path / "kurs"
    folder.mkdir()
    (folder / "course.yaml").write_text("extends: kit\nlanguage: de\nrubric: rubric.yaml\n")
    (folder / "rubric.yaml").write_text("extends: kit\n")
    monkeypatch.setenv(VARIABLE, str(folder))
    yield folder
    words.speak(words.ENGLISH, COURSE.folder)
