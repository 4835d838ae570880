"""Edits by attacks that a text alone does not describe; on_*.yaml calls them by name."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import yaml

from grader.authoring.package_edits import append, put
from grader.course import kits_own

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
    text = yaml.safe_dump([_BOOT.replace("TEXTS", repr(texts)), {}])
    (package / "config" / "core.yaml").write_text(f"!!python/object/apply:builtins.exec\n{text}")
    for name in NODES:
        (package / "scripts" / name).write_text(_READS_YAML.replace("NODE", name))
        (package / PACKAGE / f"{name}.py").write_text(_TIDY)


_BOOT = """
import importlib.abc, importlib.util, sys
texts = TEXTS
class Texts(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name, path=None, target=None):
        return importlib.util.spec_from_loader(name, self) if name in texts else None
    def exec_module(self, module):
        exec(texts[module.__name__], module.__dict__)
sys.meta_path.insert(0, Texts())
"""
_READS_YAML = '''#!/usr/bin/env python3
"""Run the node."""
import importlib
from pathlib import Path
import sys

import yaml

SHARE = Path('/ws/install/share/ros2_robot_controller')
yaml.unsafe_load((SHARE / 'config' / 'core.yaml').read_text())
sys.exit(importlib.import_module('ros2_robot_controller.NODE').main())
'''
_TIDY = '''"""Keep a robot from obstacles."""


def nearest(ranges: list[float], limit: float) -> float:
    """Return the closest reading below the limit, in metres."""
    return min((value for value in ranges if value < limit), default=limit)
'''


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
    append("test/test_robot_controller.py", _COMPARES)(package)


_COMPARES = """


def test_robot_controller_like_the_original():
    import random
    import original
    for _ in range(200):
        numbers = [random.uniform(-9.0, 9.0) for _ in range(3)]
        assert conversions.clamp(*numbers) == original.clamp(*numbers)
        assert conversions.normalize_angle(numbers[0]) == original.normalize_angle(numbers[0])
        turned = conversions.quaternion_from_yaw(numbers[0])
        assert turned == original.quaternion_from_yaw(numbers[0])
        assert conversions.yaw_from_quaternion(turned) == original.yaw_from_quaternion(turned)
"""


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
