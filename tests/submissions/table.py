"""Print edit x requirement: grade the reference with each named edit and show what it costs.

    PYTHONPATH=.:tests python -m submissions.table [EDIT ...]

An edit is graded on everything that is judged by the build and the trials, and on the requirements that it is about.
The exit status is 1 if one costs anything but `Edit.costs`.

    PYTHONPATH=.:tests python -m submissions.table --points NAME ...

prints the confinement, and as JSON the points and outcome of each (`reference` is one of the names) on the requirements
that it is about. All are to be the same in every confinement (tests/containers).
"""

from __future__ import annotations

import dataclasses
import json
import sys
import tempfile
from pathlib import Path

from grader import KIT, building, pipeline
from grader.host import namespaces
from grader.mutation.source import Mutants
from grader.quality.source import PackageText
from grader.scoring import rubric
from grader.scoring.scorecard import RequirementScore, earned
from grader.student_tests.source import StudentTestRuns
from submissions.edits import EDITS, apply


def costs(name: str, settings: pipeline.Settings) -> dict[str, float]:
    """Return the points that an edit costs, by requirement, with those below a tenth, which are shown and not taken."""
    with tempfile.TemporaryDirectory() as folder:
        package = apply(EDITS[name], Path(folder))
        grading = pipeline.grade(package, Path(folder) / "out", settings)
    return {s.requirement.id: lost for s in grading.scorecard.requirements if (lost := _lost(s)) > 1e-9}


def _lost(score: RequirementScore) -> float:
    pairs = zip(score.requirement.checks, score.results, strict=True)
    return sum(check.points - earned(check, result) for check, result in pairs)


def judged_by_trial(whole: rubric.Rubric) -> tuple[str, ...]:
    """Return the requirements that are judged by the build and the trials, not by text or the package's own tests."""
    settings = pipeline.Settings(rubric=whole, cache=building.cache_folder())
    sources = (PackageText(), StudentTestRuns(), Mutants())
    others = frozenset[str]().union(*(source.serves(settings) for source in sources))
    return tuple(r.id for r in whole.requirements if r.checks and r.id not in others)


def points(name: str) -> dict[str, tuple[float, str]]:
    """Return the points and the outcome of a submission by requirement."""
    edit = EDITS.get(name)
    needs = tuple(sorted({"F1", "F2", "I1"} | (edit.costs if edit else set())))
    settings = pipeline.Settings(
        rubric=rubric.load(KIT / "rubric.yaml"), cache=building.cache_folder(), requirements=needs
    )
    with tempfile.TemporaryDirectory() as folder:
        grading = pipeline.grade(apply(edit, Path(folder)), Path(folder) / "out", settings)
    scores = grading.scorecard.requirements
    return {s.requirement.id: (s.points, s.outcome.value) for s in scores if s.requirement.id in needs}


def main(names: list[str]) -> int:
    """Print the table; return 1 if an edit costs anything but what it should."""
    if names[:1] == ["--points"]:
        print(namespaces.confinement().value, file=sys.stderr)
        print(json.dumps({name: points(name) for name in names[1:]}))
        return 0
    whole = rubric.load(KIT / "rubric.yaml")
    settings = pipeline.Settings(rubric=whole, cache=building.cache_folder())
    always = judged_by_trial(whole)
    columns = [r.id for r in whole.requirements if r.checks]
    width = max(map(len, EDITS))
    print(" " * width, *(f"{column:>4}" for column in columns))
    wrong = 0
    for name in names or list(EDITS):
        edit = EDITS[name]
        lost = costs(name, dataclasses.replace(settings, requirements=(*always, *sorted(edit.costs - set(always)))))
        cells = [f"{-round(lost[r], 2):>4g}" if r in lost else "   ." for r in columns]
        verdict = "" if set(lost) == edit.costs else f"  expected {' '.join(sorted(edit.costs))}"
        wrong += bool(verdict)
        print(f"{name:<{width}}", *cells, verdict, flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
