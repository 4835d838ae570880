"""From a submission to a grading: take in, build, try, keep the evidence, check, score. The list one can read.

Everything of the submission runs in `gather`; below it no student code runs, and `judge` can be repeated at any time.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

from grader import KIT, build, evidence, mutation, sandbox, student_tests
from grader.checks import checks_run as checks
from grader.contract import spec
from grader.conversions import ask_conversions
from grader.errors import GraderError
from grader.host import namespaces, shortage, tempdir
from grader.intake.submission import Submission, open_submission
from grader.quality import analyse_package
from grader.scoring.grading import Grading
from grader.scoring.rubric import Requirement, Rubric
from grader.scoring.scorecard import score
from grader.trials import catalog
from grader.trials import scheduler as trials
from grader.trials.request import OBSERVER_ENDED

EVIDENCE = "evidence"


@dataclass(frozen=True)
class Settings:
    """How to grade. Times are wall seconds; `seed` decides the trials' speeds, places and noise."""

    rubric: Rubric
    cache: Path
    seed: int = 0
    build_seconds: float = 300.0
    test_seconds: float = student_tests.MODULE_SECONDS
    fault_seconds: float = mutation.SECONDS
    """The budget for putting faults into the package: the wall time that it may take on a quiet machine."""
    requirements: tuple[str, ...] = ()
    """Judge only these; by default all that have checks."""
    progress: Callable[[str], None] = lambda _what: None

    @property
    def wanted(self) -> list[Requirement]:
        """Return the requirements to be judged."""
        return [r for r in self.rubric.requirements if not self.requirements or r.id in self.requirements]


def grade(
    source: Path,
    out: Path,
    settings: Settings,
    write: Callable[[Grading, Path], object] = lambda _grading, _folder: None,
) -> Grading:
    """Grade the submission `source`, leave the evidence in `out`, and return the grading.

    `write` is to put reports of the grading into a folder; they appear in `out` together with the evidence, or nothing
    does and what is in `out` stays as it was.

    Raises:
        SubmissionError: there is nothing in it that could be graded.
        GraderError: this host cannot grade.
    """
    started = time.monotonic()
    shortage.require_memory()
    sandbox.require()
    with _results(out) as fresh:
        found = _see(source, settings)
        evidence.save(found, fresh / EVIDENCE)
        settings.progress("checking the evidence")
        grading = replace(judge(fresh / EVIDENCE, settings), wall_seconds=time.monotonic() - started)
        settings.progress("writing the report")
        write(grading, fresh)
    return grading


def _see(source: Path, settings: Settings) -> evidence.Evidence:
    """Take the submission in, try it out, and return what was seen."""
    with tempdir.folder("grading") as room:
        settings.progress(f"taking in {source.name}")
        submission = open_submission(source, room / "submission")
        found = gather(submission, room, settings)
        found = replace(found, origin=origin(submission, settings))
        if namespaces.unsafe():
            intake = replace(found.intake, notes=[namespaces.UNSAFE_WORDS, *found.intake.notes])
            flag = evidence.Flag("no sandbox", namespaces.UNSAFE_WORDS)
            found = replace(found, intake=intake, flags=[flag, *found.flags])
    return found


def gather(submission: Submission, room: Path, settings: Settings) -> evidence.Evidence:
    """Read the submission, build it and try it out behind walls. Return what was seen."""
    with ThreadPoolExecutor(1) as pool:
        # Reading needs no build, so it goes on beside one, and is done before the trials keep the cores busy.
        quality = pool.submit(_quality, submission, settings)
        found = replace(_build_and_try(submission, room, settings), quality=quality.result())
    return replace(found, flags=[*found.flags, *suppressions(found.quality)])


