"""Measure what the walls cost: the same commands walled in and without, and what a grading starts of them.

Run it:  python benchmarks/walls.py [--rounds 20]
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from grader import build, pipeline, rubric, sandbox, toolchain

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "solution_pkg" / "ros2_robot_controller"
# Starting, importing what a node imports, computing: what trials, tests and builds are made of.
COMMANDS = {
    "true": ["true"],
    "python3 -c pass": ["python3", "-I", "-c", "pass"],
    "import rclpy": ["python3", "-c", "import rclpy"],
    "1 s of work": [
        "python3",
        "-I",
        "-c",
        "import time; t = time.process_time()\nwhile time.process_time() < t + 1: pass",
    ],
}


def main() -> int:
    """Print a table: command, milliseconds without and with a wall, the difference; then a grading's share."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20, help="how often each command is run (default 20)")
    rounds = parser.parse_args().rounds
    environment = toolchain.environment(home=sandbox.HOME)
    wall = sandbox.Wall(environment=environment)
    extra_ms = []
    print(f"{'command':<18}{'bare':>9}{'walled':>9}{'more':>9}   ms, median of {rounds}")
    with tempfile.TemporaryDirectory() as home:
        bare_environment = {**environment, "HOME": home, "ROS_LOG_DIR": home}
        for name, command in COMMANDS.items():
            bare, walled = [], []
            for _ in range(rounds):  # in turns, so that the machine's mood is the same for both
                bare.append(_seconds(lambda c=command: subprocess.run(c, env=bare_environment, check=True)))
                walled.append(_seconds(lambda c=command: sandbox.run(c, wall)))
            one, other = statistics.median(bare) * 1000, statistics.median(walled) * 1000
            extra_ms.append(other - one)
            print(f"{name:<18}{one:>9.1f}{other:>9.1f}{other - one:>9.1f}")
    count, seconds = _grading()
    cost = count * max(extra_ms[:3]) / 1000
    print(f"\nA grading of the reference builds {count} walls in {seconds:.0f} s.")
    print(f"At {max(extra_ms[:3]):.0f} ms each they cost {cost:.1f} s, {100 * cost / seconds:.1f} % of it.")
    return 0


def _seconds(run: object) -> float:
    started = time.perf_counter()
    run()  # type: ignore[operator]
    return time.perf_counter() - started


def _grading() -> tuple[int, float]:
    """Grade the reference, and return how many walls were built and how long it took, in wall seconds.

    Trials are counted by what their evidence shows: each node, and each process beside it, has a wall of its own.
    """
    made = [0]
    plain = sandbox.Process.__init__

    def counted(self: sandbox.Process, *arguments: object) -> None:
        made[0] += 1
        plain(self, *arguments)  # type: ignore[arg-type]

    sandbox.Process.__init__ = counted  # type: ignore[method-assign]
    settings = pipeline.Settings(rubric=rubric.load(ROOT / "rubric.yaml"), cache=build.cache_folder())
    with tempfile.TemporaryDirectory() as out:
        grading = pipeline.grade(REFERENCE, Path(out), settings)
    in_trials = sum(1 + len(trial.others) for trial in grading.evidence.trials.values())
    networks = 3  # the hosts' own, one for each worker
    return made[0] + in_trials + networks, grading.wall_seconds


if __name__ == "__main__":
    sys.exit(main())
