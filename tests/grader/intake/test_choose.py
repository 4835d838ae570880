"""Of several packages, which is graded and why; or that nothing decides."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import pytest
from helpers.archives import NODE, PACKAGE, XML, below, refusal, write, zipped
from helpers.course import COURSE
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.errors import SubmissionError, UsageError
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


def test_a_package_path_that_does_not_exist_is_told_what_there_is(handed_in: Path, into: Path):
    write(write(handed_in, below("v1/")), below("v2/", CHANGED))
    with pytest.raises(UsageError) as error:
        open_submission(handed_in, into, COURSE, package="v3")
    assert str(error.value) == "There is no package at v3 in handed_in. It has packages at v1, v2."
    assert not into.exists()


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
