"""Taking in a submission: what is accepted, which package is found, what is refused, and what is never written."""

from __future__ import annotations

import bz2
import contextlib
import gzip
import io
import lzma
import os
import random
import stat
import struct
import subprocess
import tarfile
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.errors import GraderError, SubmissionError
from grader.intake import containers
from grader.intake.copy_plan import SizeLimits
from grader.intake.package_xml import read_package_xml
from grader.intake.submission import Submission, open_submission

XML = "<package format='3'><name>{}</name><version>1.0.0</version></package>"
NODE = "import rclpy\n"
PACKAGE = {
    "package.xml": XML.format("ros2_robot_controller"),
    "CMakeLists.txt": "project(ros2_robot_controller)\n",
    "ros2_robot_controller/__init__.py": "",
    "ros2_robot_controller/robot_controller.py": NODE,
    "ros2_robot_controller/sensor_processor.py": NODE,
    "srv/SetSpeed.srv": "float32 speed\n---\nbool success\nstring message\n",
}


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def zipped(path: Path, files: dict[str, str | bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def tarred(path: Path, members: list[tuple[tarfile.TarInfo, bytes]], mode: str = "w:gz") -> Path:
    with tarfile.open(path, mode) as archive:
        for info, data in members:
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


def member(name: str, kind: bytes = tarfile.REGTYPE, target: str = "", mode: int = 0o644) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.type, info.linkname, info.mode = kind, target, mode
    return info


def below(prefix: str, files: dict[str, str] = PACKAGE) -> dict[str, str]:
    return {prefix + name: text for name, text in files.items()}


@pytest.fixture
def handed_in(tmp_path: Path) -> Path:
    return tmp_path / "handed_in"


@pytest.fixture
def into(tmp_path: Path) -> Path:
    return tmp_path / "into"


def refusal(source: Path, into: Path) -> str:
    with pytest.raises(SubmissionError) as refused:
        open_submission(source, into)
    assert not into.exists(), "a refused submission leaves nothing behind"
    return str(refused.value)


# -- accepted submissions -----------------------------------------------------------------------------------------


def test_a_package_folder_is_found_at_its_root(handed_in: Path, into: Path):
    opened = open_submission(write(handed_in, PACKAGE), into)
    assert opened.package == into
    assert (opened.intake.package, opened.intake.package_path) == ("ros2_robot_controller", ".")
    assert opened.intake.files == sorted(PACKAGE)
    assert opened.intake.notes == []
    assert opened.flags == ()


@pytest.mark.parametrize("mode", ["w", "w:gz", "w:bz2", "w:xz"])
def test_a_tar_is_opened_however_it_is_packed(tmp_path: Path, into: Path, mode: str):
    source = tarred(tmp_path / "team", [(member(n), t.encode()) for n, t in below("pkg/").items()], mode)
    assert open_submission(source, into).package == into / "pkg"


def test_a_zip_with_extra_folder_levels_and_mac_litter_is_opened(tmp_path: Path, into: Path):
    litter = {"__MACOSX/team/._package.xml": "x", "team/.DS_Store": "x", "team/ws/src/ctl/__pycache__/a.pyc": "x"}
    source = zipped(tmp_path / "team.zip", {**below("team/ws/src/ctl/"), **litter})
    opened = open_submission(source, into)
    assert opened.intake.package_path == "team/ws/src/ctl"
    assert opened.intake.files == sorted(below("team/ws/src/ctl/"))


def test_backslashes_of_an_old_windows_zip_are_separators(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "team.zip", {n.replace("/", "\\"): t for n, t in below("pkg/").items()})
    assert open_submission(source, into).intake.package_path == "pkg"


def test_a_folder_with_a_zip_in_it_is_opened(handed_in: Path, into: Path):
    handed_in.mkdir()
    zipped(handed_in / "final (1).zip", below("pkg/"))
    opened = open_submission(handed_in, into)
    assert opened.package == into / "final (1)" / "pkg"
    assert opened.intake.notes == ["Opened final (1).zip inside."]


def test_a_zip_in_a_zip_is_opened_but_not_a_third(tmp_path: Path, into: Path):
    inner = zipped(tmp_path / "inner.zip", PACKAGE).read_bytes()
    second = zipped(tmp_path / "second.zip", {"inner.zip": inner})
    assert open_submission(second, into).package == into / "inner"
    third = zipped(tmp_path / "third.zip", {"second.zip": second.read_bytes()})
    assert "archive that was not opened (second/inner.zip)" in refusal(third, tmp_path / "other")


def test_a_damaged_zip_beside_an_intact_one_is_noted(handed_in: Path, into: Path):
    zipped(write(handed_in, {"a.zip": "no zip"}) / "b.zip", PACKAGE)
    opened = open_submission(handed_in, into)
    assert opened.package == into / "b"
    assert opened.intake.notes[0].startswith("a.zip was not opened: a.zip is not a folder, zip or tar.")


def test_a_damaged_zip_alone_is_the_reason_of_the_refusal(handed_in: Path, into: Path):
    assert refusal(write(handed_in, {"a.zip": "no zip"}), into).startswith("a.zip is not a folder, zip or tar.")


def test_a_zip_beside_a_package_stays_closed(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    zipped(handed_in / "old.zip", below("old/"))
    assert open_submission(handed_in, into).intake.others == []


def test_the_same_content_has_the_same_hash_however_it_is_packed(tmp_path: Path, handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    backwards = zipped(tmp_path / "b.zip", dict(reversed(PACKAGE.items())))
    hashes = [open_submission(s, into / str(i)).intake.sha256 for i, s in enumerate((handed_in, backwards))]
    (handed_in / "package.xml").write_text(PACKAGE["package.xml"] + "\n")
    changed = open_submission(handed_in, into / "changed").intake.sha256
    assert hashes[0] == hashes[1] != changed


def test_of_a_files_mode_only_the_executable_bit_is_kept(tmp_path: Path, into: Path):
    files = [(member(n), t.encode()) for n, t in PACKAGE.items()]
    source = tarred(tmp_path / "t.tar", [*files, (member("scripts/demo.py", mode=0o6777), b"x")])
    opened = open_submission(source, into)
    assert stat.S_IMODE((into / "scripts/demo.py").stat().st_mode) & 0o7022 == 0
    assert os.access(into / "scripts/demo.py", os.X_OK)
    assert not os.access(into / "package.xml", os.X_OK) or os.geteuid() != 0
    assert [flag.kind for flag in opened.flags] == ["setuid"]


# -- which package is found ---------------------------------------------------------------------------------------


def test_the_exact_name_wins_over_a_shallower_package(handed_in: Path, into: Path):
    write(handed_in, {"turtle/package.xml": XML.format("turtle"), "turtle/a.py": NODE})
    write(handed_in, below("ws/src/deep/"))
    opened = open_submission(handed_in, into)
    assert opened.intake.package_path == "ws/src/deep"
    assert opened.intake.others == ["turtle (turtle)"]


def test_among_other_names_the_contract_modules_win(handed_in: Path, into: Path):
    write(handed_in, {"a/package.xml": XML.format("a"), "a/a.py": NODE, "a/b.py": NODE, "a/c.py": NODE})
    write(handed_in, below("z/", {**PACKAGE, "package.xml": XML.format("my_robot")}))
    opened = open_submission(handed_in, into)
    assert opened.intake.package_path == "z"
    assert opened.intake.notes == ["The package is named my_robot, not ros2_robot_controller."]


def test_of_two_copies_the_shallower_is_graded_and_the_other_named(handed_in: Path, into: Path):
    write(write(handed_in, below("pkg/")), below("backup/old/pkg/"))
    opened = open_submission(handed_in, into)
    assert opened.intake.package_path == "pkg"
    assert any("occurs more than once" in note and "backup/old/pkg" in note for note in opened.intake.notes)


def test_a_package_of_the_interfaces_beside_it_is_found(handed_in: Path, into: Path):
    name = "ros2_robot_controller_interfaces"
    write(handed_in, below("src/ctl/"))
    write(handed_in, {f"src/{name}/package.xml": XML.format(name), f"src/{name}/srv/SetSpeed.srv": "---"})
    opened = open_submission(handed_in, into)
    assert opened.package == into / "src/ctl"
    assert opened.interfaces == into / "src" / name
    assert opened.intake.interfaces_package == f"src/{name}"
    assert opened.intake.others == []


@pytest.mark.parametrize(
    "made_by_tools",
    [
        {"install/ctl/share/ctl/package.xml": XML.format("ros2_robot_controller"), "install/COLCON_IGNORE": ""},
        {"build/ctl/package.xml": XML.format("ros2_robot_controller"), "src/x": ""},
        {"env/pyvenv.cfg": "", "env/share/rclpy/package.xml": XML.format("rclpy")},
        {"node_modules/a/package.xml": XML.format("ros2_robot_controller")},
        {".git/package.xml": XML.format("ros2_robot_controller")},
        {"off/COLCON_IGNORE": "", "off/package.xml": XML.format("ros2_robot_controller")},
    ],
)
def test_trees_made_by_tools_are_not_searched(handed_in: Path, into: Path, made_by_tools: dict[str, str]):
    write(write(handed_in, below("zz/deep/er/")), made_by_tools)
    opened = open_submission(handed_in, into)
    assert opened.intake.package_path == "zz/deep/er"
    assert opened.intake.others == []


def test_a_workspace_that_is_itself_a_virtual_environment_keeps_its_package(handed_in: Path, into: Path):
    write(handed_in, {"ws/pyvenv.cfg": "", "ws/lib/python3.11/site-packages/a.py": NODE, **below("ws/src/ctl/")})
    assert open_submission(handed_in, into).intake.package_path == "ws/src/ctl"


def test_a_package_xml_that_is_not_xml_is_noted_and_the_package_is_still_found(handed_in: Path, into: Path):
    write(handed_in, below("ctl/", {**PACKAGE, "package.xml": "<package>\n<name>ctl</package>"}))
    opened = open_submission(handed_in, into)
    assert opened.intake.package == "ctl"
    assert opened.intake.notes == ["ctl/package.xml is not XML: mismatched tag: line 2, column 11."]


def test_without_package_xml_the_contract_modules_identify_the_package(handed_in: Path, into: Path):
    write(handed_in, below("ctl/", {n: t for n, t in PACKAGE.items() if n != "package.xml"}))
    opened = open_submission(handed_in, into)
    assert opened.intake.package_path == "ctl"
    assert opened.intake.notes == ["ctl has no package.xml; its modules show that it is the package."]


def test_a_name_in_package_xml_that_is_a_path_is_not_used(handed_in: Path, into: Path):
    write(handed_in, below("ctl/", {**PACKAGE, "package.xml": XML.format("../../etc")}))
    assert open_submission(handed_in, into).intake.package == "ctl"


# -- not a submission ---------------------------------------------------------------------------------------------


CATKIN = "<package><name>ros2_robot_controller</name><buildtool_depend>catkin</buildtool_depend></package>"


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, "is empty"),
        ({"README.md": "hello"}, "holds documents only (README.md)"),
        ({"report.pdf": "x", "shot.png": "x"}, "holds documents only"),
        ({"package.xml": CATKIN, "scripts/robot_controller.py": "import rospy"}, "holds a ROS 1 (catkin) package"),
        ({"a/scripts/move.py": "import rospy\n"}, "holds code for ROS 1"),
        ({"package.xml": XML.format("ros2_robot_controller"), "src/a.cpp": "int main(){}"}, "holds a C++ package"),
        ({"main.cpp": "int main(){}"}, "holds C++ only"),
        ({"05_moving.ipynb": "{}", "README.md": ""}, "holds notebooks only"),
        ({"robot.py": NODE}, "holds a node (robot.py) but no package.xml"),
        ({"hello.py": "print(1)"}, "holds no package.xml"),
        ({"team.rar": "Rar!", "README.md": ""}, "archive that was not opened (team.rar)"),
        ({"src/x": "", "install/ctl/package.xml": XML.format("a")}, "only where colcon does not look"),
    ],
)
def test_a_non_submission_gets_one_sentence(handed_in: Path, into: Path, files: dict[str, str], words: str):
    handed_in.mkdir()
    message = refusal(write(handed_in, files), into)
    assert message.startswith("handed_in ")
    assert words in message
    assert message.endswith(".")
    assert len(message) < 250


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is an empty file"),
        (b"Rar!\x1a\x07\x00", "cannot be opened"),
        (b"PK\x03\x04 but no more", "cannot be opened"),
        (b"print(1)\n", "not a folder, zip or tar"),
        (b"\x1f\x8b\x08 no gzip", "is damaged"),
        (b"\xfd7zXZ\x00 no xz", "is damaged"),
    ],
)
def test_a_file_that_is_not_an_archive_is_refused_with_advice(tmp_path: Path, into: Path, data: bytes, words: str):
    (tmp_path / "team07.zip").write_bytes(data)
    message = refusal(tmp_path / "team07.zip", into)
    assert words in message
    assert "again" in message or "submit" in message.lower()


