"""This machine: its tools, its settings, and its own command to install what is missing.

Standard library only, because `make setup` asks it before anything is installed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.host import cgroup
from grader.host.cgroup import Hierarchy

# The names under which the package managers know what we need; "python" stands for python3.11 and the like on Debian.
_PACKAGES: dict[str, dict[str, tuple[str, ...]]] = {
    "apt-get": {
        "compiler": ("build-essential",),
        "headers": ("{python}-dev",),
        "venv": ("{python}-venv",),
    },
    "dnf": {"compiler": ("gcc", "gcc-c++"), "headers": ("python3-devel",), "venv": ("python3",)},
    "pacman": {"compiler": ("base-devel",), "headers": ("python",), "venv": ("python",)},
    "zypper": {"compiler": ("gcc", "gcc-c++"), "headers": ("python3-devel",), "venv": ("python3",)},
    "apk": {"compiler": ("build-base",), "headers": ("python3-dev",), "venv": ("python3",)},
}
_INSTALL = {
    "apt-get": "apt-get install -y",
    "dnf": "dnf install -y",
    "pacman": "pacman -S --needed --noconfirm",
    "zypper": "zypper --non-interactive install",
    "apk": "apk add",
}
_REFRESH = {"apt-get": "apt-get update", "pacman": "pacman -Sy", "apk": "apk update"}


@dataclass(frozen=True)
class Ran:
    """A command that ended. `code` is None when it could not be started or ran out of time; then `output` says so."""

    code: int | None
    output: str

    @property
    def ok(self) -> bool:
        """Whether it ended with status 0."""
        return self.code == 0


class Host:
    """The machine as a place to look things up. Tests put a made-up one in its place."""

    @property
    def root(self) -> bool:
        """Whether we are the superuser."""
        return os.geteuid() == 0

    def which(self, tool: str) -> str | None:
        """Return the path of a program, None if there is none."""
        return shutil.which(tool)

    def read(self, path: str) -> str | None:
        """Return the text of a small file, None if it cannot be read."""
        try:
            return Path(path).read_text(errors="replace")
        except OSError:
            return None

    def exists(self, path: str) -> bool:
        """Say whether there is something at `path`."""
        return Path(path).exists()

    def cgroups(self) -> Hierarchy | None:
        """Return where groups with limits on memory and processes can be made, None if nowhere."""
        return cgroup.find()

    def free_bytes(self, path: str) -> int:
        """Return the free space of the disk that holds `path`."""
        return shutil.disk_usage(path).free

    def run(self, command: Sequence[str], seconds: float, env: Mapping[str, str] | None = None, text: str = "") -> Ran:
        """Run `command` with `text` as its input and wait for it, at most `seconds` of wall time."""
        try:
            ended = subprocess.run(
                command,
                input=text,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=seconds,
                env=env,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Ran(None, f"no answer within {seconds:g} s")
        except OSError as error:
            return Ran(None, error.strerror or str(error))
        return Ran(ended.returncode, (ended.stdout + ended.stderr).strip())


def install_commands(host: Host, things: Sequence[str], python: str = "python3") -> list[list[str]]:
    """Return the commands that install `things` here, as the superuser; none if the package manager is unknown.

    A thing is "compiler", "headers", "venv" or the name of a package that all distributions share.
    `python` is the interpreter's name with its version, like "python3.11".
    """
    manager = next((name for name in _PACKAGES if host.which(name)), None)
    if manager is None:
        return []
    names = [name.format(python=python) for thing in things for name in _PACKAGES[manager].get(thing, (thing,))]
    refresh = [_REFRESH[manager].split()] if manager in _REFRESH else []
    return [*refresh, [*_INSTALL[manager].split(), *dict.fromkeys(names)]]


def install_line(host: Host, things: Sequence[str], python: str = "python3") -> str:
    """Return what to type here to install `things`."""
    commands = install_commands(host, things, python)
    if not commands:
        return f"install {', '.join(things)} with this system's package manager"
    sudo = "" if host.root else "sudo "
    return " && ".join(sudo + " ".join(command) for command in commands)
