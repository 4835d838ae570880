"""Hostile submissions: what is left out, flagged or refused."""

from __future__ import annotations

import gzip
import os
import struct
import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest
from helpers.archives import PACKAGE, below, member, refusal, tarred, write, zipped
from helpers.course import COURSE

from grader.errors import SubmissionError
from grader.intake.containers import SizeLimits
from grader.intake.submission import open_submission


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("../outside", "traversal"),
        ("a/../../outside", "traversal"),
        ("..\\outside", "traversal"),
        ("/tmp/outside", "absolute path"),
        ("C:\\outside", "absolute path"),
    ],
)
def test_an_unsafe_name_is_left_out_and_flagged(tmp_path: Path, into: Path, name: str, kind: str):
    opened = open_submission(zipped(tmp_path / "a.zip", {**PACKAGE, name: "evil"}), into, COURSE)
    assert [flag.kind for flag in opened.flags] == [kind]
    assert opened.flags[0].where
    assert opened.intake.files == sorted(PACKAGE)
    assert written_outside(tmp_path, into) == ["a.zip"]


def written_outside(tmp_path: Path, into: Path) -> list[str]:
    return sorted(p.name for p in tmp_path.rglob("*") if not p.is_relative_to(into))


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [
        ("Package.xml", "Package.xml", "package.xml"),
        ("SRV/x", "SRV", "srv"),
        ("ROS2_Robot_Controller/utils/x.py", "ROS2_Robot_Controller", "ros2_robot_controller"),
        ("u\u0308.py", "u\u0308.py", "\u00fc.py"),
    ],
)
def test_names_that_are_one_on_other_systems_are_all_kept_and_flagged_once(
    tmp_path: Path, into: Path, name: str, first: str, second: str
):
    """A folder that differs in letter case once made the whole package vanish."""
    files = {**PACKAGE, "\u00fc.py": "", name: "x"}
    opened = open_submission(zipped(tmp_path / "a.zip", files), into, COURSE)
    assert opened.intake.files == sorted(files)
    assert opened.intake.package_path == "."
    assert [(flag.kind, flag.where) for flag in opened.flags] == [("collision", second)]
    assert first in opened.flags[0].what


@pytest.mark.parametrize("kind", [tarfile.REGTYPE, tarfile.LNKTYPE])
def test_a_file_with_the_name_of_the_packages_folder_does_not_hide_the_package(tmp_path: Path, into: Path, kind: bytes):
    files = [(member(n), t.encode()) for n, t in below("pkg/").items()]
    same = (member("pkg", kind, "pkg/package.xml"), b"")
    opened = open_submission(tarred(tmp_path / "a.tar", [*files, same]), into, COURSE)
    assert opened.intake.package_path == "pkg"
    assert [(flag.kind, flag.where) for flag in opened.flags] == [("collision", "pkg")]


@pytest.mark.parametrize("form", ["zip", "tar"])
def test_of_two_files_of_one_name_the_last_is_kept_as_unzip_does_and_flagged(tmp_path: Path, into: Path, form: str):
    source = tmp_path / "a"
    if form == "zip":
        zipped(source, PACKAGE)
        with zipfile.ZipFile(source, "a") as archive, pytest.warns(UserWarning, match="Duplicate name"):
            archive.writestr("srv/SetSpeed.srv", "last")
    else:
        files = [(member(n), t.encode()) for n, t in PACKAGE.items()]
        tarred(source, [*files, (member("srv/SetSpeed.srv"), b"last")])
    opened = open_submission(source, into, COURSE)
    assert (into / "srv/SetSpeed.srv").read_text() == "last"
    assert [(flag.kind, flag.where) for flag in opened.flags] == [("collision", "srv/SetSpeed.srv")]


