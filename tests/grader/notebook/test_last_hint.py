"""The last hint of an exercise appears below the cell in which its try has failed, and nowhere before."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from grader.notebook import cell_hooks, last_hint, tries
from grader.notebook.workspace import NOTEBOOK, Workspace

PIECE = "%%into utils/motion.py\ndef cap(x):\n    return x\n"
HINT = "<details><summary>Hint 2: all but the last line</summary>\n\n    return min(...)\n</details>"


@pytest.fixture
def shown(workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what the hooks have shown, of a course whose notebook 05 has a hint for `cap` and one for a test."""
    folder = tmp_path / "notebooks"
    (folder / last_hint.FOLDER).mkdir(parents=True)
    known = {"utils/motion.py:cap": HINT, "test/test_motion.py:test_cap": HINT, "turned": HINT}
    last_hint.file_of("05_moving", folder).write_text(json.dumps(known))
    monkeypatch.setattr(last_hint, "course", lambda: SimpleNamespace(notebooks=folder))
    monkeypatch.setattr(last_hint, "_NOW", last_hint._Standing())
    monkeypatch.setattr(cell_hooks, "prepare", lambda *_: None)
    monkeypatch.setattr(cell_hooks, "forget_changed_modules", lambda *_: None)
    monkeypatch.setenv(NOTEBOOK, "05")
    found: list[str] = []
    monkeypatch.setattr("IPython.display.display", lambda data, **_: found.append(data["text/markdown"]))
    return found


def run(workspace: Workspace, cell: str, work=lambda: None) -> None:
    """Run a cell that does `work`, between the hooks."""
    hooks, info = cell_hooks.CellHooks(workspace), SimpleNamespace(raw_cell=cell)
    hooks.before(info)
    success = True
    try:
        work()
    except ZeroDivisionError:
        success = False
    hooks.after(SimpleNamespace(success=success, info=info))


def table(wanted: float):
    """Return a table's cell, with a function beside it that is no exercise."""
    return lambda: tries({"1 + 1": wanted})


def test_it_appears_below_a_table_that_is_not_right(workspace: Workspace, shown: list[str]):
    run(workspace, PIECE)
    assert not shown
    run(workspace, "def helper(): ...\ntries(...)", table(3.0))
    assert shown == [HINT]
    run(workspace, "print()")
    assert shown == [HINT]


@pytest.mark.parametrize(
    ("cell", "work", "appears"),
    [
        ("tries(...)", table(2.0), False),
        ("1 / 0", lambda: 1 / 0, True),
        ("print()", lambda: None, False),
    ],
)
def test_only_a_failure_is_a_failed_try(cell: str, work, appears: bool, workspace: Workspace, shown: list[str]):
    run(workspace, PIECE)
    run(workspace, cell, work)
    assert bool(shown) == appears


def test_what_is_right_needs_it_no_more(workspace: Workspace, shown: list[str]):
    run(workspace, PIECE)
    run(workspace, "tries(...)", table(2.0))
    run(workspace, "tries(...)", table(3.0))
    assert not shown


def test_an_exercise_without_one_does_not_open_that_of_the_exercise_before(workspace: Workspace, shown: list[str]):
    run(workspace, PIECE)
    run(workspace, "%%writefile utils/design.py\ndef f(): ...")
    run(workspace, "tries(...)", table(3.0))
    assert not shown


def test_a_function_of_the_notebook_has_one_too(workspace: Workspace, shown: list[str]):
    run(workspace, "def turned(x):\n    return x")
    run(workspace, "tries(...)", table(3.0))
    assert shown == [HINT]


@pytest.mark.parametrize(
    ("failed", "appears"),
    [
        ({"test/test_motion.py::test_cap": True}, True),
        ({"test/test_motion.py::test_cap[0.5-wall]": True}, True),
        ({"test/test_motion.py::test_other": True}, False),
        ({}, False),
        (None, False),
    ],
)
def test_pytest_says_how_the_tests_of_the_exercise_went(
    failed: dict[str, bool] | None, appears: bool, workspace: Workspace, shown: list[str]
):
    if failed is not None:
        kept = workspace.package / ".pytest_cache" / "v" / "cache" / "lastfailed"
        kept.parent.mkdir(parents=True)
        kept.write_text(json.dumps(failed))
    run(workspace, "%%into test/test_motion.py\n@pytest.fixture\ndef test_cap(): ...")
    assert not shown, "what failed before it was written says nothing of it"
    run(workspace, "!pytest -q test/test_motion.py | cat")
    assert bool(shown) == appears


@pytest.mark.parametrize(
    ("cell", "names"),
    [
        ("# A comment.\n%%into a.py\nclass A:\n    async def b(self): ...\n    def c(self): ...", {"a.py:b", "a.py:c"}),
        ("%%writefile --force config/a.yaml\ndef: no", {"config/a.yaml"}),
        ("def a(x):\n    def inner(): ...\n        def deep(): ...", {"a", "inner"}),
        ("print(1)", set()),
    ],
)
def test_what_a_cell_writes(cell: str, names: set[str]):
    assert last_hint.written(cell) == names
