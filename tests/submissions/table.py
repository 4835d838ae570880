"""Print fault x requirement: grade the reference with each named edit and show what it costs.

Run it in the tests folder:  python -m submissions.table [EDIT ...]
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
from pathlib import Path

from grader import KIT, build, pipeline
from grader.scoring import rubric
from submissions.edits import EDITS, apply

ROOT = KIT


def costs(name: str, settings: pipeline.Settings) -> dict[str, float]:
    """Return the points that an edit costs, by requirement."""
    with tempfile.TemporaryDirectory() as folder:
        package = apply(EDITS[name], Path(folder))
        grading = pipeline.grade(package, Path(folder) / "out", settings)
    scores = grading.scorecard.requirements
    return {s.requirement.id: s.max - s.points for s in scores if s.max > s.points + 1e-9}


def judged_by_trial(whole: rubric.Rubric) -> tuple[str, ...]:
    """Return the requirements of Functionality and ROS 2 integration that have checks, but for package.xml's."""
    found = [r.id for r in whole.requirements if r.id[0] in "FI" and r.id != "I2" and r.checks]
    return tuple(found)


def main(names: list[str]) -> int:
    """Print the table; return 1 if an edit costs anything but what it should."""
    whole = rubric.load(ROOT / "rubric.yaml")
    settings = dataclasses.replace(
        pipeline.Settings(rubric=whole, cache=build.cache_folder()), requirements=judged_by_trial(whole)
    )
    width = max(map(len, EDITS))
    print(" " * width, *(f"{name:>4}" for name in settings.requirements))
    wrong = 0
    for name in names or list(EDITS):
        lost = costs(name, settings)
        cells = [f"{-lost[r]:>4g}" if r in lost else "   ." for r in settings.requirements]
        expected = EDITS[name].costs & set(settings.requirements)
        verdict = "" if set(lost) == expected else f"  expected {' '.join(sorted(expected))}"
        wrong += bool(verdict)
        print(f"{name:<{width}}", *cells, verdict, flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