@pytest.mark.parametrize("target", ["/etc/passwd", "../../secret", "srv/../../secret"])
def test_a_link_out_is_left_out_and_flagged(tmp_path: Path, handed_in: Path, into: Path, target: str):
    write(handed_in, PACKAGE)
    (handed_in / "notes.txt").symlink_to(target)
    (handed_in / "folder").symlink_to("/etc")
    opened = open_submission(handed_in, into, COURSE)
    assert [flag.kind for flag in opened.flags] == ["link", "link"]
    assert opened.intake.files == sorted(PACKAGE)


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE])
def test_a_link_out_of_a_tar_is_flagged_and_nothing_is_written_through_it(tmp_path: Path, into: Path, kind: bytes):
    (tmp_path / "victim").mkdir()
    files = [(member("pkg/" + n), t.encode()) for n, t in PACKAGE.items()]
    link = (member("pkg/door", kind, str(tmp_path / "victim")), b"")
    opened = open_submission(tarred(tmp_path / "a.tar", [link, *files, (member("pkg/door/x"), b"evil")]), into, COURSE)
    assert "absolute path" in {f.kind for f in opened.flags} or "link" in {f.kind for f in opened.flags}
    assert list((tmp_path / "victim").iterdir()) == []
    assert not any(p.is_symlink() for p in into.rglob("*"))


