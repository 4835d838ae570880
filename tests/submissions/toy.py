"""A package small enough to test in a second: plain Python, "installed" by copying; nothing is built."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

from helpers import beside
from helpers.archives import write

from grader.host import ros_env
from grader.mutation.source_text import SourceText

CONTROLLER, PROCESSOR, PROGRAM, THOROUGH = beside(__file__).values()


@dataclass(frozen=True)
class Toy:
    """A package folder and its install tree."""

    package: Path
    install: Path


def make(folder: Path, files: Mapping[str, str], modules: Mapping[str, str] | None = None) -> Toy:
    """Return a package with these test files and a program; `modules` replaces or adds modules of the package."""
    package = folder / "ros2_robot_controller"
    inside = {
        "__init__.py": "",
        "robot_controller.py": CONTROLLER,
        "sensor_processor.py": PROCESSOR,
    } | dict(modules or {})
    texts = (
        {f"ros2_robot_controller/{name}": text for name, text in inside.items()}
        | {"scripts/robot_controller": PROGRAM}
        | dict(files)
    )
    write(package, texts)
    install = folder / "install"
    shutil.copytree(package / "ros2_robot_controller", install / ros_env.SITE_IN_PREFIX / "ros2_robot_controller")
    return Toy(package, install)


def source(text: str) -> SourceText:
    """Return the text of a module of a package, to be mutated."""
    return SourceText("ros2_robot_controller/node.py", dedent(text))
