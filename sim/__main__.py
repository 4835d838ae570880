"""`python -m sim WORLD`: drive through a world without ROS, print a summary, write a picture."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from sim.drive import drive
from sim.recording import Recording
from sim.robot import PROFILES
from sim.simulator import Simulator
from sim.tourist import Tourist
from sim.world import WorldError, load_world, world_names


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 for a drive, 1 for a faulty world, 2 for wrong usage."""
    parser = argparse.ArgumentParser(
        prog="python -m sim",
        description="Let the simple built-in driver drive through a world, without ROS.",
        epilog="example: python -m sim office --seed 3 --out office.png",
    )
    parser.add_argument("world", nargs="?", help=f"{', '.join(world_names())}, or a .yaml file")
    parser.add_argument("--seed", type=int, help="of the noise (default: the world's)")
    parser.add_argument("--seconds", type=float, default=60.0, help="maximum simulated time (default %(default)s)")
    parser.add_argument("--profile", choices=sorted(PROFILES), default="course", help="the robot (default %(default)s)")
    parser.add_argument("--no-noise", action="store_true", help="make all sensors exact")
    parser.add_argument("--out", type=Path, help="write a picture (.png, .svg, .pdf)")
    options = parser.parse_args(arguments)
    if options.world is None:
        for name in world_names():
            print(f"{name:18} {load_world(name).title}")
        return 0
    try:
        world = load_world(options.world)
    except WorldError as error:
        print(error, file=sys.stderr)
        return 1
    profile = PROFILES[options.profile]
    simulator = Simulator(world, profile, seed=options.seed, noise=not options.no_noise)
    tourist = Tourist(simulator)
    recording = drive(simulator, tourist, options.seconds, until=tourist.has_arrived)
    print(summary(recording))
    if options.out:
        from sim.views import run_view

        run_view(recording).savefig(options.out, dpi=120)
        print(f"written to {options.out}")
    return 0


def summary(recording: Recording) -> str:
    """Return a summary of the run in a few lines of text."""
    lines = [
        f"{recording.world.name}: {recording.world.title}",
        f"{recording.duration:.1f} s simulated, {recording.distance:.2f} m driven, seed {recording.seed}",
        f"smallest clearance {recording.clearance.min():.3f} m, {len(recording.contacts)} contacts",
    ]
    lines += [f"touched {c.obstacle} at {c.time:.2f} s, moving at {c.speed:.2f} m/s" for c in recording.contacts]
    for i, goal in enumerate(recording.world.goals, start=1):
        reached = ((recording.x - goal.x) ** 2 + (recording.y - goal.y) ** 2) ** 0.5
        lines.append(f"goal {i} at ({goal.x:.2f}, {goal.y:.2f}): came within {reached.min():.2f} m")
    if recording.unrepeatable:
        lines.append(recording.unrepeatable)
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
