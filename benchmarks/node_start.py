"""Measure what it takes to start a node in its sandbox: by starting Python, and by forking one that is warm.

    python -m benchmarks.node_start [--rounds N] [--quick]

The reference's node, until it has written its first line. Both ways take turns in the same run.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time

from benchmarks.sandbox_cost import REFERENCE
from grader import building, sandbox
from grader.course import kits_own
from grader.host import ros_env

_COMMAND = [f"{building.INSTALL}/lib/ros2_robot_controller/robot_controller"]
_PATIENCE_S = 120.0


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=20, help="how often to start each way (default %(default)s)")
    parser.add_argument("--quick", action="store_true", help="show in seconds that it runs; a poor measurement")
    options = parser.parse_args()
    install = building.build([REFERENCE], building.cache_folder(), kits_own()).install
    environment = ros_env.environment(building.INSTALL, home=sandbox.HOME) | {"ROS_DOMAIN_ID": "87"}
    box = sandbox.Sandbox(read_only={install: str(building.INSTALL)}, environment=environment, network=True)
    print(f"load at the start {os.getloadavg()[0]:.1f}\n")
    print("| start | wall ms | CPU ms |\n|---|--:|--:|")
    with sandbox.WarmPython(environment) as warm:
        assert warm.suits(_COMMAND, box)
        costs: dict[str, list[tuple[float, float]]] = {"Python anew": [], "forked": []}
        for _ in range(2 if options.quick else options.rounds):
            costs["Python anew"].append(start(box, None))
            costs["forked"].append(start(box, warm))
    for name, measured in costs.items():
        wall, cpu = (1000 * statistics.median(values) for values in zip(*measured, strict=True))
        print(f"| {name} | {wall:.0f} | {cpu:.0f} |")


def start(box: sandbox.Sandbox, warm: sandbox.WarmPython | None) -> tuple[float, float]:
    """Return the wall time and the CPU time, in seconds, until the node has written its first line."""
    began = time.monotonic()
    with sandbox.Process(_COMMAND, box, sandbox.Limits(), warm) as process:
        while "\n" not in process.output:
            if process.exit_code() is not None or time.monotonic() > began + _PATIENCE_S:
                raise SystemExit(f"The node did not start:\n{process.output}")
            time.sleep(0.001)
        ran = sum(seconds for seconds, _ in process.thread_times().values())
        return time.monotonic() - began, ran


if __name__ == "__main__":
    main()
