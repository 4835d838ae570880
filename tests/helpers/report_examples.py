"""Gradings to render: one that is good, a mediocre one, one that does not build, and parts to make others from.

`python tests/helpers/report_examples.py FOLDER` writes the three as reports, to be looked at.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from grader import KIT, report
from grader.evidence import (
    Build,
    Command,
    Evidence,
    FileCoverage,
    Flag,
    Goal,
    Intake,
    Mutant,
    Mutation,
    Sample,
    ScanSummary,
    StudentTests,
    TestModule,
    Touch,
    Trial,
)
from grader.report import Grading, Refusal
from grader.scoring.grading import Decision, Final, HandIn
from grader.scoring.rubric import Rubric, load
from grader.scoring.scorecard import CheckResult, Outcome, score
from helpers import beside
from helpers.judging import trial

SMALL: str = beside(__file__)["SMALL"]

_NODE = "ros2_robot_controller/robot_controller.py"
_TESTS = [f"test/test_motion.py::test_{name}" for name in ("stops", "turns_left", "keeps_the_limit", "starts")]
FAULTS = Mutation(
    0,
    [
        Mutant(_NODE, 41, "stop", "compare", "`<` became `<=`", "unnoticed", tried=_TESTS),
        Mutant(_NODE, 57, "drive", "number", "`0.5` became `1.5`", "noticed", by=_TESTS[0]),
        Mutant(_NODE, 58, "drive", "sign", "`-speed` became `speed`", "noticed", by=_TESTS[1], late=True),
        Mutant(_NODE, 90, "navigate", "call", "`self._publish_feedback(distance)` was left out", "unreached"),
        Mutant("ros2_robot_controller/utils/conversions.py", 7, "clamp", "call", "`min` became `max`", "not tried"),
    ],
    note="1 of 5 mutants were not tried: the budget of 20 s was used up",
)

RUBRIC = KIT / "rubric.yaml"

INTAKE = Intake(name="team07.zip", sha256="ab" * 32, package="ros2_robot_controller", package_path="team07")
CHOSEN = replace(
    INTAKE,
    package_path="ws/src/ctl",
    chosen_because="its folder bears its name",
    others=["old (ros2_robot_controller)"],
    notes=["Opened a.zip inside.", "y.rar was not opened: the grader opens zip and tar only."],
)
REFUSED = Refusal(
    submission="team07.zip",
    because="team07.zip contains no package.xml.",
    try_="Zip the package folder itself and submit again.",
    notes=["y.rar was not opened: the grader opens zip and tar only."],
    environment={"python": "3.12.3"},
    seed=7,
    source="00ff" * 4,
    wall_seconds=0.2,
)
HAND_IN = HandIn(
    people=("Jane Doe", "Li Wu"),
    team="team07",
    name="Jane Doe_12345_assignsubmission_file_/team.zip",
    submitted="2026-11-21 10:00:00+01:00",
    deadline="2026-11-20 23:59:00+01:00",
    late="10:01:00 after the deadline, 1 started day; the rule is: 10 % per started day",
    decisions=(Decision("F8", 1.5, "the target stood in a wall", "A. Lovelace"),),
    comments=("A fine README.",),
    finals=(Final((), 5.85, 10.0, "3.0", ("1 started day late: 0.65 points deducted",)),),
)
BUILD = Build(
    ok=True, cached=False, wall_seconds=14.2, exit_code=0, timed_out=False, log_tail="Finished <<< [14.2s]",
    package="ros2_robot_controller",
)  # fmt: skip
ENVIRONMENT = {"kit": "0.1.0", "python": "3.11", "rclpy": "7.1.9", "walls": "bubblewrap 0.8.0"}

TOUCHED = CheckResult(
    id="check_obstacle::test_never_touches",
    outcome=Outcome.FAILED,
    fraction=0.0,
    sentence="never touches the obstacle",
    seen="touched the wall ahead at 4.9 s sim time, x = 1.83 m, moving at 0.40 m/s",
    expected="no contact for the whole trial",
    try_="which beam points straight ahead? compare `angle_min` with the scan's first range",
    trial="drive_at_a_wall",
)


def results(rubric: Rubric, *others: CheckResult) -> list[CheckResult]:
    """Return a pass for every check of the rubric, except where `others` say otherwise."""
    instead = {other.id: other for other in others}
    return [
        instead.get(c.id) or CheckResult(c.id, Outcome.PASSED, 1.0, sentence=_sentence(c.id)) for c in rubric.checks
    ]


def grading(rubric: Rubric, found: Iterable[CheckResult], evidence: Evidence | None = None, **changes) -> Grading:
    """Return a grading with these results; `changes` replace its fields."""
    made = Grading(
        scorecard=score(rubric, found),
        evidence=evidence or Evidence(INTAKE, BUILD),
        environment=ENVIRONMENT,
        submission="team07.zip",
        seed=7,
        wall_seconds=12.4,
    )
    return replace(made, **changes)


def drive_at_a_wall(*, stop_t: float = math.inf) -> Trial:
    """Return a trial in which the robot drives at a wall 2 m ahead at 0.4 m/s, and stops at `stop_t` or by touching."""
    wall, hull, speed = 2.0, 0.171, 0.4
    touch_t = (wall - hull) / speed
    end = min(stop_t, touch_t)
    ticks = [round(0.05 * i, 2) for i in range(161)]
    xs = {t: speed * min(t, end) for t in ticks}
    return trial(
        "drive_at_a_wall",
        world="wall_ahead",
        seed=7,
        commands=[Command(t, speed if t < stop_t else 0.0, 0.0) for t in ticks[::2]],
        samples=[
            Sample(t, x, 0.0, 0.0, speed if t < end else 0.0, 0.0, x, 0.0, 0.0, wall - hull - x) for t, x in xs.items()
        ],
        scans=[ScanSummary(t, wall - xs[t], math.inf, wall - xs[t]) for t in ticks[::2]],
        touches=[Touch(round(touch_t, 2), "wall ahead", speed)] if stop_t > touch_t else [],
        wall_seconds=0.31,
    )


def drive_to_a_goal() -> Trial:
    """Return a trial in which the robot drives a quarter circle to a goal beside it."""
    ticks = [0.1 * i for i in range(100)]
    angles = [math.pi / 2 * min(1.0, t / 8.0) for t in ticks]
    moving = [0.3 if t < 8.0 else 0.0 for t in ticks]
    samples = [
        Sample(t, 1.5 * math.sin(a), 1.5 * (1 - math.cos(a)), a, v, 0.2, 0.0, 0.0, 0.0, 9.0)
        for t, a, v in zip(ticks, angles, moving, strict=True)
    ]
    return trial(
        "go_beside",
        world="open_field",
        seed=7,
        commands=[Command(t, v, 0.2) for t, v in zip(ticks, moving, strict=True)],
        samples=samples,
        scans=[ScanSummary(t, math.inf, math.inf, math.inf) for t in ticks],
        goals=[Goal(0.5, 1.5, 1.5, 0.15, True, "succeeded", True, 1.5, 1.5, 8.1)],
        wall_seconds=0.42,
    )


def good(rubric: Rubric) -> Grading:
    """Return a grading in which everything passed."""
    trials = {one.name: one for one in (drive_at_a_wall(stop_t=3.8), drive_to_a_goal())}
    tests = StudentTests(
        modules=[TestModule("test/test_robot_controller.py", False, 31, 31, passed=31)],
        coverage=[FileCoverage("ros2_robot_controller/robot_controller.py", 210, 208, 64, 62)],
    )
    return grading(rubric, results(rubric), Evidence(INTAKE, replace(BUILD, cached=True), tests, trials))


def mediocre(rubric: Rubric) -> Grading:
    """Return a grading of a robot that touches the wall, misses a target, with a flag and a fault of ours."""
    late = replace(
        TOUCHED,
        id="check_obstacle::test_stops_within_three_tenths_of_a_second",
        sentence="commands zero within 0.3 s",
        seen="the closest reading fell below 0.5 m at 3.80 s; `cmd_vel` was 0.40 m/s until the end",
        expected="zero within 0.3 s",
        try_="print the closest reading at every scan: does your callback see it?",
    )
    touched = replace(TOUCHED, id="check_obstacle::test_never_touches_the_obstacle")
    coverage = CheckResult(
        "check_student_tests::test_coverage_of_lines_and_branches",
        Outcome.PARTIAL,
        0.42,
        sentence="the package's own tests reach its lines and branches",
        seen="61 % of lines and branches (robot_controller.py 48 %, sensor_processor.py 83 %)",
        expected="90 % for full points, none at 40 %",
        try_="run `coverage html` and look at what is red",
    )
    behind = CheckResult(
        "check_navigation::test_reaches_a_target_behind",
        Outcome.FAILED,
        0.0,
        sentence="reaches a target behind it",
        seen="the goal was still unfinished after 30 s; the robot had turned by 1080 degrees",
        expected="result success within 30 s, within 0.15 m of (-1.5, 0.0)",
        try_="what does normalize_angle give for 3.2?",
        trial="go_beside",
    )
    stands = CheckResult(
        "check_navigation::test_stands_still_after_arrival",
        Outcome.NOT_REACHED,
        0.0,
        because="it did not reach the target behind it",
    )
    name = CheckResult(
        "check_graph::test_controller_shows_the_contracts_interfaces",
        Outcome.FAILED,
        0.0,
        sentence="the controller shows the contract's interfaces",
        seen="service `set_velocity` (std_srvs/srv/SetBool)",
        expected="service `set_speed` (ros2_robot_controller/srv/SetSpeed)",
        try_="compare the names in create_service with the table of the handout",
    )
    ours = CheckResult(
        "check_build::test_shared_files_are_installed", Outcome.ERROR, 0.0, seen="the check ended with KeyError"
    )
    trials = {one.name: one for one in (drive_at_a_wall(), drive_to_a_goal())}
    flags = [Flag("network", "tried to reach 93.184.216.34 port 443 during the build", "CMakeLists.txt")]
    intake = replace(INTAKE, notes=["The package lies one folder deeper than it should: team07/team07/src."])
    tests = StudentTests(note="pytest ran each module by itself.")
    evidence = Evidence(intake, BUILD, tests, trials, flags, mutation=FAULTS)
    return grading(rubric, results(rubric, touched, late, coverage, behind, stands, name, ours), evidence)


def broken(rubric: Rubric) -> Grading:
    """Return a grading of a package that does not build."""
    log = (
        "--- stderr: ros2_robot_controller\n"
        "CMake Error at CMakeLists.txt:7 (find_package):\n"
        '  By not providing "Findrosidl_default_generator.cmake" in CMAKE_MODULE_PATH this\n'
        "  project has asked CMake to find a package configuration file provided by\n"
        '  "rosidl_default_generator", but CMake did not find one.\n'
        "---\nFailed   <<< ros2_robot_controller [1.31s, exited with code 1]"
    )
    failed = CheckResult(
        "check_build::test_colcon_build_succeeds",
        Outcome.FAILED,
        0.0,
        sentence="colcon build succeeds",
        seen='CMake Error at CMakeLists.txt:7: no package "rosidl_default_generator"',
        expected="colcon build ends without an error",
        try_="compare the name with the one in package.xml, letter by letter",
    )
    because = "the package does not build"
    reached = {
        "check_student_tests::test_both_nodes_have_tests",
        "check_student_tests::test_every_test_asserts_something",
    }
    waiting = [
        CheckResult(c.id, Outcome.NOT_REACHED, 0.0, sentence=_sentence(c.id), because=because)
        for c in rubric.checks
        if c.id not in reached
    ]
    build = replace(BUILD, ok=False, exit_code=1, log_tail=log)
    return grading(rubric, results(rubric, *waiting, failed), Evidence(INTAKE, build))


def _sentence(check_id: str) -> str:
    return check_id.partition("::test_")[2].replace("_", " ")


if __name__ == "__main__":
    for make in (good, mediocre, broken):
        print(report.write(make(load(RUBRIC)), Path(sys.argv[1]) / make.__name__)[1])
