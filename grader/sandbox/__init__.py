"""Run a submission's commands in a sandbox, and read the files that they leave. Only this package starts them.

The sandbox is made by bubblewrap: a read-only system, a private /tmp and home, its own pid, ipc, user and host name,
either no network or that of the caller's namespace, and limits on time, memory, processes, files and output.
"""

from grader.sandbox.bwrap import AT_START, HOME, MIB, Limits, Sandbox, beside_script
from grader.sandbox.process import Process, RunResult, require, run

__all__ = [
    "AT_START", "HOME", "MIB", "Limits", "Process", "RunResult", "Sandbox", "beside_script", "require", "run",
]  # fmt: skip
