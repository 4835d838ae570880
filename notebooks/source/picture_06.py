"""The picture at the top of notebook 06: requests for a speed, the answers, and the speed that follows."""

from __future__ import annotations

import math

from matplotlib.figure import Figure

from sim import Simulator, Twist, World, drive
from sim.drive import Seen
from sim.views import COLORS

LIMIT_MPS, RAMP_MPS = 0.5, 0.1
REQUESTS = ((1.0, 0.3), (3.0, 0.8), (5.0, math.nan), (7.0, -0.2), (9.0, 0.0))  # simulated time in s, speed in m/s


class Obedient:
    """Follows the last request that could be accepted, gently."""

    v = 0.0

    def __call__(self, seen: Seen) -> Twist:
        """Return the command for what was asked so far."""
        wanted = 0.0
        for time, speed in REQUESTS:
            if time <= seen.time and _accepted(speed):
                wanted = speed
        if self.v * wanted < 0.0:
            self.v = 0.0
        else:
            self.v = math.copysign(min(abs(wanted), abs(self.v) + RAMP_MPS), wanted)
        return Twist(self.v, 0.0)


def _accepted(speed: float) -> bool:
    return abs(speed) <= LIMIT_MPS


def draw() -> Figure:
    """Return the figure: a line for each request at its time, and the speed below."""
    run = drive(Simulator(World(), noise=False), Obedient(), 10.5)
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    axes.axhspan(-LIMIT_MPS, LIMIT_MPS, color=COLORS["goal"], alpha=0.07)
    axes.annotate("within the limit", (0.1, 0.03 - LIMIT_MPS), color=COLORS["goal"], fontsize=9)
    axes.step(run.t, run.cmd_v, where="pre", color=COLORS["command"], linestyle="--", linewidth=1.2, label="commanded")
    axes.plot(run.t, run.v, color=COLORS["path"], linewidth=2.2, label="driven")
    for time, speed in REQUESTS:
        accepted = _accepted(speed)
        color = COLORS["goal" if accepted else "contact"]
        axes.axvline(time, color=color, linewidth=1.0, linestyle=":")
        answer = "success" if accepted else "refused:\nthe limit is 0.5 m/s"
        axes.annotate(
            f"set_speed {speed:g}\n{answer}", (time, 0.62), (3, 0), textcoords="offset points", color=color, va="bottom"
        )
    axes.set(xlabel="simulated time (s)", ylabel="v (m/s)", xlim=(0.0, 10.5), ylim=(-0.6, 1.0))
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", ncols=2)
    return figure
