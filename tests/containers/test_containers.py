"""Containers of others: Docker's confinement, a hub's pod, and what the doctor advises, on this machine's own root."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from containers import situations
from containers.situations import DOCKER, PYTHON, REFERENCE, SITUATIONS, Situation, contained
from grader import KIT
from grader.authoring import release
from grader.course import kits_own
from grader.intake import package_edits
from grader.selftest.attacks import command

pytestmark = [
    pytest.mark.containers,
    pytest.mark.slow,  # whole gradings in containers
    pytest.mark.skipif(bool(situations.missing()), reason=f"missing: {situations.missing()}"),
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
