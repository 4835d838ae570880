"""Finding the submissions of an export: each learning platform's layout as its pages and sources describe it."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import pytest
from helpers import beside

from grader.classroom import platforms
from grader.classroom.identity import SHORT, Claim
from grader.classroom.ledger import Source
from grader.classroom.platform import Export
from grader.errors import GraderError

TEXTS = beside(__file__)


def layout(root: Path, *names: str) -> Export:
    """Make files (with their folders) and read the layout. A name that ends in "/" is a folder."""
    for name in names:
        path = root / name
        if name.endswith("/"):
            path.mkdir(parents=True)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    return platforms.read(Source(root))


def test_moodle_has_a_folder_for_each_participant(tmp_path):
    export = layout(
        tmp_path,
        "Jane Doe_12345_assignsubmission_file_/team.zip",
        "Li_Na Wu_12346_assignsubmission_file_/pkg/package.xml",
    )
    jane, li = export.hand_ins
    assert export.layout == "moodle"
    assert jane.path.name == "team.zip", "the archive itself, not the folder around it"
    assert Claim("lms_id", "12345", "moodle") in jane.claims[0]
    assert Claim("name", "Jane Doe") in jane.claims[0]
    assert (li.label, li.path.name) == ("Li_Na Wu", "Li_Na Wu_12346_assignsubmission_file_")


def test_canvas_marks_late_ones_and_numbers_attachments(tmp_path):
    export = layout(
        tmp_path,
        "doejane_12345_67890_team-1.zip",
        "doejane_LATE_12345_67999_team-2.zip",
        "wuli_12346_67891_package.tar.gz",
    )
    jane, li = export.hand_ins
    assert export.layout == "canvas"
    assert jane.path.name == "doejane_LATE_12345_67999_team-2.zip", "the last attachment counts"
    assert (jane.late, li.late) == (True, False)
    assert jane.claims[0][:2] == (Claim("lms_id", "12345", "canvas"), Claim(SHORT, "doejane"))


def test_gradescope_says_who_and_when_in_its_metadata(tmp_path):
    (tmp_path / "submission_metadata.yml").write_text(TEXTS["GRADESCOPE"])
    export = layout(tmp_path, "submission_101/package.xml", "submission_102/team.zip", "submission_999/x")
    stray, first, second = export.hand_ins
    assert export.layout == "gradescope"
    assert first.submitted == dt.datetime(2026, 11, 20, 22, 58, 1, tzinfo=dt.UTC)
    assert second.submitted == dt.datetime(2026, 11, 21, 0, 0, 0, 500_000, tzinfo=dt.UTC)
    assert first.claims[1] == (Claim("id", "3002"), Claim("email", "li@uni.edu"), Claim("name", "Li Wu"))
    assert second.path.name == "team.zip"
    assert stray.label == "submission_999", "what the metadata do not list may be somebody's all the same"


@pytest.mark.parametrize(
    ("folder", "names", "kind", "labels", "notes"),
    [
        (
            "robots-submissions",
            ("robots-jane-doe/.git/HEAD", "robots-janus/.git/HEAD", "loose/readme.md"),
            "git",
            ["jane-doe", "janus", "loose"],
            (),
        ),
        ("clones", ("hw-2-anna/.git/HEAD", "hw-2-andy/.git/HEAD"), "git", ["andy", "anna"], ()),
        (
            "e",
            ("team01.zip", "team02.TAR.GZ", "team03.rar", "team04/package.xml", "roster.csv", ".DS_Store"),
            "plain",
            ["team01", "team02", "team03", "team04"],
            ("roster.csv is neither an archive nor a folder; it was left out.",),
        ),
        (
            "e",
            ("export/__MACOSX/x", "export/team01.zip", "export/team02.zip"),
            "plain",
            ["team01", "team02"],
            (),
        ),
    ],
    ids=["clones, assignment-login", "the login is what names do not share", "archives and folders", "one around all"],
)
def test_what_else_is_handed_in_is_called_by_its_name(tmp_path, folder, names, kind, labels, notes):
    export = layout(tmp_path / folder, *names)
    assert (export.layout, [each.label for each in export.hand_ins], export.notes) == (kind, labels, notes)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("package.xml", "is a single submission"),
        ("src/robot/package.xml", "is a single submission"),
        ("readme.txt", "holds no submission"),
        ("submission_metadata.yml", "not as Gradescope writes it"),
    ],
)
def test_what_is_no_class_is_refused(tmp_path, name, said):
    with pytest.raises(GraderError, match=said):
        layout(tmp_path, name)


@pytest.mark.parametrize(
    "odd",
    [
        "ekbo_12347_text.html",
        "ekbo_12347_link.html",
        "LATE_anon_x3dF9_67892_team.zip",
        "under_score_12348_67893_team.zip",
        "grades.csv",
        "by_mail.zip",
    ],
)
def test_one_odd_entry_does_not_make_an_export_of_canvas_plain(tmp_path, odd):
    """All the others were named as nobody is, and the whole roster had 0.00."""
    export = layout(tmp_path, "doejane_12345_67890_team.zip", "late_12349_67899_a.zip", "wuli_12346_67891_a.zip", odd)
    assert export.layout == "canvas"
    labels = {hand_in.label: hand_in for hand_in in export.hand_ins}
    assert {"doejane", "wuli", "late"} <= set(labels)
    assert not labels["late"].late, "that is a name: Canvas writes LATE in capitals"
    others = set(labels) - {"doejane", "wuli", "late"}
    assert others <= {"ekbo", "anon_x3dF9", "under_score", "by_mail"}
    assert len(others) == (odd != "grades.csv")
