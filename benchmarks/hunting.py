"""Measure how many cases a second a hunt runs on the reference, two at a time and one at a time, in turn.

    python -m benchmarks.hunting [--cases N] [--repeat N] [--quick] [REQUIREMENT ...]

The cases are those that `grader hunt` tries first. Each begins with a node of its own and ends with it; how long a case
is in simulated time is printed beside. Without a requirement it is F4.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

from grader import building
from grader.course import kits_own
from grader.hunt.search import AT_ONCE, listed
from grader.hunting import runner
from grader.scoring import rubric
from grader.settings import Settings
from grader.trials.promises import hunts

REFERENCE = Path(__file__).parents[1] / "solution_pkg" / "ros2_robot_controller"


def main() -> None:
    """Print a table of cases a second."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("requirements", nargs="*", default=["F4"])
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="few cases, once")
    options = parser.parse_args()
    course = kits_own()
    making, _ = hunts(course).of(options.requirements)
    cases = listed(making, 6 if options.quick else options.cases, 0)
    settings = Settings(
        rubric=rubric.load(course.rubric), course=course, cache=building.cache_folder(), requirements=making.serves
    )
    measured: dict[int, list[float]] = {AT_ONCE: [], 1: []}
    simulated = 0.0
    for _ in range(1 if options.quick else options.repeat):
        for at_once, found in measured.items():
            with runner(REFERENCE, settings, at_once) as running:
                list(running.run(cases[:1]))  # what is started once is not measured
                began = time.monotonic()
                trials = [trial for _, trial in running.run(cases[1:])]
                found.append((len(cases) - 1) / (time.monotonic() - began))
                simulated = statistics.mean(trial.samples[-1].t for trial in trials)
    print("| at once | cases a second | simulated s of a case |\n|--:|--:|--:|")
    for at_once, found in measured.items():
        print(f"| {at_once} | {statistics.median(found):.2f} | {simulated:.1f} |")


if __name__ == "__main__":
    main()
