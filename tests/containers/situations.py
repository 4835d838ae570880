"""The machines and containers in which the doctor and a grading have to agree, on this machine's own root.

test_containers.py runs the doctor in each, and what a grading asks first.

They need podman, runc and Docker's seccomp profile, which forbids what podman's own allows: on Debian and Ubuntu
`apt-get install podman runc golang-github-docker-docker-dev`; ROS2_COURSE_KIT_SECCOMP names the profile elsewhere.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from grader import KIT
from grader.host import submission_user

_PACKAGED = "/usr/share/gocode/src/github.com/docker/docker/profiles/seccomp/default.json"
PROFILE = Path(os.environ.get("ROS2_COURSE_KIT_SECCOMP", _PACKAGED))
PYTHON = Path(sys.executable)
REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
_RUN = ["podman", "--runtime", "runc", "run", "--rm", "--ulimit=nofile=4096:4096", "--ulimit=nproc=4096:4096"]
# What goes wrong in a container, such as a fork bomb, must not take this machine with it.
_RUN += ["--pids-limit=2048", "--memory=4g"]
DOCKER = [f"--security-opt=seccomp={PROFILE}", "--cap-add=MKNOD,NET_RAW,AUDIT_WRITE"]
_AS_USER = ["--user=1000:100", "--cap-drop=ALL", "--security-opt=no-new-privileges"]
_NO_PROFILE = ["--security-opt=seccomp=unconfined"]
_UNCONFINED = [*_NO_PROFILE, "--security-opt=unmask=ALL"]
_READ_ONLY = ["--read-only", "--read-only-tmpfs=false", "--tmpfs=/media", "--env=TMPDIR=/media"]
_NO_BUBBLEWRAP = "rm /usr/bin/bwrap; export ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX=1; "
_REQUIRE = """
from grader import sandbox
from grader.host import namespaces
sandbox.require()
print(namespaces.confinement().value)
"""

Ended = subprocess.CompletedProcess[str]


class Shell(Protocol):
    """Runs a shell's command in the kit's folder, somewhere."""

    def __call__(self, command: str, *, seconds: float = 300.0) -> Ended:
        """Return how it ended."""


def contained(options: list[str], command: str, *more: str, seconds: float = 300.0) -> Ended:
    """Run a command in a container with the options."""
    line = [*_RUN, "--network=none", *options, *more, "--rootfs", "/:O", "sh", "-c", f"cd {KIT} && {command}"]
    return subprocess.run(line, capture_output=True, text=True, timeout=seconds, check=False)


def _without_user_namespaces(ids: int, user: int, command: str, *, seconds: float = 300.0) -> Ended:
    """Run a command as `user` of `ids` where none can be made, which holds for a namespace and not for this machine."""
    off = 'echo 0 >/proc/sys/user/max_user_namespaces && exec setpriv --reuid=$0 --regid=$0 --clear-groups -- "$@"'
    shell = ["sh", "-c", command]
    # A program that starts as root of its namespace may change the setting; this one starts before it is root.
    line = ["unshare", "--user", "sh", "-c", 'echo up; read -r _; exec sh -c "$@"', "wait", off, str(user), *shell]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          cwd=KIT, env=_environment()) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "up\n"
        for name in ("uid_map", "gid_map"):
            Path(f"/proc/{process.pid}", name).write_text(f"0 0 {ids}\n")
        printed, errors = process.communicate("go\n", timeout=seconds)
    return subprocess.CompletedProcess(line, process.returncode, printed, errors)


def _here(command: str, *, seconds: float = 300.0) -> Ended:
    line = ["sh", "-c", command]
    return subprocess.run(
        line, capture_output=True, text=True, timeout=seconds, cwd=KIT, env=_environment(), check=False
    )


def _environment() -> dict[str, str]:
    """Return this process's environment without what it has found out about namespaces."""
    return {name: value for name, value in os.environ.items() if name != "ROS2_COURSE_KIT_NAMESPACES"} | {
        "HOME": "/tmp"
    }


