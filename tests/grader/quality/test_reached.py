"""Q1 to Q6 are for the contract's nodes: code without them earns nothing, and code that no node uses helps nobody."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from helpers.course import PACKAGE
from helpers.judging import Check, find
from helpers.quality_examples import (
    CONTROLLER,
    CONVERSIONS,
    PROCESSOR,
    REFERENCE,
    as_it_is,
    facts,
    reference,
    untouched,
    with_flake8,
    written,
)

from grader import KIT
from grader.checks import check_docstrings, check_habits, check_style
from grader.evidence import Quality, SourceFile
from grader.quality.source import PackageText, text_flags
from grader.scoring import rubric
from grader.settings import Settings

pytestmark = pytest.mark.slow  # the linters, for each of many packages

STYLE = check_style.test_ament_flake8_finds_nothing
DOCSTRINGS = check_docstrings.test_public_things_have_docstrings
RULES = check_docstrings.test_docstrings_follow_ament_pep257
CONVERSIONS_USED = find("check_structure::test_conversions_are_in_utils_and_used")
NUMBERS = find("check_habits::test_contract_numbers_are_parameters")
ANNOTATIONS = check_habits.test_public_functions_are_annotated

QUALITY = [
    check.id
    for requirement in rubric.load(KIT / "rubric.yaml").requirements
    if requirement.id in PackageText().serves(Settings(rubric.load(KIT / "rubric.yaml"), Path())) - {"I2"}
    for check in requirement.checks
    if check.id != "check_handed_in::test_demonstration_runs"  # a trial of the nodes shows it
]
PRICED_ELSEWHERE = {  # by what each of these checks looks at
    "check_structure::test_layout_matches_the_contract",
    "check_structure::test_conversions_are_in_utils_and_used",
    "check_habits::test_contract_numbers_are_parameters",
}

TALKER = '''"""Say hello."""

import rclpy
from rclpy.node import Node


class Talker(Node):
    """Say hello twice a second."""

    def __init__(self) -> None:
        """Begin to talk."""
        super().__init__('talker')
        self.create_timer(0.5, self.say)

    def say(self) -> None:
        """Say hello."""
        self.get_logger().info('hello')


def main() -> None:
    """Run the node."""
    rclpy.init()
    rclpy.spin(Talker())
'''
SLOPPY_NODE = """import rclpy
from rclpy.node import Node
class RobotController(Node):
    def __init__( self ):
        super().__init__( 'robot_controller' )
        self.create_timer( 0.1,self.drive )
    def drive( self ):
        self.get_logger( ).info( 'x' )
def main( args=None ):
    rclpy.init( args=args )
    rclpy.spin( RobotController( ) )
"""
CLEAN = '"""Nothing in here is used."""\n\n\n' + "\n\n".join(
    f'def helper_{n}(value: float) -> float:\n    """Return the value and {n}."""\n    return value + {n}\n'
    for n in range(200)
)


def tutorial(folder: Path) -> Path:
    """Return a tutorial's package: clean, with a README and a test, and nothing of the contract."""
    readme = (REFERENCE / "README.md").read_text()
    files: dict[str, str | bytes | None] = {
        "ros2_robot_controller/talker.py": TALKER,
        "ros2_robot_controller/__init__.py": '"""Talk."""\n',
        "test/test_talker.py": "def test_one():\n    assert 1\n",
        "test_results.xml": '<testsuites><testcase classname="test.test_talker" name="test_one"/></testsuites>',
        "README.md": readme,
        "scripts/demo.py": '"""Demonstrate."""\n',
        "package.xml": "<package/>",
    }
    return written(folder, files)


@pytest.mark.parametrize("check", list(map(find, QUALITY)), ids=QUALITY)
def test_code_without_a_module_of_the_contract_earns_nothing(tmp_path: Path, check: Check):
    result = as_it_is(check, with_flake8(tutorial(tmp_path)))
    assert result.share == 0.0
    if result.reached:
        assert "none of the assignment's modules is there" in result.seen