def test_a_source_that_does_not_exist_is_named(tmp_path: Path, into: Path):
    assert "There is no file or folder" in refusal(tmp_path / "nobody.zip", into)


def test_a_truncated_archive_is_damaged(tmp_path: Path, into: Path):
    noise = random.Random(1).randbytes(50_000)
    whole = tarred(tmp_path / "a.tgz", [(member("a/noise"), noise), (member("a/package.xml"), b"<package/>")])
    whole.write_bytes(whole.read_bytes()[:30_000])
    assert "is damaged" in refusal(whole, into)


def test_a_zip_with_a_password_is_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", PACKAGE)
    data = bytearray(source.read_bytes())
    position = data.index(b"PK\x01\x02")
    data[position + 8] |= 1
    source.write_bytes(data)
    assert "password" in refusal(source, into)


# -- hostile submissions ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("../outside", "traversal"),
        ("a/../../outside", "traversal"),
        ("..\\outside", "traversal"),
        ("/tmp/outside", "absolute path"),
        ("C:\\outside", "absolute path"),
        ("Package.xml", "collision"),
        ("package.xml/inside", "collision"),
        ("SRV/x", "collision"),
    ],
)
def test_an_unsafe_name_is_left_out_and_flagged(tmp_path: Path, into: Path, name: str, kind: str):
    opened = open_submission(zipped(tmp_path / "a.zip", {**PACKAGE, name: "evil"}), into)
    assert [flag.kind for flag in opened.flags] == [kind]
    assert opened.flags[0].where
    # Capitals sort first, so of two colliding names the same one is kept for every order in the archive.
    assert len(opened.intake.files) in (len(PACKAGE), len(PACKAGE) - 1)
    assert written_outside(tmp_path, into) == ["a.zip"]


