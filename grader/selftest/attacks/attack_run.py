"""Run attacks on this machine: grade the package with and without each, and judge whether it was contained."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader import pipeline, report
from grader.authoring.package_edits import Change, copy
from grader.collect import needs_build
from grader.course import find, name_of
from grader.errors import GraderError, SubmissionError
from grader.evidence import Flag
from grader.host import cgroup
from grader.host.namespaces import Confinement, confinement
from grader.report import console
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import Outcome
from grader.selftest.attacks import on_host, on_nodes
from grader.selftest.attacks.attack import Attack, fill_in
from grader.selftest.attacks.honeytokens import Honeytokens, planted

ATTACKS: dict[str, Attack] = {each.name: each for each in (*on_host.ATTACKS, *on_nodes.ATTACKS)}
"""All attacks whose success depends on the host, by name; the others are run by the kit's own tests."""
Points = dict[str, float]

# An attack on the build has a CMakeLists.txt of its own, so everything is compiled: minutes on a busy machine.
_BUILD_SECONDS = 900.0


@dataclass(frozen=True)
class AttackResult:
    """The result of an attack: points without it (`baseline`) and with it, flags, and what should not have happened.

    `not_held` is what did happen, where the kit says that this machine's sandbox does not hold the attack.
    """

    attack: Attack
    baseline: Points = field(default_factory=dict)
    points: Points = field(default_factory=dict)
    flags: tuple[Flag, ...] = ()
    problems: tuple[str, ...] = ()
    not_held: tuple[str, ...] = ()
    seconds: float = 0.0
    refused: str = ""

    @property
    def contained(self) -> bool:
        """Return whether there were no problems."""
        return not self.problems


def run(
    attacks: Iterable[Attack],
    reference: Path,
    settings: pipeline.Settings,
    done: Callable[[AttackResult], None] = lambda _result: None,
    begin: Callable[[Attack], None] = lambda _attack: None,
) -> list[AttackResult]:
    """Run the attacks one after the other and return their results; call `begin` and `done` with each.

    Raises:
        GraderError: the package without any attack cannot be graded.
    """
    attacks = list(attacks)
    baseline = _Baseline(reference, settings, attacks)
    results = []
    for each in attacks:
        begin(each)
        started = time.monotonic()
        result = _run_one(each, reference, settings, baseline)
        if each.not_without_namespaces and confinement() is not Confinement.NAMESPACES:
            result = _as_known(result)
        results.append(replace(result, seconds=time.monotonic() - started))
        done(results[-1])
    return results


def _as_known(result: AttackResult) -> AttackResult:
    """Return the result of an attack that this machine's sandbox does not hold: a problem only if it was contained."""
    if result.problems:
        return replace(result, problems=(), not_held=result.problems)
    return replace(
        result, problems=("it was contained, and the list says that no sandbox without namespaces holds it",)
    )


class _Baseline:
    """The points of packages with a weakness but no attack, graded once for all requirements that attacks need."""

    def __init__(self, reference: Path, settings: pipeline.Settings, attacks: list[Attack]) -> None:
        self._reference, self._settings = reference, settings
        self._needs: dict[tuple[Change, ...], set[str]] = {}
        for each in attacks:
            self._needs.setdefault(each.weak, set()).update(each.needs)
        self._points: dict[tuple[Change, ...], Points] = {}

    def points(self, weak: tuple[Change, ...]) -> Points:
        if weak not in self._points:
            with tempfile.TemporaryDirectory(prefix="attack-") as folder:
                package = copy(self._reference, Path(folder))
                for change in weak:
                    change(package)
                needs = tuple(sorted(self._needs[weak]))
                patient = replace(self._settings, requirements=needs, build_seconds=_BUILD_SECONDS)
                grading = pipeline.grade(package, Path(folder) / "out", patient)
            if needs_build(patient) and not grading.evidence.build.ok:
                log = grading.evidence.build.log_tail
                raise GraderError(f"The package without an attack does not build here: {log}")
            if unjudged := [s.requirement.id for s in grading.unjudged]:
                raise GraderError(f"The grader could not judge {', '.join(unjudged)} of the package without an attack.")
            self._points[weak] = _points(grading)
        return self._points[weak]


