"""When the next step is due. Pure: whoever asks brings the clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

BEHIND_S = 0.1  # of wall time: a longer stall of a busy machine is not caught up


@dataclass
class Pacer:
    """Says when the next step is due, in wall seconds of whatever clock it is given.

    Attributes:
        rate: simulated seconds per wall second; inf as fast as it goes.
    """

    rate: float = 1.0
    _due: float = -math.inf

    def wait(self, now: float) -> float:
        """Return the seconds until the next step is due, 0 if it is."""
        return 0.0 if math.isinf(self.rate) else max(0.0, self._due - now)

    def stepped(self, dt: float, now: float) -> None:
        """Note a step of `dt` simulated seconds."""
        begin = self._due if self._due > now - BEHIND_S else now
        self._due = begin + dt / self.rate
