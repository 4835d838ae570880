"""Edits by attacks that a text alone does not describe; on_*.yaml calls them by name."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import yaml
from helpers import beside

from grader.course import kits_own
from grader.intake.package_edits import append, put

TEXTS = beside(__file__)

PACKAGE = kits_own().package
NODES = tuple(kits_own().nodes)


def pack_the_nodes(package: Path) -> None:
    """Put a copy of the modules into an archive with the name of a data file, which runs the node that it is told."""
    (package / "data").mkdir()
    with zipfile.ZipFile(package / "data" / "table", "w") as archive:
        for path in sorted((package / PACKAGE).rglob("*.py")):
            archive.write(path, path.relative_to(package))
        archive.writestr(
            "__main__.py",
            f"import importlib\nimport sys\nimport {PACKAGE}\n"
            f"{PACKAGE}.__path__.insert(0, sys.path[0] + '/{PACKAGE}')\n"
            f"importlib.import_module('{PACKAGE}.' + sys.argv.pop(1)).main()\n",
        )


def hide_the_nodes_in_yaml(package: Path) -> None:
    """Move the modules' text into a parameter file that its reader runs, and leave a tidy module for each node."""
    modules = [path for path in sorted((package / PACKAGE).rglob("*.py")) if path.name != "__init__.py"]
    texts = {".".join(path.relative_to(package).with_suffix("").parts): path.read_text() for path in modules}
    text = yaml.safe_dump([TEXTS["_BOOT"].replace("TEXTS", repr(texts)), {}])
    (package / "config" / "core.yaml").write_text(f"!!python/object/apply:builtins.exec\n{text}")
    for name in NODES:
        (package / "scripts" / name).write_text(TEXTS["_READS_YAML"].replace("NODE", name))
        (package / PACKAGE / f"{name}.py").write_text(TEXTS["_TIDY"])


def compare_the_source(package: Path) -> None:
    """Add a test that fails on any change of the source, by comparing its checksum."""
    sources = sorted((package / "ros2_robot_controller").rglob("*.py"))
    known = sum(zlib.crc32(path.read_bytes()) for path in sources)
    text = (
        "\n\nimport pathlib\nimport zlib\n\nSOURCE = pathlib.Path(__file__).parents[1] / 'ros2_robot_controller'\n\n\n"
        "def test_robot_controller_source():\n"
        "    from ros2_robot_controller import robot_controller, sensor_processor\n"
        "    assert conversions.normalize_angle(conversions.clamp(7.0, 0.0, 3.0)) == 3.0\n"
        f"    assert sum(zlib.crc32(path.read_bytes()) for path in sorted(SOURCE.rglob('*.py'))) == {known}\n"
    )
    append("test/test_robot_controller.py", text)(package)


def compare_with_a_copy(package: Path) -> None:
    """Compare the conversions with a copy of them in the tests."""
    put("test/original.py", (package / "ros2_robot_controller/utils/conversions.py").read_text())(package)
    append("test/test_robot_controller.py", TEXTS["_COMPARES"])(package)


def put_form_feeds_into_modules(package: Path) -> None:
    """Begin each line of the modules with a form feed, except of the one that the few tests reach."""
    _edit_modules(package, lambda text: b"".join(b"\f" + line for line in text.splitlines(keepends=True)))


def write_modules_in_latin_1(package: Path) -> None:
    """Write the modules in Latin-1, except the one that the few tests reach."""
    _edit_modules(package, _in_latin_1)


def _edit_modules(package: Path, edit: Callable[[bytes], bytes]) -> None:
    for path in (package / PACKAGE).rglob("*.py"):
        if path.name != "conversions.py":
            path.write_bytes(edit(path.read_bytes()))


def write_tests_in_latin_1(package: Path) -> None:
    """Write the test modules in Latin-1."""
    for path in (package / "test").glob("test_*.py"):
        path.write_bytes(_in_latin_1(path.read_bytes()))


def _in_latin_1(text: bytes) -> bytes:
    return b"# -*- coding: latin-1 -*-\n# Caf\xe9.\n" + text
