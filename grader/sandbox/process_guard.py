"""Watch how many processes and threads a sandbox has, where no cgroup counts them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

from grader.host import procfs


class ProcessGuard:
    """Stops a command that has used up its processes.

    The kernel refuses it more of them (RLIMIT_NPROC), but those that it has already would keep every core of the
    machine busy until the command's time is over.
    """

    _POLL_S = 0.1
    # The kernel counts what starts and ends between two looks, too.
    _SHARE = 7 / 8

    def __init__(self, tree: Callable[[], Sequence[int]], limit: int, stop: Callable[[], None]) -> None:
        """Watch from now on the processes that `tree` returns.

        Once they have almost `limit` threads together, call `stop`, and `exceeded` is "processes".
        """
        self.exceeded = ""
        self._tree, self._most, self._stop = tree, self._SHARE * limit, stop
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closed.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._closed.wait(self._POLL_S):
            if procfs.count_threads(self._tree()) >= self._most:
                self.exceeded = "processes"
                self._stop()
                return
