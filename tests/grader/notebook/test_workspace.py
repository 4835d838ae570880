"""The workspace: its place, and the environment that shell cells see in it."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from helpers.course import PACKAGE

from grader import KIT, notebook
from grader.errors import GraderError
from grader.host import ros_env
from grader.notebook import cell_hooks, checkpoints, lanes
from grader.notebook.cell_hooks import forget_changed_modules
from grader.notebook.workspace import VARIABLE, Workspace, find, prepare


def test_the_workspace_lies_beside_the_notebooks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    with pytest.raises(GraderError, match=r"no folder `notebooks` .* set ROS2_COURSE_WS"):
        find(tmp_path)
    (tmp_path / "notebooks" / "source").mkdir(parents=True)
    inside = find(tmp_path).package
    inside.mkdir(parents=True)
    for here in (tmp_path, tmp_path / "notebooks", tmp_path / "notebooks" / "source", inside):
        assert find(here).root == tmp_path / "ws"
    monkeypatch.setenv(VARIABLE, str(tmp_path / "elsewhere"))
    assert find(Path("/")).root == tmp_path / "elsewhere"


SHOW_WAYS = """
import contextlib, os, pathlib, rclpy, socket, sys
from grader.ros2.commands.graph import quick_discovery
rclpy.init()
with quick_discovery(1.0) if sys.argv[1] == "a command" else contextlib.nullcontext():
    node = rclpy.create_node("anna")
ways = set()
for number in os.listdir("/proc/self/fd"):
    try:
        with socket.socket(fileno=os.dup(int(number))) as found:
            if (found.family, found.type) == (socket.AF_INET, socket.SOCK_DGRAM) and found.getsockname()[1]:
                ways.add(found.getsockname()[0])
    except OSError:  # not a socket
        pass
shared = "shared memory" if "/dev/shm/fast" in pathlib.Path("/proc/self/maps").read_text() else ""
print(*sorted(ways), shared)
os._exit(0)
"""


@pytest.mark.ros
@pytest.mark.parametrize("what", ["a node", "a command"])
def test_students_in_one_classroom_do_not_drive_each_others_robots(workspace: Workspace, what: str) -> None:
    """Over the loopback, with its multicast; a lock in shared memory could be held by a node that was killed."""
    prepared = dict(os.environ)
    prepare(workspace, prepared)
    command = [sys.executable, "-c", SHOW_WAYS, what]
    ran = subprocess.run(command, env=prepared, cwd=KIT, capture_output=True, text=True, check=True)
    assert ran.stdout.split() == ["127.0.0.1", "239.255.0.1"]


def test_begin_names_the_files_missing_from_earlier_notebooks(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    checkpoints.start_at(workspace, "05")
    (workspace.package / "package.xml").unlink()
    notebook.begin("05")
    said = capsys.readouterr().out
    assert "holds 17 files" in said
    assert "Missing from earlier notebooks (1 file): package.xml\n" in said
    assert 'start_at("05")' in said
    assert str(workspace.root) not in said


def test_begin_opens_the_package_and_can_be_run_again_and_in_the_next_notebook(
    workspace: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    lanes.keep(workspace, lanes.WHOLE)
    notebook.begin("01")
    assert Path.cwd() == workspace.package
    assert capsys.readouterr().out == (
        "Your package, ws/src/ros2_robot_controller, holds no files. Cells now work in that folder.\n"
    )
    before = dict(os.environ)
    notebook.begin("01")
    assert dict(os.environ) == before
    notebook.begin("02")
    assert Path.cwd() == workspace.package
    found = subprocess.run("command -v ros2 colcon python3", shell=True, capture_output=True, text=True, check=True)
    assert {str(Path(path).parent) for path in found.stdout.split()} == {str(ros_env.PREFIX / "bin")}
    assert os.environ["PATH"].split(os.pathsep).count(str(ros_env.PREFIX / "bin")) == 1


def test_a_build_is_found_once_it_exists(workspace: Workspace) -> None:
    environment: dict[str, str] = {}
    prepare(workspace, environment)
    assert str(workspace.install) not in environment["AMENT_PREFIX_PATH"]
    (workspace.install / "share").mkdir(parents=True)
    prepare(workspace, environment)
    assert environment["AMENT_PREFIX_PATH"].startswith(f"{workspace.install}:")
    assert environment["LD_LIBRARY_PATH"].startswith(f"{workspace.install}/lib:")
    assert environment["PYTHONPATH"].startswith(str(workspace.install))


def test_changed_modules_are_imported_again_and_all_of_them(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After start_at("05") in a kernel that had imported the package, there were two copies of utils.motion.

    `utils` has no `__init__.py`, and would go on handing out the old module in it.
    """
    package = workspace.package
    folder = package / "fresh_module" / "utils"
    folder.mkdir(parents=True)
    monkeypatch.setattr(cell_hooks, "course", lambda: SimpleNamespace(package="fresh_module"))
    monkeypatch.setattr(cell_hooks, "_STAMPS", {})
    monkeypatch.syspath_prepend(str(package))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (folder.parent / "__init__.py").write_text("")
    (folder / "motion.py").write_text("STOP, VALUE = object(), 1\n")
    (folder.parent / "driver.py").write_text(
        "from fresh_module.utils import motion\nfrom fresh_module.utils.motion import STOP\n"
    )

    def driver() -> Any:
        forget_changed_modules(package)
        return importlib.import_module("fresh_module.driver")

    first = driver()
    assert driver() is first
    (folder / "motion.py").write_text("STOP, VALUE = object(), 22\n")
    assert driver().motion.VALUE == 22
    assert driver().motion.STOP is driver().STOP
    for name in [name for name in sys.modules if name.startswith("fresh_module")]:
        del sys.modules[name]


@pytest.mark.slow  # a build with colcon
@pytest.mark.ros
def test_a_plain_colcon_build_works_in_a_cell_and_is_found(workspace: Workspace) -> None:
    notebook.begin("03")
    checkpoints.start_at(workspace, "04")
    built = subprocess.run("cd ../.. && colcon build", shell=True, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stdout + built.stderr
    assert built.stderr == ""
    assert f"Finished <<< {PACKAGE}" in built.stdout
    prepare(workspace, os.environ)
    shown = subprocess.run(
        f"ros2 interface show {PACKAGE}/srv/SetSpeed && ros2 pkg executables {PACKAGE} && "
        f'python3 -c "from {PACKAGE}.srv import SetSpeed; print(SetSpeed.Request(speed=0.5))"',
        shell=True, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert "float32 speed" in shown.stdout
    assert f"{PACKAGE} sensor_processor" in shown.stdout
    assert "SetSpeed_Request(speed=0.5)" in shown.stdout
