"""Make the notebooks: `python -m grader.authoring.book build 05` writes both editions of a notebook from its source.

The student edition, notebooks/NN_topic.ipynb, has stubs in its exercises and no outputs, so nothing is run for it. The
published edition, notebooks/published/NN_topic.ipynb, is run with the solutions in its exercises, after the notebooks
before it, and stored with its cleaned outputs.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import runpy
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from grader import KIT
from grader.authoring import checkpoint_texts, notebook_run, notebook_source
from grader.course.reader import VARIABLE
from grader.errors import GraderError, KitError
from grader.notebook import last_hint
from grader.notebook.workspace import course
from grader.scoring.rubric import Rubric, load

PICTURE_WIDTH = 1000  # pixels: as wide as a notebook's column on most screens
PAGE = KIT / "docs" / "course.md"
_TABLE_MARK = "<!-- Written by `python -m grader.authoring.book table`; do not edit by hand. -->"
FOLDER = "published"
NOTE = "edition"
"""The id of the cell that tells a visitor which edition this is."""

# The target of a Markdown link or of a picture, without an address, a place on the page, or another notebook.
_BESIDE = re.compile(r"(\]\(|<img[^>]*\ssrc=\")(?!\w+:|//|#|\d\d_\w+\.ipynb)(?=[^)\s\"])")
_VERBS = {
    "build": "write both editions; the published one is run with the solutions, and every check must pass",
    "student": "write the student edition alone; this runs nothing",
    "reword": "write both editions after a change of the prose alone: the published outputs stay, nothing is run",
    "pictures": "draw notebooks/pictures/NN.png",
    "check": "list the notebooks that differ from their source",
    "table": "write the table of requirements and sections into docs/course.md",
    "untouched": "run each notebook as students first see it, in an empty workspace; store nothing",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status: 0 done, 1 a notebook is not as it should be, 2 wrong usage."""
    lines = "\n".join(f"  {verb:10} {words}" for verb, words in _VERBS.items())
    parser = argparse.ArgumentParser(
        prog="python -m grader.authoring.book", description="Make the course's notebooks from notebooks/source.",
        epilog=f"verbs:\n{lines}\n\nExample:  python -m grader.authoring.book build 05",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("verb", choices=_VERBS, metavar="VERB", help="what to do, see below")
    parser.add_argument("notebooks", nargs="*", metavar="NN", help="such as 05 (default: all)")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course, unless the kit's own")
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.course:
        os.environ[VARIABLE] = str(options.course.resolve())  # for the notebooks' kernels, too
    rubric = load(course().rubric)
    folder: Path = options.folder or course().notebooks
    try:
        if options.verb == "table":
            PAGE.write_text(with_table(PAGE.read_text(), rubric))
            return 0
        names = notebook_source.select(options.notebooks, folder)
        done = [_run_verb(options.verb, Notebook(name, rubric, folder)) for name in names]
    except KitError as error:
        print(f"book: {error}", file=sys.stderr)
        return 1
    return 0 if all(done) else 1


def _run_verb(verb: str, notebook: Notebook) -> bool:
    """Do what a verb says, and return whether the notebook is as it should be."""
    match verb:
        case "check":
            problems = notebook.differences()
            print(*problems, sep="\n", end="\n" * bool(problems))
            return not problems
        case "pictures":
            return _draw(notebook.name, notebook.folder)
        case "untouched":
            return _print_run(notebook.name, notebook.run_untouched())
        case "reword":
            notebook.reword()
            return True
    notebook.write_student()
    return verb == "student" or _print_run(notebook.name, notebook.publish())


def _print_run(name: str, run: notebook_run.NotebookRun) -> bool:
    """Print the duration and the answer of each check; return whether the notebook ran to its end."""
    print(f"{name}: {run.seconds:.0f} s", *run.answers, sep="\n    ")
    if run.error:
        print(run.error, file=sys.stderr)
    return run.error is None


def student_file(name: str, notebooks: Path = notebook_source.NOTEBOOKS) -> Path:
    """Return the file of the student edition."""
    return notebooks / f"{name}.ipynb"


def published_file(name: str, notebooks: Path = notebook_source.NOTEBOOKS) -> Path:
    """Return the file of the published edition."""
    return notebooks / FOLDER / f"{name}.ipynb"


@dataclass(frozen=True)
class Notebook:
    """A notebook of a course: `folder` has both editions, and its source in `source/`."""

    name: str
    rubric: Rubric
    folder: Path = notebook_source.NOTEBOOKS
    solutions: notebook_run.Solutions = checkpoint_texts.solution

    def student(self) -> tuple[NotebookNode, str]:
        """Return the student edition, and the text of the file in which a kernel finds its last hints, "" without any.

        Raises:
            GraderError: the source is not a valid notebook.
        """
        notebook = notebook_source.read(self.name, self.rubric, self.folder)
        taken = notebook_source.take_out_hints(notebook)
        return notebook, json.dumps(taken, indent=1, ensure_ascii=False, sort_keys=True) + "\n" if taken else ""

    def published(self) -> NotebookNode:
        """Return the notebook with solved exercises and a note for visitors, before it is run."""
        source = notebook_source.read(self.name, self.rubric, self.folder)
        notebook = notebook_run.solved(self.name, source, self.solutions)
        for cell in notebook.cells:
            cell.metadata.pop("nbgrader", None)
            if cell.cell_type == "markdown":
                cell.source = _BESIDE.sub(r"\1../", cell.source)
        note = (
            "> **The published edition**, to look at: the exercises are solved, and every output comes from that run.\n"
            f"> To write the solutions yourself, open [the student edition](../{self.name}.ipynb)."
        )
        notebook.cells.insert(1, nbformat.v4.new_markdown_cell(note, id=NOTE))
        return notebook

    def write_student(self) -> None:
        """Write the student edition, and its last hints beside it."""
        (notebook, hints), file = self.student(), last_hint.file_of(self.name, self.folder)
        write(notebook, student_file(self.name, self.folder))
        file.unlink(missing_ok=True)
        if hints:
            file.parent.mkdir(exist_ok=True)
            file.write_text(hints, encoding="utf-8")

    def publish(self) -> notebook_run.NotebookRun:
        """Run it solved and write its published edition; keep the old file if the run has an error."""
        run = _cleaned(lambda workspace: notebook_run.solve(self.name, self.published(), workspace))
        if run.error is None:
            write(run.notebook, published_file(self.name, self.folder))
        return run

    def reword(self) -> None:
        """Write both editions, the published one with the outputs that are stored.

        Raises:
            GraderError: the code has changed too, so that the outputs may be others.
        """
        target, made = published_file(self.name, self.folder), self.published()
        old = [cell for cell in read_stored(target).cells if cell.cell_type == "code"]
        code = [cell for cell in made.cells if cell.cell_type == "code"]
        if [cell.source for cell in code] != [cell.source for cell in old]:
            raise GraderError(f"The code of {self.name} has changed too. {self._advice}")
        for cell, stored in zip(code, old, strict=True):
            cell.outputs, cell.execution_count = stored.outputs, stored.execution_count
        self.write_student()
        write(made, target)

    def run_untouched(self) -> notebook_run.NotebookRun:
        """Run the student edition in an empty workspace, and clean its outputs."""
        return _cleaned(lambda workspace: notebook_run.execute(self.student()[0], workspace))

    def differences(self) -> list[str]:
        """Return how the two editions and the last hints differ from the source, one sentence each."""
        (student, hints), file = self.student(), last_hint.file_of(self.name, self.folder)
        stored = file.read_text(encoding="utf-8") if file.is_file() else ""
        wrong = {} if stored == hints else {file: "is not what its source says"}
        published = published_file(self.name, self.folder)
        for file, made in ((student_file(self.name, self.folder), student), (published, self.published())):
            if not file.exists():
                wrong[file] = "is missing"
            elif _comparable(read_stored(file), file) != _comparable(made, file):
                wrong[file] = "is not what its source says"
        return [f"{file.relative_to(self.folder)} {words}. {self._advice}" for file, words in wrong.items()]

    @property
    def _advice(self) -> str:
        return f"Run `python -m grader.authoring.book build {self.name[:2]}`."


def _cleaned(run_in: Callable[[Path], notebook_run.NotebookRun]) -> notebook_run.NotebookRun:
    """Return a run in a new workspace with clean outputs."""
    with tempfile.TemporaryDirectory(prefix="book-") as scratch:
        workspace = Path(scratch) / "ws"
        run = run_in(workspace)
        notebook_run.clean(run.notebook, workspace)
    return run


def _comparable(notebook: NotebookNode, file: Path) -> Any:
    """Return what of an edition is decided by its source: all of the student's, the published one's cells."""
    if file.parent.name != FOLDER:
        return notebook
    return [notebook.metadata, *((cell["id"], cell.cell_type, cell.source, cell.metadata) for cell in notebook.cells)]


def with_table(page: str, rubric: Rubric) -> str:
    """Return the page with an up-to-date table, its last part, of where each requirement is taught and checked."""
    before, mark, _ = page.partition(_TABLE_MARK)
    checked_in: dict[str, list[str]] = {}
    for name in notebook_source.names():
        for cell in notebook_source.check_cells(notebook_source.read(name, rubric)):
            for requirement in notebook_source.checked(cell):
                checked_in.setdefault(requirement, []).append(name[:2])
    rows = ["| requirement | points | notebook | section | checked in |", "|---|---|---|---|---|"]
    for r in rubric.requirements:
        name, _, section = r.section.partition("#")
        link = f"[{name}](../notebooks/{name}.ipynb)"
        checked = ", ".join(dict.fromkeys(checked_in.get(r.id, [])))
        rows.append(f"| {r.id} {r.title} | {r.points:g} | {link} | {section} | {checked} |")
    return before + mark + "\n\n" + "\n".join(rows) + "\n"


def read_stored(path: Path) -> NotebookNode:
    """Return the notebook in the file `path`."""
    return nbformat.read(path, as_version=4)


def write(notebook: NotebookNode, path: Path) -> None:
    """Write the notebook; the same notebook gives the same bytes."""
    path.parent.mkdir(exist_ok=True)
    path.write_text(nbformat.writes(notebook, version=4).rstrip("\n") + "\n", encoding="utf-8")


def _draw(name: str, folder: Path) -> bool:
    """Draw the picture at the top of a notebook with the function `draw()` of its script."""
    number = name[:2]
    script = folder / "source" / f"picture_{number}.py"
    if not script.exists():
        print(f"{script.name} is missing; it must define `draw()`, which returns a figure")
        return False
    import matplotlib as mpl

    mpl.use("agg")
    from sim.views import png

    picture = png(runpy.run_path(str(script))["draw"](), dpi=150)
    target = folder / "pictures" / f"{number}.png"
    target.parent.mkdir(exist_ok=True)
    target.write_bytes(notebook_run.reduce_colours(picture, PICTURE_WIDTH))
    print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")
    return True


if __name__ == "__main__":
    sys.exit(main())
