"""Slots on the cores for the processes of a grading: own tests and mutants have priority, trials take what is free.

A package's own tests and then its mutants are one long chain of work; trials are many short pieces. A grading ends
soonest if the chain never waits for a core and the trials use the cores that it leaves free.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator

PER_CORE = 2
"""Slots for each core: more than one, because every process waits at times."""

_changed = threading.Condition()
_reserved = _held = 0


@contextlib.contextmanager
def reserve(processes: int) -> Iterator[None]:
    """Reserve `processes` slots with priority until the block ends."""
    global _reserved
    with _changed:
        _reserved += processes
    try:
        yield
    finally:
        with _changed:
            _reserved -= processes
            _changed.notify_all()


@contextlib.contextmanager
def free_slot() -> Iterator[None]:
    """Wait for a free slot without priority, and hold it until the block ends; there is always at least one."""
    global _held
    with _changed:
        _changed.wait_for(lambda: _held < max(PER_CORE * (os.cpu_count() or 1) - _reserved, 1))
        _held += 1
    try:
        yield
    finally:
        with _changed:
            _held -= 1
            _changed.notify_all()
