"""Measure how many times faster than real time the simulator runs, without ROS.

    python -m benchmarks.realtime [--seconds N] [--repeat N] [--quick]

20 Hz scans, 20 Hz odometry, 100 Hz IMU, 200 Hz physics, all noise on; the robot drives around and hits obstacles.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from dataclasses import replace

from benchmarks.scenes import hall
from sim import COURSE, Simulator


def factors(count: int, seconds: float) -> tuple[float, float]:
    """Return simulated seconds per second of wall time, and per second of this process's CPU time."""
    profile = replace(COURSE, lidar=replace(COURSE.lidar, rate_hz=(20.0, 20.0)))
    simulator = Simulator(hall(count), profile)
    scans = 0
    begin, begin_cpu = time.perf_counter(), time.process_time()
    for tick in range(round(seconds * 20)):
        if tick % 2 == 0:
            simulator.command(0.4, 0.5 * ((tick // 40) % 3 - 1))
        scans += sum(hasattr(reading, "ranges") for reading in simulator.step(0.05))
    wall, cpu = time.perf_counter() - begin, time.process_time() - begin_cpu
    assert scans == round(seconds * 20)
    return seconds / wall, seconds / cpu


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.realtime"
    )
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time per run (default %(default)s)")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument(
        "--quick", action="store_true", help="show in a second that everything runs; a poor measurement"
    )
    options = parser.parse_args()
    if options.quick:
        options.seconds, options.repeat = 1.0, 1
    print(f"20 Hz scans of 360 beams, 100 Hz IMU, 200 Hz physics, noise on; load {os.getloadavg()[0]:.1f}")
    for count in (0, 20, 200):
        runs = [factors(count, options.seconds) for _ in range(options.repeat)]
        wall, cpu = [w for w, _ in runs], [c for _, c in runs]
        print(
            f"{count:4} obstacles: median {statistics.median(wall):5.0f} x real time (best {max(wall):.0f}); "
            f"per CPU second median {statistics.median(cpu):5.0f} (best {max(cpu):.0f})"
        )


if __name__ == "__main__":
    main()
