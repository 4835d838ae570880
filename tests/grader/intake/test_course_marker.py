"""The marker that `start_at` leaves: nothing in it is trusted."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
from helpers.course import COURSE, REFERENCE

from grader.intake import course_marker
from grader.intake.submission import open_submission


@pytest.mark.parametrize("marker", ["", "[]", "{", '{"sha256": []}', '{"sha256": {"package.xml": 3}}', "null"])
def test_a_damaged_marker_is_ignored(tmp_path: Path, marker: str) -> None:
    (tmp_path / course_marker.MARKER).write_text(marker)
    assert course_marker.note(tmp_path) == ""


def test_a_marker_cannot_point_outside_the_package(tmp_path: Path) -> None:
    package = tmp_path / "package"
    package.mkdir()
    (tmp_path / "secret").write_text("x")
    sums = dict.fromkeys(("../secret", str(tmp_path / "secret")), hashlib.sha256(b"x").hexdigest())
    (package / course_marker.MARKER).write_text(json.dumps({"sha256": sums}))
    assert course_marker.unchanged(package) == []


def test_the_intake_of_a_package_without_a_marker_notes_nothing(tmp_path: Path) -> None:
    assert open_submission(REFERENCE, tmp_path / "taken", COURSE).intake.notes == []
