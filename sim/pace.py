"""How a node keeps time, told from when its messages come: in ticks, by wall time, repeatably. No ROS, no waiting."""

from __future__ import annotations

from dataclasses import dataclass, field

_MISSES_ALLOWED = 3  # messages that were due and did not come before the node counts as irregular
_PROBE_TICKS = 24  # how long a suspect is watched at most
_STEADY_TICKS = 6  # how long at least
_ODD_ALLOWED = 2  # a goal, or a cancel, that somebody sends between two ticks may be answered at once


@dataclass
class Answers:
    """When the node's answers came, in ticks; learns their period."""

    period: int | None = None
    last: int | None = None
    misses: int = 0
    count: int = 0

    def note(self, tick: int) -> None:
        """Take note of an answer."""
        self.count += 1
        if self.last is not None and tick > self.last:
            gap = tick - self.last
            # Two equal gaps make a period.
            self.period, self._gap = (gap if gap == self._gap else None), gap
        self.last = tick

    _gap: int = field(default=0, repr=False)

    def due(self, tick: int) -> bool:
        """Return whether an answer should come in this tick, as far as a period is known."""
        if self.period is None or self.last is None or self.misses >= _MISSES_ALLOWED:
            return False
        return tick >= self.last + self.period

    def missed(self) -> None:
        """Take note that an answer which was due has not come."""
        self.misses += 1
        self.period, self._gap = None, 0


@dataclass
class Probe:
    """Watches whether signs of life come with the ticks, or while the clock stands still."""

    of_feedback: bool
    """Whether feedback has to come, so that none at all speaks for wall time, and commands with the ticks for nothing.

    A node may steer by a timer on the clock, and sleep by wall time in the loop that sends feedback and ends the goal.
    """
    ticks: int = 0
    prompt: int = 0
    """In how many ticks there was a sign."""
    late: int = 0
    """How many signs came when the tick was long over."""

    def verdict(self) -> str:
        """Return the pace of a node that behaves so, "" while that is open."""
        by_wall = self.late > self.prompt / 4
        if self.late >= 2 and by_wall:
            return "real time"
        regular = self.prompt * 3 >= self.ticks or not (self.of_feedback or self.prompt)
        if self.ticks >= _STEADY_TICKS and self.late == 0 and regular:
            return "lockstep"
        if self.ticks < _PROBE_TICKS:
            return ""
        return "real time" if by_wall or (self.of_feedback and not self.prompt) else "lockstep"


@dataclass
class Doubts:
    """What has happened in a run that another run need not repeat."""

    real_time: bool = False
    """The node was run in real time."""
    unprompted: int = 0
    """How many answers came after the node had said that its work was done, though nothing new had been sent to it."""
    unaskable: int = 0
    """How many ticks the node could not be asked whether its work was done."""
    overslept: int = 0
    """In how many ticks the node did not answer, and the clock went on without it."""

    def sentence(self) -> str:
        """Return why another run need not be the same, in one sentence; "" if nothing speaks against it."""
        if self.real_time:
            return "Not repeatable: the node goes by wall time and was run in real time, so no two runs are the same."
        if self.overslept:
            return (
                "Perhaps not repeatable: the node was busy in a callback for seconds of wall time, "
                "and the clock went on without it."
            )
        if self.unaskable > _ODD_ALLOWED:
            return (
                "Perhaps not repeatable: the node has no parameter services, "
                "so nobody could tell when its work for a tick was done."
            )
        if self.unprompted > _ODD_ALLOWED:
            return (
                f"Perhaps not repeatable: {self.unprompted} messages came after the node had said that it was done, "
                "as they do from threads of its own, by wall time, or with an events executor."
            )
        return ""
