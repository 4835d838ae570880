"""The named edits: what is wrong in each package, and which requirements that should cost.

An edit is text replaced in a copy of the reference. It must match exactly once, so an edit that no longer bites
because the reference has changed is an error and not a silent pass.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

REFERENCE = Path(__file__).parents[2] / "solution_pkg" / "ros2_robot_controller"

_CONTROLLER = "ros2_robot_controller/robot_controller.py"
_PROCESSOR = "ros2_robot_controller/sensor_processor.py"
_MOTION = "ros2_robot_controller/utils/motion.py"
_START = "scripts/robot_controller"


@dataclass(frozen=True)
class Edit:
    """One fault: the texts it replaces (file, old, new), the requirements it costs, and words the report must hold."""

    name: str
    sentence: str
    changes: tuple[tuple[str, str, str], ...]
    costs: frozenset[str]
    says: tuple[str, ...] = ()


def apply(edit: Edit | None, folder: Path) -> Path:
    """Copy the reference below `folder`, make the edit, and return the package's path."""
    package = folder / REFERENCE.name
    shutil.copytree(REFERENCE, package, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache"))
    for file, old, new in edit.changes if edit else ():
        text = (package / file).read_text()
        if text.count(old) != 1:
            raise ValueError(f"{edit.name}: {old!r} stands {text.count(old)} times in {file}, not once")
        (package / file).write_text(text.replace(old, new))
    return package


def _edit(name: str, sentence: str, costs: str, *changes: tuple[str, str, str], says: tuple[str, ...] = ()) -> Edit:
    return Edit(name, sentence, changes, frozenset(costs.split()), says)


EDITS = {
    edit.name: edit
    for edit in (
        _edit(
            "does_not_compile",
            "CMakeLists.txt names an interface file that is not there.",
            "F1 F2 F3 F4 F7 F8 I1 I3 I4",
            ("CMakeLists.txt", '"msg/SensorFusionData.msg"', '"msg/FusedData.msg"'),
            says=("FusedData.msg", "colcon build"),
        ),
        _edit(
            "crashes_at_start",
            "The controller dies before it creates its node.",
            "F1 F2 F3 F4 F7 F8 I3 I4",
            (_START, "sys.exit(main())", "raise RuntimeError('no robot on /dev/ttyACM0')"),
            says=("no robot on /dev/ttyACM0", "ended before it came up"),
        ),
        _edit(
            "ignores_the_limit",
            "set_speed takes any finite speed.",
            "F3",
            (_MOTION, "if abs(speed) > limit * (1.0 + FLOAT32_SLACK):", "if abs(speed) > 1000.0:"),
            (_CONTROLLER, "self._speed = clamp(request.speed, -limit, limit)", "self._speed = request.speed"),
            says=("success = True", "compare abs(speed) with the limit"),
        ),
        _edit(
            "drives_into_the_wall",
            "The obstacle flag is set and told, but nobody stops for it.",
            "F4",
            (_MOTION, "    if wanted.v != 0.0 and obstacle_in_way(near, wanted.v, limits):\n        return STOP\n", ""),
            (_MOTION, "        return STOP\n    cap = speed_cap", "        return wanted\n    cap = speed_cap"),
            says=("touched the wall",),
        ),
        _edit(
            "misnames_set_speed",
            "The service is called set_velocity.",
            "F2 F3 F4 F7 I3 I4",
            (_CONTROLLER, "SetSpeed, 'set_speed'", "SetSpeed, 'set_velocity'"),
            says=("expected service set_speed (SetSpeed); found set_velocity (",),
        ),
        _edit(
            "dies_in_mid_trial",
            "The controller kills itself as soon as it is asked to drive.",
            "F2 F3 F4 F7",
            (_CONTROLLER, "            self._speed = clamp(request.speed, -limit, limit)\n",
             "            import os\n            os.kill(os.getpid(), 9)\n"),
            says=("the node ended at", "exit status -9"),
        ),
    )
}  # fmt: skip