def _build_and_try(submission: Submission, room: Path, settings: Settings) -> evidence.Evidence:
    if not build.contract_is_built(settings.cache):
        settings.progress("building the contract's interfaces: once on this machine, about a minute")
    contract = build.contract(settings.cache)
    settings.progress("building the package")
    folders = [submission.package] + ([submission.interfaces] if submission.interfaces else [])
    built = build.build(folders, settings.cache, seconds=settings.build_seconds)
    if (types := build.types_package(built.install)) != spec.PACKAGE:
        settings.progress(f"building the contract's interfaces as {types}: once on this machine, about a minute")
        contract = build.contract(settings.cache, types)
    facts = replace(
        built.facts, contract_hashes=contract.facts.type_hashes, contract_texts=contract.facts.interface_texts
    )
    found = evidence.Evidence(intake=submission.intake, build=facts, flags=[*submission.flags, *facts.flags])
    if not facts.ok:
        return found
    asked = any(requirement.id == "F14" for requirement in settings.wanted)
    (room / "trials").mkdir()
    plans = catalog.serving(requirement.id for requirement in settings.wanted)
    with ThreadPoolExecutor(2) as pool:
        # The tests are mostly one long module: they run beside the trials, or the grading would wait for it alone.
        own = pool.submit(_own_tests, submission, built, settings)
        answers = pool.submit(ask_conversions, built.install, settings.seed) if asked else None
        tried = trials.run(
            plans.values(), install=built.install, contract=contract.install, folder=room / "trials",
            package=submission.package,
            seed=settings.seed, progress=lambda name: settings.progress(f"trial {name}: {plans[name].sentence}"),
        )  # fmt: skip
        tested = own.result()
        found = replace(found, conversions=answers.result()) if answers else found
    found = replace(found, flags=[*found.flags, *oddities(tried)])
    if tested is None:
        return replace(found, trials=tried)
    found = replace(found, trials=tried, tests=tested.tests, flags=[*found.flags, *tested.flags])
    return replace(found, mutation=_mutation(submission, built, tested, settings))


def oddities(tried: Mapping[str, evidence.Trial]) -> list[evidence.Flag]:
    """Return what nodes did in trials that an instructor should look at, each once with the trials it was seen in."""
    seen: dict[tuple[str, str], list[str]] = {}
    for name, trial in tried.items():
        for publisher in trial.foreign:
            what = f"the simulator alone publishes this, and somebody else did: {publisher}"
            seen.setdefault(("foreign publisher", what), []).append(name)
        if trial.dropped:
            words = "the node sent more messages than could be kept"
            seen.setdefault(("flood", words), []).append(name)
        if trial.ended == OBSERVER_ENDED:
            seen.setdefault(("observer", trial.ended), []).append(name)
        if trial.stopped:
            seen.setdefault(("limit", f"the node went beyond its limit of {trial.stopped}"), []).append(name)
    return [evidence.Flag(kind, what, where=", ".join(names[:5])) for (kind, what), names in seen.items()]


_SILENCERS = re.compile(r"flake8[:=]\s*noqa|skip-file|ruff:\s*noqa|mypy:\s*ignore-errors", re.IGNORECASE)
_MANY_SUPPRESSIONS = 10


def suppressions(quality: evidence.Quality | None) -> list[evidence.Flag]:
    """Return a flag where comments silence a whole file, or many lines. They had no effect; somebody should know."""
    found = quality.suppressions if quality else []
    whole = [finding for finding in found if _SILENCERS.search(finding.text)]
    if not whole and len(found) < _MANY_SUPPRESSIONS:
        return []
    words = f"{len(found)} comments tell analysers to look away; they had no effect"
    places = ", ".join(f"{finding.path}:{finding.line}" for finding in (whole or found)[:5])
    return [evidence.Flag("suppressions", words, where=places)]


def store(found: evidence.Evidence, out: Path) -> Path:
    """Put the evidence below `out` in one step and return its folder: a reader never meets half of it."""
    try:
        with _results(out) as fresh:
            evidence.save(found, fresh / EVIDENCE)
    except OSError as error:
        said = shortage.words(error) or f"Cannot write the evidence to {out}: {error}. Choose another folder."
        raise GraderError(said) from error
    return out / EVIDENCE


