"""Real terminals for tests: a shell on a pty in a network of its own, used as by a person."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

# No program prints this prompt, so it marks the end of a line, with its exit code.
PROMPT = re.compile(r"<<(\d+)>> $")
CONTROLS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b[()][A-Z0-9]|\x1b[=>]|\x1b\][^\x07]*\x07")
STEP_S = 0.2
SHELLS = {"bash": ["bash", "--norc", "--noprofile", "-i"], "zsh": ["zsh", "-f", "-i"]}
# What a shell must be told to print nothing but the output and the prompt.
QUIET = {
    "bash": "bind 'set enable-bracketed-paste off'; PS1='<<$?>> '",
    "zsh": "unsetopt prompt_sp zle; PS1='<<%?>> '",
}


def needs_zsh(value: str) -> ParameterSet:
    """Return a test's parameter that is skipped where there is no zsh."""
    return pytest.param(
        value, marks=pytest.mark.skipif(shutil.which("zsh") is None, reason="needs zsh: apt-get install zsh")
    )


@contextmanager
def desk(folder: Path, env: dict[str, str], shell: str = "bash") -> Iterator[Callable[[], Terminal]]:
    """Yield a function that opens a terminal in `folder` with a shell, "bash" or "zsh".

    The terminals share a network with no other process in it.
    """
    here, there = socket.socketpair()
    process = subprocess.Popen(
        ["bwrap", "--dev-bind", "/", "/", "--tmpfs", "/dev/shm", "--unshare-net", "--die-with-parent", "--chdir",
         folder, sys.executable, __file__, str(there.fileno()), *SHELLS[shell]],
        env=env, pass_fds=[there.fileno()], stdin=subprocess.DEVNULL,
    )  # fmt: skip
    there.close()
    terminals: list[Terminal] = []

    def open_one() -> Terminal:
        here.send(b"+")
        _, (fd,), _, _ = socket.recv_fds(here, 1, 1)
        terminals.append(Terminal(fd, QUIET[shell]))
        return terminals[-1]

    try:
        yield open_one
    finally:
        for terminal in terminals:
            terminal.close()
        here.close()  # the process waits for its shells, and these for their commands
        process.wait(timeout=60)


def serve(requests: socket.socket, shell: list[str]) -> None:
    """For each byte received, start a shell on a new pty and send back its other end; then wait for the shells."""
    shells = []
    while requests.recv(1):
        pid, fd = pty.fork()
        if pid == 0:
            requests.close()
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # ignored if the tests run in the background
            os.execvp(shell[0], shell)
        shells.append(pid)
        socket.send_fds(requests, [b"+"], [fd])
        os.close(fd)
    for pid in shells:
        os.waitpid(pid, 0)


class Terminal:
    """A window with a shell in it.

    Attributes:
        code: the exit code of the line that ended last.
    """

    def __init__(self, fd: int, quiet: str) -> None:
        self.code = 0
        self._fd, self._text = fd, ""
        # Wide enough that no line is wrapped.
        fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 500, 0, 0))
        self.type(f"VIRTUAL_ENV_DISABLE_PROMPT=1; {quiet}\n")
        self._until(lambda: self._text.endswith("<<0>> "), 30.0, "the first prompt")

    def type(self, keys: str) -> None:
        """Press keys."""
        os.write(self._fd, keys.encode())

    def run(self, line: str, limit_s: float = 90.0) -> str:
        """Type a line, wait for its end, and return its output."""
        self.start(line)
        return self.end(limit_s)

    def start(self, line: str) -> None:
        """Type a line without waiting for its end."""
        self._text = ""
        self.type(line + "\n")
        self._until(lambda: "\n" in self._text, 30.0, "the echo of what was typed")
        self._text = self._text.split("\n", 1)[1]

    def wait_for(self, pattern: str, limit_s: float = 90.0) -> str:
        """Return the output since the line was typed, once it holds a pattern."""
        self._until(lambda: re.search(pattern, self._text, re.MULTILINE) is not None, limit_s, repr(pattern))
        return self._text

    def interrupt(self, limit_s: float = 60.0) -> str:
        """Press Ctrl-C, wait for the line's end, and return its output."""
        self.type("\x03")
        return self.end(limit_s)

    def end(self, limit_s: float = 90.0) -> str:
        """Wait for the line's end, and return its output."""
        self._until(lambda: PROMPT.search(self._text) is not None, limit_s, "the prompt")
        found = PROMPT.search(self._text)
        assert found is not None
        self.code = int(found[1])
        return self._text[: found.start()]

    def close(self) -> None:
        """Close the window, which sends SIGHUP to its processes."""
        os.close(self._fd)

    def _until(self, holds: Callable[[], bool], limit_s: float, what: str) -> None:
        end = time.monotonic() + limit_s
        while not holds():
            assert time.monotonic() < end, f"{what} did not appear in time; the terminal shows:\n{self._text}"
            if select.select([self._fd], [], [], STEP_S)[0]:
                new = os.read(self._fd, 65536).decode(errors="replace")
                self._text = CONTROLS.sub("", self._text + new).replace("\r\n", "\n")


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2:])
