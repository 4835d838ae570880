"""An animation of a recording as one HTML page that plays in a saved notebook or a browser, without a server."""

from __future__ import annotations

import base64
import html
import json
import math
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.geometry import Pose
from sim.obstacles import CirclePart, Obstacle, PolygonPart, SegmentPart, extreme_points
from sim.recording import Recording
from sim.views import COLORS, thresholds_of

MAX_FRAMES = 1200  # one minute at 20 Hz; longer runs are thinned out
MAX_SCANS = 400
MAX_BEAMS = 180


class Replay:
    """A recording as an animation with a slider: map, scan, speeds and distances. A notebook shows it as a result.

    The page needs no other file, no server and no network. Without JavaScript (in print) it shows the whole path.
    """

    def __init__(self, recording: Recording, *, width: int = 900) -> None:
        self._recording = recording
        self._width = width

    def html(self) -> str:
        """Return a complete HTML page."""
        template = files("sim").joinpath("replay.html.j2").read_text(encoding="utf-8")
        r = self._recording
        data = json.dumps(self._data(), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
        title = html.escape(f"{r.world.name}: {r.duration:.1f} s simulated, {r.distance:.2f} m driven")
        note = f'<p class="note">{html.escape(r.unrepeatable)}</p>' if r.unrepeatable else ""
        for key, value in (
            ("TITLE", title), ("NOTE", note), ("SCENE", self._scene()), ("DATA", data), ("VIEWBOX", self._view_box()),
        ):  # fmt: skip
            template = template.replace(f"{{{{{key}}}}}", value)
        for name, color in COLORS.items():
            template = template.replace(f"{{{{{name}}}}}", color)
        return template

    def save(self, path: str | Path) -> None:
        """Write the page to a file for any browser."""
        Path(path).write_text(self.html(), encoding="utf-8")

    def _repr_html_(self) -> str:
        """Return the page in an iframe, so that its styles and names do not clash with the notebook's."""
        _, _, wide, high = (float(v) for v in self._view_box().split())
        height = round(max(0.6 * self._width * high / wide, 0.36 * self._width)) + 100  # title and controls
        page = html.escape(self.html(), quote=True)
        style = f"width:100%;max-width:{self._width}px;height:{height}px;border:0"
        return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{page}"></iframe>'

    def _data(self) -> dict[str, Any]:
        r = self._recording
        keep = _spread(len(r), MAX_FRAMES)
        scans = _spread(len(r.scan_t), MAX_SCANS)
        beams = np.arange(0, r.scan_angles.size, max(1, math.ceil(r.scan_angles.size / MAX_BEAMS)))
        ranges = r.scan_ranges[np.ix_(scans, beams)]
        centimetres = np.where(np.isfinite(ranges), np.clip(np.round(ranges * 100), 0, 65534), 65535).astype("<u2")
        sensors = [r.pose_at(int(i)).compose(r.lidar) for i in r.scan_index[scans]]
        return {
            "radius": r.radius,
            **{
                name: _rounded(r.samples[name][keep])
                for name in ("t", "x", "y", "yaw", "v", "cmd_v", "closest", "clearance")
            },
            "scan_t": _rounded(r.scan_t[scans]),
            "scan_poses": [[round(p.x, 3), round(p.y, 3), round(p.yaw, 4)] for p in sensors],
            "scan_angles": _rounded(r.scan_angles[beams], 4),
            "scans": base64.b64encode(centimetres.tobytes()).decode(),
            "contacts": [round(c.time, 3) for c in r.contacts],
            "thresholds": dict(thresholds_of(r)),
            "obstacles": [
                {
                    "since": p.since,
                    "until": p.until if math.isfinite(p.until) else None,
                    "track": None if (track := r.track(p)) is None else [_rounded(c) for c in track[keep].T],
                    "at": [p.obstacle.pose.x, p.obstacle.pose.y],
                }
                for p in r.presences
            ],
        }

    def _scene(self) -> str:
        """Return everything that is drawn only once, as SVG in metres with y pointing up."""
        r = self._recording
        parts = [f'<g id="o{i}">{_obstacle(p.obstacle)}</g>' for i, p in enumerate(r.presences)]
        keep = _spread(len(r), MAX_FRAMES)
        line = " ".join(f"{x:.3f},{y:.3f}" for x, y in zip(r.x[keep], r.y[keep], strict=True))
        parts.append(f'<polyline id="path" points="{line}"/>')
        for i, goal in enumerate(r.world.goals, start=1):
            parts.append(f'<path class="goal" d="{_star(goal)}"><title>goal {i}</title></path>')
        for c in r.contacts:
            (x, y), a = c.point, 0.1
            cross = f"M{x - a:.3f} {y - a:.3f}l{2 * a} {2 * a}M{x - a:.3f} {y + a:.3f}l{2 * a} {-2 * a}"
            name = html.escape(f"touched {c.obstacle} at {c.time:.2f} s, {c.speed:.2f} m/s")
            parts.append(f'<path class="contact" d="{cross}"><title>{name}</title></path>')
        return "\n".join(parts)

    def _view_box(self) -> str:
        """Return the SVG view box: the path, the goals, and obstacles not too far from either."""
        r = self._recording
        xs, ys = list(r.x), list(r.y)
        for goal in r.world.goals:
            xs.append(goal.x)
            ys.append(goal.y)
        reach = 4.0  # m around the path: a distant wall must not shrink the robot to a dot
        low_x, high_x, low_y, high_y = min(xs) - reach, max(xs) + reach, min(ys) - reach, max(ys) + reach
        corners = [c for p in r.presences for c in extreme_points(p.obstacle)]
        xs += [min(max(c[0], low_x), high_x) for c in corners]
        ys += [min(max(c[1], low_y), high_y) for c in corners]
        margin = 0.4
        x0, x1, y0, y1 = min(xs) - margin, max(xs) + margin, min(ys) - margin, max(ys) + margin
        for_the_scale = 0.3
        return f"{x0:.2f} {-y1:.2f} {x1 - x0:.2f} {y1 - y0 + for_the_scale:.2f}"


def _obstacle(obstacle: Obstacle) -> str:
    kind = "mover" if obstacle.motion is not None else "obstacle"
    place = obstacle.pose.point_to_parent
    shapes = [f"<title>{html.escape(obstacle.name)}</title>"]
    for part in obstacle.parts():
        match part:
            case SegmentPart():
                (x1, y1), (x2, y2) = place(part.start), place(part.end)
                shapes.append(f'<path class="{kind} line" d="M{x1:.3f} {y1:.3f}L{x2:.3f} {y2:.3f}"/>')
            case CirclePart():
                x, y = place(part.center)
                shapes.append(f'<circle class="{kind}" cx="{x:.3f}" cy="{y:.3f}" r="{part.radius:.3f}"/>')
            case PolygonPart():
                points = " ".join(f"{x:.3f},{y:.3f}" for x, y in map(place, part.corners))
                shapes.append(f'<polygon class="{kind}" points="{points}"/>')
    return "".join(shapes)


def _star(goal: Pose, size: float = 0.16) -> str:
    tips = []
    for i in range(10):
        radius, angle = (size if i % 2 == 0 else size * 0.42), math.pi / 2 + i * math.pi / 5
        tips.append(f"{goal.x + radius * math.cos(angle):.3f} {goal.y + radius * math.sin(angle):.3f}")
    return "M" + "L".join(tips) + "Z"


def _spread(count: int, most: int) -> NDArray[np.int64]:
    """Return up to `most` indices spread evenly over `count`, including the last."""
    return (
        np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64)) if count else np.zeros(0, int)
    )


def _rounded(values: NDArray[np.float64], digits: int = 3) -> list[float | None]:
    return [round(v, digits) if math.isfinite(v) else None for v in values.tolist()]
