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
from pathlib import Path
from typing import Any

import pytest

from grader import KIT
from grader.authoring import export, package_edits
from grader.course import kits_own
from grader.host import submission_user
from grader.selftest.attacks import catalogue

_PACKAGED = "/usr/share/gocode/src/github.com/docker/docker/profiles/seccomp/default.json"
PROFILE = Path(os.environ.get("ROS2_COURSE_KIT_SECCOMP", _PACKAGED))
_MISSING = [tool for tool in ("podman", "runc") if shutil.which(tool) is None]
_MISSING += [] if PROFILE.is_file() else [f"{PROFILE}, of golang-github-docker-docker-dev"]
_MISSING += [f"root's other users: {lacks}"] if (lacks := submission_user.lacks()) else []
pytestmark = [
    pytest.mark.containers,
    pytest.mark.slow,  # whole gradings in containers
    pytest.mark.skipif(bool(_MISSING) or os.geteuid() != 0, reason=f"run as root; missing: {', '.join(_MISSING)}"),
]
RUN = ["podman", "--runtime", "runc", "run", "--rm", "--ulimit=nofile=4096:4096", "--ulimit=nproc=4096:4096"]
RUN += ["--network=none"]
DOCKER = [f"--security-opt=seccomp={PROFILE}", "--cap-add=MKNOD,NET_RAW,AUDIT_WRITE"]
AS_USER = ["--user=1000:100", "--cap-drop=ALL", "--security-opt=no-new-privileges"]
PYTHON = Path(sys.executable)
REFERENCE = KIT / "solution_pkg" / "ros2_robot_controller"
_REQUIRE = """
from grader import sandbox
from grader.host import namespaces
sandbox.require()
print(namespaces.confinement().value)
"""


def contained(options: list[str], command: str, *more: str, seconds: float = 300.0) -> subprocess.CompletedProcess[str]:
    line = [*RUN, *options, *more, "--rootfs", "/:O", "sh", "-c", f"cd {KIT} && {command}"]
    return subprocess.run(line, capture_output=True, text=True, timeout=seconds, check=False)


UNCONFINED = ["--security-opt=seccomp=unconfined", "--security-opt=unmask=ALL"]
READ_ONLY = ["--read-only", "--read-only-tmpfs=false", "--tmpfs=/media", "--env=TMPDIR=/media"]
NO_BUBBLEWRAP = "rm /usr/bin/bwrap; export ROS2_COURSE_KIT_UNSAFE_NO_SANDBOX=1;"
REFUSED, UNSAFE = "refused", "unsafe"


@pytest.mark.parametrize(
    ("options", "before", "confinement", "advice"),
    [
        pytest.param(DOCKER, "", "users", "seccomp=unconfined", id="docker"),
        pytest.param([*DOCKER, "--shm-size=64k"], "", "users", "", id="docker, tiny /dev/shm"),
        pytest.param([*DOCKER, "--ipc=none"], "", "users", "", id="docker, no /dev/shm"),
        pytest.param([*DOCKER, *READ_ONLY], "", REFUSED, "--tmpfs /var/tmp", id="docker, read-only"),
        pytest.param([*DOCKER, "--pids-limit=60"], "", REFUSED, "--pids-limit=512", id="docker, few processes"),
        pytest.param([DOCKER[0], *AS_USER], "", "none", "seccomp=unconfined", id="pod with a profile"),
        pytest.param([UNCONFINED[0], *AS_USER], "", "none", "systempaths=unconfined", id="pod of Kubernetes"),
        pytest.param([*UNCONFINED, *AS_USER], "", "namespaces", "", id="pod, unmasked"),
        pytest.param([*UNCONFINED, *AS_USER, "--ulimit=nproc=60:60"], "", REFUSED, "--ulimit", id="pod, few processes"),
        pytest.param(UNCONFINED, "", "namespaces", "", id="as advised, and devcontainer"),
        pytest.param([*UNCONFINED, *READ_ONLY], "", "namespaces", "", id="devcontainer, read-only"),
        pytest.param(["--privileged"], "", "namespaces", "", id="privileged"),
        pytest.param(DOCKER, NO_BUBBLEWRAP, UNSAFE, "install -y bubblewrap", id="no bubblewrap, --unsafe-no-sandbox"),
    ],
)
def test_the_doctor_says_what_a_grading_does(options: list[str], before: str, confinement: str, advice: str):
    """It called a container bad in which a grading gave 100 points, and good one in which none began."""
    said = contained(options, f"{before} HOME=/tmp {PYTHON} -m grader.cli doctor")
    does = contained(options, f"{before} {PYTHON} -c '{_REQUIRE}'")
    assert advice in said.stdout
    agree(said, does, confinement)


@pytest.mark.parametrize(
    ("ids", "user", "confinement", "advice"),
    [
        pytest.param(4294967294, 0, "users", "sysctl -w user.max_user_namespaces", id="root"),
        pytest.param(4294967294, 1000, "none", "sysctl -w user.max_user_namespaces", id="an ordinary user"),
        pytest.param(1, 0, REFUSED, "grader batch", id="root, the only user"),
    ],
)
def test_the_doctor_says_what_a_grading_does_without_user_namespaces(
    ids: int, user: int, confinement: str, advice: str
):
    """The setting holds for a namespace, so this machine's own stays as it is."""
    said, does = (
        without_user_namespaces(ids, user, [str(PYTHON), *arguments])
        for arguments in (["-m", "grader.cli", "doctor"], ["-c", _REQUIRE])
    )
    assert advice in said.stdout
    agree(said, does, confinement)


