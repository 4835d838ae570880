"""The process that grades for `check` while it waits for its task."""

from __future__ import annotations

from pathlib import Path

from helpers.ros2_runs import until

from grader.notebook import check_process

READS_STANDARD_INPUT = "0 0x0 "  # read(2) and its first argument, as in /proc/PID/syscall


def test_while_it_waits_it_has_no_other_threads():
    """numpy's import starts one, which would take the signal that ends a check, and die of it with all its kind."""
    process = check_process._spare.take()
    here = Path(f"/proc/{process.pid}")
    until(lambda: (here / "syscall").read_text().startswith(READS_STANDARD_INPUT))
    threads = len(list((here / "task").iterdir()))
    process.communicate("", timeout=60.0)
    assert (threads, process.returncode) == (1, 0)