def written_outside(tmp_path: Path, into: Path) -> list[str]:
    return sorted(p.name for p in tmp_path.rglob("*") if not p.is_relative_to(into))


@pytest.mark.parametrize("target", ["/etc/passwd", "../../secret", "srv/../../secret"])
def test_a_link_out_is_left_out_and_flagged(tmp_path: Path, handed_in: Path, into: Path, target: str):
    write(handed_in, PACKAGE)
    (handed_in / "notes.txt").symlink_to(target)
    (handed_in / "folder").symlink_to("/etc")
    opened = open_submission(handed_in, into)
    assert [flag.kind for flag in opened.flags] == ["link", "link"]
    assert opened.intake.files == sorted(PACKAGE)


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE])
def test_a_link_out_of_a_tar_is_flagged_and_nothing_is_written_through_it(tmp_path: Path, into: Path, kind: bytes):
    (tmp_path / "victim").mkdir()
    files = [(member("pkg/" + n), t.encode()) for n, t in PACKAGE.items()]
    link = (member("pkg/door", kind, str(tmp_path / "victim")), b"")
    opened = open_submission(tarred(tmp_path / "a.tar", [link, *files, (member("pkg/door/x"), b"evil")]), into)
    assert "absolute path" in {f.kind for f in opened.flags} or "link" in {f.kind for f in opened.flags}
    assert list((tmp_path / "victim").iterdir()) == []
    assert not any(p.is_symlink() for p in into.rglob("*"))


