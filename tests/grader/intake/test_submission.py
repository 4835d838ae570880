"""Taking in a submission: what is accepted, and errors of the grader."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from pathlib import Path

import pytest
from helpers.archives import PACKAGE, below, member, refusal, tarred, without_flag, write, zipped
from helpers.course import COURSE

from grader.errors import GraderError
from grader.intake import course_marker
from grader.intake.submission import open_submission


def test_a_package_folder_is_found_at_its_root(handed_in: Path, into: Path):
    opened = open_submission(write(handed_in, PACKAGE), into, COURSE)
    assert opened.package == into
    assert (opened.intake.package, opened.intake.package_path) == ("ros2_robot_controller", ".")
    assert opened.intake.files == sorted(PACKAGE)
    assert opened.intake.notes == []
    assert opened.flags == ()


@pytest.mark.parametrize("mode", ["w", "w:gz", "w:bz2", "w:xz"])
def test_a_tar_is_opened_however_it_is_packed(tmp_path: Path, into: Path, mode: str):
    source = tarred(tmp_path / "team", [(member(n), t.encode()) for n, t in below("pkg/").items()], mode)
    assert open_submission(source, into, COURSE).package == into / "pkg"


@pytest.mark.parametrize("name", ["r\u00e9sum\u00e9.md", "\u8bf4\u660e.md", "plain.md"])
def test_names_of_a_zip_that_are_utf_8_are_read_as_that(tmp_path: Path, into: Path, name: str):
    """macOS and others set no flag for it; a README with an accent had another name in the report."""
    whole = zipped(tmp_path / "x.zip", {**PACKAGE, name: "x"}).read_bytes()
    (tmp_path / "a.zip").write_bytes(without_flag(whole))
    assert name in open_submission(tmp_path / "a.zip", into, COURSE).intake.files


def test_names_of_a_zip_that_are_not_utf_8_stay_as_the_format_has_them(tmp_path: Path, into: Path):
    whole = zipped(tmp_path / "x.zip", {**PACKAGE, "M?ller.md": "x"}).read_bytes()
    (tmp_path / "a.zip").write_bytes(whole.replace(b"M?ller.md", b"M\x81ller.md"))
    assert "M\u00fcller.md" in open_submission(tmp_path / "a.zip", into, COURSE).intake.files


def test_a_zip_with_extra_folder_levels_and_mac_litter_is_opened(tmp_path: Path, into: Path):
    litter = {"__MACOSX/team/._package.xml": "x", "team/.DS_Store": "x", "team/ws/src/ctl/__pycache__/a.pyc": "x"}
    source = zipped(tmp_path / "team.zip", {**below("team/ws/src/ctl/"), **litter})
    opened = open_submission(source, into, COURSE)
    assert opened.intake.package_path == "team/ws/src/ctl"
    assert opened.intake.files == sorted(below("team/ws/src/ctl/"))


def test_backslashes_of_an_old_windows_zip_are_separators(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "team.zip", {n.replace("/", "\\"): t for n, t in below("pkg/").items()})
    assert open_submission(source, into, COURSE).intake.package_path == "pkg"


def test_a_folder_with_a_zip_in_it_is_opened(handed_in: Path, into: Path):
    handed_in.mkdir()
    zipped(handed_in / "final (1).zip", below("pkg/"))
    opened = open_submission(handed_in, into, COURSE)
    assert opened.package == into / "final (1)" / "pkg"
    assert opened.intake.notes == ["Opened final (1).zip inside."]


def test_a_zip_in_a_zip_is_opened_but_not_a_third(tmp_path: Path, into: Path):
    inner = zipped(tmp_path / "inner.zip", PACKAGE).read_bytes()
    second = zipped(tmp_path / "second.zip", {"inner.zip": inner})
    assert open_submission(second, into, COURSE).package == into / "inner"
    third = zipped(tmp_path / "third.zip", {"second.zip": second.read_bytes()})
    assert "archive that was not opened (second/inner.zip)" in refusal(third, tmp_path / "other")


def test_a_damaged_zip_beside_an_intact_one_is_noted(handed_in: Path, into: Path):
    zipped(write(handed_in, {"a.zip": "no zip"}) / "b.zip", PACKAGE)
    opened = open_submission(handed_in, into, COURSE)
    assert opened.package == into / "b"
    assert opened.intake.notes[0].startswith("a.zip was not opened: a.zip is not a folder, zip or tar.")


def test_an_archive_beside_a_package_stays_closed_and_is_noted(handed_in: Path, into: Path):
    write(handed_in, {**PACKAGE, "more.rar": "Rar!"})
    zipped(handed_in / "old.zip", below("old/"))
    intake = open_submission(handed_in, into, COURSE).intake
    assert intake.others == []
    assert intake.notes == [
        "more.rar was not opened: the grader opens zip and tar only.",
        "old.zip was not opened: there is a package outside of it.",
    ]


def test_of_many_archives_side_by_side_those_that_stay_closed_are_noted(handed_in: Path, into: Path):
    handed_in.mkdir()
    for number in range(6):
        zipped(handed_in / f"{number}.zip", PACKAGE if number == 0 else {"README.md": ""})
    notes = open_submission(handed_in, into, COURSE).intake.notes
    assert notes[:5] == [f"Opened {number}.zip inside." for number in range(5)]
    assert notes[5:] == ["5.zip was not opened: there is a package outside of it."]


def test_the_same_content_has_the_same_hash_however_it_is_packed(tmp_path: Path, handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    backwards = zipped(tmp_path / "b.zip", dict(reversed(PACKAGE.items())))
    hashes = [open_submission(s, into / str(i), COURSE).intake.sha256 for i, s in enumerate((handed_in, backwards))]
    (handed_in / "package.xml").write_text(PACKAGE["package.xml"] + "\n")
    changed = open_submission(handed_in, into / "changed", COURSE).intake.sha256
    assert hashes[0] == hashes[1] != changed


def test_of_a_files_mode_only_the_executable_bit_is_kept(tmp_path: Path, into: Path):
    files = [(member(n), t.encode()) for n, t in PACKAGE.items()]
    source = tarred(tmp_path / "t.tar", [*files, (member("scripts/demo.py", mode=0o6777), b"x")])
    opened = open_submission(source, into, COURSE)
    assert stat.S_IMODE((into / "scripts/demo.py").stat().st_mode) & 0o7022 == 0
    assert os.access(into / "scripts/demo.py", os.X_OK)
    assert not os.access(into / "package.xml", os.X_OK) or os.geteuid() != 0
    assert [flag.kind for flag in opened.flags] == ["setuid"]


# -- the marker that `start_at` leaves: nothing in it is trusted -------------------------------------------------------


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


# -- errors of the grader -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("when", ["a file is made", "its last bytes are written, as it is closed"])
def test_a_full_disk_is_an_error_of_the_grader(handed_in: Path, into: Path, monkeypatch: pytest.MonkeyPatch, when: str):
    really = os.open

    def full(path: str, flags: int, *rest: int, **more: int) -> int:
        if not flags & os.O_CREAT:
            return really(path, flags, *rest, **more)
        if when == "a file is made":
            raise OSError(28, "No space left on device")
        return really("/dev/full", os.O_WRONLY)

    write(handed_in, PACKAGE)
    monkeypatch.setattr(os, "open", full)
    with pytest.raises(GraderError, match=r"No space left on device. Free some space"):
        open_submission(handed_in, into, COURSE)


def test_a_folder_without_read_permission_is_an_error_of_the_grader(
    handed_in: Path, into: Path, monkeypatch: pytest.MonkeyPatch
):
    """Root can read everything, so the test raises the error itself."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(handed_in))

    write(handed_in, PACKAGE)
    monkeypatch.setattr(os, "fwalk", refuse)
    with pytest.raises(GraderError, match="Make the submission readable"):
        open_submission(handed_in, into, COURSE)


def test_the_graders_own_output_inside_the_submission_is_left_out(handed_in: Path):
    write(handed_in, PACKAGE)
    opened = open_submission(handed_in, handed_in / "out" / "src", COURSE)
    assert opened.intake.files == sorted(PACKAGE)
