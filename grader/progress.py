"""Show on standard error what is going on: on a terminal in one line that changes, in a log line by line."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable

from grader.sanitize import printable

_STEP = re.compile(r"[:;(]")
_WIDTH = 118  # of the line that changes
_EVERY_S = 60.0  # between two lines in a log about what is going on


def step(what: str) -> str:
    """Return the step that a line of progress names, without what explains it or says how far it is."""
    return _STEP.split(what)[0].strip()


class Progress:
    """One line about what is going on, which later ones replace on a terminal."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Begin; `clock` gives the wall time in seconds."""
        self.terminal = sys.stderr.isatty()
        self._clock = clock
        self._started = self._last = clock()
        self._step = ""

    @property
    def seconds(self) -> float:
        """Return the wall time since this was made."""
        return self._clock() - self._started

    def say(self, what: str) -> None:
        """Say what begins, with the time that has passed; how far it is may follow in brackets."""
        line = f"[{self.seconds:5.1f} s] {printable(what, most=400)}"
        before, self._step = self._step, step(what)
        if self.terminal or before == self._step:  # only how far it is has changed
            self.show(line)
        else:
            self._print(line)

    def show(self, line: str) -> None:
        """Show a line until the next one; in a log print it if nothing was printed for a minute."""
        if self.terminal:
            print(f"\r\x1b[K{printable(line, _WIDTH)}", end="", file=sys.stderr, flush=True)
        elif self._clock() - self._last >= _EVERY_S:
            self._print(printable(line, most=400))

    def keep(self, line: str) -> None:
        """Print a line that stays."""
        self.done()
        self._print(line)

    def done(self) -> None:
        """Remove the line that changes."""
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    def _print(self, line: str) -> None:
        print(line, file=sys.stderr, flush=True)
        self._last = self._clock()
