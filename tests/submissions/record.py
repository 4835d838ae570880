"""Record the evidence in tests/evidence: that of the reference, and of each known-bad submission the part that its
checks read.

    PYTHONPATH=.:tests python -m submissions.record [--trial TRIAL ...] [NAME ...]

Without names all are recorded, which takes about half an hour on two cores; `reference` is one of the names. A
recording on which a check does not answer as submissions/known_bad.yaml says is not written, and the exit
status is 1.

With --trial only these trials are run, and added to recordings that are there, in two to twenty seconds each. Of a
known-bad submission a trial is kept if its checks read it, or say something else of it than of the reference's: what
is not recorded of one is taken to be as the reference's (helpers.class_reports, test_agreement).
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from unittest import mock

from helpers import judging, recordings

from grader import KIT, building, pipeline
from grader.evidence import Evidence, Trial, load
from grader.scoring import rubric
from grader.trials import catalog
from grader.trials import source as trial_source
from submissions.edits import EDITS, FAILS_ON, apply

REFERENCE = "reference"


class _Noted(dict[str, Trial]):
    """Trials that remember which of them were looked at."""

    def __init__(self, trials: dict[str, Trial]) -> None:
        super().__init__(trials)
        self.read: set[str] = set()

    def get(self, name: str, default: Trial | None = None) -> Trial | None:  # type: ignore[override]
        """Return a trial, and note its name."""
        self.read.add(name)
        return super().get(name, default)


def collected(name: str, requirements: Iterable[str], settings: pipeline.Settings) -> Evidence:
    """Return the evidence of grading a submission on these requirements."""
    with tempfile.TemporaryDirectory() as folder:
        package = apply(EDITS[name] if name != REFERENCE else None, Path(folder))
        chosen = dataclasses.replace(settings, requirements=tuple(requirements))
        pipeline.grade(package, Path(folder) / "out", chosen)
        return load(Path(folder) / "out" / pipeline.EVIDENCE)


def record(name: str, settings: pipeline.Settings) -> str:
    """Record one submission; return what is wrong with it, "" if nothing is."""
    requirement = {check.id: r.id for r in settings.rubric.requirements for check in r.checks}
    checks = [check for check, bad in FAILS_ON.items() if name in (bad, REFERENCE)]
    evidence = collected(name, dict.fromkeys(requirement[check] for check in checks), settings)
    trials = _Noted(evidence.trials)
    evidence = dataclasses.replace(evidence, trials=trials)
    wrong = []
    for check in checks:
        said = judging.ask(judging.find(check), evidence)
        if (said.share == 1) != (name == REFERENCE):
            wrong.append(f"{check} gives {said.share:.0%}: {said.seen}")
    if not wrong:
        kept = {trial: facts for trial, facts in trials.items() if trial in trials.read}
        recordings.save(dataclasses.replace(evidence, trials=kept), name)
    return "; ".join(wrong)


def add(trials: Iterable[str], name: str, settings: pipeline.Settings) -> str:
    """Run these trials of a submission and add them to its recording; return what is wrong, "" if nothing is."""
    own, reference = recordings.load(name), recordings.load(REFERENCE)
    if not own.build.ok:  # judged by its text: nothing of it runs
        return ""
    plans = {trial: catalog.trials(settings.course)[trial] for trial in trials}
    asked = frozenset[str]().union(*(trial_source.serves(plan, settings) for plan in plans.values()))
    with mock.patch.object(trial_source, "wanted", return_value=plans):
        found = collected(name, asked, settings).trials
    as_taken = reference.trials | own.trials
    kept, wrong = found if name == REFERENCE else {}, []
    for check in (check.id for r in settings.rubric.requirements if r.id in asked for check in r.checks):
        seen = _Noted(as_taken | found)
        said = judging.ask(judging.find(check), dataclasses.replace(own, trials=seen))
        is_known = name == REFERENCE or FAILS_ON[check] == name
        if is_known and (said.share == 1) != (name == REFERENCE):
            wrong.append(f"{check} gives {said.share:.0%}: {said.seen}")
        elif is_known or said != judging.ask(judging.find(check), dataclasses.replace(own, trials=as_taken)):
            kept |= {trial: facts for trial, facts in found.items() if trial in seen.read}
    if kept and not wrong:
        recordings.save(dataclasses.replace(own, trials=own.trials | kept), name)
    return "; ".join(wrong)


def main(arguments: list[str]) -> int:
    """Record the named submissions, or all; return 1 if one could not be recorded."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--trial", action="append", default=[])
    given = parser.parse_args(arguments)
    settings = pipeline.Settings(rubric=rubric.load(KIT / "rubric.yaml"), cache=building.cache_folder())
    failed = 0
    for name in given.names or [REFERENCE, *dict.fromkeys(FAILS_ON.values())]:
        wrong = add(given.trial, name, settings) if given.trial else record(name, settings)
        failed += bool(wrong)
        print(name, wrong or "recorded", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
