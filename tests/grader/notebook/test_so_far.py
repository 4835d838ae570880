"""`check` in a notebook whose package cannot have all of a requirement yet: it judges the part that is taught there."""

from __future__ import annotations

import pytest

from grader import notebook
from grader.notebook import checkpoints, so_far
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.scoring import rubric


def open_after(workspace: Workspace, number: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lay out the package as notebook `number` ("01") leaves it, with that notebook still open."""
    checkpoints.start_at(workspace, f"{int(number) + 1:02}")
    monkeypatch.setenv(NOTEBOOK, number)


@pytest.mark.ros
@pytest.mark.sandbox
def test_what_a_later_notebook_brings_does_not_keep_a_requirement_from_passing(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_after(workspace, "01", monkeypatch)
    said = repr(notebook.check("I1"))
    assert said == "I1 passed so far (2 of 3)\n    later     notebook 08 brings launch and config files"


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


@pytest.mark.ros
@pytest.mark.sandbox
def test_bad_readings_are_judged_by_the_node_that_is_there(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    open_after(workspace, "04", monkeypatch)
    assert repr(notebook.check("F6")).startswith("F6 passed so far (0 of 3)\n    seen      your sensor processor")
    scans = workspace.package / "ros2_robot_controller" / "utils" / "scans.py"
    scans.write_text(scans.read_text().replace("if in_range and 0.0 < distance < math.inf:", "if True:"))
    said = repr(notebook.check("F6"))
    assert said.startswith("F6 not yet (0 of 3)")
    assert "closest_obstacle_distance" in said


@pytest.mark.sandbox
def test_a_parameter_of_a_later_notebook_is_no_bad_habit(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    open_after(workspace, "05", monkeypatch)
    assert repr(notebook.check("Q4")).startswith("Q4 passed so far (3.")
    driver = workspace.package / "ros2_robot_controller" / "driver.py"
    text = driver.read_text().replace("import math\n", "import math\nimport time\n")
    driver.write_text(
        text.replace("        limits = self._limits()\n", "        time.sleep(0.2)\n        limits = 1\n")
    )
    said = repr(notebook.check("Q4"))
    assert said.startswith("Q4 not yet")
    assert "time.sleep" in said
    assert "fusion_rate" not in said


def test_outside_a_notebook_nothing_waits() -> None:
    assert so_far.later("check_build::test_launch_and_config_are_installed", "") is None
    assert so_far.stand_in("F6", "") is None


def test_whatever_waits_is_a_check_of_the_rubric() -> None:
    whole = rubric.load(rubric.RUBRIC)
    checks = {check.id for check in whole.checks}
    assert set(so_far.LATER) <= checks
    for name, found in so_far.STAND_INS.items():
        assert whole.requirement(name)
        assert found.check in {check.id for check in whole.requirement(found.requirement).checks}
