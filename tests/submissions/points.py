"""Print the confinement, and points and outcome of known-bad submissions on the requirements that each is about.

    PYTHONPATH=.:tests python -m submissions.points [--cache DIR] NAME ...

`reference` is one of the names. All are to be the same in every confinement (tests/containers).
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


def points(name: str, cache: Path) -> dict[str, tuple[float, str]]:
    """Return the points and the outcome of a submission by requirement."""
    edit = EDITS.get(name)
    needs = tuple(sorted(_ALWAYS | (edit.costs if edit else set())))
    settings = pipeline.Settings(rubric=rubric.load(KIT / "rubric.yaml"), cache=cache, requirements=needs)
    with tempfile.TemporaryDirectory() as folder:
        grading = pipeline.grade(apply(edit, Path(folder)), Path(folder) / "out", settings)
    scores = grading.scorecard.requirements
    return {s.requirement.id: (s.points, s.outcome.value) for s in scores if s.requirement.id in needs}


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="+")
    parser.add_argument("--cache", type=Path, default=building.cache_folder())
    options = parser.parse_args()
    print(namespaces.confinement().value, file=sys.stderr)
    print(json.dumps({name: points(name, options.cache) for name in options.names}))
