"""The reports of `grader doctor` on machines of all kinds. Most are fakes; the last is this one."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from grader.errors import GraderError
from grader.host import cgroup, doctor, submission_user
from grader.host.cgroup import Hierarchy
from grader.host.doctor import Diagnosis, State, examine, exit_status, render
from grader.host.machine import CommandResult, Machine, install_line
from grader.sandbox.bwrap import Limits, with_limits

HEALTHY_TOOLS = {"apt-get", "cc", "c++", "make", "prlimit", "cmake", "ninja", "bwrap", "ccache"}

V1_FILES, V2_FILES = ["/sys/fs/cgroup/memory", "/sys/fs/cgroup/pids"], ["/sys/fs/cgroup/cgroup.controllers"]
VERSION_1 = Hierarchy(1, {name: Path("/sys/fs/cgroup", name) for name in ("memory", "pids")})
VERSION_2 = Hierarchy(2, dict.fromkeys(("memory", "pids"), Path("/sys/fs/cgroup/user.slice")))


class FakeMachine(Machine):
    """A machine on which everything is fine, except for what the test changes."""

    def __init__(
        self,
        tools: set[str] = HEALTHY_TOOLS,
        files: Mapping[str, str] | None = None,
        fails: Mapping[str, str] | None = None,
        root: bool = False,
        cgroups: Hierarchy | None = None,
        free: int = 50 * doctor.GB,
        refusal: str = "",
        lacks: str = "",
        limits: Mapping[str, int] | None = None,
    ) -> None:
        """`fails` maps a word of a command to the output of the command, which then fails."""
        self._tools, self._files, self._fails = tools, files or {}, fails or {}
        self._limits = limits or {}
        self._root, self._cgroups, self._free, self._refusal, self._lacks = root, cgroups, free, refusal, lacks

    @property
    def root(self) -> bool:
        return self._root

    def which(self, tool: str) -> str | None:
        return f"/usr/bin/{tool}" if tool in self._tools else None

    def read(self, path: str) -> str | None:
        return self._files.get(path) or {"/proc/meminfo": "MemAvailable: 8000000 kB\n"}.get(path)

    def exists(self, path: str) -> bool:
        return path in self._files or path.endswith("/Python.h")

    def cgroups(self) -> Hierarchy | None:
        return self._cgroups

    def refuses_other_user(self) -> str:
        return self._refusal

    def lacks_for_other_users(self) -> str:
        return self._lacks

    def limit(self, name: str) -> int:
        return self._limits.get(name, -1)

    def free_bytes(self, *_: object) -> int:
        return self._free

    def run(self, command: Sequence[str], *_: object, **__: object) -> CommandResult:
        for word, output in self._fails.items():
            if any(word in part for part in command):
                return CommandResult(1, output)
        return CommandResult(0, "fine")


def found(machine: Machine, name: str) -> Diagnosis:
    return next(diagnosis for diagnosis in examine(machine) if diagnosis.name == name)


MEMORY = {"/proc/meminfo": "MemTotal: 1 kB\nMemAvailable: 1048576 kB\n"}
NO_STRING = {"c++": "In file <stdin>\nfatal error: string: No such file"}
NO_MESSAGE = {"doctor_listener": "no answer"}
NO_RCLPY = {"import rclpy, std_msgs": "ModuleNotFoundError: No module named 'rclpy'"}


@pytest.mark.parametrize(
    ("machine", "name", "state", "words", "fix"),
    [
        (FakeMachine(HEALTHY_TOOLS - {"bwrap"}), "bubblewrap", State.BAD, "not found",
         "sudo apt-get update && sudo apt-get install -y bubblewrap"),
        (FakeMachine(files={"/.dockerenv": ""}, fails={"bwrap": "bwrap: No permissions"}), "bubblewrap", State.BAD,
         "this container forbids it", "--security-opt seccomp=unconfined"),
        (FakeMachine(fails=NO_STRING), "C++ compiler", State.BAD, "fatal error: string", "build-essential"),
        (FakeMachine(fails=NO_MESSAGE), "DDS in a network namespace", State.BAD, "no answer", "lo must be UP"),
        (FakeMachine(fails=NO_MESSAGE), "bubblewrap", State.OK, "isolates", ""),
        (FakeMachine(fails=NO_RCLPY), "import rclpy", State.BAD, "ModuleNotFoundError", doctor.REINSTALL),
        (FakeMachine(free=9 * doctor.GB), "disk", State.OK, "9.0 GB free", ""),
        (FakeMachine(free=doctor.GB), "disk", State.WARN, "1.0 GB free", "make clean"),
        (FakeMachine(free=0), "disk", State.BAD, "0.0 GB free", "make clean"),
        (FakeMachine(files=MEMORY), "memory", State.WARN, "1.0 GB", "ps "),
        (FakeMachine(HEALTHY_TOOLS - {"ccache"}), "ccache", State.WARN, "twice as long", "install -y ccache"),
    ],
)  # fmt: skip
def test_what_is_missing_or_broken_is_named_with_its_fix(
    machine: Machine, name: str, state: State, words: str, fix: str
):
    diagnosis = found(machine, name)
    assert diagnosis.state is state
    assert words in diagnosis.found
    assert fix in diagnosis.fix


@pytest.mark.parametrize(
    ("manager", "line"),
    [
        ("apt-get", "apt-get update && apt-get install -y build-essential"),
        ("dnf", "dnf install -y gcc gcc-c++"),
        ("pacman", "install compiler with this system's package manager"),
    ],
)
def test_a_missing_compiler_is_installed_by_the_distributions_own_command(manager: str, line: str):
    compiler = found(FakeMachine({manager, "bwrap", "make"}, root=True), "C compiler")
    assert (compiler.state, compiler.fix) == (State.BAD, line)


def test_what_is_installed_is_named_as_the_distribution_does():
    assert install_line(FakeMachine(set()), ["bubblewrap"]) == "install bubblewrap with this system's package manager"
    assert install_line(FakeMachine(root=True), ["headers"], "python3.12").endswith("install -y python3.12-dev")


@pytest.mark.parametrize(
    ("setting", "value", "fix"),
    [
        ("kernel/apparmor_restrict_unprivileged_userns", "1", "kernel.apparmor_restrict_unprivileged_userns=0"),
        ("kernel/unprivileged_userns_clone", "0", "kernel.unprivileged_userns_clone=1"),
        ("user/max_user_namespaces", "0", "user.max_user_namespaces=15000"),
    ],
)
def test_a_kernel_setting_that_forbids_sandboxes_is_named_with_its_command(setting: str, value: str, fix: str):
    machine = FakeMachine(files={f"/proc/sys/{setting}": value + "\n"}, fails={"bwrap": "bwrap: Permission denied"})
    bubblewrap = found(machine, "bubblewrap")
    assert bubblewrap.state is State.BAD
    assert "Permission denied" in bubblewrap.found
    assert bubblewrap.fix == f"sudo sysctl -w {fix}"


@pytest.mark.parametrize(
    ("confined", "fix"),
    [
        ({}, "cannot be configured here; grade an export of the platform with `grader batch` on another machine"),
        ({"/proc/self/mountinfo": "1 2 0:3 / /proc/sys ro"}, "docker run --security-opt systempaths=unconfined ..."),
        ({"/var/run/secrets/kubernetes.io": "", "/proc/self/mountinfo": "1 2 0:3 / /proc/sys ro"},
         "in the pod: securityContext: {procMount: Unmasked}"),
    ],
)  # fmt: skip
def test_a_fix_that_is_in_force_is_not_repeated(confined: dict[str, str], fix: str):
    """A container that ran with seccomp=unconfined was told to run with it."""
    files = {"/.dockerenv": "", "/proc/self/status": "Name:\tx\nSeccomp:\t0\n", **confined}
    machine = FakeMachine(files=files, fails={"bwrap": "bwrap: Can't mount proc"})
    assert found(machine, "bubblewrap").fix.startswith(fix)


@pytest.mark.parametrize(
    ("root", "instead", "status", "last"),
    [
        (True, "users: ", 0, "This machine can grade (confinement: users)."),
        (False, "none: `grader check` works", 3, "This machine cannot grade yet: bubblewrap."),
    ],
)
def test_without_namespaces_root_grades_with_other_users(root: bool, instead: str, status: int, last: str):
    """The doctor called a container bad in which a grading gave 100 points."""
    machine = FakeMachine(root=root, fails={"bwrap": "bwrap: No permissions to create new namespace"})
    diagnoses = examine(machine)
    assert found(machine, "instead of namespaces").found.startswith(instead)
    assert exit_status(diagnoses) == status
    assert render(diagnoses).endswith(last)


@pytest.mark.parametrize(
    ("lacks", "fix"),
    [
        ("other users cannot enter /root/python, so no submission could start Python from there",
         "rm -rf .venv && make setup PYTHON=/usr/bin/python3"),
        ("proot is not installed", "apt-get update && apt-get install -y proot"),
        ("this container has no other user's id", doctor.ELSEWHERE),
        ("/var/tmp cannot be written", doctor.WRITABLE),
        ("proot error: can't create temporary directory: Read-only file system", doctor.WRITABLE),
    ],
)  # fmt: skip
def test_what_other_users_cannot_reach_is_said_with_its_fix(lacks: str, fix: str):
    """The doctor said "can grade" in a container with a read-only root, where every grading was refused."""
    instead = found(FakeMachine(root=True, fails={"bwrap": "no"}, lacks=lacks), "instead of namespaces")
    assert (instead.state, instead.fix) == (State.BAD, fix)


@pytest.mark.parametrize(
    ("limits", "files", "state", "words"),
    [
        ({}, {}, State.OK, "none is below"),
        ({"NPROC": 511}, {}, State.BAD, "NPROC 511; a sandbox needs NPROC 512, NOFILE 1024"),
        ({"NPROC": 512, "NOFILE": 1024}, {"/sys/fs/cgroup/pids/pids.max": "512\n"}, State.OK, "none is below"),
        ({}, {"/sys/fs/cgroup/pids.max": "200\n"}, State.WARN, "200 processes in this container"),
        ({}, {"/sys/fs/cgroup/pids/pids.max": "60\n"}, State.BAD, "60 processes in this container"),
        ({}, {"/sys/fs/cgroup/pids.max": "max\n"}, State.OK, "none is below"),
    ],
)
def test_limits_that_a_sandbox_cannot_raise_are_bad(
    limits: dict[str, int], files: dict[str, str], state: State, words: str
):
    """The doctor said "can grade" with 60 processes for the user, where every grading was refused."""
    here = found(FakeMachine(limits=limits, files=files), "limits")
    assert here.state is state
    assert here.found.startswith(words)


def test_the_doctor_knows_the_limits_of_a_sandbox():
    options = dict(word.removeprefix("--").split("=") for word in with_limits([], Limits())[2:] if "=" in word)
    assert {name: options[name.lower()] for name in doctor.LIMITS} == {n: str(v) for n, v in doctor.LIMITS.items()}


@pytest.mark.parametrize(
    ("tools", "root", "fix"), [({"sudo"}, True, ""), (set(), False, ""), ({"sudo"}, False, "sudo -E ")]
)
def test_only_who_can_become_root_is_advised_to(tools: set[str], root: bool, fix: str):
    """A pod has no sudo."""
    machine = FakeMachine(HEALTHY_TOOLS | tools, files=dict.fromkeys(V1_FILES, ""), root=root)
    assert found(machine, "cgroups").fix.partition(".venv")[0] == fix


def test_the_doctor_cuts_no_word():
    message = "bwrap: " + "forbidden " * 60
    assert "forbidde " not in found(FakeMachine(fails={"bwrap": message}), "bubblewrap").found + " "


@pytest.mark.parametrize(
    ("files", "hierarchy", "state", "words"),
    [
        (V2_FILES, VERSION_2, State.OK, "version 2, below /sys/fs/cgroup/user.slice"),
        (V1_FILES, VERSION_1, State.OK, "version 1, below /sys/fs/cgroup/memory, /sys/fs/cgroup/pids"),
        (V2_FILES, None, State.WARN, "version 2, memory and pids are not delegated; resource limits are used instead"),
        (V1_FILES, None, State.WARN, "version 1, not writable; resource limits are used instead"),
        (V1_FILES[:1], None, State.WARN, "none for pids; resource limits are used instead"),
        ([], None, State.WARN, "none for memory and pids; resource limits are used instead"),
    ],
)
def test_cgroups_are_named_by_version_and_never_required(
    files: list[str], hierarchy: Hierarchy | None, state: State, words: str
):
    machine = FakeMachine(files=dict.fromkeys(files, ""), cgroups=hierarchy)
    cgroups = found(machine, "cgroups")
    assert (cgroups.state, cgroups.found) == (state, words)


@pytest.mark.parametrize(
    ("machine", "state", "words"),
    [
        (FakeMachine(), State.OK, "you; what belongs to others is out of their reach"),
        (FakeMachine(root=True), State.OK, "a file of root's could not be written in a sandbox"),
        (FakeMachine(root=True, refusal="setpriv: not found"), State.WARN, "another user here: setpriv: not found"),
    ],
)
def test_the_doctor_says_as_whom_submissions_run(machine: Machine, state: State, words: str):
    user = found(machine, "submissions run as")
    assert user.state is state
    assert user.found.endswith(words)


@pytest.mark.sandbox
@pytest.mark.skipif(os.geteuid() != 0, reason="about a grader that is root; run the tests as root")
def test_the_doctor_really_writes_in_a_sandbox(monkeypatch: pytest.MonkeyPatch):
    """It must not say that root's files are safe where they are not."""
    asked = submission_user.refusal.__wrapped__
    assert asked() == ""
    monkeypatch.setattr(submission_user, "become", lambda _user: ["setpriv", "--inh-caps=-all", "--"])
    assert asked() != ""
    monkeypatch.setattr(submission_user, "CAPABILITIES", ())
    assert asked() == "it can write files of root"
    monkeypatch.setattr(submission_user, "become", lambda _user: ["no-such-program"])
    assert "no-such-program" in asked()


