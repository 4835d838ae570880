"""What is said first of packages of strangers: which package it is, entry points, ROS 1."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest
from helpers import beside
from helpers.judging import ask, evidence_with
from helpers.quality_examples import facts, written

from grader.courses.robot_controller.checks import check_set_speed
from grader.evidence import Build, Fault, Kind, ProcessEnd, Quality, Reason, Trial

TEXTS = beside(__file__)

NODE = TEXTS["NODE"]


def lab(folder: Path, entries: str = "", files: dict[str, str] | None = None, build: str = "ament_python") -> Path:
    """Return the package lab5_31 with these entry points, and these files beside what every package has."""
    usual = {
        "package.xml": TEXTS["XML"].replace("BUILD", build),
        "setup.py": TEXTS["SETUP"].replace("ENTRIES", entries),
        "lab5_31/__init__.py": "",
    }
    return written(folder / "lab5_31", {**usual, **(files or {})})


def faults(package: Path) -> list[Fault]:
    return facts(package).faults


DIED_EARLY = Reason(Kind.DIED_EARLY, exit_code=1)


def down(output: str, ended: Reason = DIED_EARLY, **more: object) -> Trial:
    end = ProcessEnd("itself", 1, 0.1, textwrap.dedent(output)) if output else None
    usual = {"node": "robot_controller", "world": "w", "seed": 0, "ready": False, "pace": "lockstep"}
    return Trial(name="drive_forward", ended=ended, process=end, **{**usual, **more})  # type: ignore[arg-type]


def first_words(quality: Quality, trial: Trial, **build: object) -> str:
    """Return what F2 says of a package whose node did not come up in the trial."""
    built = Build(ok=True, cached=True, wall_seconds=0.0, exit_code=0, timed_out=False, log_tail="", **build)  # type: ignore[arg-type]
    evidence = evidence_with(trials={"drive_forward": trial}, quality=quality, build=built)
    return ask(check_set_speed.test_drives_at_the_set_speed, evidence).seen


# -- a package under another name -------------------------------------------------------------------------------------


def test_a_package_without_the_assignments_modules_hears_which_package_it_is(tmp_path: Path):
    """It heard three times that there was no entry point, with a cure that wrote one to a module that is not there."""
    package = lab(tmp_path, "'drive = lab5_31.drive:main'", {"lab5_31/drive.py": NODE})
    first, *rest = faults(package)
    assert (first.path, first.line) == ("package.xml", 2)
    assert first.text == "this is the package `lab5_31`, and it has no robot_controller.py and no sensor_processor.py"
    assert first.cure.startswith("write lab5_31/robot_controller.py and lab5_31/sensor_processor.py")
    assert not any("entry point" in fault.text + fault.cure for fault in rest)
    said = first_words(facts(package), down("", Reason(Kind.NO_PROGRAM, "robot_controller", "lab5_31")))
    assert said.startswith("package.xml:2: this is the package `lab5_31`, and it has no robot_controller.py")


def test_a_node_that_the_build_may_make_is_not_said_to_be_missing(tmp_path: Path):
    entries = "'robot_controller = lab5_31.nodes:robot', 'sensor_processor = lab5_31.nodes:sensors'"
    assert faults(lab(tmp_path, entries, {"lab5_31/nodes.py": NODE})) == []


def test_what_the_run_said_goes_before_what_was_guessed_from_the_text(tmp_path: Path):
    """The executable is there, and its traceback names a package of interfaces."""
    quality = facts(
        lab(tmp_path, "", {"lab5_31/robot_controller.py": "from robot_interfaces.srv import SetSpeed\n" + NODE})
    )
    assert [fault.stops for fault in quality.faults] == ["install", "start"]
    trial = down("""
        File "/ws/install/lib/python3/site-packages/lab5_31/robot_controller.py", line 1, in <module>
        ModuleNotFoundError: No module named 'robot_interfaces'
        """)
    said = first_words(quality, trial, executables=["robot_controller"])
    assert said.startswith("lab5_31/robot_controller.py:1: it imports `robot_interfaces`")
    assert "has no sensor_processor" not in said.partition(";")[0]


def test_ros_1_is_named(tmp_path: Path):
    """`rospy` was "not installed here", below what was said of entry points."""
    package = lab(tmp_path, "", {"lab5_31/robot_controller.py": "import rospy\n\n\ndef main():\n    pass\n"})
    (fault,) = [fault for fault in faults(package) if fault.stops == "start"]
    assert fault.text == "it imports `rospy`, which is part of ROS 1"
    assert "rclpy" in fault.cure


@pytest.mark.parametrize("kits_own_is_here", [False, True])
def test_an_import_of_the_assignments_package_in_one_of_another_name_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kits_own_is_here: bool
):
    """Where the process had imported the contract's own build, it was not: a flicker of a whole run of the tests."""
    if kits_own_is_here:
        (tmp_path / "contract" / "ros2_robot_controller").mkdir(parents=True)
        (tmp_path / "contract" / "ros2_robot_controller" / "__init__.py").touch()
        monkeypatch.syspath_prepend(tmp_path / "contract")
    text = "from ros2_robot_controller.srv import SetSpeed\n" + NODE
    (fault,) = [
        f for f in faults(lab(tmp_path / "lab", "", {"lab5_31/robot_controller.py": text})) if f.stops == "start"
    ]
    assert fault.text == "it imports `ros2_robot_controller`, and this package is called `lab5_31`"
