"""Measure a trial: speeds, zeros, rates. Pure functions over evidence."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grader.checks.judge import Judge
from grader.course import load
from grader.evidence import Call, Command, Goal, Message, Sample, Trial
from grader.words import mark

ROUTES = ("navigate_ahead", "navigate_beside", "navigate_behind")
"""The trials that drive to a target in the open."""

_LATE_S = 0.3
TRY_LIMITS = mark("range_min <= reading <= range_max: the limits themselves are valid")
TRY_MIN = mark("min() of nothing raises: min(readings, default=math.inf)")
TRY_SECTOR = mark(
    "use only the beams within 60 degrees of the direction of travel: ahead for a positive speed, behind for a "
    "negative one; is that direction used at all?"
)
TRY_TYPES = mark(
    "give each field a value of its own type, as `0.0` for a float64: ROS ends a node that sends an int there"
)
COURSE = load(Path(__file__).parents[1])
DEFAULTS = COURSE.nodes["robot_controller"].defaults
"""The defaults of the controller's numeric parameters."""
THRESHOLD_M = DEFAULTS["obstacle_detection_threshold"]


def between(commands: Sequence[Command], start: float, end: float) -> list[Command]:
    """Return the commands with start < t <= end."""
    return [command for command in commands if start + 1e-9 < command.t <= end + 1e-9]


def stamp(message: Message) -> float:
    """Return a header's stamp in seconds since the trial began (ROS time 100 s)."""
    stamp = message.data["header"]["stamp"]
    return float(stamp["sec"]) - 100.0 + float(stamp["nanosec"]) * 1e-9


def rate(commands: Sequence[Command], start: float, end: float) -> float:
    """Return the rate of the commands between `start` and `end`, in Hz of simulated time."""
    return len(between(commands, start, end)) / (end - start)


def at(samples: Sequence[Sample], t: float) -> Sample:
    """Return the sample nearest to time `t`."""
    return min(samples, key=lambda sample: abs(sample.t - t))


def meant_by(trial: Trial, t: float) -> list[Sample]:
    """Return the samples that a message may be about that came at time `t`: one, or those of the last 0.3 s.

    A node on wall time is run in real time, and on a busy machine its messages come late.
    """
    late = _LATE_S if trial.pace == "real time" else 0.0
    return [at(trial.samples, t), *(sample for sample in trial.samples if t - late <= sample.t < t)]


def odometry_speed(samples: Sequence[Sample], start: float, end: float) -> float:
    """Return the mean speed by odometry between two times along the robot's heading, m/s, negative for backwards."""
    a, b = at(samples, start), at(samples, end)
    dx, dy = b.odom_x - a.odom_x, b.odom_y - a.odom_y
    return (dx * math.cos(a.odom_yaw) + dy * math.sin(a.odom_yaw)) / (b.t - a.t)


def stays_still(samples: Sequence[Sample], start: float) -> bool:
    """Return whether the robot stays where it is from `start` on, by ground truth.

    Judged by the distance it moves, not by its speed: at an obstacle the lidar's noise may let it twitch for a tick.
    """
    later = [sample for sample in samples if sample.t >= start - 1e-9]
    return bool(later) and all(
        math.hypot(s.x - later[0].x, s.y - later[0].y) <= 0.03
        and abs(math.remainder(s.yaw - later[0].yaw, math.tau)) <= 0.05
        for s in later
    )


def answer(call: Call) -> dict[str, Any]:
    """Return what a call was answered, {} if it was not."""
    return call.response or {}


def on_the_way(trial: Trial, service: str) -> Call | None:
    """Return the first call of a service while the node was working on a goal, None if there was none."""
    working = [(goal.t, goal.ended_t) for goal in trial.goals if goal.accepted]
    for call in trial.calls:
        # The end of a goal that never ends is NaN, which compares False.
        if call.service == service and any(start < call.t and not end <= call.t for start, end in working):
            return call
    return None


def died_after(goals: int, judge: Judge, trial: Trial) -> str:
    """Return in words how the node ended by itself when its `goals` goals were over, "" if it lived on."""
    over = len(trial.goals) == goals and all(math.isfinite(goal.ended_t) for goal in trial.goals)
    by_itself = trial.process is not None and trial.process.by == "itself"
    return str(judge.not_reached(trial.ended, trial)) if trial.ended and by_itself and over else ""


def has_succeeded(goal: Goal) -> bool:
    """Return whether a goal succeeded by its status or by its result. F8 asks for both."""
    return goal.success is True or goal.status == "succeeded"


def distance_at_end(goal: Goal, samples: Sequence[Sample]) -> float:
    """Return how far the robot was from the target when the goal ended, by ground truth; inf if it has not ended."""
    if not math.isfinite(goal.ended_t):
        return math.inf
    sample = at(samples, goal.ended_t)
    return math.hypot(goal.x - sample.x, goal.y - sample.y)


def reach(samples: Sequence[Sample], start: float, end: float) -> float:
    """Return how far the robot came from its place at `start`, by ground truth, until `end` (NaN: ever), in metres."""
    first = at(samples, start)
    return max((math.hypot(s.x - first.x, s.y - first.y) for s in samples if start <= s.t and not s.t > end), default=0)


def in_the_way(trial: Trial) -> list[tuple[float, float]]:
    """Return (t, closest valid reading in the direction of travel) of each scan; the set speed's sign decides it."""
    backwards = trial.choices.get("speed", 0.0) < 0
    return [(scan.t, scan.behind if backwards else scan.ahead) for scan in trial.scans]


def first_near(trial: Trial) -> float:
    """Return the time of the first scan with a valid reading in the way below the threshold, inf if there is none."""
    return next((t for t, distance in in_the_way(trial) if distance < THRESHOLD_M), math.inf)


def closest_ahead(trial: Trial) -> float:
    """Return the smallest valid reading in the way in the whole trial, in metres."""
    return min((distance for _, distance in in_the_way(trial)), default=math.inf)


def time_in(seen: str) -> float:
    """Return the first time in s that words name as "0.35 s", of "1.6 to 2.0 s" the second, 0 if they name none."""
    found = re.search(r"(\d+(?:[.,]\d+)?) s\b", seen)
    return float(found[1].replace(",", ".")) if found else 0.0