@dataclass(frozen=True)
class Situation:
    """A machine or container.

    Attributes:
        name: as the table shows it.
        shell: runs a command there.
        confinement: what keeps a submission apart there, "refused" if a grading is, also for one's own checks, and
            "unsafe" for --unsafe-no-sandbox, of which the doctor does not speak.
        advice: a part of what the doctor says there.
        before: a part of a command that changes the situation before anything runs.
    """

    name: str
    shell: Shell
    confinement: str
    advice: str = ""
    before: str = ""

    def doctor(self) -> Ended:
        """Return what the doctor says there."""
        return self.shell(f"{self.before}HOME=/tmp {PYTHON} -m grader.cli doctor")

    def require(self) -> Ended:
        """Return what a grading asks first, without the grading."""
        return self.shell(f"{self.before}{PYTHON} -c '{_REQUIRE}'")

    def disagreement(self) -> str:
        """Return how the doctor's report differs from what a grading asks first, "" if it does not."""
        said, did = self.doctor(), self.require()
        can = f"This machine can grade (confinement: {self.confinement})."
        if self.advice not in said.stdout:
            return f"the doctor does not say {self.advice!r}"
        if self.confinement == "unsafe":  # the doctor speaks of gradings without the option
            right = "none" in did.stdout
        elif self.confinement in ("users", "namespaces"):
            right = (
                (said.returncode, did.returncode) == (0, 0) and can in said.stdout and self.confinement in did.stdout
            )
        else:
            right = said.returncode == 3 and did.returncode != 0 and "This machine cannot grade yet" in said.stdout
            right = right and ("so no points are given" in did.stderr) == (self.confinement == "none")
        return "" if right else f"{said.stdout}{did.stdout}{did.stderr}"


def _container(name: str, options: list[str], confinement: str, advice: str = "", before: str = "") -> Situation:
    return Situation(name, partial(contained, options), confinement, advice, before)


def _no_user_namespaces(name: str, ids: int, user: int, confinement: str, advice: str) -> Situation:
    return Situation(name, partial(_without_user_namespaces, ids, user), confinement, advice)


_ALL_IDS = 4294967294
SITUATIONS = (
    Situation("a plain machine", _here, "namespaces"),
    _no_user_namespaces("no user namespaces, root", _ALL_IDS, 0, "users", "sysctl -w user.max_user_namespaces"),
    _no_user_namespaces("no user namespaces, a user", _ALL_IDS, 1000, "none", "sysctl -w user.max_user_namespaces"),
    _no_user_namespaces("no user namespaces, root with one user id", 1, 0, "refused", "grader batch"),
    _container("docker", DOCKER, "users", "seccomp=unconfined"),
    _container("docker, tiny /dev/shm", [*DOCKER, "--shm-size=64k"], "users"),
    _container("docker, no /dev/shm", [*DOCKER, "--ipc=none"], "users"),
    _container("docker, read-only", [*DOCKER, *_READ_ONLY], "refused", "--tmpfs /var/tmp"),
    _container("docker, few processes", [*DOCKER, "--pids-limit=60"], "refused", "--pids-limit=512"),
    _container("pod with a profile", [DOCKER[0], *_AS_USER], "none", "seccomp=unconfined"),
    _container("pod of Kubernetes", [*_NO_PROFILE, *_AS_USER], "none", "systempaths=unconfined"),
    _container("pod, unmasked", [*_UNCONFINED, *_AS_USER], "namespaces"),
    _container("pod, few processes", [*_UNCONFINED, *_AS_USER, "--ulimit=nproc=60:60"], "refused", "--ulimit"),
    _container("as advised, and devcontainer", _UNCONFINED, "namespaces"),
    _container("devcontainer, read-only", [*_UNCONFINED, *_READ_ONLY], "namespaces"),
    _container("privileged", ["--privileged"], "namespaces"),
    _container("no bubblewrap, --unsafe-no-sandbox", DOCKER, "unsafe", "install -y bubblewrap", _NO_BUBBLEWRAP),
)


def missing() -> str:
    """Return what these situations need and this machine lacks, "" if nothing."""
    lacks = [tool for tool in ("podman", "runc") if shutil.which(tool) is None]
    lacks += [] if PROFILE.is_file() else [f"{PROFILE}, of golang-github-docker-docker-dev"]
    lacks += [f"root's other users: {why}"] if (why := submission_user.lacks()) else []
    return ", ".join(lacks) if lacks or os.geteuid() == 0 else "root"
