"""Work in a child process: its end is the program's, and Ctrl-C leaves nothing of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import beside

from grader import KIT

TEXTS = beside(__file__)

# Threads that wait, a temporary folder, and a process in a session of its own.
BUSY = """
    subprocess.Popen(["sleep", "1000"], start_new_session=True)
    threading.Thread(target=threading.Event().wait).start()
    print(tempfile.mkdtemp(), flush=True)
    threading.Event().wait()
"""


def start(work: str, temporary: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", TEXTS["PROGRAM"].replace("{work}", work)], stdout=subprocess.PIPE, text=True, cwd=KIT,
        env=os.environ | {"TMPDIR": str(temporary)}, start_new_session=True,
    )  # fmt: skip


def test_the_exit_status_is_that_of_the_work(tmp_path: Path):
    program = start("    print('done'); return 3", tmp_path)
    assert program.communicate(timeout=60)[0] == "done\n"
    assert program.returncode == 3
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_threads_and_processes_and_removes_temporary_files(tmp_path: Path, number: int):
    program = start(BUSY, tmp_path)
    assert program.stdout is not None
    made = Path(program.stdout.readline().strip())
    assert made.is_relative_to(tmp_path)
    os.kill(program.pid, number)
    # The pipe's end comes when the last process that has it is gone, `sleep` among them.
    assert program.communicate(timeout=60)[0] == "interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_a_child_that_is_killed_is_an_error_of_the_host(tmp_path: Path):
    program = start("    os.kill(os.getpid(), signal.SIGKILL)", tmp_path)
    assert "was killed from outside" in program.communicate(timeout=60)[0]
    assert list(tmp_path.iterdir()) == []


def test_it_ends_with_the_process_that_has_started_it(tmp_path: Path):
    """A class that was killed left gradings, and their temporary files, until they were done."""
    inner = TEXTS["PROGRAM"].replace("{work}", BUSY).replace("run(work)", "run(work, os.getppid())")
    starter = f"import subprocess, sys, time; subprocess.Popen([sys.executable, '-c', {inner!r}]); time.sleep(1000)"
    program = subprocess.Popen(
        [sys.executable, "-c", starter], stdout=subprocess.PIPE, text=True, cwd=KIT,
        env=os.environ | {"TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert program.stdout is not None
    assert Path(program.stdout.readline().strip()).is_relative_to(tmp_path)
    program.kill()
    # The pipe's end comes when the last process that has it is gone, `sleep` among them.
    assert program.communicate(timeout=60)[0] == "interrupted\n"
    assert list(tmp_path.iterdir()) == []


def test_the_child_dies_with_its_parent(tmp_path: Path):
    program = start("    print('up', flush=True); threading.Event().wait()", tmp_path)
    assert program.stdout is not None
    assert program.stdout.readline() == "up\n"
    program.kill()
    assert program.communicate(timeout=60)[0] == ""
