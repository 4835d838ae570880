"""What a requirement needs before it can be tried at all, and words for a package that is not so far. Reads text."""

from __future__ import annotations

import ast
import itertools
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.contract.spec import PACKAGE
from grader.evidence import Build
from grader.notebook import checkpoints

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


@dataclass(frozen=True)
class Gap:
    """What is missing, in the words of a check."""

    seen: str
    expected: str
    try_: str


def first_gap(package: Path, requirement: str, notebook: str = "") -> Gap | None:
    """Return what makes the requirement evidently impossible for the package as it is, None if it can be tried.

    `notebook` is the one at work in ("05"), for the advice.
    """
    wanted = _FILES.get(requirement, _BUILT)
    if not package.is_dir() or not any(_is_written(path) for path in package.iterdir()):
        return Gap("your package is empty", _expected("package.xml"), _where("package.xml", notebook))
    for name in wanted:
        if not (package / name).is_file():
            return Gap(f"there is no {name}", _expected(name), _where(name, notebook))
    modules = [name for name in wanted if name.startswith(f"{PACKAGE}/") and name.endswith(".py")]
    return _broken_module(package, modules, notebook)


def _is_written(path: Path) -> bool:
    return not path.name.startswith(".") and path.name != "__pycache__"


def first_error(found: Build) -> str:
    """Return the first error of a build's log with the lines that explain it."""
    if found.timed_out:
        return "`colcon build` ran out of time"
    if found.exit_code == 0:
        return "`colcon build` went through and installed no package; does CMakeLists.txt end with ament_package()?"
    lines = found.log_tail.splitlines()
    marked = (i for i, line in enumerate(lines) if re.search(r"\bError\b|\berror:|\bERROR\b", line))
    first = next(marked, None)
    if first is None:
        return f"`colcon build` ended with exit status {found.exit_code}"
    # CMake explains an error in the indented lines below it, colcon in the next one.
    explained = itertools.takewhile(lambda line: line.startswith("  ") or not line.strip(), lines[first + 1 :])
    below = [*explained] or (lines[first + 1 : first + 2] if lines[first].endswith(":") else [])
    said = " ".join(line.strip() for line in [lines[first], *below] if line.strip())
    # rosidl's complaint stands at the end of the command that made it.
    said = said[max(0, said.find("Error processing")) :]
    return re.sub(r"/ws/src/[^/\s']+/+|\bsubmission/(?=package\.xml)", "", said)[:500]


def advice(because: str) -> str:
    """Return what to do about something that stood in a check's way."""
    if named := re.search(r"\(([FITQ]\d+)\)", because):
        return f'mend {named.group(1)} first: `check("{named.group(1)}")` says more'
    if "there is no executable" in because:
        return 'install(PROGRAMS ...) in CMakeLists.txt puts it there; `check("I1")` says more'
    if "there is no service" in because or "there is no action" in because:
        return "write the exercise that offers it, and run its cell"
    if "last words" in because:
        return "the node ended by itself; its last words say where"
    return "look at what the node does and prints: `run_node()`, then `run.output`"


def _expected(name: str) -> str:
    return f"{name} in the package's folder"


def _where(name: str, notebook: str) -> str:
    """Return what to do about a missing file: which notebook writes it, and how to get it otherwise."""
    writer = checkpoints.written_in(name)
    if not writer:
        return "write it; the contract's layout is in the handout"
    if writer == notebook:
        return "write it in this notebook's exercise, and run that cell"
    if writer < notebook:
        return f'notebook {writer} writes it; `start_at("{notebook}")` lays out what the earlier notebooks leave'
    return f"notebook {writer} writes it"


def _broken_module(package: Path, names: Sequence[str], notebook: str) -> Gap | None:
    """Return the first module that is no Python or not there, of `names` and of what they import of the package."""
    todo, seen = [*names], set(names)
    while todo:
        name = todo.pop(0)
        tree = _parsed(package, name)
        if isinstance(tree, Gap):
            return tree
        for module in _own_imports(tree):
            path = f"{module.replace('.', '/')}.py"
            if path in seen or (package / path.removesuffix(".py")).is_dir():
                continue
            if not (package / path).is_file():
                seen_words = f"{name} imports {module}, and there is no {path}"
                return Gap(seen_words, _expected(path), _where(path, notebook))
            seen.add(path)
            todo.append(path)
    return None


def _parsed(package: Path, name: str) -> ast.Module | Gap:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # an invalid escape is for the linter to tell
            return ast.parse((package / name).read_bytes(), filename=name)
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        text = (getattr(error, "text", "") or "").strip()
        where = f"{name}, line {line}" if line else name
        said = f"{where}: {getattr(error, 'msg', error)}" + (f": `{text}`" if text else "")
        return Gap(said, "a file that Python can read", "look at that line, and at the end of the one before it")


def _own_imports(tree: ast.Module) -> Iterator[str]:
    """Yield the package's own modules that a module imports when it is loaded; not the generated interfaces."""
    for node in tree.body:
        found: list[str] = []
        if isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            # `from package.utils import motion` names a module by its last part, `from package.driver import Driver`
            # does not: where the first is a folder, the parts are modules or names of its __init__.
            folder = node.module in (PACKAGE, f"{PACKAGE}.utils")
            found = [f"{node.module}.{alias.name}" for alias in node.names] if folder else [node.module]
        for module in found:
            parts = module.split(".")
            if parts[0] == PACKAGE and len(parts) > 1 and parts[1] not in ("msg", "srv", "action"):
                yield module
