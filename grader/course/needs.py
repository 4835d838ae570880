"""What a requirement needs before it can be tried at all, and words for a package that is not so far. Reads text."""

from __future__ import annotations

import ast
import itertools
import re
from dataclasses import dataclass
from pathlib import Path

from grader.build import PACKAGE
from grader.evidence import Build

_CONTROLLER = f"{PACKAGE}/robot_controller.py"
_PROCESSOR = f"{PACKAGE}/sensor_processor.py"
_BUILT = ("package.xml", "CMakeLists.txt")

_FILES: dict[str, tuple[str, ...]] = {
    **{f"F{n}": (*_BUILT, _CONTROLLER) for n in (1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)},
    **{f"F{n}": (*_BUILT, _PROCESSOR) for n in (12, 13)},
    "F14": (*_BUILT, f"{PACKAGE}/utils/conversions.py"),
    "I1": _BUILT,
    "I2": ("package.xml",),
    "I3": (*_BUILT, "msg/SensorFusionData.msg"),
    "I4": (*_BUILT, _CONTROLLER, _PROCESSOR),
    "I5": (*_BUILT, "launch/robot_controller_launch.py", "launch/sensor_processor_launch.py"),
    "I6": (*_BUILT, _CONTROLLER, _PROCESSOR),
    "I7": (*_BUILT, _CONTROLLER, _PROCESSOR),
    "I8": (*_BUILT, _CONTROLLER, _PROCESSOR),
    "T1": (*_BUILT, "test/test_robot_controller.py", "test/test_sensor_processor.py"),
    "T2": (*_BUILT, "test/test_robot_controller.py", "test/test_sensor_processor.py"),
    "T3": (*_BUILT, "test/test_robot_controller.py", "test/test_sensor_processor.py"),
    "Q1": ("package.xml",),
    "Q2": ("package.xml",),
    "Q3": ("package.xml",),
    "Q4": ("package.xml",),
    "Q5": (*_BUILT, "README.md"),
    "Q6": (*_BUILT, "scripts/demo.py"),
}
"""Files of the contract's layout without which a requirement is evidently out of reach."""

_WRITTEN_IN = {
    "package.xml": "01",
    "CMakeLists.txt": "01",
    f"{PACKAGE}/__init__.py": "01",
    _CONTROLLER: "01",
    _PROCESSOR: "01",
    "msg/SensorFusionData.msg": "02",
    f"{PACKAGE}/utils/conversions.py": "03",
    "launch/robot_controller_launch.py": "08",
    "launch/sensor_processor_launch.py": "08",
    "test/test_robot_controller.py": "09",
    "test/test_sensor_processor.py": "09",
    "README.md": "10",
    "scripts/demo.py": "10",
}


@dataclass(frozen=True)
class Gap:
    """What is missing, in the words of a check."""

    seen: str
    expected: str
    try_: str


def first_gap(package: Path, requirement: str) -> Gap | None:
    """Return what makes the requirement evidently impossible for the package as it is, None if it can be tried."""
    if not package.is_dir() or not any(package.iterdir()):
        return Gap("the package is empty", _expected("package.xml"), _where("package.xml"))
    for name in _FILES.get(requirement, _BUILT):
        if not (package / name).is_file():
            return Gap(f"there is no {name}", _expected(name), _where(name))
    return _syntax_error(package, requirement)


def first_error(found: Build) -> str:
    """Return the first error of a build's log with the lines that explain it."""
    if found.timed_out:
        return "`colcon build` ran out of time"
    lines = found.log_tail.splitlines()
    marked = (i for i, line in enumerate(lines) if re.search(r"\bError\b|\berror:|\bERROR\b", line))
    first = next(marked, None)
    if first is None:
        return f"`colcon build` ended with exit status {found.exit_code}"
    below = itertools.takewhile(lambda line: line.startswith("  ") or not line.strip(), lines[first + 1 :])
    said = " ".join(line.strip() for line in [lines[first], *below] if line.strip())
    return said.replace("/ws/src/", "").replace(f"{PACKAGE}/", "", 1)[:500]


def advice(because: str) -> str:
    """Return what to do about something that stood in a check's way."""
    named = re.search(r"\((F|I|T|Q)\d+\)", because)
    if named:
        return f'mend {named.group(0).strip("()")} first: `check("{named.group(0).strip("()")}")` says more'
    if "there is no executable" in because:
        return 'install(PROGRAMS ...) in CMakeLists.txt puts it there; `check("I1")` says more'
    if "there is no service" in because or "there is no action" in because:
        return "write the notebook's exercise that offers it, and run the cell"
    if "last words" in because:
        return "the node ended by itself: its last words name the line"
    return "write the file that does it, then run this cell again"


def _expected(name: str) -> str:
    return f"{name} in the package's folder"


def _where(name: str) -> str:
    notebook = _WRITTEN_IN.get(name)
    return f"notebook {notebook} writes it: run that cell, with your solution in it" if notebook else "write it"


def _syntax_error(package: Path, requirement: str) -> Gap | None:
    """Return the first file that the requirement's node needs and that is no Python."""
    wanted = [package / name for name in _FILES.get(requirement, ()) if name.endswith(".py")]
    if not wanted:
        return None
    module = package / PACKAGE
    helpers = [module / "__init__.py", *sorted((module / "utils").glob("*.py"))]
    for path in [*wanted, *(helper for helper in helpers if helper.is_file())]:
        try:
            ast.parse(path.read_bytes(), filename=path.name)
        except (SyntaxError, ValueError) as error:
            line = getattr(error, "lineno", None)
            where = f"{path.relative_to(package)}{f', line {line}' if line else ''}"
            text = (getattr(error, "text", "") or "").strip()
            said = f"{where}: Python cannot read it: {getattr(error, 'msg', error)}"
            return Gap(said + (f": `{text}`" if text else ""), "a file that Python can read", "look at that line")
    return None
