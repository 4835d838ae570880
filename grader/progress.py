"""Show on standard error what is going on: on a terminal in one line that changes, in a log line by line."""

from __future__ import annotations

import sys
import time

from grader.sanitize import printable

_WIDTH = 118  # of the line that changes


class Progress:
    """One line about what is going on, which later ones replace on a terminal."""

    def __init__(self) -> None:
        self.terminal = sys.stderr.isatty()
        self._started = time.monotonic()

    @property
    def seconds(self) -> float:
        """Return the wall time since this was made."""
        return time.monotonic() - self._started

    def say(self, what: str) -> None:
        """Say what begins, with the time that has passed."""
        line = f"[{self.seconds:5.1f} s] {printable(what, most=400)}"
        if self.terminal:
            self.show(line)
        else:
            print(line, file=sys.stderr, flush=True)

    def show(self, line: str) -> None:
        """Show a line until the next one, on a terminal only."""
        if self.terminal:
            print(f"\r\x1b[K{printable(line, _WIDTH)}", end="", file=sys.stderr, flush=True)

    def done(self) -> None:
        """Remove the line that changes."""
        if self.terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