@pytest.mark.parametrize("check_id", sorted(set(QUALITY) - PRICED_ELSEWHERE))
def test_one_of_the_two_nodes_is_half(tmp_path: Path, check_id: str):
    quality = only("robot_controller")
    result = as_it_is(find(check_id), quality)
    if check_id == "check_readme::test_interface_table_agrees":
        quality = replace(quality, interfaces=[i for i in quality.interfaces if i.node == "robot_controller"])
        result = as_it_is(find(check_id), quality)
    assert result.share == 0.5
    assert "sensor_processor is not there, and each of the two nodes is half of these points" in result.seen


def test_the_conversions_alone_are_a_fifth():
    assert as_it_is(DOCSTRINGS, only()).share == 0.2


def only(*nodes: str) -> Quality:
    """Return the facts of the reference as if only these nodes were there."""
    whole = untouched()
    assert whole.reached is not None
    return replace(whole, reached=replace(whole.reached, nodes={name: whole.reached.nodes[name] for name in nodes}))


def test_a_node_that_cannot_be_read_is_there(tmp_path: Path):
    quality = replace(only("robot_controller"), files=[*untouched().files, SourceFile(PROCESSOR, 3, "is not text")])
    assert "is not there" not in as_it_is(STYLE, quality).seen


def test_an_empty_module_is_no_node(tmp_path: Path):
    quality = facts(written(tmp_path, {CONTROLLER: '"""A node, some day."""\n', PROCESSOR: ""}))
    assert quality.reached is not None
    assert quality.reached.nodes == {}


@pytest.mark.parametrize(
    "path",
    [
        "ros2_robot_controller/nodes/robot_controller.py",
        "robot_controller.py",
        "src/my_robot/robot_controller.py",
        "my_robot/robot_controller.py",
    ],
)
def test_a_node_is_found_in_other_folders(tmp_path: Path, path: str):
    quality = facts(written(tmp_path, {path: TALKER}))
    assert quality.reached is not None
    assert list(quality.reached.nodes) == ["robot_controller"]


def test_a_node_is_found_by_its_entry_point(tmp_path: Path):
    setup = "entry_points={'console_scripts': ['sensor_processor = my_robot.fusion:main']}\n"
    quality = facts(written(tmp_path, {"my_robot/fusion.py": TALKER, "setup.py": setup}))
    assert quality.reached is not None
    assert quality.reached.nodes == {"sensor_processor": ["my_robot/fusion.py"]}


def test_a_package_in_a_folder_src_is_followed_through_its_imports(tmp_path: Path):
    """Other good layout."""
    package = reference(tmp_path)
    (package / "src").mkdir()
    (package / "ros2_robot_controller").rename(package / "src" / "ros2_robot_controller")
    quality = facts(package)
    assert quality.reached is not None
    assert quality.reached.idle == {}
    assert as_it_is(NUMBERS, quality).share == as_it_is(CONVERSIONS_USED, quality).share == 1.0


# -- padding ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Padded:
    """A package with padding at a place: what is found in its code, with its tests, and without the padding."""

    place: str
    quality: Quality
    with_tests: Quality
    without: Quality


