"""Share the cores among what a grading does at the same time: own tests and mutants first, trials beside them.

A package's own tests and then its mutants are one long chain of work, the trials are many short pieces. A grading is
over soonest if the chain is never held up and the pieces fill what it leaves.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator

PER_CORE = 2
"""How many processes are worth starting for each core, because each waits at times."""

_changed = threading.Condition()
_first = _beside = 0


@contextlib.contextmanager
def first(processes: int) -> Iterator[None]:
    """Compute in so many processes, from now on."""
    global _first
    with _changed:
        _first += processes
    try:
        yield
    finally:
        with _changed:
            _first -= processes
            _changed.notify_all()


@contextlib.contextmanager
def beside() -> Iterator[None]:
    """Compute in one process, once the cores have room for it beside what comes first: at least for one at a time."""
    global _beside
    with _changed:
        _changed.wait_for(lambda: _beside < max(PER_CORE * (os.cpu_count() or 1) - _first, 1))
        _beside += 1
    try:
        yield
    finally:
        with _changed:
            _beside -= 1
            _changed.notify_all()
