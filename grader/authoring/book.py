"""Make the notebooks: `python -m grader.authoring.book build 05` writes notebooks/05_topic.ipynb from its source.

The notebook is run as a student first meets it, each exercise a stub, in a workspace of its own; its outputs are
cleaned of everything that differs from machine to machine, and stored. notebook_source says how cells are read,
notebook_run how they are run.
"""

from __future__ import annotations

import argparse
import io
import runpy
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from grader import KIT
from grader.authoring import nbgrader, notebook_run, notebook_source
from grader.errors import KitError
from grader.scoring.rubric import Rubric, load

PICTURE_WIDTH = 1000  # pixels: as wide as a notebook's column on most screens
PAGE = KIT / "docs" / "course.md"
_TABLE_MARK = "<!-- Written by `python -m grader.authoring.book table`; do not edit by hand. -->"
_COLOURS = 128
_VERBS = {
    "build": "make notebooks/NN_topic.ipynb from its source, and run it",
    "pictures": "draw notebooks/pictures/NN.png",
    "check": "say which notebooks differ from their source",
    "nbgrader": "write the notebooks as an nbgrader assignment into a course's folder",
    "table": "write the table of requirements and sections into docs/course.md",
    "solve": "run each notebook with the reference's files in its exercises, after those before it; store nothing",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status: 0 done, 1 a notebook is not as it should be, 2 wrong usage."""
    parser = argparse.ArgumentParser(
        prog="python -m grader.authoring.book", description="Make the course's notebooks from notebooks/source.",
        epilog="Example:  python -m grader.authoring.book build 05",
    )  # fmt: skip
    verbs = parser.add_subparsers(title="verbs", required=True, metavar="VERB", dest="verb")
    for verb, words in _VERBS.items():
        chosen = verbs.add_parser(verb, help=words, description=words[0].upper() + words[1:] + ".")
        chosen.add_argument("notebooks", nargs="*", metavar="NN", help="such as 05 (default: all)")
        chosen.add_argument("--folder", type=Path, default=notebook_source.NOTEBOOKS, help=argparse.SUPPRESS)
        if verb == "build":
            chosen.add_argument(
                "--no-run", action="store_true", help="keep the outputs of unchanged cells, run nothing"
            )
        if verb == "nbgrader":
            chosen.add_argument("--out", type=Path, required=True, help="nbgrader's course folder")
    options = parser.parse_args(arguments)
    rubric = load(KIT / "rubric.yaml")
    try:
        if options.verb == "table":
            PAGE.write_text(with_table(PAGE.read_text(), rubric))
            return 0
        if options.verb == "nbgrader":
            chosen_names = notebook_source.named(options.notebooks, options.folder)
            written = nbgrader.write(chosen_names, rubric, options.out, options.folder)
            print(f"{len(written)} files below {options.out}")
            return 0
        found = [_do(options, name, rubric) for name in notebook_source.named(options.notebooks, options.folder)]
    except KitError as error:
        print(f"book: {error}", file=sys.stderr)
        return 1
    return 0 if all(found) else 1


def _do(options: argparse.Namespace, name: str, rubric: Rubric) -> bool:
    folder: Path = options.folder
    if options.verb == "check":
        problems = differences(name, rubric, folder)
        for problem in problems:
            print(problem)
        return not problems
    if options.verb == "pictures":
        return _draw(name, folder)
    if options.verb == "solve":
        return _tell(name, notebook_run.solve(name, notebook_source.read(name, rubric, folder)))
    if options.no_run:
        target = build_without_running(name, rubric, folder)
        print(f"{target.name} written; nothing was run")
        return True
    played = build(name, rubric, folder)
    return _tell(name, played)


def _tell(name: str, played: notebook_run.Performance) -> bool:
    """Print what became of each check, and what took long."""
    print(f"{name}: {played.seconds:.0f} s")
    for cell_id, seconds in sorted(played.cell_seconds.items(), key=lambda item: -item[1])[:5]:
        if seconds >= 1:
            print(f"    {seconds:5.1f} s  {cell_id}")
    for answer in played.answers:
        print("   ", answer)
    if played.error:
        print(played.error, file=sys.stderr)
    return played.error is None


def with_table(page: str, rubric: Rubric) -> str:
    """Return the page with its last part, the table of where each requirement is taught and checked, as it is now."""
    before, mark, _ = page.partition(_TABLE_MARK)
    asked: dict[str, list[str]] = {}
    for name in notebook_source.names():
        for cell in notebook_source.read(name, rubric).cells:
            for requirement in (
                notebook_source.checked(cell) if notebook_source.CHECK in notebook_source.tags(cell) else []
            ):
                asked.setdefault(requirement, []).append(name[:2])
    rows = ["| requirement | points | notebook | section | checked in |", "|---|---|---|---|---|"]
    for r in rubric.requirements:
        name, _, section = r.section.partition("#")
        link = f"[{name}](../notebooks/{name}.ipynb)"
        checked = ", ".join(dict.fromkeys(asked.get(r.id, [])))
        rows.append(f"| {r.id} {r.title} | {r.points:g} | {link} | {section} | {checked} |")
    return before + mark + "\n\n" + "\n".join(rows) + "\n"


def build(name: str, rubric: Rubric, folder: Path = notebook_source.NOTEBOOKS) -> notebook_run.Performance:
    """Run the notebook `name` as it is shipped and write it with its outputs; an exception leaves the old file."""
    with tempfile.TemporaryDirectory(prefix="book-") as scratch:
        workspace = Path(scratch) / "ws"
        played = notebook_run.play(notebook_source.read(name, rubric, folder), workspace)
        clean(played.notebook, workspace)
    if played.error is None:
        write(played.notebook, folder / f"{name}.ipynb")
    return played


def build_without_running(name: str, rubric: Rubric, folder: Path = notebook_source.NOTEBOOKS) -> Path:
    """Write the notebook `name` with the outputs that its file has for cells that are unchanged; return the file."""
    notebook = notebook_source.read(name, rubric, folder)
    target = folder / f"{name}.ipynb"
    if target.exists():
        stored = {cell["id"]: cell for cell in read_stored(target).cells}
        for cell in notebook.cells:
            old = stored.get(cell["id"])
            if old is not None and cell.cell_type == "code" and cell.source == old.source:
                cell.outputs, cell.execution_count = old.outputs, old.execution_count
    write(notebook, target)
    return target


def read_stored(path: Path) -> NotebookNode:
    """Return the notebook in the file `path`."""
    return nbformat.read(path, as_version=4)


def write(notebook: NotebookNode, path: Path) -> None:
    """Write the notebook so that the same notebook gives the same bytes."""
    path.write_text(nbformat.writes(notebook, version=4).rstrip("\n") + "\n", encoding="utf-8")


def differences(name: str, rubric: Rubric, folder: Path = notebook_source.NOTEBOOKS) -> list[str]:
    """Return what of the notebook's file is not as its source says, one sentence each."""
    target = folder / f"{name}.ipynb"
    again = f"Run `python -m grader.authoring.book build {name[:2]}`."
    if not target.exists():
        return [f"{name}.ipynb is missing. {again}"]
    made, stored = notebook_source.read(name, rubric, folder), read_stored(target)
    found = []
    if [cell["id"] for cell in made.cells] != [cell["id"] for cell in stored.cells]:
        found.append(f"{name}.ipynb has other cells than its source. {again}")
    old = {cell["id"]: cell for cell in stored.cells}
    for cell in made.cells:
        other = old.get(cell["id"])
        if other is not None and _said(cell) != _said(other):
            found.append(f"{name}.ipynb: cell {cell['id']} differs from its source. {again}")
    if made.metadata != stored.metadata:
        found.append(f"{name}.ipynb: the notebook's metadata differ. {again}")
    return found


def _said(cell: NotebookNode) -> tuple[Any, ...]:
    return cell.cell_type, cell.source, cell.metadata


def clean(notebook: NotebookNode, workspace: Path) -> None:
    """Take out of the outputs what another machine or another day would have otherwise, and make pictures small."""
    notebook.metadata = notebook_source.metadata()  # a kernel notes its version, widgets their state
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type != "code":
            continue
        cell.outputs = list(_merged(cell.outputs))
        for output in cell.outputs:
            if output.output_type == "stream":
                output.text = notebook_run.without_paths(output.text, workspace)
            for kind, data in list(output.get("data", {}).items()):
                output.data[kind] = _clean_data(kind, data, workspace)
            _leave_the_picture(output)


def _merged(outputs: list[NotebookNode]) -> Iterator[NotebookNode]:
    """Give the outputs with all that went to one stream in one piece: in how many it came is chance."""
    streams: dict[str, NotebookNode] = {}
    for output in outputs:
        if output.output_type != "stream":
            yield output
        elif output.name in streams:
            streams[output.name].text += output.text
        else:
            streams[output.name] = output
            yield output


def _clean_data(kind: str, data: Any, workspace: Path) -> Any:
    if kind == "image/png":
        return small_png(data)
    return notebook_run.without_paths(data, workspace) if isinstance(data, str) else data


def _leave_the_picture(output: NotebookNode) -> None:
    """Where a widget left a static picture, keep that alone: the widget needs the kernel that is gone."""
    data = output.get("data", {})
    if "image/png" in data:
        data.pop("application/vnd.jupyter.widget-view+json", None)


def small_png(encoded: str) -> str:
    """Return a base64 PNG in a palette of 128 colours if that is smaller: plots have few."""
    import base64

    raw = base64.b64decode(encoded)
    smaller = _in_palette(raw)
    return base64.b64encode(smaller).decode() if len(smaller) < len(raw) else encoded


def _in_palette(png: bytes, widest: int | None = None) -> bytes:
    from PIL import Image

    with Image.open(io.BytesIO(png)) as opened:
        picture = opened.convert("RGBA")
    flat = Image.new("RGBA", picture.size, "white")
    flat.alpha_composite(picture)
    image = flat.convert("RGB")
    if widest is not None and image.width > widest:
        image = image.resize((widest, round(image.height * widest / image.width)), Image.Resampling.LANCZOS)
    held = io.BytesIO()
    image.quantize(_COLOURS, dither=Image.Dither.NONE).save(held, "png", optimize=True)
    return held.getvalue()


def _draw(name: str, folder: Path) -> bool:
    """Draw the picture at a notebook's top with the `draw()` of its script."""
    number = name[:2]
    script = folder / "source" / f"picture_{number}.py"
    if not script.exists():
        print(f"{script.name} is missing; it holds `draw()`, which returns a figure")
        return False
    import matplotlib as mpl

    mpl.use("agg")
    figure = runpy.run_path(str(script))["draw"]()
    held = io.BytesIO()
    figure.savefig(held, format="png", dpi=150, facecolor="white")
    target = folder / "pictures" / f"{number}.png"
    target.parent.mkdir(exist_ok=True)
    target.write_bytes(_in_palette(held.getvalue(), PICTURE_WIDTH))
    print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")
    return True


if __name__ == "__main__":
    sys.exit(main())
