"""How a node keeps time, judged by when its messages arrive: in lockstep or on wall time, repeatably or not. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field

_MISSES_ALLOWED = 3  # missing answers, after which the node counts as irregular and is not waited for
_PROBE_TICKS = 24  # longest probe
_STEADY_TICKS = 6  # shortest probe of a node in lockstep
_BY_CHANCE = 0.02  # how likely a node on wall time may seem to be in lockstep
_ODD_ALLOWED = 2  # a goal or a cancel that is sent between two ticks may be answered at once


@dataclass
class Answers:
    """The ticks in which the node's answers came, and their period once it is known."""

    period: int | None = None
    last: int | None = None
    misses: int = 0
    count: int = 0
    _gap: int = field(default=0, repr=False)

    def note(self, tick: int) -> None:
        """Record an answer."""
        self.count += 1
        if self.last is not None and tick > self.last:
            gap = tick - self.last
            # Two equal gaps make a period.
            self.period, self._gap = (gap if gap == self._gap else None), gap
        self.last = tick

    def due(self, tick: int) -> bool:
        """Return whether an answer is expected in this tick; False if no period is known."""
        if self.period is None or self.last is None or self.misses >= _MISSES_ALLOWED:
            return False
        return tick >= self.last + self.period

    def missed(self) -> None:
        """Record that an answer was due and did not come."""
        self.misses += 1
        self.period, self._gap = None, 0


@dataclass
class Probe:
    """Tells whether a node's messages follow the ticks, or come while the clock stands still."""

    expects_feedback: bool
    """Whether feedback is due. Then none at all means wall time, and commands that follow the ticks mean nothing.

    A node may steer by a timer on the clock, and sleep on wall time in the loop that sends feedback and ends the goal.
    """
    ticks: int = 0
    prompt: int = 0
    """The number of ticks with a prompt message."""
    late: int = 0
    """The number of messages that came long after their tick."""
    prompt_s: float = 0.0
    """The wall time in which messages counted as prompt; on a busy machine ticks take long, and it is most of all."""
    late_s: float = 0.0
    """The wall time in which messages counted as late."""

    def verdict(self) -> str:
        """Return the pace for such a node, "lockstep" or "real time", or "" if it is too early to tell."""
        on_wall_time = self.late > self.prompt / 4
        if self.late >= 2 and on_wall_time:
            return "real time"
        regular = self.prompt * 3 >= self.ticks or not (self.expects_feedback or self.prompt)
        if self.ticks >= _STEADY_TICKS and self.late == 0 and regular and self._chance() <= _BY_CHANCE:
            return "lockstep"
        if self.ticks < _PROBE_TICKS:
            return ""
        return "real time" if on_wall_time or (self.expects_feedback and not self.prompt) else "lockstep"

    @property
    def silent(self) -> bool:
        """Whether nothing came that tells its pace: feedback was due, and there was none."""
        return self.expects_feedback and not self.prompt and self.late < 2

    def _chance(self) -> float:
        """Return how likely as many messages of a node on wall time would all have come promptly."""
        whole = self.prompt_s + self.late_s
        return (self.prompt_s / whole) ** self.prompt if whole and self.prompt else 0.0


@dataclass
class Repeatability:
    """What has happened in a run that another run may not repeat."""

    real_time: bool = False
    """Whether the node was run in real time."""
    without_feedback: bool = False
    """Whether that was because it sent no feedback on a goal, and may keep time by the clock all the same."""
    unprompted: int = 0
    """The number of answers after the node had said that it was done, although nothing new had been sent to it."""
    without_services: int = 0
    """The number of ticks in which the node could not be asked whether it was done."""
    unanswered: int = 0
    """The number of ticks in which the node did not answer and the clock went on without it."""

    def caveat(self) -> str:
        """Return why another run may differ, in one sentence; "" if there is no reason."""
        if self.real_time and self.without_feedback:
            return (
                "Perhaps not repeatable: the node sent no feedback on its goal, which would show whether it keeps time "
                "by the clock, so it was run in real time."
            )
        if self.real_time:
            return "Not repeatable: the node runs on wall time and was run in real time, so no two runs are the same."
        if self.unanswered:
            return (
                "Perhaps not repeatable: the node was busy in a callback for seconds of wall time, "
                "and the clock went on without it."
            )
        if self.without_services > _ODD_ALLOWED:
            return (
                "Perhaps not repeatable: the node has no parameter services, "
                "so it could not be asked when its work for a tick was done."
            )
        if self.unprompted > _ODD_ALLOWED:
            return (
                f"Perhaps not repeatable: {self.unprompted} messages came after the node had said that it was done, "
                "as happens with threads of its own, timing by wall time, or an events executor."
            )
        return ""
