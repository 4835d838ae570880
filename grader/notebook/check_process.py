"""Grade for `check`, in a process of its own, so that interrupting the cell ends it at once and leaves nothing.

A grading waits in several threads, which a kernel cannot interrupt; see processes/supervised.py. The process writes a
line for each step, and the evidence into a folder, which is judged here.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from grader import pipeline
from grader.errors import GraderError, KitError, SubmissionError
from grader.processes import supervised
from grader.scoring.grading import Grading
from grader.settings import Settings
from grader.words import mark, say

_RAISED = "raised "
_TAIL = 500  # characters of what a process that broke has printed


def grade(package: Path, out: Path, settings: Settings) -> Grading:
    """Return the grading of a package, as pipeline.grade does, with its evidence in `out`.

    Raises:
        SubmissionError: there is nothing in it that could be graded.
        GraderError: this host cannot grade.
        KeyboardInterrupt: the cell was interrupted. No process and no temporary file is left.
    """
    wanted = {"package": str(package), "out": str(out), "settings": settings.plain()}
    process = supervised.start(__spec__.name, str(os.getpid()))
    said = supervised.hear(process, settings.progress, json.dumps(wanted))
    for line in said:
        if line.startswith(_RAISED):
            theirs, *words = json.loads(line.removeprefix(_RAISED))
            raise (SubmissionError if theirs else GraderError)(*words)
    if process.returncode:
        ended = mark("The check ended with status {status}: {said}")
        raise GraderError(say(ended, status=process.returncode, said=" ".join(said)[-_TAIL:]))
    settings.progress(say("checking the evidence"))
    return pipeline.judge(out / pipeline.EVIDENCE, settings, keep_verdict=True)


def main(wanted: dict[str, Any]) -> int:
    """Collect the evidence, and say what is done."""
    settings = Settings.of_plain(
        wanted["settings"], progress=lambda what: print(f"{supervised.STEP}{what}", flush=True)
    )
    try:
        pipeline.observe(Path(wanted["package"]), Path(wanted["out"]), settings)
    except KitError as error:
        said = [isinstance(error, SubmissionError), error.what, error.advice]
        print(f"{_RAISED}{json.dumps(said)}", flush=True)
    return 0


if __name__ == "__main__":
    if not (task := supervised.read_task()):  # the kernel that would have asked has ended
        sys.exit()
    try:
        sys.exit(supervised.run(lambda: main(json.loads(task)), parent=int(sys.argv[1])))
    except KeyboardInterrupt:
        sys.exit(130)
