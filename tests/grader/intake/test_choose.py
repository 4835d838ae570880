"""Which package of a submission is found and graded, and why; what is said where there is none, or nothing decides."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import pytest
from helpers.archives import NODE, PACKAGE, XML, below, refusal, write, zipped
from helpers.course import COURSE
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.errors import SubmissionError
from grader.intake.submission import Submission, open_submission


def package(name: str, *modules: str, nodes: int = 0) -> dict[str, str]:
    """Return a package with these modules and `nodes` nodes of other names."""
    files = {f"src/{module}.py": NODE for module in modules} | {f"src/node{n}.py": NODE for n in range(nodes)}
    return {"package.xml": XML.format(name), "setup.py": "", "src/helper.py": "", **files}


BOTH = ("robot_controller", "sensor_processor")


@pytest.mark.parametrize(
    ("chosen", "other", "because"),
    [
        (package("ros2_robot_controller"), package("nav2_bringup", *BOTH), "the assignment asks for"),
        (package("team07", *BOTH), package("ros2_robot_control", nodes=40), "the only one with modules of the"),
        (package("ros2_robot_controller", *BOTH), package("ros2_robot_controller"), "the only one with modules of the"),
    ],
)
def test_the_name_decides_and_then_the_modules(
    handed_in: Path, into: Path, chosen: dict[str, str], other: dict[str, str], because: str
):
    write(write(handed_in, below("v2/", chosen)), below("v1/", other))
    intake = open_submission(handed_in, into, COURSE).intake
    assert intake.package_path == "v2"
    assert because in intake.chosen_because
    assert [path.partition(" ")[0] for path in intake.others] == ["v1"]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (package("rosject1", nodes=1), package("rosject2", nodes=2)),
        (package("robot1", *BOTH), package("robot2", *BOTH)),
        (package("ros2_robot_controller", nodes=1), package("ros2_robot_controller", nodes=2)),
    ],
)
def test_of_several_none_is_guessed(handed_in: Path, into: Path, one: dict[str, str], other: dict[str, str]):
    write(write(handed_in, below("v2/", one)), below("v1/", other))
    names = [files["package.xml"].partition("<name>")[2].partition("</name>")[0] for files in (other, one)]
    assert refusal(handed_in, into) == (
        f"handed_in holds 2 packages, and nothing tells which is meant: v1 ({names[0]}), v2 ({names[1]}). Hand in one "
        "of them, or choose with `grader grade --package-path PATH`; in a class `package: PATH` in overrides.yaml "
        "chooses. `grader batch` grades the packages of several people."
    )
    assert open_submission(handed_in, into, COURSE, package="v2").intake.package_path == "v2"


def test_a_package_of_messages_with_a_likely_name_is_not_the_package(handed_in: Path, into: Path):
    messages = {"package.xml": XML.format("ros2_robot_controller_msgs"), "msg/A.msg": "int32 a"}
    write(write(handed_in, below("msgs/", messages)), below("mine/", package("my_robot", nodes=1)))
    intake = open_submission(handed_in, into, COURSE).intake
    assert intake.package_path == "mine"
    assert intake.chosen_because == "it is the only ROS 2 Python package that colcon finds"
    assert intake.others == ["msgs (ros2_robot_controller_msgs)"]


# -- inside a package -----------------------------------------------------------------------------------------------


def test_a_package_inside_a_package_is_not_found_as_colcon_does_not_find_it(handed_in: Path, into: Path):
    write(write(handed_in, below("team/", package("my_robot", *BOTH))), below("team/old/"))
    intake = open_submission(handed_in, into, COURSE).intake
    assert intake.package_path == "team"
    assert intake.others == ["team/old (ros2_robot_controller; inside team, where colcon does not look)"]


def test_a_package_inside_a_folder_with_nothing_but_a_package_xml_is_found_with_a_note(handed_in: Path, into: Path):
    write(write(handed_in, {"package.xml": XML.format("ws")}), below("src/ctl/"))
    intake = open_submission(handed_in, into, COURSE).intake
    assert intake.package_path == "src/ctl"
    assert intake.notes == ["src/ctl lies inside the package ., where colcon does not look."]


def test_a_package_of_interfaces_inside_the_package_is_still_used(handed_in: Path, into: Path):
    name = "ros2_robot_controller_interfaces"
    write(write(handed_in, PACKAGE), below("msgs/", {"package.xml": XML.format(name), "srv/SetSpeed.srv": "---"}))
    assert open_submission(handed_in, into, COURSE).intake.interfaces_package == "msgs"


# -- copies ---------------------------------------------------------------------------------------------------------

CHANGED = {**PACKAGE, "README.md": "another"}


@pytest.mark.parametrize("path", ["v2/ros2_robot_controller", "./v2/ros2_robot_controller/package.xml"])
def test_the_package_path_decides(handed_in: Path, into: Path, path: str):
    write(write(handed_in, below("v1/ros2_robot_controller/")), below("v2/ros2_robot_controller/", CHANGED))
    intake = open_submission(handed_in, into, COURSE, package=path).intake
    assert intake.package_path == "v2/ros2_robot_controller"
    assert intake.chosen_because == "`--package-path` names it"


def test_the_package_path_reaches_into_an_archive_beside_a_package(handed_in: Path, into: Path):
    zipped(write(handed_in, below("ctl/")) / "new.zip", below("pkg/", CHANGED))
    assert open_submission(handed_in, into, COURSE, package="new/pkg").intake.package_path == "new/pkg"


# -- where it is looked for --------------------------------------------------------------------------------------------


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
        ({"package.xml": XML.format("arm"), "msg/A.msg": "int32 a"}, "with a node in Python, only arm."),
        ({"package.xml": XML.format("arm"), "launch/a.launch.py": "", "setup.py": ""}, "nodes in Python"),
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


def test_a_zip_with_a_password_is_refused(tmp_path: Path, into: Path):
    source = zipped(tmp_path / "a.zip", PACKAGE)
    data = bytearray(source.read_bytes())
    position = data.index(b"PK\x01\x02")
    data[position + 8] |= 1
    source.write_bytes(data)
    assert "password" in refusal(source, into)


# -- any ------------------------------------------------------------------------------------------------------------

PLACES = ["a", "b", "ros2_robot_controller", "a/ros2_robot_controller", "b/src", "b/src/c", "src/ros2_robot_controller"]
NAMES = ["ros2_robot_controller", "robot_controller", "nav2", "ros2_robot_controller_interfaces"]
KINDS = [
    {},
    {"n/robot_controller.py": NODE},
    {"n/robot_controller.py": NODE, "n/sensor_processor.py": NODE},
    {"n/node.py": NODE},
    {"src/main.cpp": ""},
    {"msg/A.msg": ""},
]
TREES = st.dictionaries(
    st.sampled_from(PLACES), st.tuples(st.sampled_from(NAMES), st.sampled_from(KINDS)), min_size=1, max_size=5
)


def outcome(files: dict[str, str | bytes]) -> Submission | str:
    folder = Path(tempfile.mkdtemp())
    try:
        return open_submission(zipped(folder / "a.zip", files), folder / "into", COURSE)
    except SubmissionError as refused:
        return str(refused)
    finally:
        shutil.rmtree(folder)


@given(TREES)
@settings(max_examples=40)
def test_a_package_of_the_right_name_with_its_modules_is_never_passed_over(trees: dict[str, tuple]):
    """A package of that name is graded, or several are named between which nothing decides."""
    files = {
        f"{place}/{path}": text
        for place, (name, more) in trees.items()
        for path, text in {"package.xml": XML.format(name), **more}.items()
    }
    mine = "mine/ctl"
    found = outcome({**files, **below(f"{mine}/")})
    if isinstance(found, str):
        assert "nothing tells which is meant" in found
    else:
        assert found.intake.package == "ros2_robot_controller"