def _run_one(each: Attack, reference: Path, settings: pipeline.Settings, baseline: _Baseline) -> AttackResult:
    before = {name: points for name, points in baseline.points(each.weak).items() if name in each.needs}
    with tempfile.TemporaryDirectory(prefix="attack-") as folder, planted() as tokens:
        submission = _prepare(each, reference, Path(folder), tokens.placeholders)
        chosen = replace(settings, requirements=each.needs, build_seconds=each.build_seconds or _BUILD_SECONDS)
        try:
            with contextlib.chdir(submission if each.from_inside else Path()):
                if each.from_inside and not name_of(settings.course):
                    chosen = replace(chosen, course=(course := find()), rubric=rubric.load(course.rubric))
                grading = pipeline.grade(submission, tokens.results, chosen)
        except SubmissionError as error:
            problems = [] if each.refused and each.refused in str(error) else [f"it was refused: {error}"]
            return AttackResult(each, before, problems=(*problems, *tokens.damage()), refused=str(error))
        except GraderError as error:
            return AttackResult(each, before, problems=(f"the grader gave up: {error}", *tokens.damage()))
        except Exception as error:  # finding these is what attacks are for
            return AttackResult(each, before, problems=(f"{type(error).__name__}: {error}", *tokens.damage()))
        problems = [*_point_problems(each, grading, before), *_report_problems(each, grading, tokens), *tokens.damage()]
        problems += tokens.marks(settings.cache, submission / "package.xml")
        return AttackResult(each, before, _points(grading), tuple(grading.evidence.flags), tuple(problems))


def _prepare(each: Attack, reference: Path, folder: Path, placeholders: dict[str, str]) -> Path:
    package = copy(reference, folder)
    for change in (*each.weak, *each.changes):
        change(package)
    fill_in(package, placeholders)
    return each.pack(package, folder) if each.pack else package


def _point_problems(each: Attack, grading: Grading, before: Points) -> list[str]:
    problems = []
    if each.refused:
        problems.append("it was graded and should have been refused")
    for score in grading.scorecard.requirements:
        name = score.requirement.id
        if name not in each.needs:
            continue
        if score.outcome is Outcome.ERROR:
            seen = next((result.seen for result in score.results if result.outcome is Outcome.ERROR), "")
            problems.append(f"{name} could not be judged: {seen[:300]}")
        if score.points > before[name] + each.gains.get(name, 0.0) + 1e-6:
            problems.append(f"{name} rose from {before[name]:g} to {score.points:g} points")
        if score.points < before[name] - 1e-6 and name not in each.costs:
            problems.append(f"{name} fell from {before[name]:g} to {score.points:g} points")
    return problems


def _report_problems(each: Attack, grading: Grading, tokens: Honeytokens) -> list[str]:
    problems = []
    unseen = each.flag_needs_cgroup and cgroup.find_hierarchy() is None
    if each.flag and not unseen and not any(each.flag in flag.kind for flag in grading.evidence.flags):
        problems.append(f"no integrity flag of the kind {each.flag!r}")
    report.write(grading, tokens.results, pictures=False)
    if leaks := tokens.leaks(tokens.results):
        problems.append(f"the secret is in {', '.join(leaks)}")
    texts = [path.read_text(errors="replace") for path in (tokens.results / "evidence").rglob("*.json")]
    if each.proof and not any(each.proof in text or each.proof in text.replace("\\", "") for text in texts):
        problems.append(f"it was not carried out: {each.proof!r} is not in the evidence")
    page = (tokens.results / "report.html").read_text()
    if "<script>alert" in page or "<img src=x" in page:
        problems.append("report.html contains markup of the submission")
    shown = console.render(grading)
    if "\x1b" in shown or "\u202e" in shown:
        problems.append("escape sequences of the submission reach the console")
    if any(line.strip().startswith(("::", "##[")) for line in shown.splitlines()):
        problems.append("a line of the console starts like a CI command")
    return problems


def _points(grading: Grading) -> Points:
    return {score.requirement.id: score.points for score in grading.scorecard.requirements}
