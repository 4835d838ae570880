"""Collect the evidence that the wanted requirements need, source by source. After this no student code runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from grader import building, progress
from grader.building import Built
from grader.evidence import Build, Evidence
from grader.functions.source import FunctionCalls
from grader.host import namespaces, provenance
from grader.hunt.source import Hunts
from grader.intake.submission import Submission
from grader.league.source import LeagueCases
from grader.mutation.source import Mutants
from grader.processes import jobs
from grader.processes.jobs import Job, Where
from grader.processes.kept import NOTHING_KEPT, Kept, forget_old
from grader.quality.source import PackageText
from grader.settings import Reuse, Settings
from grader.source import Asked, Collected, Phase, Source, Subject
from grader.student_tests.source import StudentTestRuns
from grader.trials.source import Trials
from grader.words import mark, say

SOURCES: tuple[Source, ...] = (
    Trials(), Hunts(), StudentTestRuns(), FunctionCalls(), Mutants(), LeagueCases(), PackageText(),
)  # fmt: skip
"""Every source of evidence. Flags are kept in this order."""

_BUILDING = mark("building the package")
_CONTRACT, BUILD = mark("the contract's build"), mark("the package's build")


def collect(subject: Subject) -> Evidence:
    """Build the submission where that is needed, ask every source that serves a wanted requirement, and merge.

    Raises:
        GraderError: this host cannot build or run the submission.
    """
    found = _Found(kept_evidence(subject.settings), subject.settings.progress)
    text = _asked(Phase.TEXT, subject)
    built, contract = found.of(text, builds(subject)).get(BUILD, (None, None))
    subject, asked = _after_build(subject, built, contract)
    found.of(asked)
    if left := {path: file for each in found.collected.values() for path, file in each.left.items()}:
        found.of(_asked(Phase.TEXT, replace(subject, left=left)))
    package = subject.settings.course.package
    build = built.facts if built is not None else Build(ok=False, package=package, types_package=package)
    fields: dict[str, Any] = {}
    flags = [*subject.submission.flags, *build.flags]
    for collected in filter(None, (found.collected.get(source.name) for source in SOURCES)):
        for name, facts in collected.facts.items():  # two sources have trials
            fields[name] = {**fields.get(name, {}), **facts} if isinstance(facts, dict) else facts
        flags += collected.flags
    return Evidence(intake=subject.submission.intake, build=build, flags=flags, kept=found.since, **fields)


def _after_build(subject: Subject, built: Built | None, contract: Built | None) -> tuple[Subject, dict[str, Asked]]:
    """Return the subject with its build, and what the sources want done beside or after that."""
    asked = _asked(Phase.DATA, subject)
    if built is not None and built.facts.ok:
        subject = replace(subject, built=built, contract=contract)
        asked |= _asked(Phase.RUN, subject)
    return subject, asked


@dataclass(frozen=True)
class _Found:
    """What was collected by now, by its source, and when that was of what is kept."""

    known: Kept
    progress: Callable[[str], None]
    collected: dict[str, Collected] = field(default_factory=dict)
    since: dict[str, str] = field(default_factory=dict)

    def of(self, asked: Mapping[str, Asked], beside: Sequence[Job[Any]] = ()) -> Mapping[str, Any]:
        """Do the jobs of sources, and others beside them; return the results of these all."""
        done = jobs.run([*beside, *_jobs(asked)], self.known, self.progress)
        self.collected.update({name: each.collected(done.results) for name, each in asked.items()})
        self.since.update(done.kept)
        return done.results


def builds(subject: Subject) -> list[Job[Any]]:
    """Return the builds, if any wanted requirement needs them. Reading the text goes on beside them."""
    settings = subject.settings
    if not needs_build(settings):
        return []
    keeps_itself: Callable[[object], bool] = lambda _built: False  # noqa: E731 - building/cache.py keeps it
    first = "" if building.contract_is_built(settings.cache, settings.course) else say(building.FIRST_TIME)
    contract = Job(
        _CONTRACT, Where.SANDBOX, Built,
        lambda: building.build_contract(settings.cache, settings.course, "", _far(first, settings)),
        lasting=keeps_itself, says=first,
    )  # fmt: skip
    package = Job(
        BUILD, Where.SANDBOX, tuple[Built, Built], lambda built: _build(subject.submission, built, settings),
        after=_CONTRACT, lasting=keeps_itself, says=say(_BUILDING),
    )  # fmt: skip
    return [contract, package]


def explain(subject: Subject) -> list[tuple[Job[Any], str]]:
    """Return the jobs of a grading, each with the time at which its kept result was made, "" if it would be done.

    The submission is built, if need be; nothing else is done.
    """
    kept = kept_evidence(subject.settings)
    before = [*_jobs(_asked(Phase.TEXT, subject)), *builds(subject)]
    done = jobs.run(builds(subject), kept, subject.settings.progress).results
    _, later = _after_build(subject, *done.get(BUILD, (None, None)))
    return [(job, (jobs.find(job, kept) or ("", ""))[1]) for job in (*before, *_jobs(later))]


def _asked(phase: Phase, subject: Subject) -> dict[str, Asked]:
    """Return what the sources of a phase want done. The text is always read: it says why nothing builds or comes up."""
    settings = subject.settings
    of_phase = [source for source in SOURCES if source.phase is phase]
    wanted = [each for each in of_phase if phase is Phase.TEXT or each.serves(settings) & settings.checked]
    return {source.name: source.ask(subject) for source in wanted}


def _jobs(asked: Mapping[str, Asked]) -> list[Job[Any]]:
    """Return the jobs, each once."""
    return list({job.name: job for each in asked.values() for job in each.jobs}.values())


def kept_evidence(settings: Settings) -> Kept:
    """Return the evidence of earlier gradings with this kit, machine and seed."""
    if settings.reuse is Reuse.NONE:
        return NOTHING_KEPT
    folder = settings.cache / "evidence"
    forget_old(folder)
    common = (
        provenance.kit_hash(settings.course.folder),
        building.toolchain_id(),
        str(settings.seed),
        namespaces.confinement().value,
    )
    return Kept(folder, common, settings.reuse is Reuse.ANEW)


def needs_build(settings: Settings) -> bool:
    """Return whether any wanted requirement needs the package built; the others are judged by its text or data."""
    text, later = set[str](), set[str]()
    for source in SOURCES:
        (later if source.phase is Phase.RUN else text).update(source.serves(settings))
    # What no source serves is judged by the build itself.
    return not settings.checked <= text - later


def _far(step: str, settings: Settings) -> Callable[[str], None]:
    """Return a function that says how far a step is, in brackets behind it."""
    return lambda far: settings.progress(f"{progress.step(step)} ({far})")


def _build(submission: Submission, contract: Built, settings: Settings) -> tuple[Built, Built]:
    """Return the submission's build, and that of the contract's interfaces under the name that it has for them."""
    main, course = submission.intake.package, settings.course
    built = building.build(
        [path for path in (submission.package, submission.interfaces) if path], settings.cache, course,
        seconds=settings.build_seconds, main=main, far=_far(say(_BUILDING), settings),
    )  # fmt: skip
    if (types := built.facts.types_package) != course.package:
        words = mark("building the contract as {package}: once on this machine, about a minute, longer on a busy one")
        settings.progress(says := say(words, package=types))
        contract = building.build_contract(settings.cache, course, types, _far(says, settings))
    facts = replace(
        built.facts,
        contract_hashes=contract.facts.type_hashes,
        contract_texts=contract.facts.interface_texts,
    )
    return replace(built, facts=facts), contract
