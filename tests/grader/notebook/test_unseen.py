"""The unseen tasks: their checks accept the solution, and refuse what people really write, with what was seen."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest
from grader.notebook.unseen import check
from helpers.notebook_fixtures import as_in_a_kernel

from grader.authoring import notebook_source
from grader.notebook import checkpoints
from grader.notebook.workspace import Workspace

pytestmark = pytest.mark.ros

TASKS = {"U1": ("04", "around"), "U2": ("05", "safe_speed"), "U3": ("07", "pausable")}


@pytest.fixture
def answer(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., str]]:
    """A function that returns the check's answer to a task's solution, after an edit."""
    checkpoints.start_at(workspace, "08")
    monkeypatch.syspath_prepend(str(workspace.package))

    def answered(task: str, old: str = "", new: str = "") -> str:
        notebook, name = TASKS[task]
        text, names = notebook_source.functions(notebook), dict[str, Any]()
        assert old in text
        exec(text.replace(old, new) if old else text, names)
        return " ".join(repr(check(task, names[name])).split())

    with as_in_a_kernel(workspace):
        yield answered


MISTAKES = [
    # The kit's lidar looks ahead, all around, from 0.15 to 12 m.
    ("U1", "scan.angle_min + mounted", "scan.angle_min", "from whose x axis is a beam's angle measured"),
    ("U1", "scan.angle_min + mounted", "scan.angle_min - mounted", "lidar turned by 90°"),
    ("U1", "near.ahead if looks(0.0) else 0.0", "near.ahead", "what may the robot believe about that side?"),
    ("U1", "range_min=scan.range_min", "range_min=0.15", "which readings are valid is said in the scan"),
    ("U1", "near = measure_proximity(", "scan.angle_min = 0.0; near = measure_proximity(", "you have changed the scan"),
    # The kit's robot: a radius of 0.171 m, 5 m/s², 0.5 m/s; and half of the formula.
    ("U2", "distance - base.radius)", "distance - 0.171)", "It rolls"),
    ("U2", "lost = base.brake * base.delay", "lost = 0.0", "this base's own numbers"),
    ("U2", "2 * base.brake", "2 * 5.0", "then the hull touches"),
    ("U2", "min(base.max_speed,", "min(0.5,", "as fast as it safely can"),
    ("U2", "if not distance > base.radius", "if distance < base.radius", "no room, inf, nan?"),
    # A pause that forgets what was asked for, that stays silent, or that agrees to everything.
    ("U3", "self._paused = request.data", "self._paused, self._speed = request.data, 0.0", "keep apart what is wanted"),
    ("U3", "super()._wanted(limits)", "type(STOP)(v=self._speed)", "what is wanted while there is a goal?"),
    ("U3", "response.success = request.data != self._paused", "response.success = True", "a second pause: suc"),
    ("U3", "self._paused = request", "self._control_timer.cancel(); self._paused = request", "no command at all"),
    ("U3", "return STOP if self._paused else", "return", "nothing but zeros during the pause"),
    ("U3", "            return response\n", "", "`return response`?"),
    ("U3", "return Pausable", "return Navigator", "the node offers no such service"),
]  # fmt: skip


@pytest.mark.parametrize("task", TASKS)
def test_the_solution_passes(task: str, answer: Callable[..., str]):
    assert answer(task) == f"{task} passed"


@pytest.mark.parametrize(("task", "old", "new", "said"), MISTAKES, ids=[f"{m[0]}-{m[3]}" for m in MISTAKES])
def test_a_mistake_is_refused_with_what_was_seen(
    task: str, old: str, new: str, said: str, answer: Callable[..., str]
):  # fmt: skip
    text = answer(task, old, new)
    assert text.startswith(f"{task} not yet seen ")
    assert said in text


def test_a_requirement_is_checked_as_before(workspace: Workspace):
    """The import of this `check` replaces the one that the notebook's other cells call."""
    assert "F14 not yet" in repr(check("F14"))
