"""From a source to a notebook: stable ids, outputs without traces of the machine, metadata for nbgrader."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import Any

import nbformat
import pytest
from PIL import Image, ImageSequence

from grader.authoring import book, notebook_run, notebook_source
from grader.errors import GraderError
from grader.notebook import last_hint
from grader.scoring.rubric import Rubric
from sim import Simulator, Twist, World, drive
from sim.film import Film

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
    """Once read and written again, too."""
    first = book.published_file(NAME, built_example)
    book.write(book.read_stored(first), tmp_path / "again.ipynb")
    assert (tmp_path / "again.ipynb").read_bytes() == first.read_bytes()


def test_stored_outputs_name_no_machine(built_example: Path):
    stored = book.read_stored(book.published_file(NAME, built_example))
    (begun, printed, *_) = [cell for cell in stored.cells if cell.cell_type == "code"]
    assert begun.outputs[0].text == "notebook 02 in ws\n"
    assert [output.text for output in printed.outputs] == ["one\ntwo\n"]
    assert all("execution" not in cell.metadata for cell in stored.cells)


def png(width: int) -> str:
    """Return a picture with many colours."""
    stream = io.BytesIO()
    Image.linear_gradient("L").resize((width, width)).convert("RGBA").rotate(30).save(stream, "png")
    return base64.b64encode(stream.getvalue()).decode()


WIDGET = {"application/vnd.jupyter.widget-view+json": {"model_id": "1"}, "image/png": png(4), "text/plain": "Live"}


@pytest.mark.parametrize(
    ("output", "stored"),
    [
        ({"text": "[WARN] [1795369795.821985000] [node]: Battery low"}, ["[WARN] [<time>] [node]: Battery low"]),
        ({"data": {}}, []),  # a line about progress
        ({"data": WIDGET}, [{"image/png", "text/plain"}]),  # a widget needs a kernel, its picture does not
    ],
)
def test_outputs_are_stored_without_what_depends_on_the_run(output: dict[str, Any], stored: list[object]):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell("run_node()")])
    kind = "stream" if "text" in output else "display_data"
    notebook.cells[0].outputs = [nbformat.v4.new_output(kind, **output)]
    notebook_run.clean(notebook, Path("ws"))
    assert [out.get("text") or {*out.data} for out in notebook.cells[0].outputs] == stored


@pytest.mark.parametrize(
    ("said", "missing"),
    [
        ("X1 passed (2 of 2)", []),
        ("X1 is judged at hand-in, not here (10 points)", []),
        ("X1 not yet (0 of 2)", ["X1"]),
    ],
)
def test_what_is_held_back_has_not_failed(said: str, missing: list[str]):
    cell = nbformat.v4.new_code_cell('check("X1")', metadata={"tags": [notebook_source.CHECK]})
    cell.outputs = [nbformat.v4.new_output("stream", text=said)]
    assert notebook_run.answered_otherwise(nbformat.v4.new_notebook(cells=[cell])) == missing


LIVE = """\
from sim import Simulator, load_world
from sim.live import Live
live = Live(Simulator(load_world("office")))
display(live)
"""


@pytest.mark.slow  # a kernel
def test_a_live_view_that_nobody_watches_runs_for_a_while_and_is_stored_as_its_last_picture(tmp_path: Path):
    """Not one that its author lets run, the page says for how long; and not again after a reset."""
    author_runs = f"{LIVE}live.run(2.0)"
    cells = [LIVE, "live.simulator.time", author_runs, "live.simulator.time", "live.reset()", "live.simulator.time"]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    assert notebook_run.execute(notebook, tmp_path / "ws").error is None
    assert "image/png" in notebook.cells[0].outputs[-1].data
    times = [cell.outputs[0].data["text/plain"] for cell in notebook.cells[1::2]]
    assert times == ["10.0", "2.0", "0.0"]


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


def renamed(folder: Path, name: str) -> Path:
    source(folder).rename(folder / "source" / f"{name}.py")
    return folder


def cells(notebook: nbformat.NotebookNode) -> dict[str, nbformat.NotebookNode]:
    return {cell["id"]: cell for cell in notebook.cells}


def test_the_student_edition_is_the_source_and_the_published_one_its_solved_run(example: Path, rubric: Rubric):
    student = book.read_stored(book.student_file(NAME, example))
    made = notebook_source.read(NAME, rubric, example)
    notebook_source.take_out_hints(made)
    assert student == made
    assert [cell["id"] for cell in student.cells if cell.get("outputs")] == []
    page = book.read_stored(book.published_file(NAME, example))
    assert cells(page)["file-answer-py"].source == '%%writefile answer.py\n"""Hold the answer."""\n\nANSWER = 42'
    assert cells(page)["check-i3"].outputs[0].text == "I3 passed (5 of 5)\n"
    assert page.cells[0].source.startswith("# An example")
    assert "the exercises are solved" in page.cells[1].source
    assert "[the student edition](../02_example.ipynb)" in page.cells[1].source


def test_a_last_hint_is_beside_the_student_edition_until_its_exercise_was_tried(example: Path):
    """One that nothing tries, as that of the piece, stays on the page; the published edition has all of them."""
    taken = json.loads(last_hint.file_of(NAME, example).read_text())
    assert {name: "Nothing is left out." in hint for name, hint in taken.items()} == {"answer.py": True}
    told = {
        edition: sum(cell.source.count("Nothing is left out.") for cell in book.read_stored(file).cells)
        for edition, file in (
            ("student", book.student_file(NAME, example)), ("published", book.published_file(NAME, example)),
        )
    }  # fmt: skip
    assert told == {"student": 1, "published": 2}
    pages = "\n".join(cell.source for cell in book.read_stored(book.student_file(NAME, example)).cells)
    assert f"<summary>Hint 2: all but the last line</summary>\n\n{last_hint.PLACE}\n</details>" in pages


def test_the_published_edition_lies_one_folder_deeper(example: Path, notebook: book.Notebook):
    """Its pictures and pages are found from there; the next notebook is the published one."""
    links = '[a](03_next.ipynb) [b](../docs/handout.md#f1) [c](#recall) [d](https://example.org) <img src="x.png">'
    source(example).write_text(source(example).read_text().replace("Predict what this shows", links))
    made = cells(notebook.published())
    assert "![What will be there at the end](../pictures/02.png)" in made["start-01"].source
    assert (
        '[a](03_next.ipynb) [b](../../docs/handout.md#f1) [c](#recall) [d](https://example.org) <img src="../x.png">'
        in made["same-name-same-type-01"].source
    )


def test_a_change_of_the_prose_needs_no_run(example: Path, notebook: book.Notebook):
    """The new words stand in both editions, over the outputs of the last run."""
    before = cells(book.read_stored(book.published_file(NAME, example)))
    source(example).write_text(source(example).read_text().replace("Predict what this shows", "Guess what this shows"))
    notebook.reword()
    assert notebook.differences() == []
    after = cells(book.read_stored(book.published_file(NAME, example)))
    assert after["check-i3"].outputs == before["check-i3"].outputs


def test_a_changed_source_is_noticed_in_both_editions(example: Path, notebook: book.Notebook):
    assert notebook.differences() == []
    source(example).write_text(source(example).read_text().replace('print("two")', 'print("three")'))
    advice = "is not what its source says. Run `python -m grader.authoring.book build 02`."
    assert notebook.differences() == [
        f"02_example.ipynb {advice}", f"published/02_example.ipynb {advice}",
    ]  # fmt: skip
    with pytest.raises(GraderError, match="The code of 02_example has changed too"):
        notebook.reword()
    book.published_file(NAME, example).unlink()
    assert notebook.differences()[1].startswith("published/02_example.ipynb is missing.")


def test_an_output_in_a_students_notebook_is_noticed(example: Path, notebook: book.Notebook):
    """As JupyterLab leaves it when an author has saved the file."""
    page = book.read_stored(book.student_file(NAME, example))
    cells(page)["start-02"].execution_count = 1
    book.write(page, book.student_file(NAME, example))
    assert len(notebook.differences()) == 1


@pytest.mark.slow  # one more kernel
def test_an_exception_keeps_the_old_notebook_and_is_reported(example: Path, notebook: book.Notebook):
    before = book.published_file(NAME, example).read_bytes()
    source(example).write_text(source(example).read_text().replace('print("two")', 'raise ValueError("two")'))
    error = notebook.publish().error or ""
    assert "cell same-name-same-type-02:" in error
    assert "ValueError: two" in error
    assert book.published_file(NAME, example).read_bytes() == before


@pytest.mark.slow  # a kernel
def test_an_untouched_run_is_reported_and_stores_nothing(example: Path, capsys: pytest.CaptureFixture[str]):
    before = {path: path.read_bytes() for path in example.rglob("*.ipynb")}
    assert book.main(["untouched", "--folder", str(example)]) == 0
    assert "I3 not yet (0 of 5)" in capsys.readouterr().out
    source(example).write_text(source(example).read_text().replace('print("two")', 'raise ValueError("two")'))
    assert book.main(["untouched", "--folder", str(example)]) == 1
    assert "ValueError: two" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in example.rglob("*.ipynb")} == before


def test_an_unknown_notebook_is_an_error(example: Path):
    with pytest.raises(GraderError, match="There is no notebook 07; there are 02_example"):
        notebook_source.select(["07"], example)


def test_stored_pictures_are_small():
    assert len(notebook_run.small_png(png(400))) < len(png(400)) / 2


def test_a_film_is_stored_with_all_its_frames():
    film = Film(drive(Simulator(World()), lambda _: Twist(0.3, 0.0), 2.0))
    stored = notebook_run.small_png(base64.b64encode(film.png()).decode())
    assert len(list(ImageSequence.Iterator(Image.open(io.BytesIO(base64.b64decode(stored)))))) == 18


def test_a_whole_file_keeps_its_first_line_and_its_comments(example: Path, rubric: Rubric):
    lines = ["#!/usr/bin/env python3", "# !no shell", "# %no magic", "x = 1"]
    cell = "\n".join(["", '# %% tags=["given"]', "# %%writefile scripts/x", *lines, ""])
    source(example).write_text(source(example).read_text() + cell + "\n# %%\n# !ls\n")
    *_, written, shell = notebook_source.read(NAME, rubric, example).cells
    assert notebook_source.body(written).splitlines() == lines
    assert shell.source == "!ls"
