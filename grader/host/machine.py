"""This machine: its tools, its settings, and the command that installs what is missing.

Standard library only, because `make setup` uses it before anything is installed.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.errors import GraderError
from grader.host import cgroup, shortage, submission_user
from grader.host.cgroup import Hierarchy

# What we need, by the package manager's own names; {python} is python3.11 or the like on Debian.
_PACKAGES: dict[str, dict[str, tuple[str, ...]]] = {
    "apt-get": {"compiler": ("build-essential",), "headers": ("{python}-dev",), "venv": ("{python}-venv",)},
    "dnf": {"compiler": ("gcc", "gcc-c++"), "headers": ("python3-devel",), "venv": ("python3",)},
}


@dataclass(frozen=True)
class CommandResult:
    """How a command ended. `code` is None if it did not start or ran out of time; then `output` says which."""

    code: int | None
    output: str

    @property
    def ok(self) -> bool:
        """Return whether the command ended with status 0."""
        return self.code == 0


class Machine:
    """This machine, as something to look things up in. Tests replace it with a made-up one."""

    @property
    def root(self) -> bool:
        """Return whether this process runs as the superuser."""
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
        """Return whether `path` exists."""
        return Path(path).exists()

    def cgroups(self) -> Hierarchy | None:
        """Return where groups with limits on memory and processes can be made, None if nowhere."""
        return cgroup.find_hierarchy()

    def refuses_other_user(self) -> str:
        """Return why root cannot run a sandbox as another user here, "" if it can."""
        try:
            return submission_user.refusal()
        except GraderError as error:
            return str(error)

    def lacks_for_other_users(self) -> str:
        """Return what keeps sandboxes without namespaces from working here, "" if nothing does."""
        return submission_user.lacks()

    def limit(self, name: str) -> int:
        """Return a resource's limit that this process cannot raise, -1 if there is none."""
        return resource.getrlimit(getattr(resource, f"RLIMIT_{name}"))[1]

    def process_limit(self) -> int:
        """Return how many processes this container may have, a huge number if any."""
        return shortage.process_limit(self.read)

    def free_bytes(self, path: str) -> int:
        """Return the free space of the disk that holds `path`."""
        return shutil.disk_usage(path).free

    def run(
        self, command: Sequence[str], seconds: float, env: Mapping[str, str] | None = None, text: str = ""
    ) -> CommandResult:
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
            return CommandResult(None, f"no answer within {seconds:g} s")
        except OSError as error:
            return CommandResult(None, error.strerror or str(error))
        return CommandResult(ended.returncode, (ended.stdout + ended.stderr).strip())


def install_commands(machine: Machine, things: Sequence[str], python: str = "python3") -> list[list[str]]:
    """Return the commands that install `things` as the superuser; none if the package manager is unknown.

    A thing is "compiler", "headers", "venv" or a package name that all distributions share.
    `python` is the interpreter's name with its version, such as "python3.11".
    """
    manager = next((name for name in _PACKAGES if machine.which(name)), None)
    if manager is None:
        return []
    names = [name.format(python=python) for thing in things for name in _PACKAGES[manager].get(thing, (thing,))]
    refresh = [["apt-get", "update"]] if manager == "apt-get" else []
    return [*refresh, [manager, "install", "-y", *dict.fromkeys(names)]]


def install_line(machine: Machine, things: Sequence[str], python: str = "python3") -> str:
    """Return the command line that installs `things` on this machine."""
    commands = install_commands(machine, things, python)
    if not commands:
        return f"install {', '.join(things)} with this system's package manager"
    sudo = "" if machine.root else "sudo "
    return " && ".join(sudo + " ".join(command) for command in commands)
