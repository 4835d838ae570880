"""Collect the evidence that the wanted requirements need, source by source. After this no student code runs."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader import building
from grader.building import Built
from grader.evidence import Build, Evidence
from grader.evidence.kept import Kept, NotKept, forget_old
from grader.functions.source import FunctionCalls
from grader.host import namespaces, provenance
from grader.intake.submission import Submission
from grader.mutation.source import Mutants
from grader.quality.source import PackageText
from grader.settings import Settings
from grader.source import Collected, Phase, Source, Subject
from grader.student_tests.source import StudentTestRuns
from grader.trials.source import Trials
from grader.words import mark, say

SOURCES: tuple[Source, ...] = (Trials(), StudentTestRuns(), FunctionCalls(), Mutants(), PackageText())
"""Every source of evidence. Flags are kept in this order."""


def collect(submission: Submission, folder: Path, settings: Settings) -> Evidence:
    """Build the submission where that is needed, ask every source that serves a wanted requirement, and merge.

    `folder` is an empty one, for what the sources keep while they work.

    Raises:
        GraderError: this host cannot build or run the submission.
        NotKept: something would have to be collected, and the settings want only what is kept.
    """
    # The text is always read: it says why a package does not build, or why no node comes up.
    kept = kept_evidence(settings)
    wanted = [source for source in SOURCES if source.phase is Phase.TEXT or source.serves(settings) & settings.checked]
    of_text = [source for source in wanted if source.phase is Phase.TEXT]
    to_run = [source for source in wanted if source.phase is Phase.RUN]
    found: dict[str, Collected] = {}
    with ThreadPoolExecutor(1) as pool:
        # Reading needs no build, so it goes on beside one and is done before the trials keep the cores busy.
        texts = pool.submit(_ask, of_text, Subject(submission, settings, folder, kept))
        built = None
        if needs_build(settings):
            contract = _contract(submission, settings)
            built, own = _build(submission, contract, settings)
        if built is not None and built.facts.ok:
            subject = Subject(submission, settings, folder, kept, built, own)
            found |= _ask(to_run, subject)
        found |= texts.result()
        if "trials" in found and (left := found["trials"].handover):
            again = folder / "left by the build"
            again.mkdir()
            found |= _ask(of_text, replace(subject, folder=again, earlier={"trials": left}))
    facts = built.facts if built is not None else Build.not_tried(settings.course.package)
    return _merged(submission, facts, found)


def kept_evidence(settings: Settings) -> Kept:
    """Return the evidence of earlier gradings with this kit, machine and seed."""
    if not settings.keep:
        return Kept(only=settings.only_kept)
    folder = settings.cache / "evidence"
    if not settings.only_kept:
        forget_old(folder)
    common = (
        provenance.kit_hash(settings.course.layers),
        building.toolchain_id(),
        str(settings.seed),
        namespaces.confinement().value,
    )
    return Kept(folder, common, settings.fresh, settings.only_kept)


def needs_build(settings: Settings) -> bool:
    """Return whether any wanted requirement needs the package built; the others are judged by its text alone."""
    text, later = set[str](), set[str]()
    for source in SOURCES:
        (text if source.phase is Phase.TEXT else later).update(source.serves(settings))
    # What no source serves is judged by the build itself.
    return not settings.checked <= text - later


def _folders(submission: Submission) -> list[Path]:
    return [submission.package] + ([submission.interfaces] if submission.interfaces else [])


def _contract(submission: Submission, settings: Settings) -> Built:
    """Return the build of the contract's interfaces."""
    is_built = building.contract_is_built(settings.cache, settings.course)
    if settings.only_kept and not (
        is_built and building.is_built(_folders(submission), settings.cache, settings.course)
    ):
        raise NotKept
    if not is_built:
        settings.progress(say(building.FIRST_TIME))
    return building.build_contract(settings.cache, settings.course)


def _build(submission: Submission, contract: Built, settings: Settings) -> tuple[Built, Built]:
    """Return the submission's build, and that of the contract's interfaces under the name that it has for them."""
    settings.progress(say("building the package"))
    main, course = submission.intake.package, settings.course
    built = building.build(_folders(submission), settings.cache, course, seconds=settings.build_seconds, main=main)
    if (types := built.facts.types_package) != course.package:
        if settings.only_kept:  # the contract under that name may have to be built
            raise NotKept
        words = mark("building the contract as {package}: once on this machine, about a minute, longer on a busy one")
        settings.progress(say(words, package=types))
        contract = building.build_contract(settings.cache, course, types)
    facts = replace(
        built.facts,
        contract_hashes=contract.facts.type_hashes,
        contract_texts=contract.facts.interface_texts,
    )
    return replace(built, facts=facts), contract


def _ask(sources: Sequence[Source], subject: Subject) -> dict[str, Collected]:
    """Return what the sources find, by their names. They collect at the same time, each after those that it uses."""
    if not sources:
        return {}
    answers: dict[str, Future[Collected]] = {}

    def collect_from(source: Source) -> Collected:
        own = subject.folder / source.name
        own.mkdir()
        earlier = {name: answers[name].result().handover for name in source.uses & answers.keys()}
        return source.collect(replace(subject, folder=own, earlier={**subject.earlier, **earlier}))

    with ThreadPoolExecutor(len(sources)) as pool:
        for source in sorted(sources, key=lambda source: bool(source.uses)):
            answers[source.name] = pool.submit(collect_from, source)
        return {name: answer.result() for name, answer in answers.items()}


def _merged(submission: Submission, facts: Build, found: dict[str, Collected]) -> Evidence:
    fields: dict[str, Any] = {}
    flags = [*submission.flags, *facts.flags]
    for source in SOURCES:
        if source.name in found:
            fields |= found[source.name].facts
            flags += found[source.name].flags
    kept = {what: when for collected in found.values() for what, when in collected.kept.items()}
    return Evidence(intake=submission.intake, build=facts, flags=flags, kept=kept, **fields)
