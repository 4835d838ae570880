"""Slips in the interfaces: every field of the contract's four with every plausible mistake, as text and as an edit."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from helpers.course import CONTRACT

from grader.authoring.package_edits import copy, replace
from submissions.edits import REFERENCE

FILES = {
    "SetSpeed": "srv/SetSpeed.srv",
    "GetRobotStatus": "srv/GetRobotStatus.srv",
    "NavigateToPosition": "action/NavigateToPosition.action",
    "SensorFusionData": "msg/SensorFusionData.msg",
}
NEEDS = {
    "SetSpeed": ("F2", "F3", "I3", "I4", "Q6"),
    "GetRobotStatus": ("F7", "I3", "I4", "Q6"),
    "NavigateToPosition": ("F8", "F9", "I3", "I4", "Q6"),
    "SensorFusionData": ("F12", "F13", "I3", "I4"),
}
"""The requirements whose trials use the interface; with Q6 its calls also go through the observer's proxy."""

_WIDER = {
    "float32": "float64", "bool": "int32", "string": "wstring", "geometry_msgs/Pose": "geometry_msgs/PoseStamped",
    "geometry_msgs/Vector3": "geometry_msgs/Accel", "std_msgs/Header": "std_msgs/Header[]",
}  # fmt: skip
_NARROWER = {
    "float32": "int16", "bool": "byte", "string": "string<=8", "geometry_msgs/Pose": "geometry_msgs/Point",
    "geometry_msgs/Vector3": "float32[3]", "std_msgs/Header": "builtin_interfaces/Time",
}  # fmt: skip
_FIELD = re.compile(r"(\S+) (\w+)")


@dataclass(frozen=True)
class Slip:
    """One mistake in one interface.

    Attributes:
        interface: which.
        kind: widened, narrowed, renamed, swapped, one more, one less, a list or another type.
        field: the field that it is about.
        text: the interface's definition with the mistake; that of the contract for another type.
    """

    interface: str
    kind: str
    field: str
    text: str

    @property
    def name(self) -> str:
        """Return its name in tables."""
        return f"{self.interface}-{self.field or 'whole'}-{self.kind.replace(' ', '_')}"

    def apply(self, folder: Path) -> Path:
        """Copy the reference below `folder` with the slip, and return the package's path; its code stays as it is."""
        package = copy(REFERENCE, folder)
        if self.kind != "another type":
            (package / FILES[self.interface]).write_text(self.text)
            return package
        for change in _OTHER_TYPES[self.interface]:
            replace(*change)(package)
        (package / "action" / "DriveTo.action").write_text("int32 place\n---\nint32 place\n---\nstring place\n")
        return package


_TYPES = "from ros2_robot_controller"
_OTHER_TYPES = {
    "SetSpeed": (
        ("ros2_robot_controller/speed_server.py", f"{_TYPES}.srv import GetRobotStatus, SetSpeed\n",
         f"{_TYPES}.srv import GetRobotStatus\nfrom std_srvs.srv import SetBool as SetSpeed\n"),
    ),
    "GetRobotStatus": (
        ("ros2_robot_controller/speed_server.py", f"{_TYPES}.srv import GetRobotStatus, SetSpeed\n",
         f"{_TYPES}.srv import SetSpeed\nfrom std_srvs.srv import Trigger as GetRobotStatus\n"),
    ),
    "NavigateToPosition": (
        ("ros2_robot_controller/navigator.py", f"{_TYPES}.action import NavigateToPosition\n",
         f"{_TYPES}.action import DriveTo as NavigateToPosition\n"),
        ("CMakeLists.txt", '  "action/NavigateToPosition.action"\n',
         '  "action/NavigateToPosition.action"\n  "action/DriveTo.action"\n'),
    ),
    "SensorFusionData": (
        ("ros2_robot_controller/sensor_processor.py", f"{_TYPES}.msg import SensorFusionData\n",
         "from std_msgs.msg import Header as SensorFusionData\n"),
    ),
}  # fmt: skip


def table() -> Iterator[Slip]:
    """Yield every slip: each field of each interface with each mistake, then the interface as a whole."""
    for interface, path in FILES.items():
        lines = (CONTRACT / path).read_text().splitlines()
        fields = [number for number, line in enumerate(lines) if _FIELD.fullmatch(line)]
        for number in fields:
            kind, name = lines[number].split()
            following = number + 1 if number + 1 in fields else number - 1 if number - 1 in fields else None
            yield _slip(interface, "widened", name, lines, number, [f"{_WIDER[kind]} {name}"])
            yield _slip(interface, "narrowed", name, lines, number, [f"{_NARROWER[kind]} {name}"])
            yield _slip(interface, "renamed", name, lines, number, [f"{kind} the_{name}"])
            yield _slip(interface, "a list", name, lines, number, [f"{kind}[] {name}"])
            yield _slip(interface, "one more", name, lines, number, [f"{kind} {name}", "int64 count"])
            yield _slip(interface, "one less", name, lines, number, [])
            if following is not None:
                first, second = sorted((number, following))
                swapped = [*lines[:first], lines[second], lines[first], *lines[second + 1 :]]
                yield Slip(interface, "swapped", name, "\n".join(swapped) + "\n")
        yield Slip(interface, "another type", "", (CONTRACT / path).read_text())


def _slip(interface: str, kind: str, field: str, lines: list[str], number: int, new: list[str]) -> Slip:
    return Slip(interface, kind, field, "\n".join([*lines[:number], *new, *lines[number + 1 :]]) + "\n")


def representatives() -> list[Slip]:
    """Return one slip of each kind for each interface: of its first field that has one."""
    chosen: dict[tuple[str, str], Slip] = {}
    for slip in table():
        chosen.setdefault((slip.interface, slip.kind), slip)
    return list(chosen.values())
