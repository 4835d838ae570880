"""`--unsafe-no-sandbox`: every report says what it gives up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from grader import pipeline, report
from grader.host import namespaces
from grader.report import console


@pytest.mark.slow  # a whole grading
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_grading_without_a_sandbox_says_so_in_every_report(
    reference: Path, tmp_path: Path, settings: pipeline.Settings, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(namespaces.UNSAFE_VARIABLE, "1")
    grading = pipeline.grade(reference, tmp_path, replace(settings, requirements=("F14",)))
    as_json, page = report.write(grading, tmp_path, pictures=False)
    for text in (as_json.read_text(), page.read_text(), " ".join(console.render(grading).split())):
        assert "Graded with --unsafe-no-sandbox" in text
        assert "can be trusted no more than the submission" in text
