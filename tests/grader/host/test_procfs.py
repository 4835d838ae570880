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


def test_children_are_below_their_parents():
    with subprocess.Popen(["sleep", "60"]) as child:
        assert child.pid in procfs.children(os.getpid())
        assert child.pid in procfs.descendants(os.getpid())
        assert child.pid in procfs.descendants_at_a_glance(os.getpid())
        child.kill()


def test_grandchildren_are_seen_at_a_glance():
    with subprocess.Popen(["sh", "-c", "sleep 60 & echo $!; wait"], stdout=subprocess.PIPE, text=True) as shell:
        assert shell.stdout is not None
        grandchild = int(shell.stdout.readline())
        assert set(procfs.descendants_at_a_glance(os.getpid())) >= {shell.pid, grandchild}
        procfs.kill([grandchild])
