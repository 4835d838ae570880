"""Correct packages that differ from the reference in executor and structure, as other good students write them.

A variant is a copy of the reference over which the files of its folder here are laid, and then changed as variants.yaml
says.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from submissions.edits import REFERENCE, changes

_HERE = Path(__file__).parent
_PACKAGE = REFERENCE.name


@dataclass(frozen=True)
class Variant:
    """A correct package. What each field means stands at the top of variants.yaml."""

    name: str
    sentence: str
    loses: Mapping[str, float] = field(default_factory=dict)
    base: str = ""
    without: str = ""
    changes: tuple[dict[str, str], ...] = ()


def make(variant: Variant, folder: Path) -> Path:
    """Write the variant below `folder` and return the submission: the folder of its package or packages."""
    submission = folder / variant.name
    package = submission / _PACKAGE
    shutil.copytree(REFERENCE, package, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache", "test"))
    for name in variant.without.split():
        (package / name).unlink()
    for layer in (variant.base, variant.name):
        if layer and (_HERE / layer).is_dir():
            shutil.copytree(_HERE / layer, submission, dirs_exist_ok=True)
    for change in changes(variant.changes):
        change(package)
    return submission


def _read(name: str, given: dict[str, Any]) -> Variant:
    return Variant(name, given.pop("is"), changes=tuple(given.pop("changes", ())), **given)


_LISTED = yaml.safe_load((_HERE / "variants.yaml").read_text())
VARIANTS = {name: _read(name, given) for name, given in _LISTED.items()}

_SCRIPTS = "scripts/robot_controller scripts/sensor_processor"
_INSTALLED = f"install(PROGRAMS {_SCRIPTS}\n  DESTINATION lib/${{PROJECT_NAME}})\n"
_BIN = "${CMAKE_CURRENT_BINARY_DIR}/bin/${node}"
_LAUNCHER = "#!/usr/bin/env python3\nfrom ros2_robot_controller.{} import main\n\nraise SystemExit(main())\n"
_START = '#!/usr/bin/env python3\n"""Start."""\nfrom ros2_robot_controller.{} import main\n\nmain()\n'
_NODES = ("robot_controller", "sensor_processor")


def _launched(name: str, commands: str, added: Mapping[str, str] | None = None) -> Variant:
    """Return a variant with these commands for each `${node}` in place of its scripts."""
    loop = f"foreach(node {' '.join(_NODES)})\n{commands}\nendforeach()\n"
    made = [{"put": file, "text": text} for file, text in (added or {}).items()]
    made.append({"file": "CMakeLists.txt", "old": _INSTALLED, "new": loop})
    return Variant(name, "Programs as other authors install them.", without=_SCRIPTS, changes=tuple(made))


_STARTS = {f"scripts/start_{node}.py": _START.format(node) for node in _NODES}
_AS_NODE = "DESTINATION lib/${PROJECT_NAME} RENAME ${node})"
_PUT = f"install(PROGRAMS {_BIN} DESTINATION lib/${{PROJECT_NAME}})"
LAUNCHED = {
    variant.name: variant
    for variant in (
        _launched("written", f"file(WRITE {_BIN} [[{_LAUNCHER}]])\n{_PUT}".replace("[[", '"').replace("]]", '"')
                  .replace("{}", "${node}")),
        _launched("generated", f'file(GENERATE OUTPUT {_BIN} CONTENT "{_LAUNCHER}")\n{_PUT}'.replace("{}", "${node}")),
        _launched("configured", f"configure_file(scripts/node.in {_BIN} @ONLY)\n{_PUT}",
                  {"scripts/node.in": _LAUNCHER.format("@node@")}),
        _launched("renamed", f"install(PROGRAMS scripts/start_${{node}}.py {_AS_NODE}", _STARTS),
        _launched("by_shell", f"install(PROGRAMS scripts/${{node}}.sh {_AS_NODE}", {
            f"scripts/{node}.sh": f'#!/bin/sh\nset -e\nexec python3 -m {_PACKAGE}.start_{node} "$@"\n'
            for node in _NODES
        } | {f"{_PACKAGE}/start_{node}.py": _START.format(node) for node in _NODES}),
        _launched("linked", "install(PROGRAMS scripts/start_${node}.py DESTINATION lib/${PROJECT_NAME})\n"
                  'install(CODE "file(CREATE_LINK start_${node}.py '
                  '${CMAKE_INSTALL_PREFIX}/lib/${PROJECT_NAME}/${node} SYMBOLIC)")', _STARTS),
    )
}  # fmt: skip
"""The reference with programs that are not handed in under their names."""
