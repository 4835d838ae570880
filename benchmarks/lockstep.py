"""Measure how many times faster than real time the grader's lockstep runs a node, by executor.

    python -m benchmarks.lockstep [--seconds N] [--repeat N] [--smallest] [--quick] [PACKAGE ...]

First it measures the smallest real node (smallest_node.py: scan, odom, a 10 Hz timer, cmd_vel) with a single-threaded
and with a multi-threaded executor: the cost of ROS and lockstep alone. Then each package's robot_controller drives in
an open field at 20 ticks per simulated second (10 Hz scans, 20 Hz odometry), in the sandbox as in a trial, and is then
sent to a distant goal. The default packages are the reference and the tests' variants. The table is Markdown, ready for
RESULTS.md. "start s" is the wall time from the process's start until the node is up and the clock runs. "per CPU s"
counts the CPU time of observer and node. They mostly take turns, so it is close to the result on an idle machine, even
if this one is busy.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from grader import building, evidence
from grader.course import kits_own
from grader.host import namespaces
from grader.trials import observers
from grader.trials.plan import TrialPlan
from grader.trials.request import TrialRequest

_ROOT = Path(__file__).parents[1]
REFERENCE = _ROOT / "solution_pkg" / "ros2_robot_controller"


@dataclass
class _Timing:
    """The result of a run: wall seconds until the node was up; simulated seconds per wall and per CPU second."""

    start_s: float = math.nan
    driving: float = math.nan
    driving_cpu: float = math.nan
    navigating: float = math.nan
    navigating_cpu: float = math.nan
    pace: str = ""
    unrepeatable: str = ""


SMALLEST = {"single": "smallest node, single-threaded", "multi": "smallest node, multi-threaded"}
AIMS = {"single": "aim 25", "multi": "aim 8"}


def measure_smallest(executor: str, seconds: float, seed: int) -> _Timing:
    """Run the smallest node for `seconds` of simulated time. Call this only in a private network namespace."""
    from sim import Simulator, load_world
    from sim.bridge import CONTROLLER, TICK_S, Bridge

    domain_id, started = 1 + seed % 100, time.perf_counter()
    command = [sys.executable, "-m", "benchmarks.smallest_node", executor]
    with subprocess.Popen(command, env={**os.environ, "ROS_DOMAIN_ID": str(domain_id)}) as node:
        simulator = Simulator(load_world("open_field"), seed=seed)
        bridge = Bridge(
            simulator, CONTROLLER, "robot_controller", domain_id=domain_id, alive=lambda: node.poll() is None
        )
        try:
            if not bridge.await_node(lambda: True):
                sys.exit("the smallest node did not come up")
            timing = _Timing(start_s=time.perf_counter() - started)
            for _ in range(round(0.5 / TICK_S)):
                bridge.tick()
            wall, cpu = time.perf_counter(), _cpu_s()
            for _ in range(round(seconds / TICK_S)):
                bridge.tick()
            timing.driving, timing.driving_cpu = seconds / (time.perf_counter() - wall), seconds / (_cpu_s() - cpu)
            timing.pace, timing.unrepeatable = bridge.pace, simulator.unrepeatable
        finally:
            node.kill()
            bridge.close()
    return timing


def measure(install: str, seconds: float, seed: int, package: str) -> _Timing:
    """Run one node for twice `seconds` of simulated time. Only in a trial worker's network and environment."""
    from grader.trials.stage import Stage
    from grader.trials.worker import run_trial  # needs the environment that `main` makes

    timing = _Timing()

    def script(stage: Stage) -> None:
        timing.start_s = stage.node.process.wall_seconds
        stage.run(0.5)
        stage.call("set_speed", speed=0.25)
        timing.driving, timing.driving_cpu = _factors(stage)
        pose = stage.simulator.odometry().pose
        stage.navigate(pose.x + 1000.0, pose.y)
        timing.navigating, timing.navigating_cpu = _factors(stage)
        timing.pace, timing.unrepeatable = stage.bridge.pace, stage.simulator.unrepeatable

    def _factors(stage: Stage) -> tuple[float, float]:
        wall, cpu = time.perf_counter(), _cpu_s()
        stage.run(seconds)
        return seconds / (time.perf_counter() - wall), seconds / (_cpu_s() - cpu)

    plan = TrialPlan("lockstep", "", script, "robot_controller", "open_field", ())
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trial.json"
        run_trial(kits_own(), plan, TrialRequest("lockstep", install, seed, 1 + seed % 100, str(out), package))
        facts = evidence.from_json(out.read_text(), evidence.Trial)
    if facts.ended or facts.script_error:
        sys.exit(facts.ended or facts.script_error)
    return timing


