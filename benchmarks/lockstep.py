"""Measure how many times faster than real time the grader's lockstep runs a node, by executor.

    python -m benchmarks.lockstep [--seconds N] [--repeat N] [PACKAGE ...]

Each package's robot_controller drives in an open field at 20 ticks a simulated second (10 Hz scans, 20 Hz odometry),
walled in as in a trial, and is then sent to a place far away. By default: the reference, and the variants of the
tests. Start is the wall time from the process's start until the node is up and the clock runs. "per CPU s" counts the
time that observer and node have computed: they mostly take turns, so it is near what an idle machine shows, whatever
else this one is doing.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader import build, sandbox, toolchain
from grader.trials.catalog import TrialPlan
from grader.trials.request import Request

_ROOT = Path(__file__).parents[1]


@dataclass
class _Timing:
    """What a run measured: wall seconds until the node was up; simulated seconds per wall and per CPU second."""

    start_s: float = 0.0
    driving: float = 0.0
    driving_cpu: float = 0.0
    navigating: float = 0.0
    navigating_cpu: float = 0.0
    pace: str = ""


def measure(install: Path, seconds: float, seed: int) -> _Timing:
    """Run one node for twice `seconds` of simulated time. Only inside a trial host's network and environment."""
    from grader.trials.host import run_trial  # needs the environment that `main` makes
    from grader.trials.stage import Stage

    timing = _Timing()

    def script(stage: Stage) -> None:
        timing.start_s = stage.process.wall_seconds
        stage.run(0.5)
        stage.call("set_speed", speed=0.25)
        timing.driving, timing.driving_cpu = _factors(stage)
        pose = stage.simulator.odometry().pose
        stage.navigate(pose.x + 1000.0, pose.y)
        timing.navigating, timing.navigating_cpu = _factors(stage)
        timing.pace = stage.bridge.pace

    def _factors(stage: Stage) -> tuple[float, float]:
        wall, cpu = time.perf_counter(), _cpu_s()
        stage.run(seconds)
        return seconds / (time.perf_counter() - wall), seconds / (_cpu_s() - cpu)

    plan = TrialPlan("lockstep", "", script, "robot_controller", "open_field", ())
    facts = run_trial(plan, Request("lockstep", str(install), seed, 1 + seed % 100, ""))
    if facts.ended or facts.script_error:
        sys.exit(facts.ended or facts.script_error)
    return timing


def _cpu_s() -> float:
    """Return the CPU time of this process and of all below it."""
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
    """Yield name and package folders of the reference and of each variant of the tests."""
    sys.path.insert(0, str(_ROOT / "tests"))
    from submissions.edits import REFERENCE
    from variants import VARIANTS, make

    yield "reference", [REFERENCE]
    for variant in VARIANTS.values():
        yield variant.name, sorted(path.parent for path in make(variant, folder).glob("*/package.xml"))


def _run(install: Path, contract: Path, seconds: float, seed: int, home: Path) -> _Timing:
    inside = [sys.executable, "-m", "benchmarks.lockstep", "--inside", str(install)]
    done = subprocess.run(
        sandbox.private_network([*inside, "--seconds", str(seconds), "--seed", str(seed)]),
        env=toolchain.observer_environment(contract, home=home), cwd=_ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        sys.exit(done.stdout + done.stderr)
    return _Timing(**json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.lockstep"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated, per turn (default %(default)s)")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--inside", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("packages", nargs="*", type=Path, help="package folders to measure instead")
    options = parser.parse_args()
    if options.inside:
        print(json.dumps(vars(measure(options.inside, options.seconds, options.seed))))
        return
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        contract = build.contract(build.cache_folder()).install
        chosen = [(path.name, [path]) for path in options.packages] or packages(folder)
        print(f"{options.seconds:g} s driving, then as long navigating; median (worst) of {options.repeat}", end="; ")
        print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
        print(f"{'':22} {'start s':>14} {'driving x':>14} {'per CPU s':>14} {'navigating x':>14} {'per CPU s':>14}")
        for name, paths in chosen:
            install = build.build(paths, build.cache_folder()).install
            runs = [_run(install, contract, options.seconds, seed, folder) for seed in range(1, 1 + options.repeat)]
            cells = [
                _cell([run.start_s for run in runs], worst=max),
                _cell([run.driving for run in runs], worst=min),
                _cell([run.driving_cpu for run in runs], worst=min),
                _cell([run.navigating for run in runs], worst=min),
                _cell([run.navigating_cpu for run in runs], worst=min),
            ]
            print(f"{name:22} {' '.join(cells)}  {', '.join(sorted({run.pace for run in runs}))}", flush=True)


def _cell(values: list[float], worst: object) -> str:
    assert callable(worst)
    return f"{statistics.median(values):6.1f} ({worst(values):5.1f})"


if __name__ == "__main__":
    main()
