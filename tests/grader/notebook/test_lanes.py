"""The lanes of a course: which one a workspace is in, what the course gives in it, and how its notebooks fold."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import nbformat
import pytest
from helpers.course import COURSE, PACKAGE, REFERENCE
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from grader.authoring import checkpoint_texts, notebook_source
from grader.intake.submission import open_submission
from grader.notebook import checkpoints, lanes, pieces
from grader.notebook.cell_hooks import CellHooks
from grader.notebook.file_backups import target
from grader.notebook.workspace import NOTEBOOK, Workspace
from grader.scoring.rubric import load

MOTION = f"{PACKAGE}/utils/motion.py"
RUNNING = f"{PACKAGE}/utils/running.py"
SKELETON = "def ramp(a, b, c):\n    return 0.0\n\n\ndef make_safe(a, b, c):\n    return 0.0\n"


@pytest.fixture
def core(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A workspace in the core lane, at the beginning of notebook 05."""
    checkpoints.start_at(workspace, "05")
    lanes.choose(workspace, "05", "core")
    monkeypatch.chdir(workspace.package)
    monkeypatch.setitem(os.environ, NOTEBOOK, "05")
    return workspace


def run(workspace: Workspace, magic: str, line: str, cell: str) -> str:
    """Run a cell as Jupyter does, and return the text of its file afterwards."""
    path = target(line)
    assert path is not None
    plain: Callable[[str, str], None] = pieces.into if magic == pieces.MAGIC else lambda _, text: write(path, text)
    CellHooks(workspace).unless_later(plain, magic)(line, cell)
    return path.read_text()


def write(path: Path, text: str) -> None:
    path.write_text(text)


def solved(path: str, name: str) -> str:
    return pieces.functions((REFERENCE / path).read_text())[name]


# -- which lane --------------------------------------------------------------------------------------------------------


def test_where_nobody_can_answer_it_is_the_whole_lane_and_one_line_says_so(workspace: Workspace) -> None:
    workspace.root.mkdir()
    said = lanes.choose(workspace, "05")
    assert said.startswith(
        'Lane: whole. begin("05", lane=...) takes another: core (4 to 7 hours), whole (15 to 27 hours)'
    )
    assert lanes.of(workspace) == "", "the next kernel, in which somebody may answer, asks"
    assert lanes.lay_out(workspace, "05") == ""


def test_a_kernel_asks_once_and_again_after_a_slip(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    workspace.root.mkdir()
    answers, asked = iter(["cor", "core"]), []
    shell = SimpleNamespace(kernel=True)
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: shell))  # type: ignore[arg-type]
    monkeypatch.setattr("builtins.input", lambda question: asked.append(question) or next(answers))
    assert lanes.choose(workspace, "12") == "", "a notebook that all lanes leave out is no reason to ask"
    assert lanes.choose(workspace, "05") == lanes.choose(workspace, "06") == ""
    assert (lanes.of(workspace), len(asked)) == ("core", 2)


def test_a_lane_can_be_changed_at_any_time(core: Workspace) -> None:
    assert lanes.lay_out(core, "05").startswith(
        "Lane: core. The course gives in this notebook: utils/motion.py (obstacle_in_way"
    )
    before = {path: path.read_bytes() for path in core.package.rglob("*") if path.is_file()}
    lanes.choose(core, "05", "whole")
    assert (lanes.of(core), lanes.lay_out(core, "05")) == ("whole", "")
    assert {path: path.read_bytes() for path in core.package.rglob("*") if path.is_file()} == before
    with pytest.raises(ValueError, match=r"There is no lane 'short'; there are core, whole\."):
        lanes.choose(core, "05", "short")


# -- what the course gives ---------------------------------------------------------------------------------------------


def test_a_given_file_takes_the_place_of_one_that_an_earlier_notebook_gave_but_not_of_an_own_one(
    core: Workspace,
) -> None:
    lanes.lay_out(core, "05")
    assert (core.package / RUNNING).read_text() == (REFERENCE / RUNNING).read_text()
    (core.package / RUNNING).write_text("# mine\n")
    lanes.lay_out(core, "05")
    assert (core.package / RUNNING).read_text() == "# mine\n"


