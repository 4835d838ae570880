"""The trials as a source of evidence: which requirements they serve, and which flags they raise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from grader.evidence import Flag, Kind, Trial
from grader.quality import source_files
from grader.settings import Settings
from grader.source import Asked, Collected, Source, Subject, served
from grader.trials import catalog, observers, what_ran
from grader.trials.observers import Observers
from grader.trials.plan import TrialPlan
from grader.trials.request import went_well


class Trials(Source):
    """Runs every trial that serves a wanted requirement."""

    name = "trials"

    def serves(self, settings: Settings) -> frozenset[str]:
        """Return the requirements that any trial serves."""
        plans = catalog.trials(settings.course).values()
        return frozenset().union(*(serves(plan, settings) for plan in plans))

    def ask(self, subject: Subject) -> Asked:
        """Return a job for each trial."""
        assert subject.contract is not None
        settings, plans = subject.settings, wanted(subject.settings)
        folder = subject.folder / self.name
        folder.mkdir()
        running = subject.closing.enter_context(
            Observers(
                settings.course, install=subject.install, contract=subject.contract.install, folder=folder,
                seed=settings.seed, package=subject.submission.package, ros_name=subject.ros_name,
                best_effort=settings.best_effort,
            )
        )  # fmt: skip
        return Asked(
            [
                replace(job, decided_by=started_by(subject), lasting=went_well, serves=serves(plan, settings))
                for plan, job in observers.jobs(running, plans.values())
            ],
            lambda results: self._collected(subject, {name: results[observers.job_name(name)] for name in plans}),
        )

    def _collected(self, subject: Subject, every: Mapping[str, Trial]) -> Collected:
        """Return the trials' facts, by name, and the files of the build's own of which functions ran."""
        settings, submission = subject.settings, subject.submission
        handed_in = source_files.find_in_both(submission.package, submission.interfaces, settings.course)
        places = what_ran.places(every, handed_in, subject.install)
        every = {name: what_ran.in_package(trial, places) for name, trial in every.items()}
        left = {path: subject.install / where for path, where in places.left.items()}
        return Collected({"trials": every}, tuple(integrity_flags(every)), left)


def started_by(subject: Subject) -> tuple[str, ...]:
    """Return the hashes and texts that decide what any trial of a subject shows, beside the trial itself."""
    reliability = "best effort" if subject.settings.best_effort else "reliable"
    return subject.seen_by_nodes, reliability


def wanted(settings: Settings) -> dict[str, TrialPlan]:
    """Return the trials that serve at least one of the requirements to judge."""
    plans = catalog.trials(settings.course)
    return {name: plan for name, plan in plans.items() if serves(plan, settings) & settings.checked}


def serves(plan: TrialPlan, settings: Settings) -> frozenset[str]:
    """Return the ids of the requirements that a trial serves: those it names, and those that need what it shows."""
    shows = {plan.kind, "what ran" if plan.notes_functions else ""} - {""}
    return frozenset(plan.serves).union(*(served(settings, what) for what in shows))


def integrity_flags(ran: Mapping[str, Trial]) -> list[Flag]:
    """Return what an instructor should look at in the trials: each finding once, with the trials that showed it."""
    found: dict[tuple[str, str], Flag] = {}
    names: dict[tuple[str, str], list[str]] = {}
    for name, trial in ran.items():
        for flag in _flags(trial):
            key = flag.kind, flag.where or flag.what
            found.setdefault(key, flag)
            names.setdefault(key, []).append(name)
    return [replace(flag, trial=", ".join(list(dict.fromkeys(names[key]))[:5])) for key, flag in found.items()]


def _flags(trial: Trial) -> Iterator[Flag]:
    for publisher in trial.foreign:
        yield Flag("foreign publisher", f"only the simulator should publish this, but something else did: {publisher}")
    if trial.dropped:
        yield Flag("flood", "the node sent more messages than could be kept")
    if trial.ended is not None and trial.ended.kind is Kind.OBSERVER_CRASHED:
        yield Flag("observer", str(trial.ended))
    if trial.stopped:
        yield Flag("limit", f"the node exceeded its limit of {trial.stopped}")
    yield from what_ran.unseen_flags(trial)
