"""Make the texts of the files that each notebook adds, and pack them for the students' kit.

The solutions live once, in solution_pkg. Two files look different at an earlier checkpoint: edits below make that
version out of the solution. The files that the course gives live in the notebooks' sources.
"""

from __future__ import annotations

import json
import zlib
from functools import cache

from grader import KIT
from grader.authoring import notebook_source
from grader.course import kits_own
from grader.errors import GraderError
from grader.notebook import checkpoints
from grader.scoring import rubric

PACKAGE = kits_own().package

REFERENCE = KIT / "solution_pkg" / PACKAGE

Edit = tuple[str, str]
"""A text that the solution holds once, and its replacement."""

EDITS: dict[tuple[str, str], tuple[Edit, ...]] = {
    ("01", "CMakeLists.txt"): (
        (
            """\
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(std_msgs REQUIRED)

# 1. The interfaces: rosidl turns these into Python (and C, C++) types.
rosidl_generate_interfaces(${PROJECT_NAME}
  "msg/SensorFusionData.msg"
  "srv/SetSpeed.srv"
  "srv/GetRobotStatus.srv"
  "action/NavigateToPosition.action"
  DEPENDENCIES geometry_msgs std_msgs
)

# 2. Our Python modules, laid over the generated ones.
#    ament_python_install_package() cannot be used here: rosidl already owns a target of this name.
""",
            """\
find_package(ament_cmake REQUIRED)

# 1. The interfaces come here, when there are some.

# 2. Our Python modules.
""",
        ),
    ),
    ("01", "package.xml"): (
        ("  <buildtool_depend>rosidl_default_generators</buildtool_depend>\n", ""),
        ("  <depend>geometry_msgs</depend>\n  <depend>std_msgs</depend>\n\n", ""),
        (
            """\
  <exec_depend>action_msgs</exec_depend>
  <exec_depend>ament_index_python</exec_depend>
  <exec_depend>launch</exec_depend>
  <exec_depend>launch_ros</exec_depend>
  <exec_depend>nav_msgs</exec_depend>
  <exec_depend>rcl_interfaces</exec_depend>
  <exec_depend>rclpy</exec_depend>
  <exec_depend>rosidl_default_runtime</exec_depend>
  <exec_depend>sensor_msgs</exec_depend>
""",
            "  <exec_depend>rclpy</exec_depend>\n",
        ),
        ("  <member_of_group>rosidl_interface_packages</member_of_group>\n\n", ""),
    ),
}
"""How a file of a notebook differs from the solution, by notebook and path."""


def texts(notebook: str) -> dict[str, str]:
    """Return the text of every file that a notebook ("05") adds or replaces, solved.

    Raises:
        GraderError: jupytext is missing, or an edit no longer fits the solution.
    """
    files = checkpoints.checkpoint(notebook)
    given = given_texts(notebook) if files.given else {}
    solved = {path: solution(notebook, path) for path in (*files.exercises, *files.made, *files.optional)}
    return {path: given[path] for path in files.given} | solved


def solution(notebook: str, path: str) -> str:
    """Return the text that an exercise of a notebook ("05") asks for.

    Raises:
        GraderError: an edit no longer fits the solution.
    """
    edits = EDITS.get((checkpoints.number(notebook), path), ())
    return edited((REFERENCE / path).read_text(encoding="utf-8"), edits, path)


def edited(text: str, edits: tuple[Edit, ...], path: str) -> str:
    """Return the text of the file `path` with the edits made.

    Raises:
        GraderError: the solution has changed, and an edit has not.
    """
    for old, new in edits:
        if (count := text.count(old)) != 1:
            raise GraderError(f"An edit of {path} fits the solution {count} times, not once: {old!r}")
        text = text.replace(old, new)
    return text


def given_texts(notebook: str) -> dict[str, str]:
    """Return the files that a notebook gives, as the cells of its source write them."""
    (name,) = notebook_source.select([notebook])
    return dict(_given_texts(name, (notebook_source.SOURCE / f"{name}.py").stat().st_mtime_ns))


@cache
def _given_texts(name: str, _written: int) -> dict[str, str]:
    """Return the files that a notebook gives; to read the sources of all takes more than a second."""
    cells = notebook_source.read(name, rubric.load(rubric.RUBRIC)).cells
    given = [cell for cell in cells if notebook_source.GIVEN in notebook_source.tags(cell)]
    return {path: notebook_source.body(cell) for cell in given if (path := notebook_source.written_file(cell))}


def course_texts() -> dict[str, str]:
    """Return the Python that the course has: the reference's, and what the notebooks give.

    Raises:
        GraderError: jupytext is missing.
    """
    found = {str(path.relative_to(REFERENCE)): path.read_text(encoding="utf-8") for path in REFERENCE.rglob("*.py")}
    for notebook in checkpoints.table():
        if checkpoints.checkpoint(notebook).given:
            found |= {f"{notebook}/{path}": text for path, text in given_texts(notebook).items()}
    return found


def pack() -> bytes:
    """Return the texts of all notebooks as checkpoints.PACKED holds them."""
    found = {checkpoints.number(notebook): texts(notebook) for notebook in checkpoints.table()}
    return zlib.compress(json.dumps(found).encode(), level=9)
