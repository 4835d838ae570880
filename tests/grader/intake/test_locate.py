"""Which package of a submission is found, and what is said where there is none."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from helpers.archives import NODE, PACKAGE, XML, below, member, refusal, tarred, write, zipped
from helpers.course import COURSE

from grader.intake.submission import open_submission


@pytest.mark.parametrize("name", ["ros2_robot_controller_interfaces", "robot_msgs"])
def test_a_package_of_the_interfaces_may_have_another_name(handed_in: Path, into: Path, name: str):
    write(handed_in, below("src/ctl/"))
    write(handed_in, {f"src/{name}/package.xml": XML.format(name), f"src/{name}/srv/GetRobotStatus.srv": "---"})
    write(handed_in, {"src/other_msgs/package.xml": XML.format("other_msgs"), "src/other_msgs/srv/Other.srv": "---"})
    opened = open_submission(handed_in, into, COURSE)
    assert (opened.package, opened.interfaces) == (into / "src/ctl", into / "src" / name)
    assert opened.intake.interfaces_package == f"src/{name}"


@pytest.mark.parametrize(
    "made_by_tools",
    [
        {"install/ctl/share/ctl/package.xml": XML.format("ros2_robot_controller"), "install/COLCON_IGNORE": ""},
        {"build/ctl/package.xml": XML.format("ros2_robot_controller"), "build/COLCON_IGNORE": ""},
        {"env/pyvenv.cfg": "", "env/share/rclpy/package.xml": XML.format("rclpy")},
        {"node_modules/a/package.xml": XML.format("ros2_robot_controller")},
        {".git/package.xml": XML.format("ros2_robot_controller")},
        {"off/COLCON_IGNORE": "", "off/package.xml": XML.format("ros2_robot_controller")},
    ],
)
def test_trees_made_by_tools_are_not_searched(handed_in: Path, into: Path, made_by_tools: dict[str, str]):
    write(write(handed_in, below("zz/deep/er/")), made_by_tools)
    opened = open_submission(handed_in, into, COURSE)
    assert opened.intake.package_path == "zz/deep/er"
    assert opened.intake.others == []


def test_a_workspace_that_is_itself_a_virtual_environment_keeps_its_package(handed_in: Path, into: Path):
    write(handed_in, {"ws/pyvenv.cfg": "", "ws/lib/python3.11/site-packages/a.py": NODE, **below("ws/src/ctl/")})
    assert open_submission(handed_in, into, COURSE).intake.package_path == "ws/src/ctl"


def test_a_package_xml_that_is_not_xml_is_noted_and_the_package_is_still_found(handed_in: Path, into: Path):
    write(handed_in, below("ctl/", {**PACKAGE, "package.xml": "<package>\n<name>ctl</package>"}))
    opened = open_submission(handed_in, into, COURSE)
    assert opened.intake.package == "ctl"
    assert opened.intake.notes == ["ctl/package.xml is not XML: mismatched tag: line 2, column 11."]


def test_a_name_in_package_xml_that_is_a_path_is_not_used(handed_in: Path, into: Path):
    write(handed_in, below("ctl/", {**PACKAGE, "package.xml": XML.format("../../etc")}))
    assert open_submission(handed_in, into, COURSE).intake.package == "ctl"


# -- not a submission ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({}, "is empty"),
        ({"README.md": "hello"}, "contains no package.xml"),
        (
            {"package.xml": XML.format("arm"), "src/a.cpp": "int main(){}"},
            "with a node in Python, only arm.",
        ),
        ({"05_moving.ipynb": "{}", "README.md": ""}, "contains only notebooks"),
        ({n: t for n, t in PACKAGE.items() if n != "package.xml"}, "contains no package.xml"),
        ({"team.rar": "Rar!", "README.md": ""}, "archive that was not opened (team.rar)"),
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