def test_a_link_within_the_submission_is_noted_but_not_flagged(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    (handed_in / "again.py").symlink_to("ros2_robot_controller/robot_controller.py")
    opened = open_submission(handed_in, into)
    assert opened.flags == ()
    assert opened.intake.notes == [
        "again.py: it is a link to ros2_robot_controller/robot_controller.py and was left out; submit the file itself."
    ]


def test_links_in_a_colcon_build_tree_are_not_flagged(handed_in: Path, into: Path):
    write(handed_in, {**below("src/ctl/"), "install/COLCON_IGNORE": ""})
    (handed_in / "install/setup.py").symlink_to("/home/kim/ws/src/ctl/setup.py")
    assert open_submission(handed_in, into).flags == ()


def test_a_hard_link_within_a_tar_becomes_a_copy(tmp_path: Path, into: Path):
    files = [(member("pkg/" + n), t.encode()) for n, t in PACKAGE.items()]
    source = tarred(tmp_path / "a.tar", [*files, (member("pkg/copy.xml", tarfile.LNKTYPE, "pkg/package.xml"), b"")])
    opened = open_submission(source, into)
    assert (into / "pkg/copy.xml").read_text() == PACKAGE["package.xml"]
    assert (into / "pkg/copy.xml").stat().st_nlink == 1
    assert opened.flags == ()


def test_devices_and_pipes_are_left_out_and_flagged(tmp_path: Path, handed_in: Path, into: Path):
    files = [(member(n), t.encode()) for n, t in PACKAGE.items()]
    odd = [(member("null", tarfile.CHRTYPE), b""), (member("pipe", tarfile.FIFOTYPE), b"")]
    opened = open_submission(tarred(tmp_path / "a.tar", files + odd), into)
    assert [flag.kind for flag in opened.flags] == ["special file"] * 2
    os.mkfifo(write(handed_in, PACKAGE) / "pipe")
    assert [flag.kind for flag in open_submission(handed_in, tmp_path / "b").flags] == ["special file"]


def test_names_with_control_characters_are_kept_readable(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {**PACKAGE, "a\nb\x1b[31m.py": "x = 1\n", "\u202egnp.py": "y = 1\n"})
    opened = open_submission(source, into)
    assert "a%0Ab%1B[31m.py" in opened.intake.files
    assert "%202Egnp.py" in opened.intake.files
    assert all(name.isprintable() for name in opened.intake.files)


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
    opened = open_submission(handed_in, into)
    subprocess.run(["rm", "-rf", handed_in], check=True)  # rmtree would run out of stack
    assert any("too deep" in note for note in opened.intake.notes)
    assert max(name.count("/") for name in opened.intake.files) < 20


def test_a_large_recording_is_left_out_with_a_note(handed_in: Path, into: Path):
    write(handed_in, PACKAGE)
    with (handed_in / "demo.mp4").open("wb") as file:
        file.truncate(31 * 1024**2)
    opened = open_submission(handed_in, into)
    assert opened.intake.notes == ["demo.mp4: it has 31 MB, more than 10 MB, and was left out."]
    assert opened.flags == ()


def test_one_huge_file_packed_small_is_flagged(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {**PACKAGE, "zeros": bytes(40 * 1024**2)})
    assert [flag.kind for flag in open_submission(source, into).flags] == ["bomb"]


def test_many_files_packed_small_are_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {**PACKAGE, **{f"z{i}": bytes(4 * 1024**2) for i in range(5)}})
    assert "like a decompression bomb" in refusal(source, into)


