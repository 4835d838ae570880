"""`hunt("F4")` in a notebook: `grader hunt` in a process of its own, and what it found, with the replay."""

from __future__ import annotations

import html
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from grader import KIT
from grader.hunt.command import STEP
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

    Without a file, `rows` say why nothing could be tried.
    """

    cases: int
    seed: int
    rows: tuple[tuple[str, str], ...] = ()
    file: Path | None = None

    def __repr__(self) -> str:
        if not self.rows:
            return say("{n} cases, no fault found, seed {seed}.", n=self.cases, seed=self.seed)
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
        command = [sys.executable, "-P", "-m", "grader.cli", "hunt", *requirements]
        command += ["--package", str(package or workspace.package), "--course", str(course().folder)]
        command += ["--cases", str(cases), "--seed", str(seed), "--out", str(out), "--facts", str(facts)]
        path = [str(KIT), *filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            start_new_session=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        )  # fmt: skip
        said = []
        try:
            assert process.stdout is not None
            for line in process.stdout:
                if line.startswith(STEP):
                    progress.say(line.removeprefix(STEP).rstrip())
                else:
                    said.append(line.strip())
            process.wait()
        finally:
            supervised.end(process)
        if not facts.is_file():  # the package does not build, say
            return Hunt(0, seed, ((say("not yet"), "\n".join(said)[-_TAIL:].removeprefix("grader: ")),))
        found = json.loads(facts.read_text(encoding="utf-8"))
    rows = tuple((name, text) for name, text in found.get("rows", ()))
    return Hunt(found["cases"], seed, rows, Path(found["file"]) if "file" in found else None)
