"""Containers of others: Docker's confinement, a hub's pod, and what the doctor advises, on this machine's own root.

They need podman, runc and Docker's seccomp profile, which forbids what podman's own allows: on Debian and Ubuntu
`apt-get install podman runc golang-github-docker-docker-dev`; ROS2_COURSE_KIT_SECCOMP names the profile elsewhere.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import pytest

from grader import KIT
from grader.authoring import release
from grader.course import kits_own
from grader.host import submission_user
from grader.intake import package_edits
from grader.selftest.attacks import command

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


pytestmark = [
    pytest.mark.containers,
    pytest.mark.slow,  # whole gradings in containers
    pytest.mark.skipif(bool(missing()), reason=f"missing: {missing()}"),
]


@pytest.mark.parametrize("situation", SITUATIONS, ids=lambda situation: situation.name)
def test_the_doctor_says_what_a_grading_does(situation: Situation):
    """It called a container bad in which a grading gave 100 points, and good one in which none began."""
    why = situation.disagreement()
    assert not why, why  # in full: pytest cuts a comparison short


def test_points_are_the_same_by_other_users_as_by_namespaces():
    names = ["reference", "silent_when_idle", "drives_too_slowly", "ignores_the_limit", "stops_late"]
    names += ["looks_all_around", "speed_without_a_sign", "battery_as_a_ratio", "minus_pi_stays", "prints_its_answers"]
    line = [str(PYTHON), "-m", "submissions.table", "--points", *names, "has_a_failing_test"]
    here = subprocess.run(
        line, cwd=KIT, env=os.environ | {"PYTHONPATH": ".:tests"}, capture_output=True, text=True, check=True
    )
    there = contained(DOCKER, f"PYTHONPATH=.:tests {' '.join(line)}", seconds=3600)
    assert [run.stderr.split()[0] for run in (here, there)] == ["namespaces", "users"]
    assert json.loads(there.stdout) == json.loads(here.stdout)
    outcomes = [outcome for each in json.loads(here.stdout).values() for _, outcome in each.values()]
    assert set(outcomes) <= {"passed", "partial", "failed"}


AS_GRADESCOPE = ["--cpus=1", "--memory=3g", "--pids-limit=4096"]  # else a fork bomb is one for this machine, too
ATTACKS = ("calls_home", "leaves_a_daemon", "overwrites_the_grader", "reads_secrets", "writes_the_results")


@pytest.fixture(scope="module")
def autograder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Gradescope's folder, with what its setup.sh leaves; the kit is this one."""
    root = tmp_path_factory.mktemp("gradescope") / "autograder"
    release.gradescope(root.parent / "autograder.zip", kits_own())
    shutil.unpack_archive(root.parent / "autograder.zip", root / "source")
    shutil.copy(root / "source" / "run_autograder", root)
    (root / "run_autograder").chmod(0o755)
    for name in ("submission", "results", "cache"):
        (root / name).mkdir()
    return root


def graded(autograder: Path, submission: Path, seconds: int = 2340) -> dict[str, object]:
    """Return results.json of a submission in Gradescope's layout, as root under Docker's profile."""
    shutil.rmtree(autograder / "submission")
    shutil.copytree(submission, autograder / "submission" / submission.name)
    names = {"": KIT, "_AUTOGRADER": autograder, "_SECONDS": seconds, "_CACHE": autograder / "cache"}
    settings = [f"--env=ROS2_COURSE_KIT{name}={value}" for name, value in names.items()]
    ran = contained(
        [*DOCKER, *AS_GRADESCOPE],
        f"{autograder}/run_autograder",
        *settings,
        f"--volume={autograder}:{autograder}",
        seconds=3000,
    )
    results: dict[str, object] = json.loads((autograder / "results" / "results.json").read_text())
    assert ran.returncode == 0, ran.stderr
    return results


def test_gradescope_gives_the_reference_all_points(autograder: Path):
    results = graded(autograder, REFERENCE)
    assert results["score"] == 100.0
    assert {test["visibility"] for test in results["tests"]} == {"visible"}  # type: ignore[attr-defined]


def attacking(name: str, folder: Path) -> Path:
    """Return the reference with an attack."""
    package = package_edits.copy(REFERENCE, folder)
    for change in (*command.ATTACKS[name].weak, *command.ATTACKS[name].changes):
        change(package)
    return package


def test_gradescope_ends_a_fork_bomb_in_time(autograder: Path, tmp_path: Path):
    """Without cgroups its processes take the CPU from the grader: 13 minutes were not enough for its trials."""
    results = graded(autograder, attacking("fork_bomb", tmp_path), seconds=300)
    assert 0 <= float(str(results["score"])) < 100.0
    assert results["tests"] or "the time of the autograder was over after 300 s" in str(results["output"])


@pytest.mark.parametrize("name", ATTACKS)
def test_gradescope_gives_an_attack_no_more_than_the_reference_and_its_results(
    autograder: Path, tmp_path: Path, name: str
):
    results = graded(autograder, attacking(name, tmp_path))
    tests: Any = results["tests"]
    assert len(tests) == 31
    assert 0 < float(str(results["score"])) <= 100.0
    assert not any("could not be judged" in test["output"] for test in tests)


def test_gradescope_says_what_is_wrong_with_another_package(autograder: Path, tmp_path: Path):
    (tmp_path / "homework").mkdir()
    (tmp_path / "homework" / "main.py").write_text("print('not a package')\n")
    results = graded(autograder, tmp_path / "homework")
    assert (results["score"], results["tests"]) == (0.0, [])
    assert str(results["output"]) == (
        "submission contains no package.xml. Zip the package folder itself (the one with package.xml and setup.py) and "
        "submit again."
    )


def test_gradescope_gets_results_of_a_submission_that_takes_too_long(autograder: Path, tmp_path: Path):
    """The platform would kill the container, and say that the autograder has failed."""
    package = tmp_path / "ros2_robot_controller"
    shutil.copytree(REFERENCE, package)
    with (package / "CMakeLists.txt").open("a") as cmake:
        cmake.write("\nexecute_process(COMMAND sleep 100000)\n")
    results = graded(autograder, package, seconds=60)
    assert (results["score"], results["tests"]) == (0, [])
    assert "the time of the autograder was over after 60 s" in str(results["output"])
