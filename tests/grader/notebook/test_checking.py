"""`check`: the grader's own checks on the workspace's package, worded for its author."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings, running
from helpers.course import COURSE, PACKAGE

from grader import KIT, building, evidence, notebook, pipeline
from grader.authoring.release import profile_of
from grader.notebook import check_process, checking, checkpoints, prerequisites
from grader.notebook.feedback import Progress
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.scoring.grading import Grading
from grader.settings import Settings


@pytest.fixture
def package(workspace: Workspace) -> Path:
    """The finished package in the workspace."""
    checkpoints.start_at(workspace, "10")
    return workspace.package


@pytest.fixture
def no_build(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fail at any attempt to build."""

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("built for nothing")

    monkeypatch.setattr(building, "build", refuse)


def test_an_empty_workspace_is_not_yet_for_every_requirement(workspace: Workspace, no_build: None) -> None:
    names = [r.id for r in checking.rubric.load(COURSE.rubric).requirements]
    checked = notebook.check(*names)
    assert not checked.passed
    assert [line for line in repr(checked).splitlines() if not line.startswith(" ")] == [
        f"{answer.id} not yet (0 of {answer.worth})" for answer in checked.answers
    ]
    assert {answer.id for answer in checked.answers} == set(names)
    assert all("seen" in dict(note.rows) and "try" in dict(note.rows) for a in checked.answers for note in a.notes)


def test_what_the_courses_rubric_has_dropped_is_said_not_to_be_graded(workspace, monkeypatch, tmp_path) -> None:
    """A check of one that is dropped ended the run of notebook 10 with ValueError."""
    (tmp_path / "rubric.yaml").write_text(profile_of("core", COURSE.rubric.read_text()))
    monkeypatch.setattr(checking, "course", lambda: replace(COURSE, rubric=tmp_path / "rubric.yaml"))
    checked = checking.check(workspace, ["Q1"])
    assert repr(checked) == "Q1 is not graded in this course."
    assert checked.passed


def test_a_package_of_interfaces_beside_the_package_is_checked_with_it(package: Path, monkeypatch) -> None:
    """A grading found it, and `check` said that there is no srv/SetSpeed.srv."""
    beside = package.parent / "my_interfaces"
    beside.mkdir()
    (beside / "package.xml").write_text("<package/>")
    (package / "srv").rename(beside / "srv")
    (package.parent / "turtle_demo").mkdir()
    (package.parent / "turtle_demo" / "package.xml").write_text("<package/>")
    taken: list[str] = []
    monkeypatch.setattr(checking.pipeline, "grade", lambda source, *_: taken.extend(p.name for p in source.iterdir()))
    assert prerequisites.first_gap(package, "I3") is None
    whole = checking.rubric.load(COURSE.rubric)
    checking._grade(package, whole, [whole.requirement("I2")], Progress())
    assert sorted(taken) == ["my_interfaces", PACKAGE]


def test_an_unknown_requirement_is_an_error_of_the_caller(workspace: Workspace) -> None:
    with pytest.raises(ValueError, match=r"no requirement 'F99'. There are F1, F2"):
        notebook.check("F1", "F99")


def test_answers_come_in_the_order_asked_for_and_once(workspace: Workspace) -> None:
    assert [answer.id for answer in notebook.check("Q2", "F4", "Q2").answers] == ["Q2", "F4"]


@pytest.mark.slow  # a whole check more
@pytest.mark.sandbox
def test_requirements_about_text_are_judged_where_nothing_builds(package: Path) -> None:
    (package / "CMakeLists.txt").write_text("not CMake (")
    checked = notebook.check("I2", "Q1", "Q2", "Q4")
    assert checked.passed, checked


@pytest.mark.sandbox
def test_a_finding_has_seen_and_try(package: Path) -> None:
    module = package / PACKAGE / "driver.py"
    module.write_text(module.read_text().replace("import math\n", "import math\nimport os\nimport re\nimport sys\n"))
    said = repr(notebook.check("Q1"))
    assert said.startswith("Q1 not yet (4.")
    assert "F401" in said
    assert "seen" in said
    assert "try" in said
    assert "Traceback" not in said


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a build and trials
def test_a_failed_trial_is_shown_as_a_picture(package: Path) -> None:
    module = package / PACKAGE / "utils" / "motion.py"
    module.write_text(module.read_text().replace("return STOP", "pass"))
    checked = notebook.check("F4")
    assert not checked.passed
    assert "seen" in repr(checked)
    assert "data:image/png;base64," in checked._repr_html_()