def test_a_packed_tar_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, into: Path):
    header = member("zeros")
    header.size = 8 * 1024**3
    with gzip.open(tmp_path / "a.tgz", "wb", compresslevel=1) as file:
        file.write(header.tobuf())
        for _ in range(300):
            file.write(bytes(1024**2))
    assert "unpacks to more than 250 MB" in refusal(tmp_path / "a.tgz", into)


@pytest.mark.parametrize(
    ("limits", "words"),
    [(SizeLimits(files=5), "holds 6 files, more than 5"), (SizeLimits(total_bytes=100), "more than 0 MB")],
)
def test_a_submission_over_the_limits_is_refused(handed_in: Path, into: Path, limits: SizeLimits, words: str):
    with pytest.raises(SubmissionError, match=words):
        open_submission(write(handed_in, PACKAGE), into, limits)


def test_an_archive_inside_counts_against_the_same_limits(tmp_path: Path, into: Path):
    inner = zipped(tmp_path / "inner.zip", PACKAGE).read_bytes()
    source = zipped(tmp_path / "a.zip", {"i.zip": inner, "j.zip": inner})
    opened = open_submission(source, into, SizeLimits(files=10))
    assert opened.intake.package_path == "i"
    assert any("j.zip was not opened" in note and "more than 2" in note for note in opened.intake.notes)


