"""A small rubric for the tests of the report."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.report_examples import SMALL

from grader.scoring.rubric import Rubric, load


@pytest.fixture
def rubric(tmp_path: Path) -> Rubric:
    (tmp_path / "rubric.yaml").write_text(SMALL)
    return load(tmp_path / "rubric.yaml")