def _cpu_s() -> float:
    """Return the CPU time of this process and its descendants."""
    parents: dict[int, int] = {}
    ticks: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            with contextlib.suppress(OSError):
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                parents[int(entry.name)], ticks[int(entry.name)] = int(fields[1]), int(fields[11]) + int(fields[12])
    family = {os.getpid()}
    while grown := {pid for pid, parent in parents.items() if parent in family} - family:
        family |= grown
    return sum(ticks[pid] for pid in family) / os.sysconf("SC_CLK_TCK")


def packages(folder: Path) -> Iterator[tuple[str, list[Path]]]:
    """Yield name and package folders of the reference and of each of the tests' variants."""
    sys.path.insert(0, str(_ROOT / "tests"))
    from variants import VARIANTS, make

    yield "reference", [REFERENCE]
    for variant in VARIANTS.values():
        yield variant.name, sorted(path.parent for path in make(variant, folder).glob("*/package.xml"))


def _run(what: str, package: str, contract: Path, seconds: float, seed: int, home: Path) -> _Timing:
    """Measure an install tree, or the smallest node with an executor, in a separate process and network namespace."""
    inside = [sys.executable, "-m", "benchmarks.lockstep", "--inside", what, "--package", package]
    done = subprocess.run(
        namespaces.private_network([*inside, "--seconds", str(seconds), "--seed", str(seed)]),
        env=observers.observer_environment(contract, home=home), cwd=_ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError((done.stdout + done.stderr).strip())
    return _Timing(**json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.lockstep"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time per run (default %(default)s)")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--smallest", action="store_true", help="measure the smallest node only")
    parser.add_argument("--quick", action="store_true", help="show in seconds that everything runs; a poor measurement")
    parser.add_argument("--seed", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--inside", help=argparse.SUPPRESS)
    parser.add_argument("--package", help=argparse.SUPPRESS)
    parser.add_argument(
        "packages", nargs="*", type=Path, help="package folders to measure (default: the reference and the variants)"
    )
    options = parser.parse_args()
    if options.inside:
        small = options.inside in SMALLEST
        given = (options.inside, options.seconds, options.seed)
        timing = measure_smallest(*given) if small else measure(*given, options.package)
        print(json.dumps(vars(timing)))
        return
    if options.quick:
        options.seconds, options.repeat = 0.5, 1
        options.packages = options.packages or [REFERENCE]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        contract = building.build_contract(building.cache_folder(), kits_own()).install
        chosen = [(path.name, [path]) for path in options.packages] or packages(folder)
        print(f"{options.seconds:g} s driving, then as long navigating; median (worst) of {options.repeat}", end="; ")
        print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores; times real time\n")
        print("| node | start s | driving | driving per CPU s | navigating | navigating per CPU s | pace |")
        print("|---|---|---|---|---|---|---|")

        failed = False

        def row(name: str, what: str, aim: str = "", package: str = "") -> None:
            nonlocal failed
            seeds = range(1, 1 + options.repeat)
            try:
                print(
                    _row(name, aim, [_run(what, package, contract, options.seconds, seed, folder) for seed in seeds]),
                    flush=True,
                )
            except RuntimeError as error:
                failed = True
                print(f"{name}: {error}", file=sys.stderr)

        for executor, name in SMALLEST.items():
            row(name, executor, AIMS[executor])
        if not options.smallest:
            for name, paths in chosen:
                built = building.build(paths, building.cache_folder(), kits_own())
                if built.facts.ok:
                    row(name, str(built.install), package=str(paths[0]))
                else:
                    failed = True
                    print(f"{name}: does not build, or not within the time limit", file=sys.stderr)
        if failed:
            sys.exit(1)


def _row(name: str, aim: str, runs: list[_Timing]) -> str:
    """Return a row of the table; `aim` is printed beside the factor for driving."""
    cells = [
        _cell([run.start_s for run in runs], worst=max),
        _cell([run.driving for run in runs], worst=min) + (f", {aim}" if aim else ""),
        _cell([run.driving_cpu for run in runs], worst=min),
        _cell([run.navigating for run in runs], worst=min),
        _cell([run.navigating_cpu for run in runs], worst=min),
    ]
    pace = ", ".join(sorted({run.pace for run in runs}))
    doubtful = sum(bool(run.unrepeatable) for run in runs)
    return f"| {name} | {' | '.join(cells)} | {pace}{f', {doubtful} perhaps not repeatable' if doubtful else ''} |"


def _cell(values: list[float], worst: Callable[[list[float]], float]) -> str:
    if math.isnan(values[0]):
        return ""
    return f"{statistics.median(values):.1f} ({worst(values):.1f})"


if __name__ == "__main__":
    main()
