"""The trials as a source of evidence: which requirements they serve, and which flags they raise."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from grader.evidence import Flag, Trial
from grader.source import Collected, Phase, Subject
from grader.trials import catalog, scheduler
from grader.trials.request import OBSERVER_ENDED


class Trials:
    """Runs every trial that serves a wanted requirement."""

    name = "trials"
    phase = Phase.RUN

    @cached_property
    def serves(self) -> frozenset[str]:
        """Return the requirements that any trial serves."""
        return frozenset(requirement for plan in catalog.trials().values() for requirement in plan.serves)

    def collect(self, subject: Subject) -> Collected:
        """Return the trials' facts, by name."""
        assert subject.contract is not None
        settings = subject.settings
        plans = catalog.serving(settings.checked)
        ran = scheduler.run(
            plans.values(), install=subject.install, contract=subject.contract.install, folder=subject.folder,
            package=subject.submission.package, ros_name=subject.ros_name, seed=settings.seed,
            best_effort=settings.best_effort,
            progress=lambda name: settings.progress(f"trial {name}: {plans[name].sentence}"),
        )  # fmt: skip
        return Collected({"trials": ran}, tuple(integrity_flags(ran)))


def integrity_flags(ran: Mapping[str, Trial]) -> list[Flag]:
    """Return what an instructor should look at in the trials: each finding once, with the trials that showed it."""
    seen: dict[tuple[str, str], list[str]] = {}
    for name, trial in ran.items():
        for publisher in trial.foreign:
            what = f"only the simulator should publish this, but something else did: {publisher}"
            seen.setdefault(("foreign publisher", what), []).append(name)
        if trial.dropped:
            seen.setdefault(("flood", "the node sent more messages than could be kept"), []).append(name)
        if trial.ended == OBSERVER_ENDED:
            seen.setdefault(("observer", trial.ended), []).append(name)
        if trial.stopped:
            seen.setdefault(("limit", f"the node exceeded its limit of {trial.stopped}"), []).append(name)
    return [Flag(kind, what, where=", ".join(names[:5])) for (kind, what), names in seen.items()]
