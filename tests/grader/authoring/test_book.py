"""From a source to a notebook: stable ids, outputs without traces of the machine, metadata for nbgrader."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import nbformat
import pytest

from grader.authoring import book, notebook_source, stored_outputs
from grader.errors import GraderError
from grader.scoring.rubric import Rubric

NAME = "02_example"


def ids(notebook: nbformat.NotebookNode) -> list[str]:
    return [cell["id"] for cell in notebook.cells]


def source(folder: Path) -> Path:
    return folder / "source" / f"{NAME}.py"


def test_cells_are_named_after_their_section_file_and_check(example: Path, rubric: Rubric):
    assert ids(notebook_source.read(NAME, rubric, example)) == [
        "start-01",
        "start-02",
        "same-name-same-type-01",
        "same-name-same-type-02",
        "file-given-py",
        "file-tail-py",
        "piece-tail-py-first",
        "same-name-same-type-06",
        "same-name-same-type-07",
        "file-answer-py",
        "check-i3",
        "same-name-same-type-10",
        "same-name-same-type-11",
        "recall-01",
    ]


def test_a_new_cell_renames_no_cell_of_another_section(example: Path, rubric: Rubric):
    before = ids(notebook_source.read(NAME, rubric, example))
    source(example).write_text(source(example).read_text().replace("# %%\nimport os", "# %%\n1 + 1\n\n# %%\nimport os"))
    after = ids(notebook_source.read(NAME, rubric, example))
    assert after == ["start-01", "start-02", "start-03", *before[2:]]


def test_the_same_file_twice_gives_two_names(example: Path, rubric: Rubric):
    source(example).write_text(source(example).read_text() + '\n# %% tags=["exercise"]\n# %%writefile answer.py\n1\n')
    assert ids(notebook_source.read(NAME, rubric, example))[-1] == "file-answer-py-2"


def test_building_twice_writes_the_same_bytes(built_example: Path, tmp_path: Path, rubric: Rubric):
    first = book.read_stored(built_example / f"{NAME}.ipynb")
    book.write(first, tmp_path / "again.ipynb")
    assert (tmp_path / "again.ipynb").read_bytes() == (built_example / f"{NAME}.ipynb").read_bytes()


def test_stored_outputs_name_no_machine(built_example: Path):
    stored = book.read_stored(built_example / f"{NAME}.ipynb")
    (begun, printed, *_) = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert begun.outputs[0].text == "notebook 02 in ws\n"
    assert [output.text for output in printed.outputs] == ["one\ntwo\n"]
    assert all("execution" not in cell.metadata for cell in stored.cells)


def test_nbgrader_finds_its_metadata(example: Path, rubric: Rubric):
    notebook = notebook_source.read("02_interfaces", rubric, renamed(example, "02_interfaces"))
    marks = {cell["id"]: cell.metadata.nbgrader for cell in notebook.cells if "nbgrader" in cell.metadata}
    common = {"schema_version": 3, "task": False}
    theirs = {
        name: common | {"grade": False, "solution": True, "locked": False, "grade_id": name}
        for name in ("file-answer-py", "file-tail-py", "piece-tail-py-first")
    }
    assert marks == theirs | {
        "file-given-py": common | {"grade": False, "solution": False, "locked": True, "grade_id": "file-given-py"},
        "check-i3": common | {"grade": True, "solution": False, "locked": True, "grade_id": "check-i3", "points": 4.0},
    }


def test_the_last_check_of_a_requirement_holds_its_points(example: Path, rubric: Rubric):
    later = source(example).read_text().replace('check("I3")', 'check("I4", "I3")')
    (example / "source" / "07_later.py").write_text(later)
    notebook = notebook_source.read(NAME, rubric, example)
    assert notebook_source.scored_requirements(NAME, notebook, example) == {"check-i3": []}
    marks = {
        cell["id"]: cell.metadata.get("nbgrader", {})
        for cell in notebook_source.read("07_later", rubric, example).cells
    }
    assert marks["check-i4-i3"]["points"] == 7.0
    (first,) = [cell for cell in notebook_source.read(NAME, rubric, example).cells if cell["id"] == "check-i3"]
    assert (first.metadata.nbgrader.grade, first.metadata.nbgrader.locked) == (False, True)


def test_nbgrader_counts_the_points_of_a_check(example: Path, tmp_path: Path):
    """A number as the last value is partial credit; the lines between the marks are hidden from students."""
    assert book.main(["nbgrader", "02", "--folder", str(example), "--out", str(tmp_path)]) == 0
    written = book.read_stored(tmp_path / "source" / "notebooks" / f"{NAME}.ipynb")
    (checked,) = [cell for cell in written.cells if cell["id"] == "check-i3"]
    assert checked.source.splitlines() == [
        'answer = check("I3")',
        "answer",
        "### BEGIN HIDDEN TESTS",
        "sum(float(found.points) for found in answer.answers if found.id in ['I3'])",
        "### END HIDDEN TESTS",
    ]


def renamed(folder: Path, name: str) -> Path:
    source(folder).rename(folder / "source" / f"{name}.py")
    return folder


def test_a_changed_source_is_noticed(example: Path, rubric: Rubric):
    assert book.differences(NAME, rubric, example) == []
    source(example).write_text(source(example).read_text().replace("ANSWER = 0", "ANSWER = 1"))
    (problem,) = book.differences(NAME, rubric, example)
    assert problem.startswith("02_example.ipynb: cell file-answer-py differs from its source.")


def test_a_new_cell_and_a_missing_notebook_are_noticed(example: Path, rubric: Rubric):
    source(example).write_text(source(example).read_text() + "\n# %%\n1 + 1\n")
    assert "has other cells than its source" in book.differences(NAME, rubric, example)[0]
    (example / f"{NAME}.ipynb").unlink()
    assert "is missing" in book.differences(NAME, rubric, example)[0]


def test_without_running_unchanged_cells_keep_their_outputs(example: Path, rubric: Rubric):
    source(example).write_text(source(example).read_text().replace('print("two")', 'print("three")'))
    book.build_without_running(NAME, rubric, example)
    cells = {cell["id"]: cell for cell in book.read_stored(example / f"{NAME}.ipynb").cells}
    assert cells["start-02"].outputs[0].text == "notebook 02 in ws\n"
    assert cells["same-name-same-type-02"].outputs == []


def test_an_exception_keeps_the_old_notebook_and_is_reported(
    example: Path, rubric: Rubric, capsys: pytest.CaptureFixture[str]
):
    before = (example / f"{NAME}.ipynb").read_bytes()
    source(example).write_text(source(example).read_text().replace('print("two")', 'raise ValueError("two")'))
    assert book.main(["build", "--folder", str(example)]) == 1
    assert "cell same-name-same-type-02:" in (said := capsys.readouterr().err)
    assert "ValueError: two" in said
    assert (example / f"{NAME}.ipynb").read_bytes() == before


def test_an_unknown_notebook_is_an_error(example: Path):
    with pytest.raises(GraderError, match="There is no notebook 07; there are 02_example"):
        notebook_source.select(["07"], example)


def test_a_widget_with_a_static_picture_is_stored_as_that_picture():
    widget = {"application/vnd.jupyter.widget-view+json": {"model_id": "1"}, "image/png": png(4), "text/plain": "Live"}
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("live")])
    notebook.cells[0].outputs = [nbformat.v4.new_output("display_data", data=widget)]
    stored_outputs.clean(notebook, Path("ws"))
    assert set(notebook.cells[0].outputs[0].data) == {"image/png", "text/plain"}


def test_stored_pictures_are_small():
    assert len(stored_outputs.small_png(png(400))) < len(png(400)) / 2


def png(width: int) -> str:
    """Return a picture with many colours."""
    from PIL import Image

    stream = io.BytesIO()
    Image.linear_gradient("L").resize((width, width)).convert("RGBA").rotate(30).save(stream, "png")
    return base64.b64encode(stream.getvalue()).decode()


def test_a_whole_file_keeps_its_first_line_and_its_comments(example: Path, rubric: Rubric):
    lines = ["#!/usr/bin/env python3", "# !no shell", "# %no magic", "x = 1"]
    cell = "\n".join(["", '# %% tags=["given"]', "# %%writefile scripts/x", *lines, ""])
    source(example).write_text(source(example).read_text() + cell + "\n# %%\n# !ls\n")
    *_, written, shell = notebook_source.read(NAME, rubric, example).cells
    assert notebook_source.body(written).splitlines() == lines
    assert shell.source == "!ls"
