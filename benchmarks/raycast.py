"""Measure one 360-beam scan: this caster, pymunk's public API, dense numpy and, if installed, ir-sim.

    python -m benchmarks.raycast [--repeat N] [--quick]

All methods scan the same rooms from the same poses, take turns within one run, and are compared with the exact answer.
Times are this process's CPU times (every method is single-threaded), so other work on the machine has little effect.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import math
import os
import platform
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pymunk
import yaml

from benchmarks.scenes import hall, poses
from sim import Box, Circle, Pose, Wall, World
from sim.lidar import Beams, Outline, cast

BEAMS = Beams()
Method = Callable[[Pose], np.ndarray]


def this_caster(world: World) -> Method:
    """Return `sim.lidar.cast`."""
    shapes = Outline((o.pose, o.parts()) for o in world.obstacles).shapes()
    return lambda pose: cast(shapes, pose, BEAMS)


def pymunk_space(world: World) -> pymunk.Space:
    """Return the world as static pymunk shapes."""
    space = pymunk.Space()
    for o in world.obstacles:
        match o:
            case Wall():
                space.add(pymunk.Segment(space.static_body, o.start, o.end, 0.0))
            case Circle():
                space.add(pymunk.Circle(space.static_body, o.radius, o.center))
            case Box():
                corners = [o.pose.point_to_parent(c) for part in o.parts() for c in part.corners]
                space.add(pymunk.Poly(space.static_body, corners))
    return space


def pymunk_naive(world: World) -> Method:
    """Return pymunk's public API, used naively: a filter and trigonometry for each beam."""
    space = pymunk_space(world)

    def scan(pose: Pose) -> np.ndarray:
        ranges = np.full(BEAMS.count, np.inf)
        for i in range(BEAMS.count):
            angle = pose.yaw + BEAMS.angle_min + i * BEAMS.increment
            end = (pose.x + BEAMS.range_max * math.cos(angle), pose.y + BEAMS.range_max * math.sin(angle))
            hit = space.segment_query_first((pose.x, pose.y), end, 0.0, pymunk.ShapeFilter())
            if hit is not None:
                ranges[i] = hit.alpha * BEAMS.range_max
        return ranges

    return scan


def pymunk_tuned(world: World) -> Method:
    """Return pymunk's public API, optimised: one filter, all ends computed at once, a bound method."""
    space = pymunk_space(world)
    query, everything = space.segment_query_first, pymunk.ShapeFilter()
    angles, reach, inf = BEAMS.angles, BEAMS.range_max, math.inf

    def scan(pose: Pose) -> np.ndarray:
        start = (pose.x, pose.y)
        bearing = angles + pose.yaw
        ends = zip(
            (pose.x + reach * np.cos(bearing)).tolist(), (pose.y + reach * np.sin(bearing)).tolist(), strict=True
        )
        hits = [query(start, end, 0.0, everything) for end in ends]
        return np.array([inf if hit is None else hit.alpha * reach for hit in hits])

    return scan


def numpy_dense(world: World) -> Method:
    """Return a caster that tests every beam against every segment and circle, in one array."""
    shapes = Outline((o.pose, o.parts()) for o in world.obstacles).shapes()
    n = shapes.edge_on.size
    points = np.stack([shapes.points.real, shapes.points.imag])
    a, b, c = points[:, :n], points[:, n : 2 * n], points[:, 2 * n :]
    ex, ey = b - a
    angles = BEAMS.angles

    def scan(pose: Pose) -> np.ndarray:
        bearing = angles + pose.yaw
        dx, dy = np.cos(bearing)[:, None], np.sin(bearing)[:, None]
        ax, ay = a[0] - pose.x, a[1] - pose.y
        cx, cy = c[0] - pose.x, c[1] - pose.y
        with np.errstate(divide="ignore", invalid="ignore"):
            across = dx * ey - dy * ex
            t = (ax * ey - ay * ex) / across
            u = (ax * dy - ay * dx) / across
            t = np.where((t >= 0) & (u >= -1e-12) & (u <= 1 + 1e-12), t, np.inf)
            along = dx * cx + dy * cy
            root = along * along - (cx * cx + cy * cy - shapes.radii**2)
            s = along - np.sqrt(root)
            s = np.where((root >= 0) & (s >= 0), s, np.inf)
        ranges = np.minimum(t.min(axis=1, initial=np.inf), s.min(axis=1, initial=np.inf))
        return np.where(ranges <= BEAMS.range_max, ranges, np.inf)

    return scan


