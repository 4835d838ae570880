"""Correct packages that differ from the reference in executor and structure, as other good students write them.

A variant is a copy of the reference over which the files of its folder here are laid; a few lines may be changed by
name instead. `loses` is what the contract takes from it: everything else has to be given.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from submissions.edits import REFERENCE

_HERE = Path(__file__).parent
_PACKAGE = REFERENCE.name


@dataclass(frozen=True)
class Variant:
    """A correct package: the texts changed in it (file, old, new), and the points that the contract takes from it.

    `moved` are files and folders of the reference that lie in another place. `base` is a variant to start from.
    """

    name: str
    sentence: str
    loses: Mapping[str, float] = field(default_factory=dict)
    base: str = ""
    without: tuple[str, ...] = ()
    moved: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[tuple[str, str, str], ...] = ()


def make(variant: Variant, folder: Path) -> Path:
    """Write the variant below `folder` and return the submission: the folder of its package or packages."""
    submission = folder / variant.name
    package = submission / _PACKAGE
    shutil.copytree(REFERENCE, package, ignore=shutil.ignore_patterns("__pycache__", ".pytest_cache", "test"))
    for name in variant.without:
        (package / name).unlink()
    for layer in (variant.base, variant.name):
        if layer and (_HERE / layer).is_dir():
            shutil.copytree(_HERE / layer, submission, dirs_exist_ok=True)
    for name, place in variant.moved.items():
        shutil.move(package / name, submission / place)
    for file, old, new in variant.changes:
        text = (package / file).read_text()
        if old not in text:
            raise ValueError(f"{variant.name}: {old!r} does not stand in {file}")
        (package / file).write_text(text.replace(old, new))
    return submission


_CONTROLLER = f"{_PACKAGE}/robot_controller.py"
_PROCESSOR = f"{_PACKAGE}/sensor_processor.py"
_INTERFACES = f"{_PACKAGE}_interfaces"
# The reference's layers below its robot_controller.py; a variant's own does all of their work.
_SPEED_SERVER = f"{_PACKAGE}/speed_server.py"
_NAVIGATOR = f"{_PACKAGE}/navigator.py"
_LAYERS = (f"{_PACKAGE}/driver.py", _SPEED_SERVER, _NAVIGATOR)

VARIANTS = {
    variant.name: variant
    for variant in (
        Variant(
            "multithreaded",
            "Many threads; the action's own loops at a Rate of the node's clock.",
            without=_LAYERS,
        ),
        Variant(
            "wall_sleeping_action",
            "Many threads; the action's own loops with time.sleep and drives by itself.",
            without=_LAYERS,
        ),
        Variant(
            "own_thread",
            "A thread that sleeps on the node's clock drives; rclpy spins in the main thread.",
            without=_LAYERS,
        ),
        Variant(
            "wall_feedback",
            "A timer on the clock drives; the action's loop, which steers and gives feedback, sleeps 0.4 s of wall time.",
            base="multithreaded",
            without=_LAYERS,
            changes=(
                (_CONTROLLER, "import threading\n", "import threading\nimport time\n"),
                (_CONTROLLER, "            self._rate.sleep()\n", "            time.sleep(0.4)\n"),
                (_CONTROLLER, "while not handle.is", "while not self._stopping and not handle.is"),
                (_CONTROLLER, "seconds=0.2))\n", "seconds=0.2))\n        time.sleep(0.5)  # the loop ends meanwhile\n"),
            ),
        ),
        Variant(
            "wall_time",
            "The threads sleep by wall time, whatever /clock says.",
            loses={"I7": 1.0},
            base="own_thread",
            without=_LAYERS,
            changes=(
                (_CONTROLLER, "clock.sleep_for(Duration(seconds=1.0 / self.p('laser_processing_rate')))",
                 "time.sleep(1.0 / self.p('laser_processing_rate'))"),
                (_CONTROLLER, "        clock = self.get_clock()\n", ""),
                (_CONTROLLER, "from threading import Lock, Thread\n", "from threading import Lock, Thread\nimport time\n"),
                (_PROCESSOR, "value)\n        try:", "value, Clock(clock_type=ClockType.STEADY_TIME))\n        try:"),
                (_PROCESSOR, "import rclpy\n", "import rclpy\nfrom rclpy.clock import Clock, ClockType\n"),
            ),
        ),
        Variant(
            "split_interfaces",
            "The interfaces are a package of their own, the nodes an ament_python one.",
            loses={"I3": 2.0},
            without=("CMakeLists.txt",),
            moved={"msg": f"{_INTERFACES}/msg", "srv": f"{_INTERFACES}/srv", "action": f"{_INTERFACES}/action"},
            changes=(
                (_NAVIGATOR, "ros2_robot_controller.action import", "ros2_robot_controller_interfaces.action import"),
                (_SPEED_SERVER, "ros2_robot_controller.srv import", "ros2_robot_controller_interfaces.srv import"),
                (_PROCESSOR, "ros2_robot_controller.msg import", "ros2_robot_controller_interfaces.msg import"),
                ("scripts/demo.py", "ros2_robot_controller.action import",
                 "ros2_robot_controller_interfaces.action import"),
                ("scripts/demo.py", "ros2_robot_controller.srv import", "ros2_robot_controller_interfaces.srv import"),
            ),
        ),
        Variant(
            "events",
            "An events executor, lambdas and partials, async timers, settings read once, own QoS.",
            without=_LAYERS,
        ),
    )
}  # fmt: skip
