"""A small rubric for the tests of the report."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.report_examples import small_rubric

from grader.scoring.rubric import Rubric


@pytest.fixture
def rubric(tmp_path: Path) -> Rubric:
    return small_rubric(tmp_path)