def test_a_link_within_the_submission_is_noted_but_not_flagged(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    (handed_in / "again.py").symlink_to("ros2_robot_controller/robot_controller.py")
    opened = open_submission(handed_in, into, COURSE)
    assert opened.flags == ()
    assert opened.intake.notes == [
        "again.py: it is a link to ros2_robot_controller/robot_controller.py and was left out; submit the file itself."
    ]


def test_links_in_a_colcon_build_tree_are_not_flagged(handed_in: Path, into: Path):
    write(handed_in, {**below("src/ctl/"), "install/COLCON_IGNORE": ""})
    (handed_in / "install/setup.py").symlink_to("/home/kim/ws/src/ctl/setup.py")
    assert open_submission(handed_in, into, COURSE).flags == ()


def test_a_hard_link_within_a_tar_becomes_a_copy(tmp_path: Path, into: Path):
    files = [(member("pkg/" + n), t.encode()) for n, t in PACKAGE.items()]
    source = tarred(tmp_path / "a.tar", [*files, (member("pkg/copy.xml", tarfile.LNKTYPE, "pkg/package.xml"), b"")])
    opened = open_submission(source, into, COURSE)
    assert (into / "pkg/copy.xml").read_text() == PACKAGE["package.xml"]
    assert (into / "pkg/copy.xml").stat().st_nlink == 1
    assert opened.flags == ()


def test_devices_and_pipes_are_left_out_and_flagged(tmp_path: Path, handed_in: Path, into: Path):
    files = [(member(n), t.encode()) for n, t in PACKAGE.items()]
    odd = [(member("null", tarfile.CHRTYPE), b""), (member("pipe", tarfile.FIFOTYPE), b"")]
    opened = open_submission(tarred(tmp_path / "a.tar", files + odd), into, COURSE)
    assert [flag.kind for flag in opened.flags] == ["special file"] * 2
    os.mkfifo(write(handed_in, PACKAGE) / "pipe")
    assert [flag.kind for flag in open_submission(handed_in, tmp_path / "b", COURSE).flags] == ["special file"]


def test_a_folder_deeper_than_any_stack_is_left_out(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    handle = os.open(handed_in, os.O_RDONLY)
    for _ in range(1500):  # no path can be that long, so go down step by step
        os.mkdir("d", dir_fd=handle)
        inner = os.open("d", os.O_RDONLY, dir_fd=handle)
        os.close(os.open("f", os.O_CREAT, dir_fd=inner))
        os.close(handle)
        handle = inner
    os.close(handle)
    opened = open_submission(handed_in, into, COURSE)
    subprocess.run(["rm", "-rf", handed_in], check=True)  # rmtree would run out of stack
    assert any("too deep" in note for note in opened.intake.notes)
    assert max(name.count("/") for name in opened.intake.files) < 20


def test_a_large_recording_is_left_out_with_a_note(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    with (handed_in / "demo.mp4").open("wb") as file:
        file.truncate(31 * 1024**2)
    opened = open_submission(handed_in, into, COURSE)
    assert opened.intake.notes == ["demo.mp4: it has 31 MB, more than 10 MB, and was left out."]
    assert opened.flags == ()


def test_one_huge_file_packed_small_is_flagged(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {**PACKAGE, "zeros": bytes(40 * 1024**2)})
    assert [flag.kind for flag in open_submission(source, into, COURSE).flags] == ["bomb"]


def test_many_files_packed_small_are_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {**PACKAGE, **{f"z{i}": bytes(4 * 1024**2) for i in range(5)}})
    assert "like a decompression bomb" in refusal(source, into)


@pytest.mark.parametrize("form", ["folder", "zip", "tar"])
def test_a_submission_that_is_too_large_names_its_largest_files(tmp_path: Path, into: Path, handed_in: Path, form: str):
    bags = {f"bag_{megabytes}.mcap": os.urandom(megabytes * 1024**2) for megabytes in (3, 9, 8, 2)}
    if form == "folder":
        write(handed_in, PACKAGE)
        for name, data in bags.items():
            (handed_in / name).write_bytes(data)
    elif form == "zip":
        zipped(handed_in, {**PACKAGE, **bags})
    else:
        tarred(handed_in, [(member(name), data) for name, data in bags.items()], "w")
    with pytest.raises(SubmissionError) as refused:
        open_submission(handed_in, into, COURSE, SizeLimits(total_bytes=10 * 1024**2))
    largest = "bag_9.mcap (9 MB), bag_8.mcap (8 MB), bag_3.mcap (3 MB)"
    assert f"contains 22 MB, more than 10 MB. The largest files are {largest}." in str(refused.value)


def test_a_packed_tar_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, into: Path):
    header = member("zeros")
    header.size = 8 * 1024**3
    with gzip.open(tmp_path / "a.tgz", "wb", compresslevel=1) as file:
        file.write(header.tobuf())
        for _ in range(300):
            file.write(bytes(1024**2))
    message = refusal(tmp_path / "a.tgz", into)
    assert "unpacks to more than 250 MB. The largest of its first files are zeros (8192 MB)." in message


@pytest.mark.parametrize(
    ("limits", "words"),
    [(SizeLimits(files=5), "contains 6 files, more than 5"), (SizeLimits(total_bytes=100), "more than 0 MB")],
)
def test_a_submission_over_the_limits_is_refused(handed_in: Path, into: Path, limits: SizeLimits, words: str):
    with pytest.raises(SubmissionError, match=words):
        open_submission(write(handed_in, PACKAGE), into, COURSE, limits)


def test_an_archive_inside_counts_against_the_same_limits(tmp_path: Path, into: Path):
    inner = zipped(tmp_path / "inner.zip", PACKAGE).read_bytes()
    source = zipped(tmp_path / "a.zip", {"i.zip": inner, "j.zip": inner})
    opened = open_submission(source, into, COURSE, SizeLimits(files=10))
    assert opened.intake.package_path == "i"
    assert any("j.zip was not opened" in note and "more than 2" in note for note in opened.intake.notes)


def test_a_zip_with_too_many_entries_is_not_read(tmp_path: Path, into: Path, monkeypatch: pytest.MonkeyPatch):
    limits = SizeLimits(entries=50)
    source = zipped(tmp_path / "a.zip", {f"f{i}": "" for i in range(51)})
    monkeypatch.setattr(zipfile.ZipFile, "infolist", lambda _: pytest.fail("the entries were read"))
    with pytest.raises(SubmissionError, match="more than 50 files"):
        open_submission(source, into, COURSE, limits)


def test_a_file_longer_than_declared_is_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {"package.xml": "x" * 1000})
    data = source.read_bytes()
    position = data.index(b"PK\x01\x02")
    source.write_bytes(data[: position + 24] + struct.pack("<I", 10) + data[position + 28 :])
    assert "is damaged" in refusal(source, into)
