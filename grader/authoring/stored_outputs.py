"""Clean a notebook's outputs of everything that depends on the machine or the day, and make its pictures small."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from PIL import Image

from grader.authoring import notebook_run, notebook_source

_COLOURS = 128
_OVERWRITTEN = re.compile(r"^.*\r(?!\n)", re.MULTILINE)  # what a status line says before its last text


def clean(notebook: NotebookNode, workspace: Path) -> None:
    """Clean the outputs of a notebook that was run in `workspace`, in place."""
    notebook.metadata = notebook_source.metadata()  # a kernel adds its version, widgets their state
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type != "code":
            continue
        # A line about progress, which is empty at the end, leaves an empty output.
        cell.outputs = [output for output in _merged(cell.outputs) if output.get("data") != {}]
        for output in cell.outputs:
            if output.output_type == "stream":
                output.text = notebook_run.without_paths(_OVERWRITTEN.sub("", output.text), workspace)
            data = output.get("data", {})
            if "image/png" in data:  # the static picture of a widget: the widget needs a kernel, the picture does not
                data.pop("application/vnd.jupyter.widget-view+json", None)
            for kind in list(data):
                data[kind] = _clean_data(kind, data[kind], workspace)


def _merged(outputs: list[NotebookNode]) -> Iterator[NotebookNode]:
    """Yield the outputs with each stream in one piece: the number of its pieces depends on timing."""
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


def small_png(encoded: str) -> str:
    """Return a base64 PNG reduced to 128 colours if that makes it smaller: plots have few colours. A film stays."""
    raw = base64.b64decode(encoded)
    with Image.open(io.BytesIO(raw)) as opened:
        if getattr(opened, "is_animated", False):
            return encoded
    smaller = reduce_colours(raw)
    return base64.b64encode(smaller).decode() if len(smaller) < len(raw) else encoded


def reduce_colours(png: bytes, max_width: int | None = None) -> bytes:
    """Return a PNG with a palette of 128 colours on white, no wider than `max_width` pixels."""
    with Image.open(io.BytesIO(png)) as opened:
        picture = opened.convert("RGBA")
    flat = Image.new("RGBA", picture.size, "white")
    flat.alpha_composite(picture)
    image = flat.convert("RGB")
    if max_width is not None and image.width > max_width:
        image = image.resize((max_width, round(image.height * max_width / image.width)), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.quantize(_COLOURS, dither=Image.Dither.NONE).save(stream, "png", optimize=True)
    return stream.getvalue()
