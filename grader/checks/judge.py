"""How a check says what it found. A check passes unless it raises one of these, or takes a share of its points."""

from __future__ import annotations

from collections.abc import Sequence

from grader.evidence import Call, Evidence, Goal, Graph, Quality, Sample, Trial


class Failed(AssertionError):
    """The requirement is not met: what was seen, and what to try."""

    def __init__(self, seen: str, try_: str, expected: str = "") -> None:
        super().__init__(seen)
        self.seen, self.try_, self.expected = seen, try_, expected


class NotReached(Exception):
    """The requirement could not be judged because something it depends on failed."""


class Unjudged(Exception):
    """The requirement could not be judged, and that is our fault."""


class Judge:
    """What a check works with: the evidence, and words for what it found."""

    def __init__(self, evidence: Evidence) -> None:
        self.evidence = evidence
        self.fraction = 1.0
        self.seen = ""
        self.try_ = ""
        self.trials: list[str] = []

    def built(self) -> None:
        """Go on only if the package builds.

        Raises:
            NotReached: it does not.
        """
        build = self.evidence.build
        if not build.ok:
            how = "ran out of time" if build.timed_out else f"ended with exit status {build.exit_code}"
            raise NotReached(f"`colcon build` {how} (I1)")

    def trial(self, name: str, *, complete: bool = True) -> Trial:
        """Return a trial, which ran to its end unless `complete` is False.

        Raises:
            NotReached: the node did not come up or did not last.
            Unjudged: the trial went wrong by a fault of ours.
        """
        self.built()
        self.trials.append(name)
        trial = self.evidence.trials.get(name)
        if trial is None:
            raise Unjudged(f"the trial {name} was not run")
        if trial.script_error:
            raise Unjudged(f"the trial {name} broke: {trial.script_error.strip().splitlines()[-1]}")
        if not trial.ready or (complete and trial.ended):
            raise NotReached(trial.ended + last_words(trial))
        return trial

    def started(self, name: str) -> Trial:
        """Return a trial whose node may have refused to start.

        Raises:
            Unjudged: the trial went wrong by a fault of ours.
        """
        self.built()
        self.trials.append(name)
        trial = self.evidence.trials.get(name)
        if trial is None or trial.script_error:
            raise Unjudged(f"the trial {name} broke" if trial else f"the trial {name} was not run")
        return trial

    def graph(self, name: str) -> Graph:
        """Return what the graph showed in a trial whose node came up."""
        trial = self.trial(name, complete=False)
        if trial.graph is None:
            raise Unjudged(f"the trial {name} has no view of the graph")
        return trial.graph

    def call(self, trial: Trial, service: str, index: int) -> Call:
        """Return the trial's call number `index` of `service`, which was answered.

        Raises:
            NotReached: it was not; the reason names a near miss if there is one.
        """
        calls = [call for call in trial.calls if call.service == service]
        if index >= len(calls) and trial.ended:
            raise NotReached(trial.ended + last_words(trial))
        if index >= len(calls):
            raise Unjudged(f"the trial {trial.name} has no call {index} of {service}")
        if calls[index].response is None:
            raise NotReached(calls[index].problem + near_miss(trial.graph, service) + last_words(trial))
        return calls[index]

    def goal(self, trial: Trial, index: int = 0) -> Goal:
        """Return the trial's goal number `index`, which the node accepted.

        Raises:
            NotReached: there is no such action. Failed: the goal was rejected.
        """
        if index >= len(trial.goals) and trial.ended:
            raise NotReached(trial.ended + last_words(trial))
        if index >= len(trial.goals):
            raise Unjudged(f"the trial {trial.name} has no goal {index}")
        goal = trial.goals[index]
        if goal.problem:
            raise NotReached(goal.problem + near_miss(trial.graph, "navigate_to_position"))
        if not goal.accepted:
            raise Failed(f"the goal ({goal.x:.2f}, {goal.y:.2f}) was rejected", "accept goals with finite numbers")
        return goal

    def quality(self) -> Quality:
        """Return what the package's text shows."""
        if self.evidence.quality is None:
            raise Unjudged("the package's text was not read")
        return self.evidence.quality

    def expect(self, holds: bool, seen: str, try_: str) -> None:
        """Fail the check unless `holds`."""
        if not holds:
            raise Failed(seen, try_)

    def share(self, fraction: float, seen: str, try_: str) -> None:
        """Give a share of the check's points, 0 to 1."""
        self.fraction = min(1.0, max(0.0, fraction))
        self.seen, self.try_ = seen, try_


def near_miss(graph: Graph | None, wanted: str) -> str:
    """Return words that name what was probably meant to be `wanted`, "" if the graph shows nothing of the kind."""
    if graph is None:
        return ""
    offered = {**graph.services, **graph.actions}
    if wanted in offered:
        return f"; found {wanted} of type {short_types(offered[wanted])}"
    others = {name: types for name, types in offered.items() if name not in KNOWN}
    if not others:
        return ""
    return "; found " + ", ".join(f"{name} ({short_types(types)})" for name, types in sorted(others.items())[:4])


def near_topic(graph: Graph | None, wanted: str) -> str:
    """Return words that name the publishers that the graph shows instead of `wanted`, "" if there are none."""
    names = sorted({e.topic for e in graph.endpoints if e.kind == "publisher"} - _ALWAYS) if graph else []
    if wanted in names:
        return f"; {wanted} is on the graph, but nothing came"
    return f"; the node publishes {', '.join(names)}" if names else ""


_ALWAYS = {"rosout", "parameter_events"}

# Services and actions of the contract: one of these is no near miss of another.
KNOWN = ("set_speed", "get_status", "navigate_to_position")


def short_types(types: Sequence[str]) -> str:
    """Return "SetBool" for ["std_srvs/srv/SetBool"]; a type that bears a contract's name keeps its package."""
    return ", ".join(name if "robot" in name else name.rpartition("/")[2] for name in types)


def at(samples: Sequence[Sample], t: float) -> Sample:
    """Return the sample nearest to time `t`."""
    return min(samples, key=lambda sample: abs(sample.t - t))


def last_words(trial: Trial) -> str:
    """Return the last line that a node which ended by itself had printed, for the reader to find the cause."""
    if trial.process is None or trial.process.by != "itself":
        return ""
    lines = [line for line in trial.process.output_tail.splitlines() if line.strip()]
    return f"; its last words were: {lines[-1].strip()[:300]}" if lines else ""