def test_a_skeleton_gets_the_given_functions_and_pieces_go_beside_them(core: Workspace) -> None:
    now = run(core, "writefile", MOTION, SKELETON)
    assert solved(MOTION, "ramp") in now
    assert "def make_safe(a, b, c):\n    return 0.0" in now
    now = run(core, "into", MOTION, "def make_safe(a, b, c):\n    return 1.0\n")
    assert solved(MOTION, "ramp") in now
    assert "return 1.0" in now


def test_functions_come_into_a_skeleton_that_was_written_before_the_lane_was_chosen(core: Workspace) -> None:
    lanes.choose(core, "05", "whole")
    run(core, "writefile", MOTION, SKELETON.replace("ramp", "speed_cap") + "\n\ndef ramp(a):\n    return 0.0\n")
    run(core, "into", MOTION, "def ramp(a):\n    return a  # mine\n")
    lanes.choose(core, "05", "core")
    lanes.lay_out(core, "05")
    now = (core.package / MOTION).read_text()
    assert solved(MOTION, "speed_cap") in now
    assert "return a  # mine" in now


def test_a_stub_does_not_replace_what_is_given_unless_the_cell_says_so(
    core: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    """`Run All` in the whole lane's notebook ran the stubs, too."""
    run(core, "writefile", MOTION, SKELETON)
    stub = "def ramp(a, b, c):\n    return 7.0  # mine\n"
    assert "7.0" not in run(core, "into", MOTION, stub)
    assert (
        "your lane, core, gives ramp. To write it yourself, begin the cell with %%into -f." in capsys.readouterr().out
    )
    assert "7.0" in run(core, "into", f"-f {MOTION}", stub)
    lanes.lay_out(core, "05")
    assert "7.0" in (core.package / MOTION).read_text(), "what a learner has written stays"
    assert "stub" not in run(core, "writefile", RUNNING, "# stub\n")


def test_what_was_given_is_named_in_what_is_handed_in(core: Workspace, tmp_path: Path) -> None:
    lanes.lay_out(core, "05")
    run(core, "writefile", MOTION, (REFERENCE / MOTION).read_text())
    notes = open_submission(core.package, tmp_path / "taken", COURSE).intake.notes
    (note,) = [note for note in notes if "laid out" in note]
    assert RUNNING in note
    assert note.endswith(
        "5 functions were given by the course (a lane) and not changed since: "
        "motion.py clearance, motion.py obstacle_in_way, motion.py ramp, motion.py speed_cap, "
        "motion.py speed_up_gently."
    )
    (core.package / MOTION).write_text("def ramp(): ...\n")
    notes = open_submission(core.package, tmp_path / "again", COURSE).intake.notes
    assert not any("functions were given" in note for note in notes)


def test_a_kit_without_solutions_says_that_it_gives_nothing(core: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoints, "entry_points", lambda **_group: ())
    assert lanes.lay_out(core, "05").startswith("lane core: this kit holds no solutions")


@pytest.mark.parametrize("lane", [lane for lane in lanes.table() if lane != lanes.WHOLE])
def test_all_that_a_lane_gives_is_in_the_solution(lane: str) -> None:
    for notebook in lanes.minutes(lane):
        for path, names in lanes.given(lane, notebook).items():
            text = checkpoint_texts.texts(notebook)[path]
            assert set(names) <= set(pieces.functions(text) if path.endswith(".py") else ()), path


# -- how a notebook looks ----------------------------------------------------------------------------------------------


def test_what_a_lane_leaves_out_folds_and_the_rest_stays_as_it_is() -> None:
    whole = {"tags": ["whole"]}
    cells = [
        new_markdown_cell("# 05 Moving", id="a"),
        new_code_cell('begin("05")', id="b"),
        new_markdown_cell("### Step 2: more\n\nWhy.", id="c", metadata=whole),
        new_code_cell("print(1)", id="d", metadata=whole),
        new_code_cell("print(2)", id="e"),
    ]
    folded = lanes.fold(new_notebook(cells=cells), "05", "core")
    title, note, first, closed, last = folded.cells
    assert title.source == "# 05 Moving"
    assert "core lane: 29 to 50 minutes" in note.source
    assert first.source == 'begin("05", lane="core")'
    assert closed.cell_type == "markdown", "it does not run"
    assert closed.source == (
        "<details><summary>Whole lane, 2 cells: Step 2: more</summary>\n\n**Step 2: more**\n\nWhy.\n\n"
        "````python\nprint(1)\n````\n\n</details>"
    )
    assert last.source == "print(2)"


def test_a_lane_has_more_of_an_exercise_than_the_whole_one_and_a_skeleton_says_what_is_given() -> None:
    stub, skeleton = (
        "class Driver:\n    def _control(self):\n        pass  # TODO\n",
        SKELETON.replace("0.0", "0.0  # step 4"),
    )
    cells = [
        new_code_cell(f"%%into ros2_robot_controller/driver.py\n{stub}", id="piece-driver-py-driver-control"),
        new_code_cell(f"%%writefile {MOTION}\n{skeleton}", id="b"),
    ]
    solved = new_code_cell(cells[0].source.replace("pass  # TODO", "self.move()"), id=cells[0].id)
    exercise, _, given = lanes.fold(new_notebook(cells=cells), "05", "core").cells
    assert exercise.source.startswith("%%into ros2_robot_controller/driver.py\nclass Driver:")
    assert "limits = self._limits()" in exercise.source
    assert "def ramp(a, b, c):\n    return 0.0  # the core lane fills it in when the cell runs" in given.source
    assert "def make_safe(a, b, c):\n    return 0.0  # step 4" in given.source
    assert "self.move()" in lanes.fold(new_notebook(cells=[solved]), "05", "core").cells[0].source


@pytest.mark.parametrize("lane", [lane for lane in lanes.table() if lane != lanes.WHOLE])
@pytest.mark.parametrize("name", notebook_source.names())
def test_a_frame_is_of_an_exercise_and_a_part_of_its_solution(name: str, lane: str) -> None:
    cells = {cell["id"]: cell for cell in notebook_source.read(name, load(COURSE.rubric)).cells}
    for found, frame in lanes.frames(lane, name[:2]).items():
        assert lanes.WHOLE not in notebook_source.tags(cells[found])
        path = notebook_source.written_file(cells[found]) or notebook_source.piece_file(cells[found]) or ""
        right = {line.strip(' "') for line in checkpoint_texts.texts(name[:2])[path].splitlines()}
        added = [line for line in frame.splitlines() if "TODO" not in line and line.strip(' "') not in right]
        assert len(added) < 5, "the rest of a frame is the solution's, word for word"
        assert "TODO" in frame
        if path.endswith(".py"):
            pieces.definitions(frame)


def test_who_chooses_a_lane_gets_folded_copies_beside_the_notebooks(workspace: Workspace, tmp_path: Path) -> None:
    """A copy that is there may hold a learner's work."""
    (tmp_path / "notebooks").mkdir()
    cells = [new_markdown_cell("# 05", id="a"), new_markdown_cell("[next](06_services.ipynb)", id="b")]
    for name in ("05_moving_safely", "06_services", "12_frames"):
        nbformat.write(new_notebook(cells=cells), tmp_path / "notebooks" / f"{name}.ipynb")
    (tmp_path / "notebooks" / "06_services.core.ipynb").write_text("mine")
    said = lanes.choose(workspace, "05", "core")
    assert said == "Open 05_moving_safely.core.ipynb, and so on: in them what the lane leaves out is folded."
    found = {path.name: path.read_text() for path in (tmp_path / "notebooks").glob("*.core.ipynb")}
    assert "(06_services.core.ipynb)" in found["05_moving_safely.core.ipynb"]
    assert found["06_services.core.ipynb"] == "mine"
    assert len(found) == 2
    assert lanes.choose(workspace, "06", "core") == "", "only when the lane changes"
