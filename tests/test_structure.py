"""Who may import whom: no circles between files, no import of a room above, each folder by itself where it must be.

The rooms of `grader` from the top, as docs/architecture.md describes them; a room imports only what stands below it.
Imports inside functions and for typing alone count like all others.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

from grader import KIT

_LISTED = (KIT / "docs" / "architecture.md").read_text(encoding="utf-8").partition("| room | job |")[2]
_ROWS = "\n".join(re.findall(r"^\| (`.*?) \|", _LISTED.partition("\n\n")[0], re.MULTILINE))
ROOMS = (*re.findall(r"`(\w+)(?:/|\.py)`", _ROWS), "")
"""As docs/architecture.md lists them, and then what is in `grader` itself."""

CHECKS_MAY_IMPORT = {"checks", "evidence", "course", "scoring", "errors", "host", "tracebacks", "words", ""}
"""`scoring` for the outcomes, `host` for running pytest; nothing that collects."""

APART = {"template_course", "notebooks", "lessons", "patients"}
"""What lecturers copy, which is loaded as a course and not as a part of the kit; a course's notebooks and lessons."""

ROS = ("rclpy", "rosgraph_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs")

Imports = Mapping[str, set[str]]


def imports(root: Path, *packages: str) -> Imports:
    """Return for each module below `root` the modules of `packages` that it imports, anywhere in its text."""
    files = {
        _name(path.relative_to(root)): path
        for package in packages
        for path in sorted((root / package).rglob("*.py"))
        if not APART & set(path.parts)
    }
    return {name: set(_imported(name, path, files)) - {name} for name, path in files.items()}


def _name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def _imported(name: str, path: Path, known: Iterable[str]) -> Iterable[str]:
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            module = ".".join([*above, *([node.module] if node.module else [])])
            for alias in node.names:
                # A name of a package's __init__ stands for that file; a module of it for itself.
                found = f"{module}.{alias.name}" if f"{module}.{alias.name}" in known else module
                if found in known:
                    yield found


def circle(found: Imports) -> list[str]:
    """Return the modules of a circle of imports, the first one again at the end; [] if there is none.

    A package's __init__ that imports its own modules is loaded before them and makes no circle with them.
    """
    done: set[str] = set()

    def visit(name: str, way: list[str]) -> list[str]:
        if name in way:
            return [*way[way.index(name) :], name]
        if name in done:
            return []
        for other in sorted(found.get(name, ())):
            if around := visit(other, [*way, name]):
                return around
        done.add(name)
        return []

    return next((around for name in sorted(found) if (around := visit(name, []))), [])


def upwards(found: Imports, rooms: tuple[str, ...] = ROOMS) -> list[str]:
    """Return each import of a room above, as "importer -> imported"."""
    level = {room: index for index, room in enumerate(rooms)}
    return [
        f"{name} -> {other}"
        for name, others in sorted(found.items())
        for other in sorted(others)
        if level[_room(other)] < level[_room(name)]
    ]


def _room(module: str) -> str:
    return [*module.split("."), ""][1]


@pytest.fixture(scope="module")
def kit() -> Imports:
    return imports(KIT, "grader", "sim")


def test_no_module_imports_itself_by_way_of_others(kit: Imports):
    around = circle(kit)
    assert not around, " -> ".join(around)


def test_every_room_is_on_the_page_and_imports_none_above(kit: Imports):
    own = _within(kit, "grader", but="grader.ros2")
    new = {_room(name) for name in own} - {*ROOMS}
    assert not new, f"not in the table of rooms in docs/architecture.md: {', '.join(sorted(new))}"
    found = upwards({name: {other for other in others if other in own} for name, others in own.items()})
    assert not found, ", ".join(found)


def test_the_simulator_knows_nothing_of_the_grader(kit: Imports):
    assert _leading_out(_within(kit, "sim"), "sim") == []


def test_ros_is_met_in_two_modules_of_the_simulator_alone():
    met = {
        path.stem
        for path in (KIT / "sim").rglob("*.py")
        if any(f"{kind} {name}" in path.read_text() for kind in ("from", "import") for name in ROS)
    }
    assert met == {"bridge", "messages"}
    assert "import rclpy" not in (KIT / "sim" / "messages.py").read_text()


def test_the_ros2_command_imports_nothing_of_the_kit(kit: Imports):
    """It is mounted alone into sandboxes."""
    assert _leading_out(_within(kit, "grader.ros2"), "grader.ros2") == []


def test_nothing_imports_the_ros2_command(kit: Imports):
    outside = _within(kit, "grader", but="grader.ros2")
    assert [f"{n} -> {o}" for n, others in outside.items() for o in others if o.startswith("grader.ros2")] == []


def _within(found: Imports, top: str, but: str = "-") -> Imports:
    return {name: others for name, others in found.items() if name.startswith(top) and not name.startswith(but)}


def _leading_out(found: Imports, top: str) -> list[str]:
    return [f"{name} -> {other}" for name, others in found.items() for other in others if not other.startswith(top)]


def test_checks_import_nothing_that_collects(kit: Imports):
    found = [
        f"{name} -> {other}"
        for name, others in kit.items() if name.startswith("grader.checks")
        for other in others if _room(other) not in CHECKS_MAY_IMPORT
    ]  # fmt: skip
    assert found == []


def test_a_circle_is_found_and_named(tmp_path: Path):
    (tmp_path / "grader").mkdir()
    (tmp_path / "grader" / "a.py").write_text("def f():\n    from grader import b\n")
    (tmp_path / "grader" / "b.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .a import f\n"
    )
    assert circle(imports(tmp_path, "grader")) == ["grader.a", "grader.b", "grader.a"]


def test_an_import_of_a_room_above_is_found_and_named(tmp_path: Path):
    (tmp_path / "grader" / "host").mkdir(parents=True)
    (tmp_path / "grader" / "pipeline.py").write_text("from grader.host import tools\n")
    (tmp_path / "grader" / "host" / "tools.py").write_text("import grader.pipeline\n")
    assert upwards(imports(tmp_path, "grader")) == ["grader.host.tools -> grader.pipeline"]
