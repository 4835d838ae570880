"""The errors of a launch, and the line of the launch file that each is about."""

from __future__ import annotations

import os
import sys
import traceback
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

HERE = str(Path(__file__).resolve().parent.parent)  # the whole folder of the command
STANDARD_LIBRARY = str(Path(os.__file__).parent)  # the loop runs actions from here: no line of a launch file


@dataclass(frozen=True)
class Place:
    """A line of a launch file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}"


def caller() -> Place | None:
    """Return the nearest line on the stack that is of a launch file; None if there is none."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and frame.f_code.co_filename.startswith((HERE, STANDARD_LIBRARY, "<frozen")):
        frame = frame.f_back
    return None if frame is None else Place(frame.f_code.co_filename, frame.f_lineno)


class LaunchError(RuntimeError):
    """A launch file asks for something impossible."""


class UnsupportedError(LaunchError):
    """A launch file asks for a feature of ROS 2 that this kit does not implement."""

    def __init__(self, feature: str, instead: str = "") -> None:
        self.place = caller()
        where = f"{self.place}: " if self.place else ""
        super().__init__(f"{where}{feature} is not supported by the launch of this kit. {instead}".strip())


class SubstitutionFailure(LaunchError):
    """A substitution has no value."""


class InvalidConditionExpressionError(LaunchError):
    """The text of a condition is not a truth value."""


def explain(error: BaseException) -> str:
    """Return a one-message description of an error, with the launch file's line if it is known."""
    if isinstance(error, UnsupportedError) and error.place is not None:
        return str(error)
    if isinstance(error, SyntaxError) and error.filename:
        return f"SyntaxError: {error.msg} ({error.filename}, line {error.lineno})"
    text = str(error) if isinstance(error, LaunchError) else f"{type(error).__name__}: {error}"
    outside = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith((HERE, "<", sys.prefix, sys.base_prefix))
    ]
    if outside:
        return f"{text} ({outside[-1].filename}, line {outside[-1].lineno})"
    place = getattr(error, "launch_place", None)
    return f"{text} ({place})" if place is not None else text
