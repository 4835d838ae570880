"""The process that grades for `check` while it waits for its task."""

from __future__ import annotations

import json
import os
from pathlib import Path

from helpers import until

from grader.notebook import check_process
from grader.processes import supervised
from grader.scoring.rubric import RUBRIC, load
from grader.settings import Reuse, Settings

READS_STANDARD_INPUT = "0 0x0 "  # read(2) and its first argument, as in /proc/PID/syscall


def test_all_settings_reach_the_process():
    """Three of them did not: the seed, and the limits for the build and for tests."""
    asked = Settings(
        load(RUBRIC), Path("/c"), seed=7, build_seconds=1.0, mutation_budget_s=3.0,
        requirements=("F1",), package_path="p", best_effort=True, reuse=Reuse.ANEW,
    )  # fmt: skip
    usual = Settings(asked.rubric, Path("/d"))
    same = [name for name, value in usual.plain().items() if asked.plain()[name] == value]
    assert same == ["course"], "all others are other than usual"
    sent = json.loads(json.dumps(asked.plain()))
    assert Settings.of_plain(sent, asked.progress) == asked


def test_while_it_waits_it_has_no_other_threads():
    """numpy's import starts one, which would take the signal that ends a check, and die of it with all its kind."""
    process = supervised.start(check_process.__name__, str(os.getpid()))
    here = Path(f"/proc/{process.pid}")
    until(lambda: (here / "syscall").read_text().startswith(READS_STANDARD_INPUT))
    threads = len(list((here / "task").iterdir()))
    process.communicate("", timeout=60.0)
    assert (threads, process.returncode) == (1, 0)
