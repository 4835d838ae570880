"""The verb `grader attack`: its arguments, its printing, its exit status."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from grader import KIT
from grader.contract.spec import PACKAGE


def add(verbs: Any) -> None:
    """Add the verb to the command line."""
    parser = verbs.add_parser(
        "attack",
        help="attack the grader on this machine, and say what stopped each attack",
        description="Grade the reference package with one attack after the other built in, and compare with the same\n"
        "package without: no attack may win points, reach the host or spoil a grading. Takes about half an hour.",
        epilog="Example:  grader attack --only fork_bomb calls_home\n"
        "Exit status: 0 all contained, 1 one was not, 2 wrong usage, 3 a fault of ours.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these attacks only")
    parser.add_argument("--list", action="store_true", help="name the attacks and run none")
    parser.add_argument("--reference", type=Path, help="the package to build attacks into (default: the reference)")
    parser.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    parser.set_defaults(run=main)


def main(options: argparse.Namespace) -> int:
    """Run the attacks and print how each came out as it ends."""
    from grader import build, pipeline
    from grader.errors import EXIT_USAGE, GraderError
    from grader.scoring import rubric
    from grader.selftest.attacks import attack_run, summary
    from grader.selftest.attacks.catalogue import ATTACKS

    unknown = [name for name in options.only or [] if name not in ATTACKS]
    if unknown:
        print(f"grader: there is no attack {', '.join(unknown)}; --list names them all.", file=sys.stderr)
        return EXIT_USAGE
    chosen = [ATTACKS[name] for name in options.only] if options.only else list(ATTACKS.values())
    width = max(len(each.name) for each in chosen)
    if options.list:
        for each in chosen:
            print(f"{each.name:<{width}}  {each.tries}")
        return 0
    reference = options.reference or KIT / "solution_pkg" / PACKAGE
    if not (reference / "package.xml").is_file():
        raise GraderError(f"There is no package in {reference}. Name the reference package with --reference.")
    settings = pipeline.Settings(rubric=rubric.load(rubric.RUBRIC), cache=options.cache or build.cache_folder())
    for line in _defences():
        print(line)
    carried = attack_run.run(
        chosen, reference, settings, done=lambda one: print(f"\n{summary.row(one, width)}", flush=True)
    )
    print(f"\n{summary.summary(carried)}")
    return 0 if all(each.contained for each in carried) else 1


def _defences() -> list[str]:
    """Return the defences that this host lacks, in the doctor's words."""
    from grader.host import doctor

    lacking = [diagnosis for diagnosis in doctor.examine_sandbox() if diagnosis.state is not doctor.State.OK]
    if not lacking:
        return ["All defences stand: walls, networks of their own, cgroups for memory and processes."]
    return ["This host lacks defences:", *(f"  {each.name}: {each.found}" for each in lacking)]
