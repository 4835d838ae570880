"""Run one check in this process, as pytest's run over the evidence does, but in milliseconds."""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from grader.checks.judge import Failed, Judge, NotReached
from grader.checks.pytest_plugin import concluded
from grader.course import Course
from grader.evidence import Build, Evidence, Intake, Manifest, Quality, Reason, SourceFile, Trial
from grader.scoring.rubric import RUBRIC, load
from grader.scoring.scorecard import CheckResult, Outcome
from helpers.course import COURSE

Check = Callable[[Judge], None]


@dataclass(frozen=True)
class Judged:
    """What a check says: the share of its points, what it saw, what to try, and whether or why it could not judge."""

    share: float
    seen: str
    try_: str = ""
    reached: bool = True
    reason: Reason | None = None


def evidence_with(**facts: Any) -> Evidence:
    """Return the evidence of a package that was built, with these facts (fields of Evidence) and no others."""
    built = Build(ok=True, cached=True, wall_seconds=0.0, exit_code=0, timed_out=False, log_tail="")
    return Evidence(Intake("team07.zip", "", "ros2_robot_controller", "."), **{"build": built, **facts})


def trial(name: str, node: str = "robot_controller", **facts: Any) -> Trial:
    """Return a trial that ran to its end, with these facts (fields of Trial)."""
    usual = {"world": "lone_post", "seed": 0, "ready": True, "pace": "lockstep", "ended": None}
    return Trial(name=name, node=node, **{**usual, **facts})


def with_trials(evidence: Evidence, *trials: Trial) -> Evidence:
    """Return evidence with these trials instead of those of the same names."""
    return replace(evidence, trials={**evidence.trials, **{one.name: one for one in trials}})


def find(check_id: str) -> Check:
    """Return the check "module::function" of the kit's own course, or of those that every course can use."""
    module, _, function = check_id.partition("::")
    for folder in ("grader.courses.robot_controller.checks", "grader.checks"):
        with contextlib.suppress(ModuleNotFoundError):
            check: Check | None = getattr(importlib.import_module(f"{folder}.{module}"), function, None)
            if check is not None:
                return check
    raise LookupError(check_id)


def _with_text(evidence: Evidence) -> Evidence:
    """Return evidence about tests alone with a text that has all files of which these know, as one that was read."""
    if evidence.quality is not None or not (evidence.tests or evidence.mutation):
        return evidence
    paths = {node.module for node in COURSE.nodes.values()}
    if evidence.tests is not None:
        paths |= {file.path for file in evidence.tests.coverage}
        paths |= {path for module in evidence.tests.modules for path in (*module.reached, *module.tested)}
    paths |= {mutant.path for mutant in (evidence.mutation.mutants if evidence.mutation else ())}
    files = [SourceFile(path, 10, functions=[[1, 1000]]) for path in sorted(paths)]
    return replace(evidence, quality=Quality(Manifest(found=True), files=files))


def ask(check: Check, evidence: Evidence, course: Course = COURSE) -> Judged:
    """Return what `check` says of the evidence. An error of the grader (Unjudged, RuntimeError) is raised."""
    judge, error = Judge(_with_text(evidence), course), None
    try:
        check(judge)
    except (Failed, NotReached) as raised:
        error = raised
    result = concluded(judge, CheckResult("check", Outcome.ERROR, 0.0), error)
    reached = result.outcome is not Outcome.NOT_REACHED
    return Judged(result.fraction, result.seen or result.because, result.try_, reached, result.reason)


def judged(evidence: Evidence) -> list[CheckResult]:
    """Return the results of the kit's checks that these facts suffice for, all of one trial; the others pass."""
    results = []
    for check in load(RUBRIC).checks:
        try:
            said = ask(find(check.id), evidence)
        except Exception:  # as in the grader: an error of the check itself costs nothing
            results.append(CheckResult(check.id, Outcome.PASSED, 1.0))
            continue
        how = Outcome.NOT_REACHED if not said.reached else Outcome.PARTIAL if said.share else Outcome.FAILED
        seen, because = (said.seen, "") if said.reached else ("", said.seen)
        trial = "idle_robot_controller"
        results.append(
            CheckResult(check.id, how, said.share, seen=seen, because=because, trial=trial, reason=said.reason)
        )
    return results