@pytest.mark.sandbox
def test_nothing_runs_as_root_because_a_probe_failed_by_chance(monkeypatch: pytest.MonkeyPatch):
    """With no process left for root, for a moment, a grading once begun must not go on as root."""
    busy = subprocess.CompletedProcess([], 1, "", "bwrap: Can't fork: Resource temporarily unavailable\n")
    monkeypatch.setattr(submission_user, "_run", lambda _command: busy)
    with pytest.raises(GraderError, match="Resource temporarily unavailable"):
        submission_user.refusal.__wrapped__()


def test_this_hosts_cgroups_are_what_a_grading_finds():
    """A check of the doctor's own could say "writable" where no group can be made, or the other way round."""
    hierarchy = cgroup.find_hierarchy()
    here = next(diagnosis for diagnosis in doctor.examine_sandbox() if diagnosis.name == "cgroups")
    assert (here.state is State.OK) == (hierarchy is not None)
    if hierarchy is not None:
        assert here.found.startswith(f"version {hierarchy.version}, below ")


def test_every_bad_diagnosis_has_a_fix():
    poor = FakeMachine(set(), fails={"": "broken"}, free=0)
    diagnoses = [diagnosis for diagnosis in examine(poor) if diagnosis.state is State.BAD]
    assert len(diagnoses) >= 8
    assert all(diagnosis.fix for diagnosis in diagnoses)


def test_the_console_shows_a_line_for_each_and_one_for_its_fix():
    diagnoses = [
        Diagnosis("make", State.OK, "/usr/bin/make"),
        Diagnosis("bubblewrap", State.BAD, "not found", "dnf add it"),
    ]
    assert render(diagnoses) == (
        "ok    make        /usr/bin/make\n"
        "bad   bubblewrap  not found\n"
        "                  fix: dnf add it\n"
        "This machine cannot grade yet: bubblewrap."
    )
    assert exit_status(diagnoses) == 3
    assert exit_status(diagnoses[:1]) == 0


@pytest.mark.ros
@pytest.mark.sandbox
def test_this_machine_can_grade_and_is_examined_in_seconds():
    started = time.monotonic()
    diagnoses = examine()
    assert [diagnosis for diagnosis in diagnoses if diagnosis.state is State.BAD] == []
    assert exit_status(diagnoses) == 0
    assert time.monotonic() - started < 60  # 2 s on an idle machine; a busy one may take its time
