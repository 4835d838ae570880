"""Reading running processes from /proc: any of them may end in the meantime."""

from __future__ import annotations

import os
import subprocess

from grader.host import procfs


def ended() -> int:
    """Return the id of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def test_a_process_that_has_just_ended_has_no_thread_times():
    assert procfs.thread_times([ended()]) == {}
    # Another process of one thread: in this one, threads of other tests may begin and end meanwhile.
    with subprocess.Popen(["sleep", "60"]) as running:
        assert procfs.thread_times([ended(), running.pid]).keys() == {running.pid}
        running.kill()


def test_children_and_grandchildren_are_below_their_parents():
    with subprocess.Popen(["sh", "-c", "sleep 60 & echo $!; wait"], stdout=subprocess.PIPE, text=True) as shell:
        assert shell.stdout is not None
        grandchild = int(shell.stdout.readline())
        both = {shell.pid, grandchild}
        assert shell.pid in procfs.children(os.getpid())
        assert {*procfs.descendants(os.getpid())} >= both
        assert {*procfs.descendants_at_a_glance(os.getpid())} >= both
        procfs.kill([grandchild])
