"""Hunts with real nodes: what is found fails again; a node that hangs, floods or exits leaves nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from helpers import running as processes_with
from helpers.course import COURSE, copied
from helpers.hunting import NODE
from submissions.edits import EDITS, apply

from grader import cli, collect, pipeline
from grader.course import load
from grader.host import ros_env
from grader.hunt import report, search
from grader.hunting import runner
from grader.intake import package_edits
from grader.intake.submission import open_submission
from grader.processes import jobs
from grader.scoring import rubric
from grader.scoring.scorecard import Outcome
from grader.settings import Settings
from grader.source import Subject
from grader.trials.case import Case, Step
from grader.trials.promises import LIVES, Run, hunts

pytestmark = [pytest.mark.ros, pytest.mark.sandbox, pytest.mark.slow]  # builds, and some 20 trials
LEFT = "86417.5"
DOES = f"""\
        import subprocess
        import threading
        subprocess.Popen(['sleep', '{LEFT}'], start_new_session=True)
        does = self._value('robot_name')
        if does == 'exits':
            raise SystemExit(3)
        if does == 'hangs':
            self.create_timer(0.5, lambda: sum(iter(int, 1)))
        if does == 'floods':
            threading.Thread(target=lambda: sum(print("x" * 1000) or 0 for _ in iter(int, 1)), daemon=True).start()
"""


def test_what_is_found_in_a_known_bad_edit_fails_again(tmp_path: Path, settings: Settings):
    package = apply(EDITS["drives_into_the_wall"], tmp_path)
    with runner(package, settings) as running:
        found = search.hunt(running, *hunts(COURSE).of(["F4"]), cases=20, shrinks=4).finding
    assert found is not None
    assert "F4" in found.promise.serves
    file = report.save(found, tmp_path / "hunt")
    assert cli.main(["hunt", "--again", str(file), "--package", str(package)]) == 1
    assert cli.main(["hunt", "--again", str(file), "--package", str(COURSE.solution)]) == 0
    test = report.test_of(file)
    assert "1 failed" in on_the_bench(test, package, settings, tmp_path / "known bad")
    assert "1 passed" in on_the_bench(test, COURSE.solution, settings, tmp_path / "solution")


def on_the_bench(test: Path, package: Path, settings: Settings, folder: Path) -> str:
    """Return what pytest says of a test in a package's folder of tests; nothing of the kit is on its path."""
    with ExitStack() as closing:
        submission = open_submission(package, folder / "submission", settings.course)
        subject = Subject(submission, settings, folder, closing)
        built, contract = jobs.run(collect.builds(subject)).results[collect.BUILD]
        shutil.copytree(package / "test", folder / "test")
        shutil.copy(test, folder / "test")
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test.name]
        environment = ros_env.environment(built.install, contract.install, home=folder)
        done = subprocess.run(
            command, cwd=folder / "test", env=environment, capture_output=True, text=True, check=False
        )
    return done.stdout


def test_a_course_grades_by_a_hunt(tmp_path: Path, settings: Settings):
    """The reference keeps its point, an edit loses it, and the same edit loses it again by the same case."""
    data = yaml.safe_load(COURSE.rubric.read_text())
    for criterion in data["criteria"]:
        criterion.pop("points", None)
    (f5,) = (each for criterion in data["criteria"] for each in criterion["requirements"] if each["id"] == "F5")
    f5.pop("points", None)
    f5["hunt"] = {"cases": 3, "points": 1}
    with_hunt = load(copied(tmp_path / "course", yaml.safe_dump(data)))
    settings = replace(settings, course=with_hunt, rubric=rubric.load(with_hunt.rubric), requirements=("F5",))
    bad, said = apply(EDITS["emergency_for_good"], tmp_path / "bad"), []
    for package in (COURSE.solution, bad, bad):
        card = pipeline.grade(package, tmp_path / "out", settings).scorecard
        said.append(next(score for score in card.requirements if score.requirement.id == "F5").results[-1])
    assert [each.outcome for each in said] == [Outcome.PASSED, Outcome.FAILED, Outcome.FAILED]
    assert said[0].seen == "3 cases, no fault found"
    assert "node: robot_controller\nsteps:\n" in said[1].seen
    assert said[1] == said[2]


def test_a_node_that_hangs_floods_or_exits_is_named_and_leaves_no_process(tmp_path: Path, settings: Settings):
    package = apply(None, tmp_path)
    line = "        self.get_logger().info(f\"{self._value('robot_name')} is ready\")\n"
    package_edits.replace("ros2_robot_controller/robot_controller.py", line, DOES)(package)
    cases = [
        Case(NODE, (Step("wait", 1.5),), parameters={"robot_name": does})
        for does in ("hangs", "floods", "exits", "lives")
    ]
    with runner(package, settings) as running:
        broken = [LIVES.judge(Run(case, trial)) for case, trial in running.run(cases)]
    said = [each.seen if each else "" for each in broken]
    assert "a callback hangs" in said[0]
    assert "with exit status 3" in said[2]
    assert said[1] == said[3] == ""  # what a node prints is cut, and breaks nothing
    assert processes_with(LEFT) == []
