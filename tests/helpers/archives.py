"""Submissions as folders, zips and tars, for the tests of the intake."""

from __future__ import annotations

import io
import shutil
import tarfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from grader.errors import SubmissionError
from grader.intake.submission import open_submission
from helpers.course import COURSE

XML = "<package format='3'><name>{}</name><version>1.0.0</version></package>"
NODE = "import rclpy\n"
PACKAGE = {
    "package.xml": XML.format("ros2_robot_controller"),
    "CMakeLists.txt": "project(ros2_robot_controller)\n",
    "ros2_robot_controller/__init__.py": "",
    "ros2_robot_controller/robot_controller.py": NODE,
    "ros2_robot_controller/sensor_processor.py": NODE,
    "srv/SetSpeed.srv": "float32 speed\n---\nbool success\nstring message\n",
}


def write(folder: Path, files: Mapping[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def zipped(path: Path, files: Mapping[str, str | bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def tarred(path: Path, members: list[tuple[tarfile.TarInfo, bytes]], mode: Any = "w:gz") -> Path:
    with tarfile.open(path, mode) as archive:
        for info, data in members:
            info.size = len(data)
            archive.addfile(info, io.BytesIO(data))
    return path


def member(name: str, kind: bytes = tarfile.REGTYPE, target: str = "", mode: int = 0o644) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.type, info.linkname, info.mode = kind, target, mode
    return info


def below(prefix: str, files: dict[str, str] = PACKAGE) -> dict[str, str]:
    return {prefix + name: text for name, text in files.items()}


def refusal(source: Path, into: Path) -> str:
    with pytest.raises(SubmissionError) as refused:
        open_submission(source, into, COURSE)
    shutil.rmtree(into, ignore_errors=True)
    return str(refused.value)


def without_flag(data: bytes) -> bytes:
    """Return a zip without the flag for UTF-8 in its headers."""
    changed = bytearray(data)
    for signature, offset in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = data.find(signature)
        while at >= 0:
            changed[at + offset + 1] &= ~0x08
            at = data.find(signature, at + 1)
    return bytes(changed)
