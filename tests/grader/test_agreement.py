"""A check and a grading of the same thing agree: what a requirement says does not depend on what else is asked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import pytest
from helpers import judging, recordings
from helpers.course import COURSE
from submissions.edits import EDITS, apply
from variants import LAUNCHED, VARIANTS, make

from grader import collect, pipeline
from grader.evidence import Evidence
from grader.host import provenance
from grader.intake.submission import open_submission
from grader.scoring.scorecard import Outcome
from grader.settings import Reuse, Settings
from grader.source import Asked, Collected, Phase, Source, Subject
from grader.trials.source import wanted as wanted_trials

pytestmark = pytest.mark.slow  # judges ten packages twice, and grades a dozen

REFERENCE = "reference"
BAD = (
    "calls_itself_ament_python", "copies_a_block", "does_not_compile", "forgets_an_executable", "leaves_the_types_out",
    "renames_the_package", "sets_the_parameters_in_the_launch_file", "sleeps_in_a_callback",
    "tests_its_conversions_only",
)  # fmt: skip


@dataclass(frozen=True)
class Recorded:
    """A source that finds what another one has found before; of the trials, those that serve what is asked."""

    source: Source
    evidence: Evidence

    @property
    def name(self) -> str:
        return self.source.name

    @property
    def phase(self) -> Phase:
        return self.source.phase

    def serves(self, settings: Settings) -> frozenset[str]:
        return self.source.serves(settings)

    def ask(self, subject: Subject) -> Asked:
        wanted = wanted_trials(subject.settings)
        trials = {name: trial for name, trial in self.evidence.trials.items() if name in wanted}
        facts = {"trials": trials, "tests": self.evidence.tests, "functions": self.evidence.functions}
        facts |= {"mutation": self.evidence.mutation}
        field = {"student tests": "tests"}.get(self.name, self.name)
        return Asked([], lambda _results: Collected({field: facts[field]}))


@pytest.mark.parametrize("name", [REFERENCE, *BAD])
def test_a_requirement_says_by_itself_what_it_says_beside_all_others(
    name: str, settings: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """With the package's text as it is read for one requirement and for all, and recorded runs of its nodes."""
    reference = own = recordings.load(REFERENCE)
    if name in EDITS:
        own = recordings.load(name)
    whole = replace(  # of a known-bad submission only what differs is recorded
        own, trials=reference.trials | own.trials, tests=own.tests or reference.tests,
        functions=own.functions or reference.functions, mutation=own.mutation or reference.mutation,
    )  # fmt: skip
    sources = [source if source.phase is Phase.TEXT else Recorded(source, whole) for source in collect.SOURCES]
    built = collect.Built(own.build, tmp_path / "install")
    monkeypatch.setattr(collect, "SOURCES", tuple(sources))
    monkeypatch.setattr(provenance, "kit_hash", cache(provenance.kit_hash))  # it is asked for 38 times
    monkeypatch.setattr(collect.building, "build_contract", lambda *_: built)
    monkeypatch.setattr(collect, "_build", lambda *_: (built, built))
    package = apply(EDITS.get(name), tmp_path)
    submission = open_submission(package, tmp_path / "submission", COURSE)

    def collected(*requirements: str) -> Evidence:
        folder = tmp_path / "-".join(["work", *requirements])
        folder.mkdir()
        chosen = replace(settings, cache=tmp_path / "cache", reuse=Reuse.KEPT, requirements=requirements)
        return collect.collect(Subject(submission, chosen, folder))

    together = collected()
    for requirement in settings.rubric.requirements:
        # `check Q1` gave 4.77 and `check Q1 I1` 0: only the second had a build.
        of_text = requirement.id.startswith("Q")
        for asked in [(requirement.id,), (requirement.id, "I1")] if of_text else [(requirement.id,)]:
            found = collected(*asked)
            for check in map(judging.find, (check.id for check in requirement.checks)):
                assert judging.ask(check, found) == judging.ask(check, together), asked


@pytest.mark.ros
@pytest.mark.sandbox
@pytest.mark.parametrize("name", [REFERENCE, *VARIANTS, "written", "tests_its_conversions_only"])
def test_a_check_of_one_requirement_gives_what_a_grading_gives(name: str, settings: Settings, tmp_path: Path):
    """Nothing is run twice: a check takes what the grading has kept, where that decides it."""
    variant = (VARIANTS | LAUNCHED).get(name)
    package = make(variant, tmp_path) if variant else apply(EDITS.get(name), tmp_path)
    keeps = replace(settings, reuse=Reuse.KEPT)
    together = results(pipeline.grade(package, tmp_path / "all", keeps))
    for requirement in settings.rubric.requirements:
        alone = results(pipeline.grade(package, tmp_path / "alone", replace(keeps, requirements=(requirement.id,))))
        assert alone == {check: result for check, result in together.items() if check in alone}, requirement.id


def results(grading: pipeline.Grading) -> dict[str, tuple[Outcome, float]]:
    """Return the outcomes and shares of the checks; the words of what was not kept, and ran again, have other times."""
    found = [result for score in grading.scorecard.requirements for result in score.results]
    return {result.id: (result.outcome, result.fraction) for result in found}
