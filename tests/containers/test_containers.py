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

import pytest

from grader import KIT
from grader.authoring import export
from grader.host import submission_user

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


@pytest.mark.parametrize(
    ("options", "confinement"),
    [
        pytest.param(DOCKER, "users", id="docker"),
        pytest.param([DOCKER[0], *AS_USER], "none", id="pod with a profile"),
        pytest.param(["--security-opt=seccomp=unconfined", *AS_USER], "none", id="pod of Kubernetes"),
        pytest.param(["--security-opt=seccomp=unconfined", "--security-opt=unmask=ALL"], "namespaces", id="as advised"),
        pytest.param(["--privileged"], "namespaces", id="privileged"),
    ],
)
def test_the_doctor_says_what_a_grading_does(options: list[str], confinement: str):
    """It called a container bad in which a grading gave 100 points, and good one in which none began."""
    said = contained(options, f"HOME=/tmp {PYTHON} -m grader.cli doctor")
    does = contained(options, f"{PYTHON} -c '{_REQUIRE}'")
    assert (said.returncode == 0) == (does.returncode == 0), said.stdout + does.stderr
    assert ("instead of namespaces" in said.stdout) == (confinement != "namespaces")
    if confinement == "none":
        assert "so no points are given" in does.stderr
    else:
        assert does.stdout.strip() == confinement
        assert f"This machine can grade (confinement: {confinement})." in said.stdout


@pytest.fixture(scope="module")
def autograder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Gradescope's folder, with what its setup.sh leaves; the kit is this one."""
    root = tmp_path_factory.mktemp("gradescope") / "autograder"
    export.gradescope(root.parent / "autograder.zip")
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
