"""The verb `grader self-test`: grade the package with and without each attack, and judge whether it was contained."""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from grader import building, pipeline, report
from grader.collect import needs_build
from grader.course import find, name_of
from grader.errors import GraderError, SubmissionError, UsageError
from grader.evidence import Flag
from grader.host import cgroup, doctor
from grader.host.namespaces import Confinement, confinement
from grader.intake.package_edits import Change, copy
from grader.report import console
from grader.scoring import rubric
from grader.scoring.grading import Grading
from grader.scoring.scorecard import Outcome
from grader.selftest.attacks import on_host, on_nodes
from grader.selftest.attacks.attack import Attack, fill_in
from grader.selftest.attacks.honeytokens import Honeytokens, planted

_WIDTH = 78


def add(verbs: Any) -> None:
    """Add the verb to the command line."""
    parser = verbs.add_parser(
        "self-test",
        help="attack the grader on this machine, and report what stopped each attack",
        description="Grade the reference package with one attack after the other built in, and compare with the same\n"
        "package without it: no attack may gain points, reach the host or spoil a grading. Takes up to half an hour.",
        epilog="Example:  grader self-test --only fork_bomb calls_home\n"
        "Exit status: 0 all contained, 1 one was not, 2 wrong usage, 3 an error of the kit or host.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="run only these attacks")
    parser.add_argument("--list", action="store_true", help="list the attacks and run none")
    parser.add_argument("--course", type=Path, metavar="DIR", help="the folder of the course (default: as for grade)")
    parser.add_argument(
        "--reference", type=Path, help="the package to build attacks into (default: the course's solution)"
    )
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: in the user's cache folder)")
    parser.set_defaults(run=main)


def main(options: argparse.Namespace) -> int:
    """Run the attacks and print the result of each as it ends."""
    if unknown := [name for name in options.only or () if name not in ATTACKS]:
        raise UsageError(f"unknown attack {', '.join(unknown)}; --list shows all names.")
    chosen = [ATTACKS[name] for name in options.only or ATTACKS]
    width = max(len(each.name) for each in chosen)
    if options.list:
        for each in chosen:
            print(f"{each.name:<{width}}  {each.tries}")
        return 0
    course = find(options.course)
    whole = rubric.load(course.rubric)
    reference = options.reference or course.solution
    if not (reference / "package.xml").is_file():
        raise GraderError(f"There is no package in {reference}. Name the reference package with --reference.")
    settings = pipeline.Settings(rubric=whole, cache=options.cache or building.cache_folder(), course=course)
    print("\n".join(_defences()))
    names = [each.name for each in chosen]
    results = run(
        [each.on(course, whole) for each in chosen],
        reference,
        settings,
        done=lambda one: print(f"\n{row(one, width)}", flush=True),
        begin=lambda one: print(f"[{names.index(one.name) + 1} of {len(names)}] {one.name}", file=sys.stderr),
    )
    print(f"\n{summary(results)}")
    return 0 if all(each.contained for each in results) else 1


def _defences() -> list[str]:
    """Return which defences this host lacks, in the doctor's words."""
    lacking = [diagnosis for diagnosis in doctor.examine_sandbox() if diagnosis.state is not doctor.State.OK]
    if not lacking:
        return ["All defences work: the sandbox, its networks, cgroups for memory and processes."]
    return ["This host lacks defences:", *(f"  {each.name}: {each.found}" for each in lacking)]


def row(result: AttackResult, name_width: int) -> str:
    """Return an attack's line and, below it, what it tried and what stopped it."""
    attack = result.attack
    verdict = "not held" if result.not_held else "contained" if result.contained else "NOT CONTAINED"
    points = f"{_sum(result.points, attack.needs)} of {_sum(result.baseline, attack.needs)}"
    points = "refused" if result.refused else points
    kinds = ", ".join(dict.fromkeys(flag.kind for flag in result.flags)) or "-"
    head = f"{attack.name:<{name_width}}  {verdict:<14}  {points:<14}  flag: {kinds:<20}  {result.seconds:5.1f} s"
    lines = [head.rstrip(), *_wrapped("tried", attack.tries)]
    words = ("why", attack.not_without_namespaces) if result.not_held else ("stopped", attack.stopped)
    lines += _wrapped(*words)
    for problem in (*result.problems, *result.not_held):
        lines += _wrapped("PROBLEM" if result.problems else "seen", problem)
    return "\n".join(lines)


def summary(results: Sequence[AttackResult]) -> str:
    """Return the last line: how many attacks were contained."""
    bad = [each.attack.name for each in results if not each.contained]
    weak = [each.attack.name for each in results if each.not_held]
    others = f". Not held without namespaces: {', '.join(weak)}" if weak else ""
    if bad:
        return f"{len(bad)} of {len(results)} attacks were NOT contained: {', '.join(bad)}{others}."
    return f"{len(results) - len(weak)} of {len(results)} attacks were contained{others}."


def _sum(points: dict[str, float], needs: Iterable[str]) -> str:
    return f"{sum(points.get(name, 0.0) for name in needs):.4g}"


def _wrapped(word: str, text: str) -> list[str]:
    first, *more = textwrap.wrap(text, _WIDTH) or [""]
    return [f"    {word:<9} {first}", *(f"{'':14}{line}" for line in more)]


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
    baselines: dict[tuple[Change, ...], Points] = {}
    results = []
    for each in attacks:
        begin(each)
        started = time.monotonic()
        if each.weak not in baselines:
            needs = {name for other in attacks if other.weak == each.weak for name in other.needs}
            baselines[each.weak] = _baseline(each.weak, needs, reference, settings)
        before = {name: points for name, points in baselines[each.weak].items() if name in each.needs}
        result = _run_one(each, reference, settings, before)
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


def _baseline(weak: tuple[Change, ...], needs: set[str], reference: Path, settings: pipeline.Settings) -> Points:
    """Return the points of the package with a weakness but no attack."""
    with tempfile.TemporaryDirectory(prefix="attack-") as folder:
        package = copy(reference, Path(folder))
        for change in weak:
            change(package)
        patient = replace(settings, requirements=tuple(sorted(needs)), build_seconds=_BUILD_SECONDS)
        grading = pipeline.grade(package, Path(folder) / "out", patient)
    if needs_build(patient) and not grading.evidence.build.ok:
        raise GraderError(f"The package without an attack does not build here: {grading.evidence.build.log_tail}")
    if unjudged := [s.requirement.id for s in grading.unjudged]:
        raise GraderError(f"The grader could not judge {', '.join(unjudged)} of the package without an attack.")
    return _points(grading)


def _run_one(each: Attack, reference: Path, settings: pipeline.Settings, before: Points) -> AttackResult:
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