def test_a_zip_with_too_many_entries_is_not_read(tmp_path: Path, into: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(containers, "MAX_ENTRIES", 50)
    source = zipped(tmp_path / "a.zip", {f"f{i}": "" for i in range(51)})
    monkeypatch.setattr(zipfile.ZipFile, "infolist", lambda _: pytest.fail("the entries were read"))
    assert "more than 50 files" in refusal(source, into)


def test_a_file_longer_than_declared_is_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", {"package.xml": "x" * 1000})
    data = source.read_bytes()
    position = data.index(b"PK\x01\x02")
    source.write_bytes(data[: position + 24] + struct.pack("<I", 10) + data[position + 28 :])
    assert "is damaged" in refusal(source, into)


# -- errors of the grader -----------------------------------------------------------------------------------------


def test_a_target_folder_in_use_is_an_error_of_the_grader_and_unchanged(handed_in: Path, into: Path):
    write(into, {"precious": "x"})
    with pytest.raises(GraderError, match="not an empty folder"):
        open_submission(write(handed_in, PACKAGE), into)
    assert (into / "precious").exists()


def test_a_full_disk_is_an_error_of_the_grader(handed_in: Path, into: Path, monkeypatch: pytest.MonkeyPatch):
    really = os.open

    def full(path: str, flags: int, *rest: int, **more: int) -> int:
        if flags & os.O_CREAT:
            raise OSError(28, "No space left on device")
        return really(path, flags, *rest, **more)

    write(handed_in, PACKAGE)
    monkeypatch.setattr(os, "open", full)
    with pytest.raises(GraderError, match="No space left on device"):
        open_submission(handed_in, into)


def test_a_folder_without_read_permission_is_an_error_of_the_grader(
    handed_in: Path, into: Path, monkeypatch: pytest.MonkeyPatch
):
    """Root can read everything, so the test raises the error itself."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(handed_in))

    write(handed_in, PACKAGE)
    monkeypatch.setattr(os, "fwalk", refuse)
    with pytest.raises(GraderError, match="Make the submission readable"):
        open_submission(handed_in, into)


def test_the_graders_own_output_inside_the_submission_is_left_out(handed_in: Path):
    write(handed_in, PACKAGE)
    opened = open_submission(handed_in, handed_in / "out" / "src")
    assert opened.intake.files == sorted(PACKAGE)


# -- package.xml --------------------------------------------------------------------------------------------------


def test_entities_are_refused_rather_than_expanded(tmp_path: Path):
    bomb = "<!DOCTYPE p [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;'>]><package><name>&b;</name></package>"
    (tmp_path / "package.xml").write_text(bomb)
    assert read_package_xml(tmp_path / "package.xml").problem == "declares a DOCTYPE, which is not allowed"


def test_an_entity_in_utf16_is_refused_too(tmp_path: Path):
    (tmp_path / "package.xml").write_bytes("<!DOCTYPE p SYSTEM '/etc/passwd'><package/>".encode("utf-16"))
    assert "DOCTYPE" in read_package_xml(tmp_path / "package.xml").problem


def test_the_fields_of_package_xml_are_read(tmp_path: Path):
    text = (
        "<?xml version='1.0'?><?xml-model href='x'?><package format='3'><name> a_b </name><depend>rclpy</depend>"
        "<export><build_type>ament_cmake</build_type></export></package>"
    )
    (tmp_path / "package.xml").write_text(text)
    read = read_package_xml(tmp_path / "package.xml")
    assert (read.name, read.format, read.build_type, read.texts("depend")) == ("a_b", "3", "ament_cmake", ["rclpy"])


@given(st.binary(max_size=300))
@settings(max_examples=200)
def test_any_bytes_as_package_xml_give_an_answer(data: bytes):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "package.xml")
        for content in (data, b"<?xml version='1.0' encoding='" + data[:20] + b"'?><package/>"):
            path.write_bytes(content)
            read_package_xml(path)


# -- any input: a Submission or a SubmissionError, and nothing outside `into` -------------------------------------


NAMES = st.lists(
    st.sampled_from(["..", ".", "a", "A", "src", "package.xml", "robot_controller.py", "CMakeLists.txt", "pyvenv.cfg"])
    | st.sampled_from(
        ["COLCON_IGNORE", "share", "build", "x.zip", "\x00", "\n", "é", "e\u0301", "\ud800", "~", "C:", "n" * 260]
    )
    | st.text(max_size=6),
    min_size=1,
    max_size=5,
).map("/".join) | st.sampled_from(["/etc/passwd", "..\\..\\x", "a//b", "./a", "/", ""])
CONTENTS = st.binary(max_size=60) | st.sampled_from(
    [b"<package><name>a</name></package>", b"import rclpy\n", b"PK\x05\x06" + bytes(18)]
)
KINDS = st.sampled_from(
    [
        tarfile.REGTYPE,
        tarfile.REGTYPE,
        tarfile.DIRTYPE,
        tarfile.SYMTYPE,
        tarfile.LNKTYPE,
        tarfile.CHRTYPE,
        tarfile.FIFOTYPE,
        b"S",
        b"x",
        b"L",
    ]
)
ENTRIES = st.lists(st.tuples(NAMES, KINDS, NAMES, CONTENTS), max_size=8)


def as_zip(path: Path, entries: list[tuple[str, bytes, str, bytes]]) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, kind, target, data in entries:
            info = zipfile.ZipInfo(name.encode("utf-8", "replace").decode() or "x")
            modes = {tarfile.SYMTYPE: stat.S_IFLNK, tarfile.CHRTYPE: stat.S_IFCHR, tarfile.FIFOTYPE: stat.S_IFIFO}
            info.external_attr = (modes.get(kind, stat.S_IFREG) | 0o4755) << 16
            archive.writestr(info, os.fsencode(target.replace("\ud800", "")) if kind == tarfile.SYMTYPE else data)


def as_tar(path: Path, entries: list[tuple[str, bytes, str, bytes]]) -> None:
    with tarfile.open(path, "w", format=tarfile.GNU_FORMAT, errors="replace") as archive:
        for name, kind, target, data in entries:
            info = member(name.replace("\x00", ""), kind, target.replace("\x00", ""), 0o4755)
            info.size = len(data) if kind in (tarfile.REGTYPE, b"S", b"x", b"L") else 0
            archive.addfile(info, io.BytesIO(data))


def check_any(make: Callable[[Path], object]) -> Submission | None:
    """Open what `make` writes; check that only the two permitted outcomes occur, and nothing outside `into`."""
    with tempfile.TemporaryDirectory() as folder:
        tmp = Path(folder)
        source, into = tmp / "source", tmp / "deep" / "er" / "into"
        into.parent.mkdir(parents=True)
        make(source)
        before = sorted(tmp.rglob("*"))
        opened, message = None, ""
        try:
            opened = open_submission(source, into)
        except SubmissionError as refused:
            message = str(refused)
        if opened is None:
            assert message.isprintable()
            assert sorted(tmp.rglob("*")) == before
            return None
        assert [path for path in sorted(tmp.rglob("*")) if not path.is_relative_to(into)] == before
        for path in into.rglob("*"):
            mode = path.lstat().st_mode
            assert stat.S_ISREG(mode) or stat.S_ISDIR(mode)
            assert not mode & (stat.S_ISUID | stat.S_ISGID)
        assert opened.package.is_relative_to(into)
        assert opened.package.is_dir()
        assert all(text.isprintable() for text in [*opened.intake.files, *opened.intake.notes, *opened.intake.others])
        return opened


ANY = settings(
    max_examples=int(os.environ.get("KIT_EXAMPLES", "80")), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)


@given(ENTRIES)
@ANY
def test_any_zip_gives_a_submission_or_a_sentence(entries: list[tuple[str, bytes, str, bytes]]):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # by zipfile, for duplicate names
        check_any(lambda path: as_zip(path, entries))


@given(ENTRIES)
@ANY
def test_any_tar_gives_a_submission_or_a_sentence(entries: list[tuple[str, bytes, str, bytes]]):
    check_any(lambda path: as_tar(path, entries))


@given(st.integers(0, 10_000), st.sampled_from(["zip", "tar", "tar.gz", "tar.bz2", "tar.xz"]))
@ANY
def test_a_damaged_archive_gives_a_submission_or_a_sentence(seed: int, form: str):
    """Change bytes of an intact archive, and sometimes truncate it."""
    rng = random.Random(seed)

    def make(path: Path) -> None:
        whole = bytearray(INTACT[form])
        for _ in range(rng.randint(1, 8)):
            whole[rng.randrange(len(whole))] = rng.choice((0, 255, 0x80, rng.randrange(256)))
        path.write_bytes(whole[: rng.choice((len(whole), rng.randrange(1, len(whole))))])

    check_any(make)


@given(st.binary(max_size=400), st.sampled_from([b"PK\x03\x04", b"\x1f\x8b\x08", b"BZh9", b"\xfd7zXZ\x00", b""]))
@ANY
def test_any_bytes_give_a_sentence(data: bytes, magic: bytes):
    assert check_any(lambda path: path.write_bytes(magic + data)) is None


@given(
    st.lists(
        st.tuples(
            st.lists(
                st.sampled_from(["a", "A", "src", "package.xml", "\n", "é", "build", "%0A", "\\"]),
                min_size=1,
                max_size=4,
            ),
            st.sampled_from(["file", "link", "pipe"]),
        ),
        max_size=8,
    )
)
@ANY
def test_any_folder_gives_a_submission_or_a_sentence(entries: list[tuple[list[str], str]]):
    def make(path: Path) -> None:
        path.mkdir()
        for parts, kind in entries:
            place = path.joinpath(*parts)
            with contextlib.suppress(OSError):  # there is a file of that name
                place.parent.mkdir(parents=True, exist_ok=True)
                if kind == "file":
                    place.touch()
                elif kind == "link":
                    place.symlink_to("/etc")
                else:
                    os.mkfifo(place)

    check_any(make)


def _intact() -> dict[str, bytes]:
    plain = io.BytesIO()
    with tarfile.open(fileobj=plain, mode="w") as archive:
        for name, text in PACKAGE.items():
            info = member("pkg/" + name)
            info.size = len(text)
            archive.addfile(info, io.BytesIO(text.encode()))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive_:
        for name, text in PACKAGE.items():
            archive_.writestr("pkg/" + name, text)
    tar = plain.getvalue()
    return {
        "zip": packed.getvalue(),
        "tar": tar,
        "tar.gz": gzip.compress(tar),
        "tar.bz2": bz2.compress(tar),
        "tar.xz": lzma.compress(tar),
    }


INTACT = _intact()