def ir_sim(world: World) -> Method | None:
    """Return ir-sim's lidar2d in the same room, None if ir-sim is not installed."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    try:
        import irsim
    except ImportError:
        return None
    obstacles = []
    for o in world.obstacles:
        match o:
            case Circle():
                obstacles.append({"shape": {"name": "circle", "radius": o.radius}, "state": [*o.center, 0]})
            case Box():
                shape = {"name": "rectangle", "length": o.size[0], "width": o.size[1]}
                obstacles.append({"shape": shape, "state": [*o.center, o.yaw]})
            case Wall():
                ends = [list(o.start), list(o.end)]
                obstacles.append({"shape": {"name": "linestring", "vertices": ends}, "state": [0, 0, 0]})
    lidar = {"name": "lidar2d", "range_min": 0, "range_max": BEAMS.range_max, "angle_range": math.tau, "number": 360}
    robot = {"kinematics": {"name": "diff"}, "shape": {"name": "circle", "radius": 0.171}, "sensors": [lidar]}
    scene = {
        "world": {"width": 24, "height": 24, "offset": [-12, -12], "collision_mode": "unobstructed"},
        "robot": robot,
        "obstacle": obstacles,
    }
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        path = Path(folder) / "hall.yaml"
        path.write_text(yaml.safe_dump(scene))
        environment = irsim.make(str(path), display=False)

    def scan(pose: Pose) -> np.ndarray:
        environment.robot.set_state([pose.x, pose.y, pose.yaw])
        environment.robot.sensor_step()
        return np.array(environment.robot.get_lidar_scan()["ranges"])

    return scan


METHODS: dict[str, tuple[Callable[[World], Method | None], int]] = {
    "this caster": (this_caster, 10),
    "numpy, dense": (numpy_dense, 3),
    "pymunk public API, tuned": (pymunk_tuned, 1),
    "pymunk public API, naive": (pymunk_naive, 1),
    "ir-sim lidar2d": (ir_sim, 1),
}


def measure(count: int, repeat: int) -> list[dict[str, object]]:
    """Return one row per method: median and best time of a scan in µs, speed relative to pymunk, and worst error."""
    world = hall(count)
    places = poses(world)
    methods = {name: (make(world), inner) for name, (make, inner) in METHODS.items()}
    exact = [methods["pymunk public API, tuned"][0](pose) for pose in places]
    times: dict[str, list[float]] = {name: [] for name in methods}
    for turn in range(repeat):
        for name, (scan, inner) in methods.items():
            if scan is None or (name == "ir-sim lidar2d" and turn >= 2):
                continue
            begin = time.process_time()
            for _ in range(inner):
                for pose in places:
                    scan(pose)
            times[name].append((time.process_time() - begin) / (inner * len(places)) * 1e6)
    rows: list[dict[str, object]] = []
    for name, (scan, _) in methods.items():
        if scan is None:
            rows.append({"method": name, "note": "not installed (pip install ir-sim)"})
            continue
        # ir-sim spreads its 360 beams differently over the circle (with both ends), so its values are not comparable.
        comparable = name != "ir-sim lidar2d"
        worst = max(_apart(scan(p), answer) for p, answer in zip(places, exact, strict=True)) if comparable else None
        rows.append(
            {"method": name, "median_us": statistics.median(times[name]), "best_us": min(times[name]), "worst_m": worst}
        )
    tuned = next(row for row in rows if row["method"] == "pymunk public API, tuned")
    for row in rows:
        if "median_us" in row:
            # Compare turn by turn: anything that slows the machine for a moment slows both.
            pairs = zip(times["pymunk public API, tuned"], times[str(row["method"])], strict=False)
            row["times_pymunk"] = statistics.median(p / m for p, m in pairs)
    assert tuned["worst_m"] == 0.0
    return rows


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    a, b = np.where(np.isinf(a), 12.0, a), np.where(np.isinf(b), 12.0, b)
    return float(np.abs(a - b).max())


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="example: python -m benchmarks.raycast"
    )
    parser.add_argument("--repeat", type=int, default=15, help="runs per method (default %(default)s)")
    parser.add_argument("--quick", action="store_true", help="show in seconds that everything runs; a poor measurement")
    options = parser.parse_args()
    if options.quick:
        options.repeat = 1
    results = {count: measure(count, options.repeat) for count in (20, 200)}
    print(f"360 beams, 12 m, 20 poses, CPU time, median of {options.repeat} turns; Python {platform.python_version()},")
    print(f"numpy {np.__version__}, pymunk {pymunk.version}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    for count, rows in results.items():
        print(f"\n{count} obstacles             median µs   best µs   scans/s   x pymunk tuned   worst difference")
        for row in rows:
            if "note" in row:
                print(f"  {row['method']:26} {row['note']}")
                continue
            rate = 1e6 / float(str(row["median_us"]))
            print(
                f"  {row['method']:26} {row['median_us']:7.0f} {row['best_us']:9.0f} {rate:9.0f}"
                f" {row['times_pymunk']:14.2f}   "
                + ("not comparable" if row["worst_m"] is None else f"{row['worst_m']:12.1e} m")
            )


if __name__ == "__main__":
    main()