def without_user_namespaces(ids: int, user: int, command: list[str]) -> subprocess.CompletedProcess[str]:
    off = 'echo 0 >/proc/sys/user/max_user_namespaces && exec setpriv --reuid=$0 --regid=$0 --clear-groups -- "$@"'
    # A program that starts as root of its namespace may change the setting; this one starts before it is root.
    line = ["unshare", "--user", "sh", "-c", 'echo up; read -r _; exec sh -c "$@"', "wait", off, str(user), *command]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          cwd=KIT, env=os.environ | {"HOME": "/tmp"}) as process:  # fmt: skip
        assert process.stdout is not None
        assert process.stdout.readline() == "up\n"
        for name in ("uid_map", "gid_map"):
            Path(f"/proc/{process.pid}", name).write_text(f"0 0 {ids}\n")
        printed, errors = process.communicate("go\n", timeout=300)
    return subprocess.CompletedProcess(line, process.returncode, printed, errors)


def agree(said: subprocess.CompletedProcess[str], does: subprocess.CompletedProcess[str], confinement: str) -> None:
    """Check that the doctor's report is what becomes of a grading."""
    if confinement == UNSAFE:  # the doctor speaks of gradings without the option
        assert does.stdout.strip() == "none", does.stderr
    elif confinement in ("users", "namespaces"):
        assert does.stdout.strip() == confinement, said.stdout + does.stderr
        assert f"This machine can grade (confinement: {confinement})." in said.stdout
        assert said.returncode == 0
    else:
        assert (said.returncode, does.returncode) == (3, 1), said.stdout + said.stderr + does.stdout
        assert "This machine cannot grade yet" in said.stdout
        assert ("so no points are given" in does.stderr) == (confinement == "none"), does.stderr


def test_points_are_the_same_by_other_users_as_by_namespaces():
    names = ["reference", "silent_when_idle", "drives_too_slowly", "ignores_the_limit", "stops_late"]
    names += ["looks_all_around", "speed_without_a_sign", "battery_as_a_ratio", "minus_pi_stays", "prints_its_answers"]
    line = [str(PYTHON), "-m", "submissions.points", *names, "has_a_failing_test"]
    here = subprocess.run(
        line, cwd=KIT, env=os.environ | {"PYTHONPATH": ".:tests"}, capture_output=True, text=True, check=True
    )
    there = contained(DOCKER, f"PYTHONPATH=.:tests {' '.join(line)}", seconds=3600)
    assert [run.stderr.split()[0] for run in (here, there)] == ["namespaces", "users"]
    assert json.loads(there.stdout) == json.loads(here.stdout)
    assert all(points >= 0 for each in json.loads(here.stdout).values() for points in each.values())  # -1: not judged


ATTACKS = ("calls_home", "fork_bomb", "leaves_a_daemon", "overwrites_the_grader", "reads_secrets", "writes_the_results")


@pytest.fixture(scope="module")
def autograder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Gradescope's folder, with what its setup.sh leaves; the kit is this one."""
    root = tmp_path_factory.mktemp("gradescope") / "autograder"
    export.gradescope(root.parent / "autograder.zip", kits_own())
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
        DOCKER, f"{autograder}/run_autograder", *settings, f"--volume={autograder}:{autograder}", seconds=3000
    )
    results: dict[str, object] = json.loads((autograder / "results" / "results.json").read_text())
    assert ran.returncode == 0, ran.stderr
    return results


def test_gradescope_gives_the_reference_all_points(autograder: Path):
    results = graded(autograder, REFERENCE)
    assert results["score"] == 100.0
    assert {test["visibility"] for test in results["tests"]} == {"visible"}  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ATTACKS)
def test_gradescope_gives_an_attack_no_more_than_the_reference_and_its_results(
    autograder: Path, tmp_path: Path, name: str
):
    package = package_edits.copy(REFERENCE, tmp_path)
    for change in (*catalogue.ATTACKS[name].weak, *catalogue.ATTACKS[name].changes):
        change(package)
    results = graded(autograder, package)
    tests: Any = results["tests"]
    assert len(tests) == 31
    assert 0 < float(str(results["score"])) <= 100.0
    assert not any("could not be judged" in test["output"] for test in tests)


def test_gradescope_says_what_is_wrong_with_another_package(autograder: Path, tmp_path: Path):
    (tmp_path / "homework").mkdir()
    (tmp_path / "homework" / "main.py").write_text("print('not a package')\n")
    results = graded(autograder, tmp_path / "homework")
    assert results["score"] == 0.0
    assert "package.xml" in str(results["output"])


def test_gradescope_gets_results_of_a_submission_that_takes_too_long(autograder: Path, tmp_path: Path):
    """The platform would kill the container, and say that the autograder has failed."""
    package = tmp_path / "ros2_robot_controller"
    shutil.copytree(REFERENCE, package)
    with (package / "CMakeLists.txt").open("a") as cmake:
        cmake.write("\nexecute_process(COMMAND sleep 100000)\n")
    results = graded(autograder, package, seconds=60)
    assert (results["score"], results["tests"]) == (0, [])
    assert "the time of the autograder was over after 60 s" in str(results["output"])
