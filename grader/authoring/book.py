"""Make the notebooks: `python -m grader.authoring.book build 05` writes both editions of a notebook from its source.

The student edition has no outputs, so nothing is run for it. The published edition is run with the solutions in its
exercises, after the notebooks before it, and stored with its cleaned outputs; `editions` says more.
"""

from __future__ import annotations

import argparse
import os
import runpy
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from grader import KIT
from grader.authoring import checkpoint_texts, editions, nbgrader, notebook_run, notebook_source, stored_outputs
from grader.course.reader import VARIABLE
from grader.errors import GraderError, KitError
from grader.notebook.workspace import course
from grader.scoring.rubric import Rubric, load
from grader.words import counted

PICTURE_WIDTH = 1000  # pixels: as wide as a notebook's column on most screens
PAGE = KIT / "docs" / "course.md"
_TABLE_MARK = "<!-- Written by `python -m grader.authoring.book table`; do not edit by hand. -->"
_VERBS = {
    "build": "write both editions; the published one is run with the solutions, and every check must pass",
    "student": "write the student edition alone; this runs nothing",
    "reword": "write both editions after a change of the prose alone: the published outputs stay, nothing is run",
    "pictures": "draw notebooks/pictures/NN.png",
    "check": "list the notebooks that differ from their source",
    "nbgrader": "write the notebooks as an nbgrader assignment into an nbgrader course folder",
    "table": "write the table of requirements and sections into docs/course.md",
    "solve": "run each notebook with the solutions in its exercises, after the notebooks before it; store nothing",
    "untouched": "run each notebook as students first see it, in an empty workspace; store nothing",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status: 0 done, 1 a notebook is not as it should be, 2 wrong usage."""
    options = _parser().parse_args(arguments)
    if options.course:
        os.environ[VARIABLE] = str(options.course.resolve())  # for the notebooks' kernels, too
    rubric = load(course().rubric)
    folder: Path = options.folder or course().notebooks
    try:
        if options.verb == "table":
            PAGE.write_text(with_table(PAGE.read_text(), rubric))
            return 0
        names = notebook_source.select(options.notebooks, folder)
        if options.verb == "nbgrader":
            written = nbgrader.write(names, rubric, options.out, folder)
            print(f"{counted(len(written), 'file')} below {options.out}")
            return 0
        done = [_run_verb(options, name, rubric, folder) for name in names]
    except KitError as error:
        print(f"book: {error}", file=sys.stderr)
        return 1
    return 0 if all(done) else 1


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m grader.authoring.book", description="Make the course's notebooks from notebooks/source.",
        epilog="Example:  python -m grader.authoring.book build 05",
    )  # fmt: skip
    verbs = parser.add_subparsers(title="verbs", required=True, metavar="VERB", dest="verb")
    for verb, words in _VERBS.items():
        subparser = verbs.add_parser(verb, help=words, description=words[0].upper() + words[1:] + ".")
        subparser.add_argument("notebooks", nargs="*", metavar="NN", help="such as 05 (default: all)")
        subparser.add_argument(
            "--course", type=Path, metavar="DIR", help="the folder of the course, unless the kit's own"
        )
        subparser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
        if verb == "nbgrader":
            subparser.add_argument("--out", type=Path, required=True, help="the nbgrader course folder")
    return parser


def _run_verb(options: argparse.Namespace, name: str, rubric: Rubric, folder: Path) -> bool:
    if options.verb == "check":
        problems = differences(name, rubric, folder)
        for problem in problems:
            print(problem)
        return not problems
    if options.verb == "pictures":
        return _draw(name, folder)
    if options.verb == "student":
        print(f"{write_student(name, rubric, folder).name} written")
        return True
    if options.verb == "reword":
        reword(name, rubric, folder)
        print(f"{name}: both editions written")
        return True
    if options.verb == "untouched":
        return _print_run(name, run_untouched(name, rubric, folder))
    if options.verb == "solve":
        return _print_run(name, run_solved(name, rubric, folder))
    write_student(name, rubric, folder)
    return _print_run(name, publish(name, rubric, folder))


def _print_run(name: str, run: notebook_run.NotebookRun) -> bool:
    """Print the duration, the slow cells and the answer of each check; return whether the notebook ran to its end."""
    print(f"{name}: {run.seconds:.0f} s")
    for cell_id, seconds in sorted(run.cell_seconds.items(), key=lambda item: -item[1])[:5]:
        if seconds >= 1:
            print(f"    {seconds:5.1f} s  {cell_id}")
    for answer in run.answers:
        print("   ", answer)
    if run.error:
        print(run.error, file=sys.stderr)
    return run.error is None


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


def write_student(name: str, rubric: Rubric, folder: Path = notebook_source.NOTEBOOKS) -> Path:
    """Write the student edition of the notebook `name` and return its file."""
    target = editions.student_file(name, folder)
    write(editions.student(name, rubric, folder), target)
    return target


def publish(
    name: str,
    rubric: Rubric,
    folder: Path = notebook_source.NOTEBOOKS,
    solutions: notebook_run.Solutions = checkpoint_texts.solution,
) -> notebook_run.NotebookRun:
    """Run the notebook `name` solved and write its published edition; keep the old file if the run has an error."""
    run = run_solved(name, rubric, folder, solutions)
    if run.error is None:
        target = editions.published_file(name, folder)
        target.parent.mkdir(exist_ok=True)
        write(run.notebook, target)
    return run


def reword(
    name: str,
    rubric: Rubric,
    folder: Path = notebook_source.NOTEBOOKS,
    solutions: notebook_run.Solutions = checkpoint_texts.solution,
) -> None:
    """Write both editions of the notebook `name`, the published one with the outputs that are stored.

    Raises:
        GraderError: the code has changed too, so that the outputs may be others.
    """
    target = editions.published_file(name, folder)
    made = editions.published(name, rubric, folder, solutions)
    old = [cell for cell in read_stored(target).cells if cell.cell_type == "code"]
    code = [cell for cell in made.cells if cell.cell_type == "code"]
    if [cell.source for cell in code] != [cell.source for cell in old]:
        raise GraderError(
            f"The code of {name} has changed too. Run `python -m grader.authoring.book build {name[:2]}`."
        )
    for cell, stored in zip(code, old, strict=True):
        cell.outputs, cell.execution_count = stored.outputs, stored.execution_count
    write_student(name, rubric, folder)
    write(made, target)


def run_solved(
    name: str,
    rubric: Rubric,
    folder: Path = notebook_source.NOTEBOOKS,
    solutions: notebook_run.Solutions = checkpoint_texts.solution,
) -> notebook_run.NotebookRun:
    """Run the published edition of the notebook `name` in a new workspace, and clean its outputs."""
    with tempfile.TemporaryDirectory(prefix="book-") as scratch:
        workspace = Path(scratch) / "ws"
        run = notebook_run.solve(name, editions.published(name, rubric, folder, solutions), workspace)
        stored_outputs.clean(run.notebook, workspace)
    return run


def run_untouched(name: str, rubric: Rubric, folder: Path = notebook_source.NOTEBOOKS) -> notebook_run.NotebookRun:
    """Run the student edition of the notebook `name` in an empty workspace, and clean its outputs."""
    with tempfile.TemporaryDirectory(prefix="book-") as scratch:
        workspace = Path(scratch) / "ws"
        run = notebook_run.execute(editions.student(name, rubric, folder), workspace)
        stored_outputs.clean(run.notebook, workspace)
    return run


def read_stored(path: Path) -> NotebookNode:
    """Return the notebook in the file `path`."""
    return nbformat.read(path, as_version=4)


def write(notebook: NotebookNode, path: Path) -> None:
    """Write the notebook; the same notebook gives the same bytes."""
    path.write_text(nbformat.writes(notebook, version=4).rstrip("\n") + "\n", encoding="utf-8")


def differences(
    name: str,
    rubric: Rubric,
    folder: Path = notebook_source.NOTEBOOKS,
    solutions: notebook_run.Solutions = checkpoint_texts.solution,
) -> list[str]:
    """Return how the two editions of a notebook differ from its source, one sentence each."""
    student, published = editions.student_file(name, folder), editions.published_file(name, folder)
    advice = f"Run `python -m grader.authoring.book build {name[:2]}`."
    missing = [file.relative_to(folder) for file in (student, published) if not file.exists()]
    found = [f"{file} is missing. {advice}" for file in missing]
    if student.exists() and read_stored(student) != editions.student(name, rubric, folder):
        found.append(f"{student.name} is not what its source says. {advice}")
    if published.exists():
        made = editions.published(name, rubric, folder, solutions)
        where = f"{editions.FOLDER}/{published.name}"
        found += [f"{where}: {problem}. {advice}" for problem in _problems(made, read_stored(published))]
    return found


def _problems(made: NotebookNode, stored: NotebookNode) -> Iterator[str]:
    """Yield where a stored notebook differs from the one made of its source, whatever their outputs."""
    if [cell["id"] for cell in made.cells] != [cell["id"] for cell in stored.cells]:
        yield "it has other cells than its source"
    old = {cell["id"]: cell for cell in stored.cells}
    for cell in made.cells:
        other = old.get(cell["id"])
        if other is not None and _without_outputs(cell) != _without_outputs(other):
            yield f"cell {cell['id']} differs from its source"
    if made.metadata != stored.metadata:
        yield "the notebook's metadata differ"


def _without_outputs(cell: NotebookNode) -> tuple[Any, ...]:
    return cell.cell_type, cell.source, cell.metadata


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
    target.write_bytes(stored_outputs.reduce_colours(picture, PICTURE_WIDTH))
    print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")
    return True


if __name__ == "__main__":
    sys.exit(main())
