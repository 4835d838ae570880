"""Draw one trial as PNG with the simulator's drawings: a map with the path driven, and speeds and ranges over time.

Import this only where a picture is drawn: matplotlib takes half a second.
"""

from __future__ import annotations

import base64
import io
import itertools
import math
from collections.abc import Iterable
from dataclasses import replace

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from grader.evidence import Trial
from grader.report.recording import recording
from grader.words import localized, mark, say
from sim.views import draw_distances, draw_run, draw_speed, draw_turn_rate

MARGIN_M = 0.9  # around the path driven, so that walls near it are visible
STILL_M = 0.02  # a shorter path counts as standing still
SPEED_LIMIT = 3.0  # m/s, for drawing: a command of 1e300 m/s must not flatten everything else
RANGE_LIMIT = 4.0  # m, for drawing: anything farther away does not matter for stopping
# What the drawings are labelled with, to be said in the language of the course.
_LABELS = (
    mark("path"), mark("odometry"), mark("goal"), mark("contact"), mark("commanded"), mark("driven"),
    mark("closest reading"), mark("clearance of the hull"), mark("distance (m)"), mark("simulated time (s)"),
    mark("promise broken"),
)  # fmt: skip


def drawable(trial: Trial) -> bool:
    """Return whether there is something to see in a trial: a robot that moved or was commanded to."""
    commanded = any(command.v != 0 or command.omega != 0 for command in trial.commands)
    return len(trial.samples) > 1 and (commanded or bool(trial.touches) or _way(trial) > STILL_M)


def data_uri(trial: Trial, at: float | None = None) -> str:
    """Return the picture of a trial as a data URI for an HTML image."""
    return "data:image/png;base64," + base64.b64encode(png(trial, at)).decode("ascii")


def describe(trial: Trial) -> str:
    """Return a description of the picture in a sentence or two, for readers who cannot see it."""
    first, last = trial.samples[0], trial.samples[-1]
    way = mark(
        "The robot went from ({first.x:.2f}, {first.y:.2f}) to ({last.x:.2f}, {last.y:.2f}) m in {last.t:.1f} s of "
        "simulated time."
    )
    said = [say(way, first=first, last=last)]
    sent = mark("It was sent to ({goal.x:.2f}, {goal.y:.2f}) m; the goal {status}.")
    said += [say(sent, goal=goal, status=say(goal.status)) for goal in trial.goals[:1]]
    if trial.touches:
        touch = trial.touches[0]
        words = mark("It touched {touch.obstacle} at {touch.t:.1f} s, moving at {speed:.2f} m/s.")
        said.append(say(words, touch=touch, speed=abs(touch.speed)))
    nearest = min((scan.ahead for scan in trial.scans), default=math.inf)
    if math.isfinite(nearest):
        said.append(say("The closest reading ahead was {d:.2f} m.", d=nearest))
    return " ".join(said)


def png(trial: Trial, at: float | None = None) -> bytes:
    """Return the picture of a trial that is `drawable`, as PNG, with a line where a promise was broken, `at` s.

    Of a robot that only turns it shows how fast that was.
    """
    run = recording(trial)
    drawn = {name: np.clip(run.samples[name], -SPEED_LIMIT, SPEED_LIMIT) for name in ("v", "cmd_v")}
    drawn |= {name: np.where(run.samples[name] <= RANGE_LIMIT, run.samples[name], np.nan) for name in _RANGES}
    run = replace(run, samples=run.samples | drawn)
    with mpl.rc_context({"font.size": 8.0}):
        figure = Figure(figsize=(9.6, 3.9), dpi=120, facecolor="#fcfcfa")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(
            2, 2, width_ratios=(1.0, 1.5), left=0.06, right=0.98, bottom=0.12, top=0.9, wspace=0.14, hspace=0.3
        )
        chart, speeds = figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[0, 1])
        ranges = figure.add_subplot(grid[1, 1], sharex=speeds)
        draw_run(chart, run)
        places = [run.x.tolist(), run.y.tolist()]
        for values, goals in zip(places, ([g.x for g in run.world.goals], [g.y for g in run.world.goals]), strict=True):
            values += goals
        half = max(max(values) - min(values) for values in places) / 2 + MARGIN_M
        x, y = ((max(values) + min(values)) / 2 for values in places)
        chart.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal", xlabel="x (m)", ylabel="y (m)")
        chart.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
        turns = not np.any(run.samples["cmd_v"][np.isfinite(run.samples["cmd_v"])]) and _way(trial) <= STILL_M
        (draw_turn_rate if turns else draw_speed)(speeds, run)
        draw_distances(ranges, run, trial.thresholds)
        for axes, t in itertools.product((speeds, ranges), () if at is None else (at,)):
            axes.axvline(t, color="black", linewidth=1.2, linestyle=":", label="promise broken")
        speeds.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, frameon=False, borderaxespad=0.2)
        speeds.tick_params(labelbottom=False)
        ranges.set_xlabel("simulated time (s)")
        for text in figure.findobj(Text):
            text.set_text(say(text.get_text()) if text.get_text() in _LABELS else localized(text.get_text()))
        stream = io.BytesIO()
        figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()


_RANGES = ("closest", "clearance")


def worth_drawing(trials: Iterable[Trial]) -> Trial | None:
    """Return the drawable trial in which the robot went the longest way, None if there is none."""
    return max((trial for trial in trials if drawable(trial)), key=_way, default=None)


def _way(trial: Trial) -> float:
    return sum(math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(trial.samples))
