"""Run one command of a submission in a sandbox. Nothing else in the kit starts a process of a submission."""

from grader.sandbox.bwrap import HOME, MIB, Limits, Sandbox
from grader.sandbox.process import Process, RunResult, require, run

__all__ = ["HOME", "MIB", "Limits", "Process", "RunResult", "Sandbox", "require", "run"]
