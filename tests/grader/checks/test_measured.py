"""Which files count for quality and tests: those of which code ran."""

from __future__ import annotations

from dataclasses import replace

from helpers import judging
from helpers.course import COURSE
from helpers.judging import evidence_with

from grader.checks import package_text
from grader.checks.judge import Judge
from grader.checks.measured import Measured, measure
from grader.evidence import Manifest, Quality, Ran, SourceFile, Trial

P = "ros2_robot_controller"
FILES = [
    SourceFile(f"{P}/robot_controller.py", 30, "", 10, [[5, 20]]),
    SourceFile(f"{P}/sensor_processor.py", 20, "", 10, [[5, 20]]),
    SourceFile(f"{P}/driver.py", 40, "", 10, [[5, 20]]),
    SourceFile(f"{P}/limits.py", 9, "", 3, [[4, 9]]),
    SourceFile(f"{P}/running.py", 9, "", 3, [[4, 9]]),
    SourceFile(f"{P}/tidy.py", 90, "", 3, [[4, 90]]),
    SourceFile(f"{P}/utils/conversions.py", 20, "", 5, [[6, 9]]),
    SourceFile("scripts/demo.py", 20, "", 5, [[6, 9]]),
    SourceFile("test/test_driver.py", 20, "", 5, [[6, 9]]),
    SourceFile("setup.py", 5, "", 5),
]


def trial(node: str, **functions: list[int]) -> Trial:
    ran = Ran({f"{P}/{name}.py": lines for name, lines in functions.items()})
    return judging.trial(node, node, ran=ran)


DRIVES = trial("robot_controller", robot_controller=[5], driver=[5], running=[4], limits=[])
FUSES = trial("sensor_processor", sensor_processor=[5], running=[4])


def measured(*trials: Trial, files: list[SourceFile] = FILES) -> Measured:
    quality = Quality(Manifest(found=True), files=files)
    return measure(evidence_with(quality=quality, trials={each.name: each for each in trials}), COURSE)


def test_what_of_a_package_counts_by_what_ran_of_it():
    """A file of which a function ran counts whole, one that was only imported where it is outside of functions."""
    found = measured(DRIVES, FUSES)
    names = ("robot_controller", "driver", "running", "sensor_processor", "utils/conversions")
    assert found.whole == {f"{P}/{name}.py" for name in names}
    assert found.covers(f"{P}/driver.py", 17)
    assert not found.covers("test/test_driver.py", 1)
    assert found.imported == {f"{P}/limits.py"}
    assert [found.covers(f"{P}/limits.py", line) for line in (1, 4, 9, 10)] == [True, False, False, True]
    assert found.lines(FILES) == 30 + 20 + 40 + 9 + 20 + 3
    assert found.idle == [f"{P}/tidy.py"]
    assert found.of_node == {  # what ran in no other node's trials
        "robot_controller": {f"{P}/robot_controller.py", f"{P}/driver.py"},
        "sensor_processor": {f"{P}/sensor_processor.py"},
    }


def test_nodes_in_one_file_share_it():
    both = [trial(node, driver=[5]) for node in ("robot_controller", "sensor_processor")]
    assert set(measured(*both).of_node.values()) == {frozenset({f"{P}/driver.py"})}


def test_of_a_node_that_did_not_come_up_its_module_counts_as_handed_in():
    found = measured(DRIVES)
    assert found.of_node["sensor_processor"] == {f"{P}/sensor_processor.py"}
    assert found.covers(f"{P}/sensor_processor.py", 7)
    assert not found.covers(f"{P}/tidy.py", 7)


def test_without_any_trial_all_modules_count_and_the_nodes_programs():
    found = measured()
    assert found.whole == {file.path for file in FILES if file.path.startswith(P)}
    assert not found.by_notes
    assert found.of_node.keys() == {"robot_controller", "sensor_processor"}


def test_a_module_without_a_function_is_no_node():
    stub = [SourceFile(f"{P}/robot_controller.py", 1, "", 1), *FILES[1:]]
    assert measured(files=stub).of_node.keys() == {"sensor_processor"}


def test_a_node_of_which_no_file_ran_is_not_there():
    """Its code came from an archive, and the tidy modules beside it had full marks."""
    nothing = replace(DRIVES, ran=Ran(unseen=["archive: share/p/table"]))
    assert measured(nothing, FUSES).of_node.keys() == {"sensor_processor"}
    off = replace(DRIVES, ran=Ran(unseen=["notes turned off: it noted nothing"], of_functions=False))
    assert measured(off, FUSES).of_node.keys() == {"robot_controller", "sensor_processor"}


def test_what_a_check_gives_counts_for_the_nodes_that_are_there():
    stub = [SourceFile(f"{P}/robot_controller.py", 1, "", 1), *FILES[1:]]
    judge = Judge(evidence_with(quality=Quality(Manifest(found=True), files=stub)), COURSE)
    package_text.weigh(judge)
    assert (judge.fraction, judge.seen) == (
        0.5,
        "robot_controller: not there, and each of the 2 nodes counts the same of these points",
    )
    judge.share(0.6, "six of ten", "")
    assert judge.fraction == 0.3
