"""The `grader` command: verbs, printing, exit codes. Everything else is done elsewhere."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from grader import KIT
from grader.errors import EXIT_GRADED, EXIT_NOT_GRADED, EXIT_OUR_FAULT, EXIT_USAGE, GraderError, SubmissionError
from grader.host import namespaces, shortage
from grader.sanitize import printable
from grader.settings import MUTATION_BUDGET_S

if TYPE_CHECKING:
    from grader.scoring.rubric import Rubric


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb and return the exit status: 0 graded, 1 could not be graded, 2 wrong usage, 3 our fault."""
    options = _parser().parse_args(arguments)
    try:
        return int(options.run(options))
    except SubmissionError as error:
        return _fail(error, EXIT_NOT_GRADED, options.debug)
    except GraderError as error:
        return _fail(error, EXIT_OUR_FAULT, options.debug)
    except KeyboardInterrupt:
        print("grader: interrupted; nothing was written.", file=sys.stderr)
        return 130
    except Exception as error:
        if options.debug:
            raise
        if said := shortage.explain(error):
            print(f"grader: {said}", file=sys.stderr)
            return EXIT_OUR_FAULT
        words = f"grader: a fault of the kit: {type(error).__name__}: {error}. No points are lost by it. "
        print(words + "Run again with --debug and send the traceback to the kit's maintainers.", file=sys.stderr)
        return EXIT_OUR_FAULT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="grader",
        description="Grade a ROS 2 package: build it, wall it in, drive it through trials, score what was seen.",
        epilog="Example:  grader grade solution_pkg/ros2_robot_controller --out out/reference",
    )
    parser.add_argument("--debug", action="store_true", help="show the traceback of an error")
    verbs = parser.add_subparsers(title="verbs", required=True, metavar="VERB")

    grade = verbs.add_parser(
        "grade",
        help="grade a submission",
        description="Grade a submission (a folder or an archive) and write report.json, report.html and evidence/.",
        epilog="Example:  grader grade team07.zip --out out/team07\n"
        "Exit status: 0 graded whatever the points, 1 could not be graded, 2 wrong usage, 3 a fault of ours.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    grade.add_argument("submission", type=Path, help="the package's folder, or an archive of it")
    grade.add_argument("--out", type=Path, required=True, help="the folder for the reports and the evidence")
    grade.add_argument("--rubric", type=Path, help="another rubric than the kit's own")
    grade.add_argument("--seed", type=int, default=0, help="decides speeds, places and noise of the trials (default 0)")
    grade.add_argument("--build-timeout", type=_seconds, default=300.0, metavar="S", help="for colcon (default 300 s)")
    grade.add_argument(
        "--mutation-budget",
        type=_seconds,
        default=MUTATION_BUDGET_S,
        metavar="S",
        help="for faults put into the package, to see whether its tests notice (default 20 s of a quiet machine)",
    )
    grade.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    grade.add_argument(
        "--unsafe-no-sandbox",
        action="store_true",
        help="grade with hardly any wall around the submission's code; every report says so",
    )
    grade.set_defaults(run=_grade)

    check = verbs.add_parser(
        "check",
        help="check single requirements of a package",
        description="Run just what the named requirements need, and say what was seen, expected, and what to try.",
        epilog="Example:  grader check F4 F5 --package ws/src/ros2_robot_controller",
    )
    check.add_argument("requirements", nargs="+", metavar="REQUIREMENT", help="such as F4")
    check.add_argument("--package", type=Path, default=Path(), help="the package's folder (default: this one)")
    check.add_argument("--seed", type=int, default=0, help="decides speeds, places and noise of the trials (default 0)")
    check.add_argument("--cache", type=Path, help="the folder for builds (default: the user's cache folder)")
    check.set_defaults(run=_check)

    submit = verbs.add_parser(
        "submit",
        help="pack a package for handing in, and say what the grader will see",
        description="Pack the package as one zip, run the public checks on it, and say what the grader will see.",
        epilog="Example:  grader submit --package ws/src/ros2_robot_controller --out team07.zip",
    )
    submit.add_argument("--package", type=Path, help="the package's folder (default: this one, or the workspace's)")
    submit.add_argument("--out", type=Path, help="the zip (default: in the workspace, above src)")
    submit.add_argument("--no-check", action="store_true", help="pack and describe only; checking takes some minutes")
    submit.set_defaults(run=_submit)

    if (KIT / "grader" / "authoring").exists():  # a released kit has none to release
        release = verbs.add_parser(
            "release",
            help="write the kit for students",
            description="Write what students get as one zip: notebooks, simulator, grader with the public checks, "
            "rubric and handout; not the reference package.",
            epilog="Example:  grader release --out kit.zip",
        )
        release.add_argument("--out", type=Path, required=True, help="the zip")
        release.add_argument(
            "--without-stages", action="store_true", help="leave out what `start_at` lays out: the solutions, packed"
        )
        release.set_defaults(run=_release)

    handout = verbs.add_parser("handout", help="write what students are asked to do, from the rubric, as Markdown")
    handout.add_argument("--out", type=Path, help="the file (default: standard output)")
    handout.add_argument("--rubric", type=Path, help="another rubric than the kit's own")
    handout.set_defaults(run=_handout)

    doctor = verbs.add_parser("doctor", help="say what this host has and lacks, and how to mend it")
    doctor.set_defaults(run=_doctor)

    if (KIT / "grader" / "selftest").exists():  # not in the students' kit
        from grader.selftest import flakiness
        from grader.selftest.attacks import command as attacks

        attacks.add(verbs)
        flakiness.add(verbs)
    return parser


def _seconds(text: str) -> float:
    value = float(text)
    if not 1 <= value <= 3600:
        raise argparse.ArgumentTypeError("choose between 1 and 3600 seconds")
    return value


def _grade(options: argparse.Namespace) -> int:
    # Imported here: `grader --help` and `grader doctor` answer at once, and on hosts that lack half of this.
    from grader import build, pipeline, report
    from grader.report import console
    from grader.scoring import rubric

    if options.unsafe_no_sandbox:
        os.environ[namespaces.UNSAFE_VARIABLE] = "1"
    progress = _Progress()
    settings = pipeline.Settings(
        rubric=rubric.load(options.rubric or rubric.RUBRIC),
        cache=options.cache or build.cache_folder(),
        seed=options.seed,
        build_seconds=options.build_timeout,
        mutation_budget_s=options.mutation_budget,
        progress=progress.say,
    )
    grading = pipeline.grade(options.submission, options.out, settings, write=report.write)
    progress.done()
    colour = console.wants_colour(sys.stdout, os.environ)
    print(console.render(grading, colour=colour, encoding=sys.stdout.encoding or "utf-8"))
    print(f"Report: {options.out / report.PAGE}")
    return EXIT_GRADED


def _check(options: argparse.Namespace) -> int:
    from grader import build, pipeline
    from grader.report import console
    from grader.scoring import rubric

    whole = rubric.load(rubric.RUBRIC)
    known = {requirement.id for requirement in whole.requirements}
    unknown = [name for name in options.requirements if name not in known]
    if unknown:
        print(f"grader: there is no requirement {', '.join(unknown)}; there are {_listed(whole)}.", file=sys.stderr)
        return EXIT_USAGE
    progress = _Progress()
    settings = pipeline.Settings(
        rubric=whole,
        cache=options.cache or build.cache_folder(),
        seed=options.seed,
        requirements=tuple(options.requirements),
        progress=progress.say,
    )
    with tempfile.TemporaryDirectory(prefix="check-") as scratch:
        grading = pipeline.grade(options.package.resolve(), Path(scratch), settings)
    progress.done()
    colour = console.wants_colour(sys.stdout, os.environ)
    print(console.render_checks(grading, colour=colour, encoding=sys.stdout.encoding or "utf-8"))
    return EXIT_GRADED


def _submit(options: argparse.Namespace) -> int:
    from grader.notebook import packing

    progress = _Progress()
    found = packing.submit(options.package, options.out, check=not options.no_check, progress=progress.say)
    progress.done()
    print(found)
    print(f"Hand in: {_shown(found.archive)}")
    return EXIT_GRADED


def _release(options: argparse.Namespace) -> int:
    from grader.authoring.release import release

    written = release(options.out, stages=not options.without_stages)
    print(f"{len(written.files)} files, {written.bytes / 1e6:.1f} MB; {written.words}")
    print(f"Kit: {options.out}")
    return EXIT_GRADED


def _shown(path: Path) -> str:
    """Return a path as short as it can be said from here."""
    near = os.path.relpath(path)
    return near if near.count("..") <= 3 else str(path)


def _handout(options: argparse.Namespace) -> int:
    from grader.scoring import handout, rubric

    text = handout.render(rubric.load(options.rubric or rubric.RUBRIC))
    if options.out is None:
        print(text, end="")
    else:
        options.out.write_text(text)
        print(f"Handout: {options.out}")
    return EXIT_GRADED


def _doctor(_options: argparse.Namespace) -> int:
    from grader.host import doctor

    findings = doctor.examine()
    print(doctor.render(findings))
    return doctor.exit_status(findings)


def _listed(whole: Rubric) -> str:
    """Return "F1 to F14, Q1 to Q6, ..." for a rubric's requirements."""
    ends = [(c.requirements[0].id, c.requirements[-1].id) for c in whole.criteria]
    return ", ".join(f"{first} to {last}" for first, last in ends)


class _Progress:
    """Says on standard error what is being done: on a terminal in one line, in a log only what is new."""

    def __init__(self) -> None:
        self._started = time.monotonic()
        self._terminal = sys.stderr.isatty()

    def say(self, what: str) -> None:
        line = f"[{time.monotonic() - self._started:5.1f} s] {printable(what, most=400)}"
        if self._terminal:
            print(f"\r\x1b[K{line[:110]}", end="", file=sys.stderr, flush=True)
        else:
            print(line, file=sys.stderr, flush=True)

    def done(self) -> None:
        if self._terminal:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def _fail(error: Exception, status: int, debug: bool) -> int:
    if debug:
        raise error
    print(f"grader: {error}", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
