"""The verb `grader self-test`: its arguments, its output, its exit status."""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.course import find
from grader.errors import GraderError, UsageError

if TYPE_CHECKING:
    from grader.selftest.attacks.attack_run import AttackResult

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
    from grader import building, pipeline
    from grader.scoring import rubric
    from grader.selftest.attacks import attack_run
    from grader.selftest.attacks.attack_run import ATTACKS

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
    results = attack_run.run(
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
    from grader.host import doctor

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
