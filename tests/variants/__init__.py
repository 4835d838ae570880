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

    `moved` are files and folders of the reference that lie in another place, `added` further files with their texts.
    `base` is a variant to start from.
    """

    name: str
    sentence: str
    loses: Mapping[str, float] = field(default_factory=dict)
    base: str = ""
    without: tuple[str, ...] = ()
    moved: Mapping[str, str] = field(default_factory=dict)
    added: Mapping[str, str] = field(default_factory=dict)
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
    for name, text in variant.added.items():
        (package / name).write_text(text)
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
            "default_executor",
            "The default MultiThreadedExecutor, a reentrant group, and an action that waits in a loop at a Rate.",
            changes=(
                (_NAVIGATOR, "from rclpy.task import Future\n",
                 "from rclpy.callback_groups import ReentrantCallbackGroup\nfrom rclpy.task import Future\n"),
                (_NAVIGATOR, "cancel_callback=self._on_cancel)",
                 "cancel_callback=self._on_cancel,\n            callback_group=ReentrantCallbackGroup())"),
                (_NAVIGATOR, "    async def _navigate(", "    def _navigate("),
                (_NAVIGATOR, "        ending = await goal.ending\n",
                 "        rate = self.create_rate(20)\n        while not goal.ending.done():\n            rate.sleep()\n"
                 "        ending = goal.ending.result()\n"),
                (f"{_PACKAGE}/utils/running.py", "SingleThreadedExecutor", "MultiThreadedExecutor"),
            ),
            # Ctrl-C during a goal: the rate's sleep raises ROSInterruptException, and the executor prints its traceback.
            loses={"I8": 1.0},
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
            "share_root",
            "Launch and parameter files are installed in the root of the share folder, as in many tutorials.",
            changes=(
                ("CMakeLists.txt", "install(DIRECTORY launch config\n", "install(DIRECTORY launch/ config/\n"),
                ("launch/robot_controller_launch.py", "'ros2_robot_controller'), 'config']", "'ros2_robot_controller')]"),
                ("launch/sensor_processor_launch.py", "share, 'config', 'sensor", "share, 'sensor"),
            ),
        ),
        Variant(
            "ends_at_once",
            "On Ctrl-C the node publishes a zero, waits for nothing, and destroys its publisher.",
            changes=(
                (f"{_PACKAGE}/driver.py", "self._cmd_vel.wait_for_all_acked(Duration(seconds=LAST_WORD_S))",
                 "self.destroy_publisher(self._cmd_vel)"),
            ),
        ),
        Variant(
            "events",
            "An events executor, lambdas and partials, async timers, settings read once, own QoS.",
            without=_LAYERS,
        ),
    )
}  # fmt: skip

_SCRIPTS = ("scripts/robot_controller", "scripts/sensor_processor")
_INSTALLED = "install(PROGRAMS scripts/robot_controller scripts/sensor_processor\n  DESTINATION lib/${PROJECT_NAME})\n"
_BIN = "${CMAKE_CURRENT_BINARY_DIR}/bin/${node}"
_LAUNCHER = "#!/usr/bin/env python3\nfrom ros2_robot_controller.{} import main\n\nraise SystemExit(main())\n"
_START = '#!/usr/bin/env python3\n"""Start."""\nfrom ros2_robot_controller.{} import main\n\nmain()\n'
_NODES = ("robot_controller", "sensor_processor")


def _launched(name: str, commands: str, added: Mapping[str, str] | None = None) -> Variant:
    """Return a variant with these commands for each `${node}` in place of its scripts."""
    loop = f"foreach(node {' '.join(_NODES)})\n{commands}\nendforeach()\n"
    changes = (("CMakeLists.txt", _INSTALLED, loop),)
    return Variant(name, "Programs as other authors install them.", without=_SCRIPTS, added=added or {}, changes=changes)


_PUT = f"install(PROGRAMS {_BIN} DESTINATION lib/${{PROJECT_NAME}})"
LAUNCHED = {
    variant.name: variant
    for variant in (
        _launched("written", f"file(WRITE {_BIN} [[{_LAUNCHER}]])\n{_PUT}".replace("[[", '"').replace("]]", '"')
                  .replace("{}", "${node}")),
        _launched("generated", f'file(GENERATE OUTPUT {_BIN} CONTENT "{_LAUNCHER}")\n{_PUT}'.replace("{}", "${node}")),
        _launched("configured", f"configure_file(scripts/node.in {_BIN} @ONLY)\n{_PUT}",
                  {"scripts/node.in": _LAUNCHER.format("@node@")}),
        _launched("renamed", "install(PROGRAMS scripts/start_${node}.py DESTINATION lib/${PROJECT_NAME} RENAME ${node})",
                  {f"scripts/start_{node}.py": _START.format(node) for node in _NODES}),
        _launched("by_shell", "install(PROGRAMS scripts/${node}.sh DESTINATION lib/${PROJECT_NAME} RENAME ${node})",
                  {f"scripts/{node}.sh": f'#!/bin/sh\nset -e\nexec python3 -m {_PACKAGE}.start_{node} "$@"\n' for node in _NODES}
                  | {f"{_PACKAGE}/start_{node}.py": _START.format(node) for node in _NODES}),
        _launched("linked", "install(PROGRAMS scripts/start_${node}.py DESTINATION lib/${PROJECT_NAME})\n"
                  'install(CODE "file(CREATE_LINK start_${node}.py '
                  '${CMAKE_INSTALL_PREFIX}/lib/${PROJECT_NAME}/${node} SYMBOLIC)")',
                  {f"scripts/start_{node}.py": _START.format(node) for node in _NODES}),
    )
}  # fmt: skip
"""The reference with programs that are not handed in under their names."""
