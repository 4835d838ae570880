"""No module of the engine holds a name, a type, a parameter, a path or a requirement of the kit's own course.

Docstrings are left out; they may give examples.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path, PurePosixPath

from helpers.course import COURSE, NODE_TESTS

from grader import KIT
from grader.scoring import rubric

FIELD = re.compile(r"^[\w/]+(?:\[.*\])? +([a-z]\w*)", re.MULTILINE)
# Names that others gave to things of their own, which the contract has, too.
NOT_THE_COURSES = {
    "linear_acceleration",  # a field of sensor_msgs/Imu
    "normalize_angle",  # sim has a function of this name for itself
    "angular_velocity",  # likewise
    *("header", "pose", "message", "status", "success"),  # fields of ROS's own types
    *("speed", "tolerance"),  # what every robot has, and every goal
    *("odom", "scan", "state", "data", "imu", "battery"),  # what every robot has
}
OF_A_SIMULATOR = {"cmd_vel"}  # ROS's usual name, by which the simulator offers its robot
OWN = ("grader/courses/", "grader/authoring/template_c", "grader/ros2/")


@cache
def words_of_the_course() -> set[str]:
    """Return what a module may not hold: names of the contract and of its files, and requirements' ids."""
    paths = [PurePosixPath(path).name.split(".")[0] for path in (*COURSE.modules, *COURSE.shared, *NODE_TESTS)]
    types = [type_.partition("/")[2] for type_ in COURSE.interfaces]
    parameters = [name for node in COURSE.nodes.values() for name in node.parameters]
    files = [COURSE.contract / COURSE.interface_file(type_) for type_ in COURSE.interfaces]
    fields = [name for file in files for name in FIELD.findall(file.read_text())]
    names = {
        *fields,
        COURSE.package,
        *COURSE.nodes,
        *COURSE.topics,
        *paths,
        *types,
        *parameters,
        *(COURSE.functions.names if COURSE.functions else ()),
    }
    return {word for name in names for word in name.split("/")} - NOT_THE_COURSES


@cache
def requirements() -> set[str]:
    """Return the requirements' ids. Of these flake8's rules look like some, so they count in strings alone."""
    return {requirement.id for requirement in rubric.load(COURSE.rubric).requirements}


def held(text: str) -> set[str]:
    """Return the course's words that a module's code holds."""
    tree = ast.parse(text)
    bodies = [body for node in ast.walk(tree) if isinstance(body := getattr(node, "body", None), list)]
    docstrings = {id(part.value) for body in bodies for part in body if isinstance(part, ast.Expr)}
    said = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docstrings]
    strings = [str(node.value) for node in said if isinstance(node.value, str)]
    found = {word for node in ast.walk(tree) for word in _names(node)} & words_of_the_course()
    found |= {word for string in strings for word in re.findall(r"\w+", string)} & words_of_the_course()
    return found | ({word for string in strings for word in re.findall(r"\w+", string)} & requirements())


def _names(node: ast.AST) -> Iterator[str]:
    for field in ("id", "attr", "arg", "name"):
        yield from re.findall(r"\w+", str(getattr(node, field, None) or ""))
    yield from (getattr(node, "module", None) or "").split(".")


def modules() -> list[Path]:
    files = [path for room in ("grader", "sim") for path in sorted((KIT / room).rglob("*.py"))]
    return [path for path in files if not path.relative_to(KIT).as_posix().startswith(OWN)]


def test_no_module_of_the_engine_holds_anything_of_a_course():
    found = {path.relative_to(KIT).as_posix(): held(path.read_text()) for path in modules()}
    found = {path: words - (OF_A_SIMULATOR if path.startswith("sim/") else set()) for path, words in found.items()}
    found = {path: words for path, words in found.items() if words}
    assert not {path: sorted(words) for path, words in found.items()}


def test_a_name_that_is_put_in_by_hand_is_found():
    assert held('"""About set_speed."""\nX = 1\n') == set()
    assert held("def f():\n    'F4 asks for set_speed.'\n    return 1\n") == set()
    assert held('if plan.node == "robot_controller": pass\n') == {"robot_controller"}
    assert held("from x.interfaces import SetSpeed\n") == {"SetSpeed"}
    assert held('serves = {"F14"}\n') == {"F14"}
    assert held('path = "config/robot_params.yaml"\n') == {"robot_params"}