@pytest.fixture(scope="module", params=["ros2_robot_controller/padding.py", "scripts/padding.py", "more/padding.py"])
def padded(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Padded:
    """Return what is found in a package with a sloppy node, with and without clean code that only a test calls."""
    calls = "from ros2_robot_controller.padding import helper_1\n\n\ndef test_it():\n    assert helper_1(1) == 2\n"
    files = {CONTROLLER: SLOPPY_NODE, PROCESSOR: TALKER, request.param: CLEAN, "test/test_it.py": calls}
    package = written(tmp_path_factory.mktemp("padded"), files)
    with_padding, with_tests = with_flake8(package), facts(package, tests=True)
    (package / request.param).unlink()
    return Padded(request.param, with_padding, with_tests, with_flake8(package))


@pytest.mark.slow  # the linters, for each of many places
@pytest.mark.parametrize("check", [STYLE, DOCSTRINGS, RULES, ANNOTATIONS], ids=lambda check: check.__name__)
def test_clean_code_that_nothing_uses_does_not_make_up_for_a_sloppy_node(padded: Padded, check: Check):
    with_padding, without = as_it_is(check, padded.quality), as_it_is(check, padded.without)
    assert with_padding.share <= without.share < 0.75
    assert "the nodes use" in with_padding.seen


def test_functions_that_nothing_calls_do_not_help_in_a_nodes_own_file(tmp_path: Path):
    whole = SLOPPY_NODE + CLEAN.partition("\n\n\n")[2]
    quality = with_flake8(written(tmp_path, {CONTROLLER: whole, PROCESSOR: TALKER}))
    assert as_it_is(STYLE, quality).share == 0.0
    assert as_it_is(DOCSTRINGS, quality).share < 0.75


def test_a_large_module_weighs_no_more_than_the_nodes(tmp_path: Path):
    """It is used, and clean; the nodes are half of the average all the same."""
    node = "from ros2_robot_controller import helpers\n" + SLOPPY_NODE.replace("'x'", "helpers.all_of_them()")
    uses = "def all_of_them():\n    " + "\n    ".join(f"helper_{n}(1)" for n in range(200)) + "\n"
    files: dict[str, str | bytes | None] = {CONTROLLER: node, "ros2_robot_controller/helpers.py": CLEAN + "\n\n" + uses}
    quality = with_flake8(written(tmp_path, files))
    assert quality.reached is not None
    assert quality.reached.lines["ros2_robot_controller/helpers.py"] > 400
    assert as_it_is(STYLE, quality).share == 0.0
    assert as_it_is(ANNOTATIONS, quality).share < 0.5


def test_a_parameter_that_only_unused_code_reads_is_not_read(tmp_path: Path):
    dead = "\n\ndef unused(node):\n    return node.declare_parameter('fusion_rate', 20.0).value\n"
    quality = facts(written(tmp_path, {CONTROLLER: TALKER + dead, PROCESSOR: TALKER}))
    assert "fusion_rate is not declared" in as_it_is(NUMBERS, quality).seen


def test_a_conversion_that_only_unused_code_calls_is_not_used(tmp_path: Path):
    dead = "\n\ndef unused():\n    return clamp(1, 2, 3)\n"
    node = "from ros2_robot_controller.utils.conversions import clamp\n" + TALKER + dead
    files: dict[str, str | bytes | None] = {CONTROLLER: node, CONVERSIONS: (REFERENCE / CONVERSIONS).read_text()}
    quality = facts(written(tmp_path, files))
    assert "no node calls a function of utils/conversions.py" in as_it_is(CONVERSIONS_USED, quality).seen


def test_padding_is_flagged(padded: Padded):
    flags = [flag for flag in text_flags(padded.with_tests, PACKAGE) if flag.kind == "padding"]
    # A program of its own is not the nodes', and not hidden among their modules.
    assert [flag.where for flag in flags] == [place for place in [padded.place] if not place.startswith("scripts/")]


def test_a_further_node_is_no_padding(tmp_path: Path):
    teleop = TALKER + "\n\n" + "\n\n".join(f"def key_{n}():\n    return {n}\n" for n in range(100))
    quality = facts(reference(tmp_path, files={"ros2_robot_controller/teleop.py": teleop}))
    assert text_flags(quality, PACKAGE) == []


def test_a_helper_module_that_the_nodes_use_costs_nothing(tmp_path: Path):
    """Other good work: one more module, called from a callback."""
    helper = '"""Remember."""\n\n\ndef remember(what: str) -> str:\n    """Return it."""\n    return what\n'
    change = (CONTROLLER, "        changed = {parameter", "        remember('it')\n        changed = {parameter")
    last = "from ros2_robot_controller.utils.running import run\n"
    imports = (CONTROLLER, last, f"from ros2_robot_controller.utils.memory import remember\n{last}")
    files: dict[str, str | bytes | None] = {"ros2_robot_controller/utils/memory.py": helper}
    quality = with_flake8(reference(tmp_path, change, imports, files=files))
    assert quality.reached is not None
    assert quality.reached.lines["ros2_robot_controller/utils/memory.py"] == 2
    assert quality.reached.idle == {}
    for check in (STYLE, DOCSTRINGS, ANNOTATIONS, NUMBERS, CONVERSIONS_USED):
        assert as_it_is(check, quality).share == 1.0, check.__name__
