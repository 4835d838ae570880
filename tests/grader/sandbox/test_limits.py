"""Limits of a sandbox as a whole: memory, processes, disk."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers import beside, running, until

from grader import KIT, sandbox
from grader.host import cgroup, ros_env, tempdir
from grader.sandbox import MIB, Limits, Process, Sandbox

TEXTS = beside(__file__)

pytestmark = pytest.mark.sandbox

PYTHON = Sandbox(environment=ros_env.environment(home=sandbox.HOME))
needs_cgroups = pytest.mark.skipif(
    cgroup.find_hierarchy() is None,
    reason="no cgroup can be made here; `grader doctor` names the command that delegates one",
)


def python(code: str, box: Sandbox = PYTHON, **limits: object) -> sandbox.RunResult:
    return sandbox.run(["python3", "-c", code], box, Limits(**{"wall_seconds": 60.0, **limits}))  # type: ignore[arg-type]


@needs_cgroups
def test_a_fork_bomb_hits_the_limit_of_the_whole_sandbox():
    """RLIMIT_NPROC does not limit root; the cgroup does."""
    result = python(TEXTS["BOMB"], processes=40)
    made, _, words = result.output.partition(" ")
    assert int(made) < 40
    assert words == "Resource temporarily unavailable\n"
    assert result.stopped == "processes"


@needs_cgroups
def test_memory_is_counted_for_all_processes_together():
    code = "import os\nfor _ in range(4):\n    if os.fork() == 0:\n        kept = []\n        while True:\n"
    code += "            kept.append(b'x' * (1 << 20))\nfor _ in range(4):\n    os.wait()\n"
    result = python(code, resident_bytes=200 * MIB)
    assert result.stopped == "memory"


@needs_cgroups
def test_disks_in_memory_count_as_memory():
    code = "open('/tmp/big', 'wb').write(b'x' * (150 << 20)); open('/dev/shm/big', 'wb').write(b'x' * (150 << 20))"
    assert python(code, resident_bytes=200 * MIB).stopped == "memory"


@pytest.mark.parametrize("folder", ["/dev/shm", "/run", "/dev", "/", "/home"])
def test_disks_in_memory_have_a_size(folder: str):
    code = f"import os, sys\nfor n in range(4):\n    open(f'{folder}/x{{n}}', 'wb').write(b'x' * (100 << 20))"
    result = python(code, file_bytes=200 * MIB)
    assert "OSError" in result.output or "Error: [Errno" in result.output


@pytest.mark.parametrize(
    ("code", "limits", "stopped"),
    [
        ("import time\nfor n in range(30):\n    open(f'/ws/out/{n}', 'wb').write(b'x' * (1 << 20))\ntime.sleep(100)",
         {"disk_bytes": 10 * MIB}, "disk"),
        ("for n in range(500):\n    open(f'/ws/out/{n}', 'w')", {"files": 200}, "disk"),
        ("open('/ws/out/x', 'w').write('x')", {}, ""),
    ],
    ids=["fills the disk", "a million small files", "below the limits"],
)  # fmt: skip
def test_a_command_that_writes_too_much_is_stopped(tmp_path: Path, code: str, limits: dict[str, int], stopped: str):
    box = Sandbox(writable={tmp_path: "/ws/out"}, environment=PYTHON.environment)
    result = python(code, box, **limits)
    assert result.stopped == stopped
    assert result.wall_seconds < 60


def test_a_file_with_holes_counts_by_its_size(tmp_path: Path):
    """A copy of it would write the zeros."""
    box = Sandbox(writable={tmp_path: "/ws/out"}, environment=PYTHON.environment)
    code = "import os, time\nos.truncate(os.open('/ws/out/a', os.O_CREAT | os.O_RDWR), 50 << 20)\ntime.sleep(100)"
    assert python(code, box, disk_bytes=10 * MIB).stopped == "disk"


@pytest.mark.slow  # makes thousands of folders
@pytest.mark.parametrize(("name", "depth"), [("d", 3000), ("d" * 250, 30)])
def test_folders_in_folders_without_end_count_as_too_many(tmp_path: Path, name: str, depth: int):
    """Beyond a path of 4096 characters they cannot be counted; and Python's rmtree gives up earlier."""
    box = Sandbox(writable={tmp_path: "/ws/out"}, environment=PYTHON.environment)
    code = f"import os\nos.chdir('/ws/out')\nfor _ in range({depth}):\n    os.mkdir('{name}')\n    os.chdir('{name}')"
    try:
        assert python(code, box).stopped == "disk"
    finally:
        tempdir.remove(tmp_path / name)
    assert not (tmp_path / name).exists()


def test_only_the_standard_streams_are_inherited():
    """The pipes used to set up the sandbox are closed before the command starts."""
    assert (
        python("import os; print(sorted(os.listdir('/proc/self/fd')))").output == "['0', '1', '2', '3']\n"
    )  # 3: listdir
    assert python("import sys; print(repr(sys.stdin.read()))").output == "''\n"


@needs_cgroups
def test_a_group_is_removed_with_its_sandbox():
    with Process(["sleep", "100"], PYTHON, Limits()) as process:
        folders = list(process._group.folders)
        assert all(folder.is_dir() for folder in folders)
    assert folders
    assert not any(folder.exists() for folder in folders)


@needs_cgroups
def test_a_sandbox_does_not_outlive_its_grader_even_during_set_up(tmp_path: Path):
    """A grader that is killed before bubblewrap has tied itself to it never lets the command start.

    And the watchdog kills a half-built sandbox.
    """
    code = (
        "import os, signal\nfrom grader import sandbox\nfrom grader.sandbox import process\n"
        "process._Output = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        f"sandbox.Process(['sleep', '{os.getpid()}.1234'], sandbox.Sandbox(), sandbox.Limits())"
    )
    ended = subprocess.run([sys.executable, "-c", code], cwd=KIT, check=False)
    assert ended.returncode == -9
    until(lambda: not running(f"{os.getpid()}.1234"))


@pytest.mark.skipif(
    (hierarchy := cgroup.find_hierarchy()) is None or hierarchy.version != 1,
    reason="needs cgroups of version 1 to make one in",
)
def test_a_submission_is_not_blamed_when_the_host_runs_out_of_memory():
    """A machine without memory kills its largest process, which has not reached any limit of the grader's."""
    assert hierarchy is not None
    outer = {name: folder / f"test-{os.getpid()}" for name, folder in hierarchy.folders.items()}
    for folder in outer.values():
        folder.mkdir()
    try:
        (outer["memory"] / "memory.limit_in_bytes").write_text(str(200 * MIB))
        done = subprocess.run(
            [sys.executable, "-c", TEXTS["HUNGRY"], *map(str, outer.values())],
            cwd=KIT, capture_output=True, text=True, check=False,
        )  # fmt: skip
    finally:
        deadline = time.monotonic() + 20.0
        for folder in outer.values():
            for left in [*folder.glob("*/"), folder]:
                while left.exists() and time.monotonic() < deadline:
                    try:
                        left.rmdir()
                    except OSError:
                        time.sleep(0.05)
    assert done.stdout.startswith("grader: The grader has run out of memory."), done.stdout + done.stderr
