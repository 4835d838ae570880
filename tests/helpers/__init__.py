"""What several tests share: examples, runs of commands, notebooks."""

import contextlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml


def beside(file: str) -> Any:
    """Return what the YAML file beside a test holds: the programs that it runs, and the texts that it gives to read."""
    return yaml.safe_load(Path(file).with_suffix(".yaml").read_text(encoding="utf-8"))


def until(holds: Callable[[], object], limit_s: float = 120.0) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + limit_s
    while not holds():
        assert time.monotonic() < end, "the condition was not met in time"
        time.sleep(0.01)


def running(words: str) -> list[str]:
    """Return the processes of this machine with this text in their command line, whose words end in NUL."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended
            if words.encode() in (process / "cmdline").read_bytes():
                found.append(process.name)
    return found
