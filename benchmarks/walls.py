"""Measure what the walls cost: the same commands walled in and without, in pairs, and what a grading makes of them.

Run it:  python benchmarks/walls.py [--rounds 20] [--only F1 F14]

What is compared is CPU time, ours and our children's: a busy machine makes a command wait, and charges it nothing for
that. Each round runs both, one right after the other and in turns first, and what counts is the median of the rounds'
differences: whatever slows the machine down for a while slows both.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader import build, pipeline, sandbox
from grader.host import procfs, ros_env
from grader.scoring import rubric

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "solution_pkg" / "ros2_robot_controller"
# Starting, importing what a node imports, computing: what trials, tests and builds are made of.
_SUBREAPER = 36  # prctl: orphans of our children become our children, and their time ours
START, WORK = "start and end", "compute"
COMMANDS = {
    START: ["true"],
    "start Python": ["python3", "-I", "-c", "pass"],
    "import rclpy": ["python3", "-c", "import rclpy"],
    WORK: ["python3", "-I", "-c", "for number in range(5_000_000): number * number"],
}


@dataclass(frozen=True)
class Cost:
    """CPU milliseconds of one command without a wall, and how many more it takes behind one: quartiles and median."""

    bare_ms: float
    low_ms: float
    more_ms: float
    high_ms: float


def main() -> int:
    """Print, as Markdown, a table of what each command costs and what share of a grading that is."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20, help="how often each pair is run (default 20, at least 2)")
    parser.add_argument("--only", nargs="*", default=[], metavar="REQUIREMENT", help="grade just these (default all)")
    options = parser.parse_args()
    sandbox.require()  # starts what goes on beside all walls
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    print(f"| CPU ms, {options.rounds} pairs | without | more in a wall | half of the pairs |")
    print("|---|--:|--:|--:|")
    costs = {}
    for name, command in COMMANDS.items():
        cost = costs[name] = compare(command, max(2, options.rounds))
        print(f"| {name} | {cost.bare_ms:.1f} | {cost.more_ms:.1f} | {cost.low_ms:.1f} to {cost.high_ms:.1f} |")
    walls, seconds = grading(options.only)
    each_ms = max(cost.more_ms for name, cost in costs.items() if name != WORK)
    # What is left of a long computation's extra cost when the wall itself is taken off.
    dearer = max(0.0, costs[WORK].more_ms - costs["start Python"].more_ms) / costs[WORK].bare_ms
    spent = walls * each_ms / 1000
    what = " ".join(options.only) or "everything"
    print(f"\nA grading of the reference on {what} builds {walls} walls and takes {seconds:.0f} s of CPU time.")
    print(f"At {each_ms:.0f} ms each they cost {spent:.1f} s, {100 * spent / seconds:.1f} % of it.")
    print(f"What runs for long in a wall takes {100 * dearer:.1f} % more there.")
    return 0


def compare(command: Sequence[str], rounds: int) -> Cost:
    """Return what `command` costs without a wall and how much more in one, from `rounds` pairs."""
    environment = ros_env.environment(home=sandbox.HOME)
    wall = sandbox.Sandbox(environment=environment)
    bare, more = [], []
    with tempfile.TemporaryDirectory() as home:
        outside = {**environment, "HOME": home, "ROS_LOG_DIR": home}

        def without() -> object:
            return subprocess.run(command, env=outside, check=True)

        def walled() -> object:
            return sandbox.run(command, wall)

        for number in range(rounds):
            first, second = (without, walled) if number % 2 else (walled, without)
            one, other = cpu_seconds(first), cpu_seconds(second)
            plain, inside = (one, other) if number % 2 else (other, one)
            bare.append(1000 * plain)
            more.append(1000 * (inside - plain))
    low, median, high = statistics.quantiles(more, n=4)
    return Cost(statistics.median(bare), low, median, high)


def cpu_seconds(run: Callable[[], object]) -> float:
    """Return the CPU time that `run` takes in this process and in the children that it waits for."""
    others = _children()
    ours, theirs = _used(resource.RUSAGE_SELF), _used(resource.RUSAGE_CHILDREN)
    run()
    ours = _used(resource.RUSAGE_SELF) - ours  # without the search for orphans
    deadline = time.monotonic() + 5.0
    while (orphans := _children() - others) and time.monotonic() < deadline:
        for orphan in orphans:  # of bubblewrap's, which does not wait for the first process in its wall
            with contextlib.suppress(ChildProcessError):
                os.waitpid(orphan, os.WNOHANG)
    return ours + _used(resource.RUSAGE_CHILDREN) - theirs


def _children() -> set[int]:
    return set(procfs.children(os.getpid()))


def _used(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def grading(only: Sequence[str]) -> tuple[int, float]:
    """Grade the reference; return how many walls were built and the CPU seconds that it took.

    Trials are counted by what their evidence shows: each node, and each process beside it, has a wall of its own. The
    time of nodes that are stopped at the end of a trial is not in the sum, so the walls' share is rather less.
    """
    made = [0]
    plain = sandbox.Process.__init__

    def counted(self: sandbox.Process, *arguments: object) -> None:
        made[0] += 1
        plain(self, *arguments)  # type: ignore[arg-type]

    sandbox.Process.__init__ = counted  # type: ignore[method-assign]
    settings = pipeline.Settings(rubric=rubric.load(ROOT / "rubric.yaml"), cache=build.cache_folder())
    found = []
    with tempfile.TemporaryDirectory() as out:
        chosen = replace(settings, requirements=tuple(only))
        seconds = cpu_seconds(lambda: found.append(pipeline.grade(REFERENCE, Path(out), chosen)))
    trials = found[0].evidence.trials.values()
    networks = 3 if trials else 0  # the hosts' own, one for each worker
    return made[0] + sum(1 + len(trial.others) for trial in trials) + networks, seconds


if __name__ == "__main__":
    sys.exit(main())