@contextmanager
def _results(out: Path) -> Iterator[Path]:
    """Give an empty folder to write into. What is in it in the end takes its place in `out`, all of it or nothing."""
    existed = out.exists()
    out.mkdir(parents=True, exist_ok=True)
    for left in (*out.glob(f"{_FRESH}*"), *out.glob(".report.*")):  # by a grader that was killed
        shutil.rmtree(left) if left.is_dir() else left.unlink()
    fresh = Path(tempfile.mkdtemp(prefix=_FRESH, dir=out))
    try:
        yield fresh
        # Everything is on the disk by now; moving it needs no room.
        for entry in sorted(fresh.iterdir()):
            if (out / entry.name).is_dir():
                (out / entry.name).rename(fresh / f"old-{entry.name}")
            entry.rename(out / entry.name)
    except OSError as error:
        # A failed write does not say where.
        if shortage.words(error) and (said := shortage.full(out)):
            raise GraderError(said) from error
        raise
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
        if not existed:
            with contextlib.suppress(OSError):  # it is empty where nothing was graded
                out.rmdir()


_FRESH = ".results-"


def judge(folder: Path, settings: Settings) -> Grading:
    """Run the checks over the evidence in `folder` and score what they find."""
    ids = [check.id for requirement in settings.wanted for check in requirement.checks]
    results = checks.run(folder, ids)
    wanted = {requirement.id for requirement in settings.wanted}
    found = evidence.load(folder)
    return Grading(
        scorecard=score(_only(settings.rubric, wanted), results),
        evidence=found,
        environment=environment(),
        submission=found.intake.name,
        seed=settings.seed,
        wall_seconds=0.0,
    )


def environment() -> dict[str, str]:
    """Return what graded: versions that decide a result, so that an appeal can run the same."""
    names = ("ros2-course-kit", "ros-jazzy-rclpy", "pymunk", "numpy", "pytest", "coverage")
    versions = {name: _version(name) for name in names}
    return versions | {"python": platform.python_version(), "system": platform.platform(), "cores": str(os.cpu_count())}


def origin(submission: Submission, settings: Settings) -> dict[str, str]:
    """Return what makes the evidence: with the same of all this the same can be seen again."""
    sources = sorted(path for folder in (KIT / "grader", KIT / "sim") for path in folder.rglob("*.py"))
    digest = hashlib.sha256()
    for path in sources:
        digest.update(f"{path.relative_to(KIT)}\0".encode() + path.read_bytes())
    made = {"seed": str(settings.seed), "kit": digest.hexdigest()[:16], "submission": submission.intake.sha256}
    return made | environment()


def _quality(submission: Submission, settings: Settings) -> evidence.Quality | None:
    wanted = {requirement.id for requirement in settings.wanted}
    lint = any(name.startswith("Q") for name in wanted)
    if not lint and "I2" not in wanted:
        return None
    return analyse_package(submission.package, submission.interfaces, lint=lint)


def _own_tests(submission: Submission, built: build.Built, settings: Settings) -> student_tests.OwnRun | None:
    if not any(requirement.id.startswith("T") and requirement.checks for requirement in settings.wanted):
        return None
    modules = student_tests.read_modules(submission.package)
    return student_tests.run_modules(
        submission.package, built.install, modules, seconds=settings.test_seconds, seed=settings.seed,
        progress=lambda path: settings.progress(f"own tests: {path}"),
    )  # fmt: skip


def _mutation(
    submission: Submission, built: build.Built, tested: student_tests.OwnRun, settings: Settings
) -> evidence.Mutation | None:
    """Put faults into the package, after everything else: it takes all cores."""
    if not any(requirement.id == "T3" and requirement.checks for requirement in settings.wanted):
        return None
    settings.progress("putting faults into the package, to see whether its own tests notice")
    return mutation.mutate(
        submission.package, built.install, tested.reach, seed=settings.seed, seconds=settings.fault_seconds,
        progress=settings.progress,
    )  # fmt: skip


def _only(whole: Rubric, wanted: Sequence[str] | set[str]) -> Rubric:
    """Return the rubric with the checks of unwanted requirements left out, which makes them "not graded"."""
    return replace(
        whole,
        criteria=tuple(
            replace(c, requirements=tuple(r if r.id in wanted else replace(r, checks=()) for r in c.requirements))
            for c in whole.criteria
        ),
    )


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