def test_a_check_leaves_the_environment_unchanged(workspace: Workspace) -> None:
    before = dict(os.environ)
    notebook.check("F1")
    assert dict(os.environ) == before


INTERRUPTED = """
import os, signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started us may have it ignored
from grader.notebook import begin, check, feedback
begin("08")
def say(self, what):
    print(what, flush=True)
    if what.startswith(os.environ["AT"]):
        os.kill(os.getpid(), signal.SIGINT)
feedback.Progress.say = say
check("F4")
"""


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.slow  # a build and trials
@pytest.mark.parametrize("at", ["building the package", "trial "])
def test_an_interrupted_check_leaves_nothing_behind(package: Path, tmp_path: Path, at: str) -> None:
    """Its threads went on with builds and trials, and the kernel was deaf until they were done."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    environment = os.environ | {"AT": at, "TMPDIR": str(temporary), "PYTHONPATH": str(KIT)}
    ran = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], env=environment, capture_output=True, text=True, check=False
    )
    assert ran.stdout.splitlines()[-1].startswith(at)
    assert ran.stderr.endswith("KeyboardInterrupt\n")
    assert list(temporary.iterdir()) == []
    assert running(str(temporary)) == []


# -- a package that cannot have all of a requirement yet ---------------------------------------------------------------
def open_after(workspace: Workspace, number: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lay out the package as notebook `number` ("01") leaves it, with that notebook still open."""
    checkpoints.start_at(workspace, f"{int(number) + 1:02}")
    monkeypatch.setenv(NOTEBOOK, number)


@pytest.mark.slow  # a whole check more
@pytest.mark.ros
@pytest.mark.sandbox
def test_what_a_later_notebook_brings_does_not_keep_a_requirement_from_passing(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_after(workspace, "01", monkeypatch)
    said = repr(notebook.check("I1"))
    assert said == "I1 passed so far (2 of 3)\n    later     notebook 08 brings launch and config files"


@pytest.mark.slow  # a whole check more
@pytest.mark.ros
@pytest.mark.sandbox
def test_what_the_notebook_teaches_is_still_asked_for(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    open_after(workspace, "01", monkeypatch)
    cmake = workspace.package / "CMakeLists.txt"
    cmake.write_text(cmake.read_text().replace("DESTINATION lib/${PROJECT_NAME}", "DESTINATION bin"))
    said = repr(notebook.check("I1"))
    assert said.startswith("I1 not yet (1 of 3)")
    assert "bin/robot_controller" in said
    assert "launch" not in said


def test_a_stub_is_no_file_of_the_layout(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    open_after(workspace, "01", monkeypatch)
    (workspace.package / "package.xml").write_text("<!-- TODO 1 -->\n")
    assert "package.xml is still a stub" in repr(notebook.check("Q3"))


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Return what makes a check find the evidence recorded of a submission, completed with that of the reference."""
    reference = replace(recordings.load("reference"), mutation=None)

    def recorded(name: str) -> None:
        found = replace(reference, trials=reference.trials | recordings.load(name).trials)

        def grade(_package: Path, out: Path, settings: Settings) -> Grading:
            evidence.save(found, out / pipeline.EVIDENCE)
            return pipeline.judge(out / pipeline.EVIDENCE, settings)

        monkeypatch.setattr(check_process, "grade", grade)

    return recorded


@pytest.mark.slow  # a whole check more
def test_bad_readings_are_judged_by_the_node_that_is_there(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch, seen: Callable[[str], None]
) -> None:
    """The published notebook 04 has the first answer, from trials."""
    open_after(workspace, "04", monkeypatch)
    seen("reference")
    found = notebook.check("F6")
    assert repr(found).startswith(
        "F6 passed so far (its points come with a later notebook: 3)\n    seen      your sensor processor"
    )
    assert "✓" not in found._repr_html_(), "no green tick beside a requirement that has given no points"
    seen("publishes_nothing_when_nothing_is_near")
    said = repr(notebook.check("F6"))
    assert said.startswith("F6 not yet (0 of 3)")
    assert "closest_obstacle_distance" in said
