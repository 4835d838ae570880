"""What a check works with. A check passes unless it raises one of these exceptions or gives a share of its points."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import PurePosixPath

from grader import tracebacks
from grader.checks import first_cause
from grader.checks.first_cause import HOLDS_ON, behind, besides, holds_on, last_output, with_cure
from grader.checks.measured import Measured, measure
from grader.checks.wording import near_miss, place
from grader.course import Course
from grader.evidence import Call, Evidence, Fault, Finding, Goal, Graph, Kind, Quality, Reason, StudentTests, Trial
from grader.words import say

# What a trial is about, by how its name begins: see Fault.stops.
_ABOUT = {"launch": ("parameters",), "file": ("parameters",)}
SILENT = (Kind.NO_ANSWER, Kind.NO_VERDICT, Kind.HANGS, Kind.SLOW, Kind.WAITS, Kind.WAITED)
"""Reasons of a node that is there and does not answer."""
_NOT_CALLABLE = "'NoneType' object is not callable"
_SCRIPT = re.compile(r'File "[^"]*(?<!/grader)/(trials/\w+\.py)", line (\d+)')  # a frame of a course's trial


class Failed(AssertionError):
    """The requirement is not met; says what was seen, and what to try."""

    def __init__(self, seen: str, try_: str, reason: Reason | None = None) -> None:
        super().__init__(seen)
        self.seen, self.try_, self.reason = seen, try_, reason


class NotReached(Exception):
    """The requirement could not be judged because something it depends on failed.

    Args:
        reason: why. A check may say it in words of its own, with the ids of the `requirements` that come first.
        words: the reason as a student reads it, with whatever else was seen.
    """

    def __init__(self, reason: Reason | str, *requirements: str, words: str = "") -> None:
        if isinstance(reason, str):
            reason = Reason(Kind.DEPENDS, said=reason, requirements=requirements)
        super().__init__(words or str(reason))
        self.reason = reason


class Unjudged(Exception):
    """The requirement could not be judged because of an error of the grader."""


class Judge:
    """The evidence for one check, and the share of its points, with feedback.

    Attributes:
        course: the assignment.
        fraction: the share of the points, 0 to 1.
        seen: what was seen, for the student.
        try_: what to try, for the student.
        trials: the names of the trials that the check has looked at.
        figures: what the check has measured, by name.
    """

    def __init__(self, evidence: Evidence, course: Course) -> None:
        self.evidence, self.course = evidence, course
        self.fraction = 1.0
        self.seen = ""
        self.try_ = ""
        self.trials: list[str] = []
        self.figures: dict[str, float] = {}
        self._weight = 1.0
        self._why = ""

    def require_build(self, *about: str) -> None:
        """Return if the package was built: `judge.require_build()`. `about` is what the check asks: see Fault.stops.

        Raises:
            NotReached: it was not. What its text shows of `about` is said all the same.
        """
        build = self.evidence.build
        if not build.ok:
            how = say("ended with exit status {build.exit_code}", build=build)
            how = say("ran out of time") if build.timed_out else how
            reason = Reason(Kind.NOT_BUILT, said=how, requirements=self.judged_by("check_build"))
            raise NotReached(reason, words=f"{reason}{besides(self.faults(*about))}")

    def judged_by(self, module: str) -> tuple[str, ...]:
        """Return the id of the requirement that a module judges, () for none: `judge.judged_by("check_build")`."""
        requirement = self.course.requirement_of(module)
        return (requirement,) if requirement else ()

    def faults(self, *stops: str) -> list[Fault]:
        """Return what the package's text shows of these kinds, the first cause first; [] if it was not read.

        `judge.faults("install", "start")`
        What the build has installed is not lacking, whatever the text seems to say.
        """
        quality = self.evidence.quality
        return [
            fault
            for fault in (quality.faults if quality is not None else ())
            if fault.stops in stops and not (fault.lacks and all(map(self.is_installed, fault.lacks)))
        ]

    def is_installed(self, thing: str) -> bool:
        """Return whether the build has installed an executable, or a file in the share folder.

        `judge.is_installed("guard")`, `judge.is_installed("config/guard.yaml")`
        """
        build = self.evidence.build
        if "/" not in thing:
            return thing in build.executables or thing in build.misplaced
        return PurePosixPath(thing).name in {PurePosixPath(path).name for path in build.shared_files}

    def unwritten(self, things: Iterable[str]) -> list[str]:
        """Return which of these are files that the package does not have; [] if its text was not read.

        `judge.unwritten(["config/guard.yaml"])`
        """
        quality = self.evidence.quality
        return [path for path in things if "/" in path and quality is not None and path not in quality.paths]

    def require_installed(self, path: str) -> None:
        """Return if a file is installed, or was never written: `judge.require_installed("config/guard.yaml")`.

        Raises:
            NotReached: the package has it, and does not install it.
        """
        if path and not self.is_installed(path) and not self.unwritten([path]):
            cause, build = behind(self.faults("install"), [path]), self.judged_by("check_build")
            reason = Reason(Kind.NO_FILE, path, self.evidence.build.package, requirements=build, fault=cause)
            raise NotReached(reason, words=f"{with_cure(cause)}; {reason}" if cause else "")

    def started(self, name: str) -> Trial:
        """Return a trial whose node may have refused to start: `judge.started("senseless_start_guard")`.

        Raises:
            NotReached: the package was not built.
            Unjudged: the trial was not run, or broke by an error of the grader.
        """
        self.require_build(*_ABOUT.get(name.partition("_")[0], ()))
        self.trials.append(name)
        trial = self.evidence.trials.get(name)
        if trial is None:
            raise Unjudged(f"the trial {name} was not run")
        if trial.script_error:
            where = [f" ({file}, line {line})" for file, line in _SCRIPT.findall(trial.script_error)]
            words = f"{trial.script_error.strip().splitlines()[-1]}{''.join(where[-1:])}"
            raise Unjudged(f"the trial {name} broke: {words}")
        return trial

    def trial(self, name: str, *, complete: bool = True) -> Trial:
        """Return a trial whose node came up, and lasted to its end if `complete`: `judge.trial("to_the_end")`.

        Raises:
            NotReached: the node did not come up, or ended too early.
            Unjudged: see `started`.
        """
        trial = self.started(name)
        if not trial.ready:
            raise self._not_up(trial)
        if complete and trial.ended:
            raise self.not_reached(trial.ended, trial)
        return trial

    def not_reached(self, reason: Reason, trial: Trial) -> NotReached:
        """Return that a check is kept from being judged by how a trial ended, or by a call without an answer in it.

        `raise judge.not_reached(trial.ended, trial)`
        """
        by_itself = trial.process is not None and trial.process.by == "itself"
        output = trial.process.output_tail if trial.process is not None and by_itself else ""
        # rclpy's own words for a service's callback that has returned something else than a response.
        raised = output.partition("in send_response")[2].splitlines()
        if any(line.strip().removeprefix("raise ").startswith("TypeError") for line in raised):
            found = [habit for habit in self.habits if habit.rule == "no-response"]
            shown = "; ".join(f"{place(habit)} {habit.text}" for habit in found[:2])
            why = Reason(Kind.NO_RESPONSE, said=shown or say("the callback of a service returned None"))
            return NotReached(why, words=f"{reason}; {why}")
        words = f"{reason}{last_output(trial)}"
        called = [habit for habit in self.habits if habit.rule == "called-at-once" and _NOT_CALLABLE in output]
        if called:  # the traceback leads to the executor, and to the line that spins the node
            where = place(called[0])
            return NotReached(replace(reason, place=where), words=f"{reason}: {where} {called[0].text}")
        if by_itself:
            said, _ = tracebacks.raised(output)
            return NotReached(replace(reason, place=tracebacks.last_place(output), said=said), words=words)
        if reason.kind in SILENT and (spins := first_cause.spinning([trial], self.habits, self._own_files)):
            return NotReached(spins)
        if reason.kind in SILENT and (held := holds_on(self.habits, reason.place)):
            habit = held[0]
            fault = Fault(habit.path, habit.line, "start", habit.text, say(HOLDS_ON[habit.rule]))
            because = replace(reason, place=reason.place or place(habit), fault=fault)
            return NotReached(because, words=words + first_cause.holding_on(held))
        return NotReached(reason, words=words)

    @property
    def habits(self) -> list[Finding]:
        """Return the habits that the package's text shows, [] if it was not read: `for habit in judge.habits`."""
        return self.evidence.quality.habits if self.evidence.quality is not None else []

    def cause(self, seen: str) -> Reason | None:
        """Return what comes before what a check has `seen` in its trials, None if nothing does: `judge.cause(seen)`.

        The node's own last words, then what the graph shows, then what the node cannot hear.
        """
        shown = first_cause.of_trials(self._ran, self.course, seen, self.judged_by("check_graph"))
        return shown or first_cause.spinning(self._ran, self.habits, self._own_files)

    @property
    def _ran(self) -> list[Trial]:
        """Return the trials that the check has looked at, the latest first."""
        return [self.evidence.trials[name] for name in reversed(self.trials) if name in self.evidence.trials]

    def _not_up(self, trial: Trial) -> NotReached:
        """Return why a trial's node did not come up: first what the package's text shows, if what was seen agrees."""
        reason = trial.ended or Reason(Kind.DEPENDS, said=say("the node did not come up"))
        said = first_cause.launch_errors(trial) if trial.launch else last_output(trial)
        name = first_cause.its_name(trial, self.course.nodes)
        words = f"{reason}{name}{said}" if trial.launch else f"{reason}{said}{name}"
        faults = self.faults("install", "start", *_ABOUT.get(trial.name.partition("_")[0], ()))
        lacked = [reason.name] if reason.kind in (Kind.NO_PROGRAM, Kind.NO_FILE) else []
        output = trial.process.output_tail if trial.process is not None else ""
        cause = behind(faults, lacked) if lacked else first_cause.shown_by(faults, output)
        if cause is not None:
            return NotReached(replace(reason, fault=cause), words=f"{with_cure(cause)}; {words}")
        if self.unwritten(lacked):
            return NotReached(replace(reason, kind=Kind.UNWRITTEN))
        place, (said, _) = "" if trial.launch else tracebacks.last_place(output), tracebacks.raised(output)
        return NotReached(replace(reason, place=place, said=said), words=words + besides(faults))

    def graph(self, name: str) -> Graph:
        """Return the graph of a trial whose node came up: `judge.graph("idle_guard").services`."""
        trial = self.trial(name, complete=False)
        if trial.graph is None:
            raise Unjudged(f"the trial {name} has no graph")
        node, shown = self.course.nodes.get(trial.node), {end.topic for end in trial.graph.endpoints}
        if trial.ended and node is not None and not {*node.subscribes, *node.publishes} <= shown:
            raise self.not_reached(trial.ended, trial)  # it was gone before all of it was there
        return trial.graph

    @property
    def in_namespace(self) -> Trial | None:
        """Return the trial whose launch file, the course's own, puts the nodes into NAMESPACE; None if none was run.

        `trial = judge.in_namespace`
        """
        launched = (trial for trial in self.evidence.trials.values() if trial.launch)
        return next((t for t in launched if f"launch/{t.launch}" not in self.course.launch), None)

    def call(self, trial: Trial, service: str, index: int) -> Call:
        """Return the trial's call number `index` of `service`, which was answered: `judge.call(trial, "patrol", 0)`.

        Raises:
            NotReached: it was not answered; the reason names similar services if there are any.
        """
        calls = [call for call in trial.calls if call.service == service]
        if index >= len(calls) and trial.ended:
            raise self.not_reached(trial.ended, trial)
        if index >= len(calls):
            raise Unjudged(f"the trial {trial.name} has no call {index} of {service}")
        if calls[index].response is None:
            raise self._unanswered(calls[index].problem, trial, service)
        return calls[index]

    def _unanswered(self, problem: Reason | None, trial: Trial, name: str) -> NotReached:
        """Return why a service or an action gave no answer: another definition, another name, or what the node did."""
        problem = problem or Reason(Kind.NO_ANSWER, name)
        build, kind = self.evidence.build, self.course.offered.get(name, "")
        if build.type_hashes.get(kind) not in (None, build.contract_hashes.get(kind)):
            why = say("{kind} differs from the contract, so nobody else can call it", kind=kind)
            differs = Reason(Kind.DEPENDS, said=why, requirements=self.judged_by("check_interfaces"))
            return NotReached(differs, words=f"{problem}{last_output(trial)}: {differs}")
        # A service that does not answer is there: nothing else is meant.
        if problem.kind in SILENT:
            return self.not_reached(problem, trial)
        instead = near_miss(trial.graph, name, self.course.offered)
        return NotReached(problem, words=f"{problem}{last_output(trial)}{instead}")

    def goal(self, trial: Trial, index: int = 0) -> Goal:
        """Return the trial's goal number `index`, which the node accepted: `judge.goal(trial)`.

        Raises:
            NotReached: there is no such action.
            Failed: the goal was rejected.
        """
        if index >= len(trial.goals) and trial.ended:
            raise self.not_reached(trial.ended, trial)
        if index >= len(trial.goals):
            raise Unjudged(f"the trial {trial.name} has no goal {index}")
        goal = trial.goals[index]
        if goal.problem:
            raise self._unanswered(goal.problem, trial, next(iter(self.course.nodes[trial.node].actions), ""))
        if not goal.accepted:
            seen = say("the goal ({goal.x:.2f}, {goal.y:.2f}) was rejected", goal=goal)
            raise Failed(seen, say("accept goals with finite numbers"))
        return goal

    @property
    def installer(self) -> str:
        """Return the file that says what is installed, setup.py or CMakeLists.txt: `f"see {judge.installer}"`."""
        quality = self.evidence.quality
        found = quality is not None and quality.manifest.found and not quality.manifest.has_cmake
        return "setup.py" if found else "CMakeLists.txt"

    def quality(self) -> Quality:
        """Return the facts about the package's text: `judge.quality().paths`."""
        if self.evidence.quality is None:
            raise Unjudged("the package's text was not read")
        return self.evidence.quality

    def measured(self) -> Measured:
        """Return what of the package counts for its quality and its tests: `judge.measured().covers(path, line)`."""
        self.quality()
        return self._measured

    @cached_property
    def _measured(self) -> Measured:
        return measure(self.evidence, self.course)

    @property
    def _own_files(self) -> Mapping[str, frozenset[str]]:
        return self._measured.of_node if self._measured.by_notes else {}

    def student_tests(self) -> StudentTests:
        """Return the facts about the package's own tests, which need a build: `judge.student_tests().modules`."""
        self.require_build()
        if self.evidence.tests is None:
            raise Unjudged("the package's own tests were not run")
        return self.evidence.tests

    def expect(self, holds: bool, seen: str, try_: str, reason: Reason | None = None) -> None:
        """Fail the check unless `holds`; say what was seen, and what to try.

        `judge.expect(speed <= 0.3, f"drove at {speed:.2f} m/s", "read `max_speed`")`
        """
        if not holds:
            raise Failed(seen, try_, reason)

    def share(self, fraction: float, seen: str, try_: str) -> None:
        """Give a share of the points, 0 to 1, with feedback: `judge.share(0.5, "one of two came", "publish both")`.

        A requirement that would lose less than 0.1 points in all loses nothing, and shows what was seen.
        """
        self.fraction = min(1.0, max(0.0, fraction)) * self._weight
        self.seen, self.try_ = "\n".join(words for words in (seen, self._why) if words), try_

    def figure(self, name: str, value: float) -> None:
        """Record a measured value, by which the class page may rank: `judge.figure("time", 41.5)`.

        It costs nothing. The rubric's `league` says which figures rank, in which unit.
        """
        self.figures[name] = round(value, 3)

    def remark(self, seen: str, try_: str = "") -> None:
        """Say what was noticed and costs nothing: `judge.remark("1 of 30 scans was skipped")`."""
        self.seen = "\n".join(words for words in (self.seen, seen) if words)
        self.try_ = self.try_ or try_

    def weigh(self, weight: float, why: str) -> None:
        """Let all that the check gives count for `weight` of its points, 0 to 1: `judge.weigh(0.5, "of two nodes")`."""
        self._weight, self._why = weight, why
        self.share(1.0, "", "")
