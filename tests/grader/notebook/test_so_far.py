"""`check` in a notebook whose package cannot have all of a requirement yet: it judges the part that is taught there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from helpers import recordings

from grader import evidence, notebook, pipeline
from grader.notebook import check_process, checkpoints, so_far
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.settings import Settings


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


@pytest.mark.slow  # a whole check more
@pytest.mark.sandbox
def test_the_layout_is_asked_for_as_far_as_it_should_be_there(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_after(workspace, "01", monkeypatch)
    assert repr(notebook.check("Q3")).startswith("Q3 passed so far (2.")
    (workspace.package / "setup.cfg").unlink()
    said = repr(notebook.check("Q3"))
    assert said.startswith("Q3 not yet (0 of 5)\n    seen      there is no setup.cfg")


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


@pytest.mark.slow  # a whole check more
@pytest.mark.ros
@pytest.mark.sandbox
def test_a_parameter_of_a_later_notebook_is_no_bad_habit(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    """The published notebook 05 has the answer for a driver without another bad habit."""
    open_after(workspace, "05", monkeypatch)
    driver = workspace.package / "ros2_robot_controller" / "driver.py"
    text = driver.read_text()
    driver.write_text(
        text.replace("        limits = self._limits()\n", "        print()\n        limits = self._limits()\n")
    )
    said = repr(notebook.check("Q4"))
    assert said.startswith("Q4 not yet")
    assert "print" in said
    assert "fusion_rate" not in said


def test_outside_a_notebook_nothing_waits() -> None:
    assert so_far.later("check_build::test_shared_files_are_installed", "") is None
    assert so_far.stand_in("F6", "") is None


def test_whatever_waits_is_a_check_of_the_rubric() -> None:
    whole = rubric.load(rubric.RUBRIC)
    checks = {check.id for check in whole.checks}
    assert set(so_far.waiting().keys()) <= checks
    for name, found in so_far.stand_ins().items():
        assert whole.requirement(name)
        assert found.check in {check.id for check in whole.requirement(found.requirement).checks}


def test_a_check_waits_before_the_notebook_that_brings_what_it_needs_and_not_in_it():
    assert so_far.waiting()
    for check, row in so_far.waiting().items():
        assert so_far.later(check, "00") == row
        assert so_far.later(check, row.notebook) is None
        assert so_far.later(check, "") is None
