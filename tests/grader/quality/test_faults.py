"""What the text of a package shows without a build: the reference with one slip each, and the first fault found."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.archives import write
from helpers.course import COURSE, PACKAGE
from helpers.quality_examples import parsed
from submissions.edits import REFERENCE, apply
from variants import VARIANTS, make

from grader.evidence import Fault, SourceFile
from grader.quality import package_sources, source_files
from grader.quality.faults import find_faults
from grader.quality.package_sources import read_sources
from grader.quality.parsed_module import Module

CMAKE, XML = "CMakeLists.txt", "package.xml"
NODE = "ros2_robot_controller/robot_controller.py"
INTERFACES = "ros2_robot_controller_interfaces"


def faults(package: Path, interfaces: Path | None = None) -> list[Fault]:
    modules: list[Module] = []
    unreadable: list[SourceFile] = []
    for source in source_files.find(package, COURSE):
        try:
            modules.append(parsed(source.path, source.data, PACKAGE))
        except ValueError as error:
            unreadable.append(SourceFile(source.path, 0, f"is not valid Python: {error}"))
    return find_faults(read_sources(package, interfaces, COURSE), interfaces, modules, unreadable)


def reference(folder: Path, file: str = "", old: str = "", new: str = "") -> Path:
    """Return a copy of the reference in which `old` is `new` in a file; a `file` without `old` is written."""
    package = apply(None, folder)
    if not file:
        return package
    if not old:
        return write(package, {file: new})
    text = (package / file).read_text()
    assert old in text, f"{old} is not in {file}"
    (package / file).write_bytes(text.replace(old, new).encode())
    return package


@pytest.mark.parametrize(
    ("file", "old", "new", "place", "words", "cure"),
    [
        (CMAKE, "ament_package()\n", "", "CMakeLists.txt", "does not end with `ament_package()`", "last line"),
        (XML, "<build_type>ament_cmake<", "<build_type>ament_python<",
         "package.xml:32", "colcon ignores CMakeLists.txt", "<build_type>ament_cmake</build_type>"),
        ("srv/SetSpeed.srv", "---\n", "", "srv/SetSpeed.srv", "has 0 of the lines `---` between its parts", ""),
        ("srv/SetSpeed.srv", "float32 speed", "float64 speed",
         "srv/SetSpeed.srv:2", "`float64 speed` should be `float32 speed`", "compare it with the contract"),
        ("ros2_robot_controller/extra.py", "", "import no_such_filters\n\nprint(no_such_filters)\n",
         "ros2_robot_controller/extra.py:1", "it imports `no_such_filters`, which is not among the packages that",
         "ask your instructor for it"),
        (NODE, "def main(", "de f main(",
         f"{NODE}:43", "it is not valid Python: invalid syntax", "look at that line"),
        ("scripts/robot_controller", "#!/usr/bin/env python3\n", "",
         "scripts/robot_controller:1", "does not say which program runs it", "#!/usr/bin/env python3"),
        ("scripts/robot_controller", "\n", "\r\n", "scripts/robot_controller:1", "as on Windows", "sed -i"),
        ("config/robot_params.yaml", "/**/robot_controller:", "robot_control:",
         "config/robot_params.yaml:3", "its key is `robot_control`", "robot_controller: or /**:"),
        ("config/robot_params.yaml", "  ros__parameters:\n", "  params:\n",
         "config/robot_params.yaml:5", "not below a `ros__parameters:`", "below it ros__parameters:"),
        ("config/robot_params.yaml", "  ros__parameters:\n", "ros__parameters:\n",
         "config/robot_params.yaml:3", "is below `/**/robot_controller:`", "by two more spaces"),
        ("config/robot_params.yaml", "max_linear_speed: 0.5", "max_linear_speed:0.5",
         "config/robot_params.yaml:6", "no blank after the colon", "max_linear_speed: 0.5"),
        ("config/robot_params.yaml", "    max_linear", "\tmax_linear",
         "config/robot_params.yaml:6", "it is not YAML: a tab", "spaces only"),
        ("config/robot_params.yaml", "max_linear_speed", "max_linear_sped",
         "config/robot_params.yaml:6", "the parameter is called `max_linear_speed`", "max_linear_speed:"),
    ],
)  # fmt: skip
def test_a_slip_is_found_in_the_text(tmp_path: Path, file: str, old: str, new: str, place: str, words: str, cure: str):
    """Each with its file, its line where it has one, and what to do; nothing is built."""
    first = faults(reference(tmp_path, file, old, new))[0]
    assert f"{first.path}:{first.line}".startswith(place)
    assert words in first.text
    assert cure in first.cure


def test_the_reference_has_no_fault():
    assert faults(REFERENCE) == []


@pytest.mark.parametrize("variant", VARIANTS)
def test_an_honest_package_of_another_shape_has_no_fault(tmp_path: Path, variant: str):
    submission = make(VARIANTS[variant], tmp_path)
    interfaces = submission / INTERFACES
    assert faults(submission / REFERENCE.name, interfaces if interfaces.is_dir() else None) == []


PARAMS = "config/robot_params.yaml"
EXTRA = "    max_linear_speed: 0.5\n    max_linear_speed2: 0.5"
LAUNCHES = (
    "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n\nprint(LaunchDescription, Node)\n"
)


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        (PARAMS, "    max_linear_speed: 0.5", EXTRA),
        # I5 needs it: "launch_ros: the assignment needs rclpy and messages only".
        ("ros2_robot_controller/bringup.py", "", LAUNCHES),
        # Imports are absolute: ros2_robot_controller.types is another module than types.
        *((f"ros2_robot_controller/{name}.py", "", '"""Mine."""\n') for name in ("types", "launch", "queue")),
    ],
    ids=["a parameter of one's own", "launch in a module", "types.py", "launch.py", "queue.py"],
)
def test_what_a_package_may_have_is_no_fault(tmp_path: Path, file: str, old: str, new: str):
    assert faults(reference(tmp_path, file, old, new)) == []


def test_types_of_another_package_of_the_submission_are_not_said_to_be_missing_from_it(tmp_path: Path):
    """It may be there: only two packages are built together."""
    text = "from lab_msgs.msg import Map\n\nprint(Map)\n"
    (fault,) = faults(reference(tmp_path, "ros2_robot_controller/extra.py", new=text))
    assert fault.text.endswith("a package of interfaces that is neither installed here nor built with this one")
    assert fault.cure == "if it is yours, hand its interfaces in with the package, in it or beside it in one zip"


def test_a_package_of_interfaces_under_another_name_is_named(tmp_path: Path):
    """The imports ask for one name, and the submission has another."""
    submission = make(VARIANTS["split_interfaces"], tmp_path)
    (submission / INTERFACES).rename(submission / "robot_types")
    xml = submission / "robot_types" / XML
    xml.write_text(xml.read_text().replace(INTERFACES, "robot_types"))
    found = [fault for fault in faults(submission / REFERENCE.name, submission / "robot_types") if fault.line]
    assert found[0].cure == "the package of interfaces is called robot_types: from robot_types.srv import ..."


def test_a_package_of_interfaces_that_was_not_handed_in_is_named(tmp_path: Path):
    package = reference(tmp_path)
    for path in (path for path in package.rglob("*.py") if path.is_file()):
        path.write_text(path.read_text().replace("ros2_robot_controller.srv", f"{INTERFACES}.srv"))
    found = [fault for fault in faults(package) if fault.stops == "start"]
    assert f"it imports `{INTERFACES}`" in found[0].text
    assert "hand its interfaces in with the package" in found[0].cure


def test_the_line_ends_of_a_node_come_before_those_of_the_demonstration(tmp_path: Path):
    package = reference(tmp_path)
    for path in (package / "scripts").iterdir():
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    found = [fault.path for fault in faults(package) if "as on Windows" in fault.text]
    assert found == ["scripts/robot_controller", "scripts/sensor_processor", "scripts/demo.py"]


def test_the_fields_of_a_package_of_interfaces_are_compared_too(tmp_path: Path):
    submission = make(VARIANTS["split_interfaces"], tmp_path)
    interfaces = submission / INTERFACES
    path = interfaces / "srv" / "SetSpeed.srv"
    path.write_text(path.read_text().replace("string message", "string text"))
    first = faults(submission / REFERENCE.name, interfaces)[0]
    assert first.path == f"{INTERFACES}/srv/SetSpeed.srv"
    assert first.text == "`string text` should be `string message`"


def test_cmake_is_read_with_comments_strings_and_blocks():
    text = '#[[ a (\n]]\nproject(robot) # (\nset(FILES a b)\nif(X)\n  install(FILES ${FILES} "c (d")\nendif()\n'
    found = package_sources.commands(text)
    assert [(command.name, command.line) for command in found] == [
        ("project", 3), ("set", 4), ("if", 5), ("install", 6), ("endif", 7),
    ]  # fmt: skip
    assert found[3].arguments == ("FILES", "a", "b", "c (d")


@pytest.mark.slow  # waits for a limit
@pytest.mark.parametrize(
    ("file", "text"),
    [
        (CMAKE, "install(FILES " + "x " * 30_000 + ")"),
        (CMAKE, "project(x)\nset(a b c)\n" + "set(a ${a} ${a})\n" * 60),
        (CMAKE, '"\\' * 15_000),
        ("config/robot_params.yaml", "[" * 2000),
        ("srv/SetSpeed.srv", "float32 x\n" * 20_000),
    ],
    ids=["thirty thousand names", "a variable that doubles", "open strings", "open brackets", "a long message"],
)
def test_a_text_that_is_out_of_all_bounds_is_left_alone_after_a_while(tmp_path: Path, file: str, text: str):
    """Each of these once took minutes, gigabytes or a deep stack."""
    package = reference(tmp_path)
    (package / file).write_text(text)
    assert len(find_faults(read_sources(package, None, COURSE), None, [], [])) <= 50
