"""`hunt("F4")` in a notebook: `grader hunt` in a process of its own, and what it found, with the replay."""

from __future__ import annotations

import html
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path

from grader.notebook import checkpoints
from grader.notebook.feedback import Progress
from grader.notebook.workspace import Workspace, course, ignored_by_colcon
from grader.processes import supervised
from grader.words import say

FOLDER = "hunt"
_TAIL = 600  # characters


@dataclass(frozen=True)
class Hunt:
    """What a hunt has come to. Notebooks display it; `file` has the case, None if no fault was found.

    Without a file, `rows` say why nothing could be tried. `left_out` says how many cases
    failed once and not again, or could not be judged.
    """

    cases: int
    seed: int
    rows: tuple[tuple[str, str], ...] = ()
    file: Path | None = None
    left_out: str = ""

    def __repr__(self) -> str:
        if not self.rows:
            words = say("{n} cases, no fault found, seed {seed}.", n=self.cases, seed=self.seed)
            return f"{words} {self.left_out}".rstrip()
        return "\n".join(f"{name}: {text}" for name, text in self.rows)

    def _repr_html_(self) -> str | None:
        if self.file is None:
            return None
        page = html.escape(self.file.with_suffix(".html").read_text(encoding="utf-8"))
        size = "width:100%;height:44em;border:0"
        return f'<iframe sandbox="allow-scripts" style="{size}" srcdoc="{page}"></iframe>'


def prepared(workspace: Workspace, name: str) -> Path:
    """Return the folder of a prepared package ("H1"), laid out where it is not there yet.

    Raises:
        GraderError: this kit holds no such package.
    """
    ignored_by_colcon(workspace.root / FOLDER)
    package = workspace.root / FOLDER / name / course().package
    if not package.exists():
        checkpoints.write_files(package, checkpoints.patient(name)["files"])
        print(say("{name} is laid out in {where}.", name=name, where=workspace.shown(package)))
    return package


def hunt(
    workspace: Workspace, requirements: tuple[str, ...], cases: int, seed: int, package: Path | None = None
) -> Hunt:
    """Hunt in the workspace's package, or in another, and return what was found.

    Raises:
        KeyboardInterrupt: the cell was interrupted. What was found by then is in the workspace's folder `hunt`.
    """
    out = workspace.root / FOLDER
    with tempfile.TemporaryDirectory(prefix="hunt-") as scratch, Progress() as progress:
        facts = Path(scratch) / "facts.json"
        process = supervised.start(
            "grader.cli", "hunt", *requirements,
            "--package", str(package or workspace.package), "--course", str(course().folder),
            "--cases", str(cases), "--seed", str(seed), "--out", str(out), "--facts", str(facts),
        )  # fmt: skip
        said = supervised.hear(process, progress.say)
        if not facts.is_file():  # the package does not build, say
            return Hunt(0, seed, ((say("not yet"), "\n".join(said)[-_TAIL:].removeprefix("grader: ")),))
        found = json.loads(facts.read_text(encoding="utf-8"))
    rows = [(name, text) for name, text in found.get("rows", ())]
    file = Path(found["file"]) if "file" in found else None
    if file is not None:
        rows.append((say("kept"), say("{file}; again: !grader hunt --again FILE", file=workspace.shown(file))))
    return Hunt(found["cases"], seed, tuple(rows), file, found["left_out"])
