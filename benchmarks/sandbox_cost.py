"""Measure the cost of the sandbox: the same commands with and without it, in pairs, and its share of a grading.

    python -m benchmarks.sandbox_cost [--rounds 20] [--only F1 F14] [--quick]

It compares CPU time, this process's and its children's, because waiting on a busy machine costs no CPU time. Each round
runs a command both ways, one right after the other in alternating order. The result is the median of the rounds'
differences: anything that slows down the machine for a while slows down both.
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

from grader import building, pipeline, sandbox
from grader.host import procfs, ros_env
from grader.scoring import rubric
from grader.settings import Settings

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "solution_pkg" / "ros2_robot_controller"
_SUBREAPER = 36  # prctl: orphans of our children become our children, and their CPU time ours
# Starting, importing what a node imports, computing: trials, tests and builds consist of these.
START, WORK = "start and end", "compute"
COMMANDS = {
    START: ["true"],
    "start Python": ["python3", "-I", "-c", "pass"],
    "import rclpy": ["python3", "-c", "import rclpy"],
    WORK: ["python3", "-I", "-c", "for number in range(5_000_000): number * number"],
}


@dataclass(frozen=True)
class Cost:
    """CPU milliseconds of a command without the sandbox, and how many more it takes in it: quartiles and median."""

    bare_ms: float
    low_ms: float
    more_ms: float
    high_ms: float


def main() -> int:
    """Print a Markdown table of the cost for each command, and the sandbox's share of a grading."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20, help="number of pairs (default %(default)s, at least 2)")
    parser.add_argument("--only", nargs="*", default=[], metavar="REQUIREMENT", help="grade only these (default all)")
    parser.add_argument("--quick", action="store_true", help="show in seconds that everything runs; a poor measurement")
    options = parser.parse_args()
    if options.quick:
        options.rounds, options.only = 2, ["F14"]
    sandbox.require()  # starts what all sandboxes share
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    print(f"| CPU ms, {options.rounds} pairs | without | more in the sandbox | half of the pairs |")
    print("|---|--:|--:|--:|")
    costs = {}
    for name, command in COMMANDS.items():
        cost = costs[name] = compare(command, max(2, options.rounds))
        print(f"| {name} | {cost.bare_ms:.1f} | {cost.more_ms:.1f} | {cost.low_ms:.1f} to {cost.high_ms:.1f} |")
    sandboxes, seconds = grading(options.only)
    each_ms = max(cost.more_ms for name, cost in costs.items() if name != WORK)
    # The extra cost of a long computation, without the cost of setting up the sandbox.
    dearer = max(0.0, costs[WORK].more_ms - costs["start Python"].more_ms) / costs[WORK].bare_ms
    spent = sandboxes * each_ms / 1000
    what = " ".join(options.only) or "everything"
    print(f"\nA grading of the reference on {what} starts {sandboxes} sandboxes and takes {seconds:.0f} s of CPU time.")
    print(f"At {each_ms:.0f} ms each they take {spent:.1f} s, {100 * spent / seconds:.1f} % of it.")
    print(f"A long computation takes {100 * dearer:.1f} % more CPU time in the sandbox.")
    return 0


def compare(command: Sequence[str], rounds: int) -> Cost:
    """Return the CPU time of `command` without the sandbox and how much more it takes in it, from `rounds` pairs."""
    environment = ros_env.environment(home=sandbox.HOME)
    box = sandbox.Sandbox(environment=environment)
    bare, more = [], []
    with tempfile.TemporaryDirectory() as home:
        outside = {**environment, "HOME": home, "ROS_LOG_DIR": home}

        def without() -> object:
            return subprocess.run(command, env=outside, check=True)

        def within() -> object:
            return sandbox.run(command, box)

        for number in range(rounds):
            first, second = (without, within) if number % 2 else (within, without)
            one, other = cpu_seconds(first), cpu_seconds(second)
            plain, inside = (one, other) if number % 2 else (other, one)
            bare.append(1000 * plain)
            more.append(1000 * (inside - plain))
    low, median, high = statistics.quantiles(more, n=4)
    return Cost(statistics.median(bare), low, median, high)


def cpu_seconds(run: Callable[[], object]) -> float:
    """Return the CPU time of `run` in this process and in the children that it waits for."""
    others = _children()
    ours, theirs = _used(resource.RUSAGE_SELF), _used(resource.RUSAGE_CHILDREN)
    run()
    ours = _used(resource.RUSAGE_SELF) - ours  # without the search for orphans
    deadline = time.monotonic() + 5.0
    while (orphans := _children() - others) and time.monotonic() < deadline:
        for orphan in orphans:  # of bubblewrap, which does not wait for the first process in its sandbox
            with contextlib.suppress(ChildProcessError):
                os.waitpid(orphan, os.WNOHANG)
    return ours + _used(resource.RUSAGE_CHILDREN) - theirs


def _children() -> set[int]:
    return set(procfs.children(os.getpid()))


def _used(who: int) -> float:
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def grading(only: Sequence[str]) -> tuple[int, float]:
    """Grade the reference; return the number of sandboxes and the CPU seconds.

    The sandboxes of trials are counted from the evidence: each node, and each process beside it, has its own. The CPU
    time of nodes that are stopped at the end of a trial is not included, so the true share is a little smaller.
    """
    made = [0]
    plain = sandbox.Process.__init__

    def counted(self: sandbox.Process, *arguments: object) -> None:
        made[0] += 1
        plain(self, *arguments)  # type: ignore[arg-type]

    sandbox.Process.__init__ = counted  # type: ignore[method-assign]
    settings = Settings(rubric=rubric.load(ROOT / "rubric.yaml"), cache=building.cache_folder())
    found = []
    with tempfile.TemporaryDirectory() as out:
        chosen = replace(settings, requirements=tuple(only))
        seconds = cpu_seconds(lambda: found.append(pipeline.grade(REFERENCE, Path(out), chosen)))
    trials = found[0].evidence.trials.values()
    networks = 3 if trials else 0  # one for each worker's own network
    return made[0] + sum(1 + len(trial.others) for trial in trials) + networks, seconds


if __name__ == "__main__":
    sys.exit(main())
