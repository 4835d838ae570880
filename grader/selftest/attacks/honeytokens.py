"""Honeytokens: things planted on the host for an attack to read, change or reach, and what became of them."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from grader import KIT
from grader.host import ros_env

SECRET_VARIABLE = "GRADER_ATTACK_SECRET"
_GRADER = KIT / "grader"
_SETTLE_S = 2.0


class Honeytokens:
    """Another submission's report, a file and a variable with a secret, and an open port. No attack may reach them."""

    def __init__(self, folder: Path) -> None:
        self._began = time.time()
        self.token = f"canary{secrets.token_hex(8)}"
        self.secret = folder / "roster.csv"
        self.secret.write_text(f"student,password\nann,{self.hidden}\n")
        self.neighbour = folder / "neighbour"
        self.neighbour.mkdir()
        (self.neighbour / "report.json").write_text('{"total": 12}')
        self.results = folder / "out"
        self._server = socket.create_server(("127.0.0.1", 0))
        self._datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._datagrams.bind(("127.0.0.1", self._server.getsockname()[1]))
        self._before = self._state()
        self.calls = 0
        for receive in (lambda: self._server.accept()[0].close(), lambda: self._datagrams.recv(1000)):
            threading.Thread(target=self._count, args=[receive], daemon=True).start()

    @property
    def placeholders(self) -> dict[str, str]:
        """Return the values of the placeholders in an attack's texts."""
        return {
            "SECRET": str(self.secret), "TOKEN": self.token, "PORT": str(self._server.getsockname()[1]),
            "RESULTS": str(self.results), "NEIGHBOUR": str(self.neighbour / "report.json"), "KIT": str(_GRADER),
        }  # fmt: skip

    def damage(self) -> list[str]:
        """Return a phrase for each thing on the host that was changed, reached or left running."""
        found = [
            f"{name} changed{_what(self._before[name], state)}"
            for name, state in self._state().items()
            if state != self._before[name]
        ]
        if self.calls:
            found.append(f"a port of the host was reached {self.calls} times")
        deadline = time.monotonic() + _SETTLE_S
        while (left := self._processes()) and time.monotonic() < deadline:
            time.sleep(0.02)
        return found + [f"the process {pid} still runs" for pid in left]

    def marks(self, cache: Path, key: Path) -> list[str]:
        """Return a phrase for each new file with the token in the build trees that submissions share.

        Copies of the file `key` do not count: only submissions that have the same file share a tree.
        """
        trees = [path for path in (cache / "trees").glob("*") if path.is_dir() and path.stat().st_mtime > self._began]
        own = key.read_bytes() if key.is_file() else b""
        return [
            f"its mark is in {path.name} of a shared build tree"
            for path in _holding(self.token, trees)
            if path.read_bytes() != own
        ]

    def leaks(self, *folders: Path) -> list[str]:
        """Return the names of the files below `folders` that contain the secret."""
        return [path.name for path in _holding(self.hidden, folders)]

    def close(self) -> None:
        """Close the port."""
        for each in (self._server, self._datagrams):
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    @property
    def hidden(self) -> str:
        """Return the secret: the token reversed, because the token itself may be in the attack's own files."""
        return self.token[::-1]

    def _state(self) -> dict[str, object]:
        home = Path.home()
        return {
            "the neighbour's report": (self.neighbour / "report.json").read_text(),
            "the roster": self.secret.read_text(),
            "the kit": _digest(_GRADER),
            "the Python packages": _listing(ros_env.SITE_PACKAGES),
            "the home folder": _listing(home, ignore=(".cache", ".bash_history", ".python_history")),
            "shared memory": sorted((path.name,) for path in Path("/dev/shm").iterdir() if "canary" in path.name),
        }

    def _processes(self) -> list[str]:
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != os.getpid():
                with contextlib.suppress(OSError):
                    if self.token.encode() in (entry / "cmdline").read_bytes():
                        found.append(entry.name)
        return found

    def _count(self, receive: Callable[[], object]) -> None:
        with contextlib.suppress(OSError):
            while receive() != b"":  # an empty datagram when the socket is shut down
                self.calls += 1


@contextlib.contextmanager
def planted() -> Iterator[Honeytokens]:
    """Plant the honeytokens, also a secret in the grader's own environment, and remove them again."""
    with tempfile.TemporaryDirectory(prefix="attack-") as folder:
        tokens = Honeytokens(Path(folder))
        os.environ[SECRET_VARIABLE] = tokens.hidden
        try:
            yield tokens
        finally:
            del os.environ[SECRET_VARIABLE]
            tokens.close()


def _what(before: object, after: object) -> str:
    """Return which entries of a listing changed: another program's on a busy machine can be told by their names."""
    if not isinstance(before, list) or not isinstance(after, list):
        return ""
    return f": {', '.join(sorted({str(name) for name, *_ in set(before) ^ set(after)}))}"


def _holding(text: str, folders: Iterable[Path]) -> list[Path]:
    paths = [path for folder in folders for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    return [path for path in paths if text.encode() in path.read_bytes()]


def _digest(folder: Path) -> str:
    """Return a hash of the file in the kit that attacks try to change, and of the names beside it."""
    names = "\n".join(sorted(path.name for path in folder.iterdir() if path.suffix != ".py"))
    return hashlib.sha256((folder / "__init__.py").read_bytes() + names.encode()).hexdigest()


def _listing(folder: Path, ignore: tuple[str, ...] = ()) -> list[tuple[str, int]]:
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        return sorted(
            (e.name, e.stat(follow_symlinks=False).st_mtime_ns if e.is_file() else 0)
            for e in entries
            if e.name not in ignore
        )
    return []
