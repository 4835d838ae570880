"""Where a learner stands: the answers of checks and the active minutes, in one panel."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from grader import notebook
from grader.notebook import cell_hooks, lanes, standing
from grader.notebook.feedback import Answer
from grader.notebook.workspace import LINKED, NOTEBOOK, Workspace

IDLE = Answer("F1", "Zero command when idle", "3", "3", True)
TOUCHED = Answer("F4", "Stops before an obstacle", "0", "5", False)
BUILT = Answer("I1", "Builds and installs", "2", "3", True, so_far=True)


@pytest.fixture
def here(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """The workspace, with notebook 05 open."""
    monkeypatch.setenv(NOTEBOOK, "05")
    return workspace


def panel(workspace: Workspace) -> dict[str, str]:
    """Return the panel's rows by notebook, and its other lines below "lines"."""
    text = repr(standing.of(workspace))
    rows = {match[1]: match[2] for match in re.finditer(r"^[> ] (\d\d) [a-z ]+?  +(.*)$", text, re.MULTILINE)}
    return rows | {"lines": "\n".join(line for line in text.splitlines() if line[:1] not in "> ")}


def test_a_requirement_is_done_so_far_or_open(here: Workspace):
    standing.note(here, [IDLE, TOUCHED, BUILT])
    rows = panel(here)
    assert rows["05"].startswith("✓ F1  ○ F4  ○ F5")
    assert "○ Q3  ◐ I1  ○ I2" in rows["01"]
    assert "5 of 100 points in your last checks." in rows["lines"]
    assert 'Next: F4 Stops before an obstacle, in the section "Stop before the wall" of this notebook.' in rows["lines"]


def test_in_a_shorter_lane_only_what_it_asks_for_is_shown_and_counted(here: Workspace):
    lanes.keep(here, "core")
    standing.note(here, [IDLE, Answer("I8", "Ctrl-C", "1", "1", True)])
    rows = panel(here)
    assert rows["05"] == "✓ F1  ○ F4  ○ Q4  ✓ I8"
    assert "3 of 85 points in your last checks." in rows["lines"]


def test_in_a_shorter_lane_what_it_asks_for_later_is_not_next(here: Workspace, monkeypatch):
    lanes.keep(here, "core")
    for number, names, after in (
        ("04", ("F6", "F12", "F13", "I4"), "05 moving safely"), ("05", ("F1", "F4"), "06 services"),
    ):  # fmt: skip
        monkeypatch.setenv(NOTEBOOK, number)
        standing.note(here, [Answer(name, "", "1", "1", True) for name in names])
        assert f"Next: notebook {after}." in panel(here)["lines"]


def test_the_last_answer_counts_and_an_error_of_the_kit_does_not(here: Workspace):
    standing.note(here, [IDLE, Answer("F4", "", "5", "5", True)])
    standing.note(here, [TOUCHED, Answer("F1", "", "0", "3", False, ours=True)])
    assert panel(here)["05"].startswith("✓ F1  ○ F4")


def test_what_is_done_stays_done_when_an_earlier_notebook_asks_less(here: Workspace, monkeypatch):
    standing.note(here, [IDLE])
    monkeypatch.setenv(NOTEBOOK, "04")
    standing.note(here, [Answer("F1", "", "0", "3", True, so_far=True)])
    assert panel(here)["05"].startswith("✓ F1")


def test_when_all_of_a_notebook_is_done_the_next_one_is_next(here: Workspace):
    names = ("F1", "F4", "F5", "I8", "Q4")
    standing.note(here, [Answer(name, "", "1", "1", True) for name in names])
    assert "Next: notebook 06 services." in panel(here)["lines"]


def test_the_panel_follows_the_theme_and_escapes(here: Workspace):
    standing.note(here, [IDLE])
    page = standing.of(here)._repr_html_()
    assert "<style" not in page
    assert "&quot;Stop before the wall&quot;" in page
    for colour in re.findall(r"(?<!-)(?:color|background|border[-a-z]*):[^;\"]*", page):
        assert not re.search(r"#[0-9a-f]{3,8}(?![0-9a-f]*\))", colour), colour  # only as the last resort of a variable


def test_minutes_are_kept_for_each_notebook_and_shown(here: Workspace):
    for _ in range(62):
        standing.add_seconds(here, "04", 60.0)
    standing.add_seconds(here, "05", 20.0)
    standing.add_seconds(here, "05", 40.0)
    assert standing.minutes(here) == {"04": 62, "05": 1}
    rows = panel(here)
    assert rows["04"].startswith("1 h 2 min")
    assert rows["05"].startswith("1 min")
    assert "1 h 3 min of work so far, without pauses of more than 10 minutes" in rows["lines"]


def test_a_kernel_counts_what_passes_in_and_between_cells_but_not_a_pause(here: Workspace, monkeypatch):
    times = iter((0.0, 0.0, 60.0, 180.0, 781.0, 841.0))
    monkeypatch.setattr("time.monotonic", lambda: next(times))
    hooks, cell = cell_hooks.CellHooks(here), SimpleNamespace(raw_cell="")
    ended = SimpleNamespace(success=True, info=cell)
    hooks.after(ended)  # of the cell with `begin`
    for _ in range(2):
        hooks.before(cell)
        hooks.after(ended)
    assert standing.minutes(here) == {"05": 4}


def test_the_minutes_with_a_patient_are_the_learners(here: Workspace):
    clinic = Workspace(here.root / "clinic")
    clinic.root.mkdir(parents=True)
    (clinic.root / LINKED).touch()
    standing.add_seconds(clinic, "11", 120.0)
    assert standing.minutes(here) == {"11": 2}


@pytest.mark.parametrize("text", ["", "[]", '{"seconds": "x", "answers": {}}', '{"seconds": 1, "answers": {"F1": 2}}'])
def test_a_record_that_cannot_be_read_counts_as_none(text: str, here: Workspace):
    record = here.root / ".progress" / "05.json"
    record.parent.mkdir(parents=True)
    record.write_text(text)
    assert panel(here)["05"].startswith("○ F1")
    standing.add_seconds(here, "05", 60.0)
    assert standing.minutes(here) == {"05": 1}


def test_without_a_place_for_the_record_a_cell_goes_on(here: Workspace):
    here.root.mkdir(parents=True, exist_ok=True)
    (here.root / ".progress").write_text("a file")
    standing.add_seconds(here, "05", 60.0)
    assert standing.minutes(here) == {}


def test_a_stored_notebook_shows_its_own_requirements_alone(here: Workspace, monkeypatch):
    """What was run before it, and for how long, differs from run to run."""
    standing.add_seconds(here, "05", 600.0)
    standing.note(here, [IDLE])
    monkeypatch.setenv(standing.ALONE, "1")
    rows = panel(here)
    assert rows.keys() == {"05", "lines"}
    assert rows["05"].startswith("✓ F1")
    assert "points" not in rows["lines"]


def test_a_check_leaves_its_answers_for_the_panel(here: Workspace):
    notebook.check("Q5")
    kept = json.loads((Path(here.root) / ".progress" / "05.json").read_text())
    assert kept["answers"]["Q5"]["state"] == "open"
    assert repr(notebook.progress()).splitlines()[0].startswith("  00 first drive")
