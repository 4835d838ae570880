"""Print the confinement, and the points of known-bad submissions on the requirements that each is about.

    PYTHONPATH=.:tests python -m submissions.points [--cache DIR] NAME ...

`reference` is one of the names. Points are to be the same in every confinement (tests/containers).
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from grader import KIT, building, pipeline
from grader.host import namespaces
from grader.scoring import rubric
from submissions.edits import EDITS, apply

_ALWAYS = {"F1", "F2", "I1"}


def points(name: str, cache: Path) -> dict[str, float]:
    """Return the points of a submission by requirement; minus one for what the grader could not judge."""
    edit = EDITS.get(name)
    needs = tuple(sorted(_ALWAYS | (edit.costs if edit else set())))
    settings = pipeline.Settings(rubric=rubric.load(KIT / "rubric.yaml"), cache=cache, requirements=needs)
    with tempfile.TemporaryDirectory() as folder:
        grading = pipeline.grade(apply(edit, Path(folder)), Path(folder) / "out", settings)
    unjudged = {score.requirement.id for score in grading.unjudged}
    found = {score.requirement.id: score.points for score in grading.scorecard.requirements}
    return {need: -1.0 if need in unjudged else found[need] for need in needs}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="+")
    parser.add_argument("--cache", type=Path, default=building.cache_folder())
    options = parser.parse_args()
    print(namespaces.confinement().value, file=sys.stderr)
    print(json.dumps({name: points(name, options.cache) for name in options.names}))
