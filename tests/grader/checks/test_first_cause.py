"""What is said of a package that does not build, or whose node does not come up: the first cause first, with a cure."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.course import LAYOUT
from helpers.judging import ask, evidence_with, trial

from grader.checks import (
    check_build,
    check_interfaces,
    check_launch,
    check_package_xml,
    check_parameters,
    check_structure,
)
from grader.checks.wording import listing
from grader.courses.robot_controller.checks import check_set_speed
from grader.evidence import (
    Build,
    Call,
    Evidence,
    Fault,
    Finding,
    Graph,
    Kind,
    Manifest,
    ParameterAnswer,
    ProcessEnd,
    Quality,
    Reason,
    SourceFile,
)
from grader.notebook.prerequisites import advice

LOGS = Path(__file__).parent / "build_logs"
NOT_CMAKE = Fault("package.xml", 32, "build", "it says `ament_python`, so colcon ignores CMakeLists.txt",
                  "<build_type>ament_cmake</build_type>", shown_as=["can't open file 'setup.py'"])  # fmt: skip
DIFFERS = Fault("srv/SetSpeed.srv", 2, "interfaces", "`float64 speed` should be `float32 speed`", "compare it")
IGNORED = replace(NOT_CMAKE, stops="install", lacks=["config/robot_params.yaml"])
IMPORT = Fault("ros2_robot_controller/driver.py", 7, "start", "it imports `scan_tools`, which is not installed here",
               "do without it", shown_as=["No module named 'scan_tools'"])  # fmt: skip
KEY = Fault("config/robot_params.yaml", 3, "parameters", "its key is `robot_control`, and the node is called "
            "`robot_controller`", "robot_controller: or /**: as the key above ros__parameters")  # fmt: skip

NOT_THERE = Reason(Kind.NO_FILE, "config/robot_params.yaml", "team_robot")


def text(*faults: Fault, cmake: bool = True, habits: tuple[Finding, ...] = ()) -> Quality:
    return Quality(Manifest(found=True, has_cmake=cmake), faults=list(faults), habits=list(habits))


def unbuilt(log: str, *faults: Fault, exit_code: int = 1) -> Evidence:
    build = Build(ok=False, cached=False, wall_seconds=3.0, exit_code=exit_code, timed_out=False, log_tail=log)
    return evidence_with(build=build, quality=text(*faults))


# -- nothing builds ---------------------------------------------------------------------------------------------------


def test_the_first_cause_in_the_text_leads_where_the_log_agrees():
    log = "Traceback (most recent call last):\npython3: can't open file 'setup.py': [Errno 2]\nValueError: no\n"
    said = ask(check_build.test_colcon_build_succeeds, unbuilt(log, IGNORED, NOT_CMAKE, IMPORT))
    first, second, *rest = said.seen.splitlines()
    assert first == "package.xml:32: it says `ament_python`, so colcon ignores CMakeLists.txt"
    assert second.startswith("colcon build ended with exit status 1: ")
    assert said.try_ == NOT_CMAKE.cure
    assert "ros2_robot_controller/driver.py:7" in "".join(rest)


def test_the_log_leads_where_it_is_about_something_else():
    log = (LOGS / "no_find_geometry.txt").read_text()
    said = ask(check_build.test_colcon_build_succeeds, unbuilt(log, NOT_CMAKE))
    assert said.seen.startswith("colcon build ended with exit status 1: CMake Error at CMakeLists.txt:9")
    assert said.try_ == "find_package(geometry_msgs REQUIRED) before rosidl_generate_interfaces"
    assert "its text shows besides:\n  package.xml:32: it says" in said.seen


def test_a_build_without_a_word_of_error_is_explained_by_the_text():
    ends = Fault("CMakeLists.txt", 0, "build", "it does not end with `ament_package()`", "write it as its last line")
    said = ask(check_build.test_colcon_build_succeeds, unbuilt("Summary: 1 package finished\n", ends, exit_code=0))
    assert said.seen.startswith("CMakeLists.txt: it does not end with `ament_package()`")
    assert "exit status 0" not in said.seen
    assert said.try_ == "write it as its last line"


def test_fields_that_differ_are_named_without_a_build():
    said = ask(check_interfaces.test_type_hashes_match_the_contract, unbuilt("", NOT_CMAKE, DIFFERS))
    assert not said.reached
    assert "srv/SetSpeed.srv:2: `float64 speed` should be `float32 speed`" in said.seen
    assert "ament_python" not in said.seen


def test_interfaces_that_nobody_has_written_are_not_to_be_compared():
    contract = {"srv/SetSpeed": "a"}
    evidence = evidence_with(quality=text(cmake=False))
    said = ask(check_interfaces.test_type_hashes_match_the_contract,
               replace(evidence, build=replace(evidence.build, contract_hashes=contract)))  # fmt: skip
    assert said.try_ == "write srv/SetSpeed.srv as the contract says, in a package with a CMakeLists.txt"


def test_faults_of_parameter_files_are_named_without_a_build():
    loaded = ask(FILES, unbuilt("", KEY))
    assert "config/robot_params.yaml:3: its key is `robot_control`" in loaded.seen


# -- no node comes up -------------------------------------------------------------------------------------------------


SPEED, FILES = check_set_speed.test_drives_at_the_set_speed, check_parameters.test_parameter_files_load
TAB = Fault("config/robot_params.yaml", 6, "parameters", "it is not YAML: a tab", "indent with spaces only",
            shown_as=["config/robot_params.yaml"])  # fmt: skip
NO_TOOLS = "Traceback (most recent call last):\nModuleNotFoundError: No module named 'scan_tools'\n"
NO_PARAMS = "RCLError: Couldn't parse params file: '--params-file /ws/install/share/p/config/robot_params.yaml'."
DIED_EARLY = Reason(Kind.DIED_EARLY, exit_code=1)


@pytest.mark.parametrize(
    ("check", "name", "ended", "output", "faults", "words"),
    [
        (SPEED, "drive_forward", DIED_EARLY, NO_TOOLS, (IGNORED, IMPORT),
         ["^ros2_robot_controller/driver.py:7: it imports `scan_tools`", "its last output was: ModuleNotFoundError"]),
        (FILES, "file_robot_controller", DIED_EARLY, NO_PARAMS, (IMPORT, TAB),
         ["^config/robot_params.yaml:6: it is not YAML: a tab \\(indent with spaces only\\); the node"]),
        # I6 once said only that the node had ended.
        (FILES, "file_robot_controller", NOT_THERE, "", (IGNORED,),
         ["^package.xml:32: it says `ament_python`, so colcon ignores CMakeLists.txt \\(<build_type>"]),
        # I6 told to install it with install(DIRECTORY ...).
        (FILES, "file_robot_controller", NOT_THERE, "", (), ["; config/robot_params.yaml is not in the package$"]),
    ],
    ids=["an import", "not YAML", "not installed", "not written"],
)  # fmt: skip
def test_a_node_that_does_not_come_up_is_explained_by_the_text_first(check, name, ended, output, faults, words):
    end = ProcessEnd("itself", 1, 1.0, output) if output else None
    down = trial(name, ready=False, ended=ended, process=end)
    said = ask(check, evidence_with(trials={name: down}, quality=text(*faults)))
    assert all(re.search(pattern, said.seen) for pattern in words), said.seen
    assert faults or advice(said.reason).startswith("write it")


def test_a_relative_path_is_why_a_launch_file_sets_no_parameters():
    output = "[WARNING] [launch_ros.actions.node]: Parameter file path is not a file: config/robot_params.yaml\n"
    ran = trial("launch_robot_controller", launch="robot_controller_launch.py", in_files={"safety_margin": 0.4},
                parameters=[ParameterAnswer(0.1, "safety_margin", value=0.3, node="robot_controller")],
                process=ProcessEnd("us", None, 9.0, output))  # fmt: skip
    evidence = evidence_with(trials={"launch_robot_controller": ran}, quality=text())
    said = ask(check_launch.test_parameters_come_from_the_yaml_files, evidence)
    assert said.seen.startswith("Parameter file path is not a file: config/robot_params.yaml\nsafety_margin was 0.4")
    assert said.try_.startswith("os.path.join(get_package_share_directory(")


def test_a_node_that_came_up_under_another_name_is_asked_for_its_name():
    ended = Reason(Kind.NOT_UP, "robot_controller", seconds=30.0, nodes=("driver",))
    down = trial("drive_forward", ready=False, ended=ended, graph=Graph(nodes=["driver"]))
    said = ask(SPEED, evidence_with(trials={"drive_forward": down}))
    assert said.seen.startswith(f"{ended}; is `driver` its name? super().__init__('robot_controller')")


# -- hints ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("check", "cmake", "tool"),
    [
        (check_build.test_executables_are_installed, True, "install(P"),
        (check_build.test_executables_are_installed, False, "entry_points in setup.py"),
        (check_build.test_shared_files_are_installed, True, "install(DIRECTORY"),
        (check_build.test_shared_files_are_installed, False, "data_files in setup.py"),
    ],
)
def test_what_is_not_installed_is_explained_by_what_builds_the_package(check, cmake: bool, tool: str):
    """A package with setup.py was once told of install(PROGRAMS ...)."""
    said = ask(check, evidence_with(quality=replace(text(cmake=cmake), paths=list(LAYOUT))))
    assert said.try_.startswith(tool)
    assert cmake or "install(" not in said.try_


def test_a_package_without_a_build_type_is_told_so():
    """It was once told that "<build_type> is none"."""
    said = ask(check_package_xml.test_build_type_matches_the_package, evidence_with(quality=text()))
    assert said.seen == "package.xml names no build type, and there is a CMakeLists.txt"
    assert said.try_.startswith("<export><build_type>ament_cmake</build_type></export>")


@pytest.mark.parametrize(
    "check",
    [
        check_package_xml.test_licence_has_its_spdx_name,
        check_package_xml.test_build_type_matches_the_package,
        check_package_xml.test_every_package_used_is_declared,
    ],
)
def test_a_package_xml_that_cannot_be_read_is_not_told_that_everything_is_missing(check):
    broken = "package.xml is not XML: mismatched tag: line 14, column 20"
    manifest = Manifest(found=True, problems=[broken], has_cmake=True, used={"rclpy": ["a.py:1"]})
    said = ask(check, evidence_with(quality=Quality(manifest)))
    assert (said.share, said.reached, said.seen) == (0.0, False, broken)


def test_a_parameter_that_is_not_declared_is_named_with_its_declaration():
    answers = [ParameterAnswer(0.1, "max_linear_speed", value=0.5), ParameterAnswer(0.1, "safety_margin")]
    trials = {
        "file_robot_controller": trial("file_robot_controller", parameters=answers),
        "file_sensor_processor": trial("file_sensor_processor", node="sensor_processor"),
    }
    said = ask(FILES, evidence_with(trials=trials))
    assert said.seen == "not declared: robot_controller: safety_margin"
    assert said.try_.startswith("self.declare_parameter('safety_margin', 0.3)")


def test_a_refusal_for_want_of_a_declaration_is_not_taken_for_a_callback_that_is_too_strict():
    good = ParameterAnswer(0.1, "max_linear_speed", 0.375, accepted=False,
                           reason="('Invalid access to undeclared parameter(s)', ['max_linear_speed'])")  # fmt: skip
    trials = {"senseless_settings_robot_controller": trial("senseless_settings_robot_controller", parameters=[good])}
    said = ask(check_parameters.test_invalid_values_are_refused_at_run_time, evidence_with(trials=trials))
    assert said.try_.startswith("self.declare_parameter('max_linear_speed', 0.5)")


def test_a_key_of_another_node_is_named_with_its_line():
    answers = [ParameterAnswer(0.1, "max_linear_speed", value=0.5)]
    trials = {
        "file_robot_controller": trial(
            "file_robot_controller", parameters=answers, in_files={"max_linear_speed": 0.375}
        ),
        "file_sensor_processor": trial("file_sensor_processor", node="sensor_processor"),
    }
    said = ask(FILES, evidence_with(trials=trials, quality=text(KEY)))
    assert said.seen.startswith("config/robot_params.yaml:3: its key is `robot_control`")
    assert said.try_ == KEY.cure


def test_what_would_crash_is_listed_before_findings_of_style():
    """An undefined name once stood below "and 8 more"."""
    style = [Finding("a.py", number, rule, "text") for rule in ("E501", "W291", "E302", "Q000") for number in range(5)]
    shown = listing([*style, Finding("a.py", 9, "F821", "undefined name 'spede'")])
    assert shown.startswith("F821: ")
    assert "a.py:9 undefined name 'spede'" in shown


@pytest.mark.parametrize(
    ("rule", "words"),
    [("loop-in-callback", "`while` in the callback `on_scan`"), ("sleep-in-callback", "`time.sleep` in the callback")],
)
def test_a_callback_that_does_not_return_is_named_where_the_node_does_not_answer(rule: str, words: str):
    call = Call(0.5, "set_speed", {"speed": 0.25}, None, problem=Reason(Kind.NO_ANSWER, "set_speed", seconds=2.0))
    graph = Graph(services={"set_speed": ["ros2_robot_controller/srv/SetSpeed"]})
    deaf = trial("drive_forward", calls=[call], process=ProcessEnd("us", None, 9.0, ""), graph=graph)
    habit = Finding("ros2_robot_controller/robot_controller.py", 88, rule, f"{words} `on_scan`")
    said = ask(SPEED, evidence_with(trials={"drive_forward": deaf}, quality=text(habits=(habit,))))
    assert said.seen.startswith("no answer within 2 s; while a callback runs the node answers nothing")
    assert f"ros2_robot_controller/robot_controller.py:88 {words}" in said.seen


def test_a_service_of_another_definition_is_why_nobody_can_call_it():
    """`float64 speed` in SetSpeed.srv gave "no answer within 2 s" for F2 and F3, and nothing led to I3."""
    call = Call(0.5, "set_speed", {"speed": 0.25}, None, problem=Reason(Kind.NO_ANSWER, "set_speed", seconds=2.0))
    evidence = evidence_with(trials={"drive_forward": trial("drive_forward", calls=[call])})
    build = replace(evidence.build, type_hashes={"srv/SetSpeed": "b"}, contract_hashes={"srv/SetSpeed": "a"})
    said = ask(SPEED, replace(evidence, build=build))
    assert said.seen == "no answer within 2 s: srv/SetSpeed differs from the contract, so nobody else can call it (I3)"


def test_a_near_miss_is_no_file_that_has_its_own_place():
    """What is missing is not meant by a file of the layout that is there; a misplaced one is."""
    own = {"test/test_robot_controller.py", "config/sensor_params.yaml", "msg/SensorFusionData.msg"}
    paths = sorted((set(LAYOUT) - {"config/robot_params.yaml"} - own) | {"params/sensor-params.yaml", *own})
    node = SourceFile("ros2_robot_controller/robot_controller.py", 9, "", 3, [[4, 9]])
    there = replace(text(), files=[node], paths=paths)
    said = ask(check_structure.test_layout_matches_the_contract, evidence_with(quality=there))
    assert said.seen == "missing: config/robot_params.yaml"
    elsewhere = replace(there, paths=sorted({*paths, "params/robot_params.yaml"}))
    said = ask(check_structure.test_layout_matches_the_contract, evidence_with(quality=elsewhere))
    assert said.seen == "missing: config/robot_params.yaml; perhaps meant: params/robot_params.yaml"
