"""The errors of the launch layer, each with the launch file's line that it is about where one is known."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

HERE = str(Path(__file__).resolve().parent.parent)  # the whole folder of the command


@dataclass(frozen=True)
class Place:
    """A line of somebody's launch file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}"


def caller() -> Place | None:
    """Return the nearest line on the stack that is not this layer's own: the line of the launch file."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code.co_filename.startswith((HERE, "<frozen")):
        frame = frame.f_back
    return None if frame is None else Place(frame.f_code.co_filename, frame.f_lineno)


class LaunchError(RuntimeError):
    """A launch file asks for something that cannot be."""


class UnsupportedError(LaunchError):
    """A launch file asks for a feature of ROS 2 that this layer does not have."""

    def __init__(self, feature: str, instead: str = "", place: Place | None = None) -> None:
        place = place or caller()
        where = f"{place}: " if place else ""
        super().__init__(f"{where}{feature} is not supported by the launch of this kit. {instead}".strip())


class SubstitutionFailure(LaunchError):
    """A substitution has no value."""


class PackageNotFoundError(LaunchError):
    """A package is in no prefix of AMENT_PREFIX_PATH."""
