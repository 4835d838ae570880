"""The open views of a live robot: which there are, when the next picture is due, and what they are told."""

from __future__ import annotations

import math
import threading
from typing import Protocol

from sim.live.feed import Feed, Message

# After how much silence a view counts as closed: views say every 4 s that they are there, a hidden tab once a minute,
# and where a busy cell keeps the kernel from hearing it, nobody can tell.
LOST_S, HIDDEN_LOST_S, UNHEARD_LOST_S = 15.0, 180.0, 600.0


class Channel(Protocol):
    """Where messages go: the widget, or a list in a test."""

    def send(self, content: Message, buffers: list[bytes]) -> None:
        """Send one message to every open view."""


def patience_s(hidden: bool) -> float:
    """Return how long a view may be silent from now on, in s; asked in the thread in which it was heard."""
    busy_cells_deafen = threading.current_thread() is threading.main_thread()
    patience = UNHEARD_LOST_S if busy_cells_deafen else LOST_S
    return max(patience, HIDDEN_LOST_S) if hidden else patience


class Audience:
    """The views, and what the next message to them says. `now` is wall time in s, of whatever clock.

    Attributes:
        channel: where messages go, if anywhere.
        has_news: something is to be told though no step was made.
    """

    def __init__(self, feed: Feed, fps: float) -> None:
        self.channel: Channel | None = None
        self.has_news = True
        self._feed = feed
        self._fps = fps
        self._open: dict[str, float] = {}  # until when each counts as open
        self._frame_due = -math.inf
        self._frames = self._notes = 0
        self._note = ""

    @property
    def is_there(self) -> bool:
        """Whether anybody watches."""
        return bool(self._open)

    def hear(self, view: str, until: float, *, begins: bool) -> None:
        """Take note that a view is there. One that begins, or comes again, is told everything."""
        if begins or view not in self._open:
            self._feed.begin()
            self.has_news = True
        self._open[view] = until

    def leave(self, view: str) -> None:
        """Take note that a view has been closed."""
        self._open.pop(view, None)

    def drop_silent(self, now: float) -> None:
        """Forget the views that have not been heard for too long."""
        self._open = {view: until for view, until in self._open.items() if now <= until}

    def say(self, note: str) -> None:
        """Let the views show some words."""
        self._note, self.has_news = note, True
        self._notes += 1

    def is_due(self, now: float) -> bool:
        """Return whether it is time for the next picture of a robot that drives."""
        return now >= self._frame_due

    def send(self, now: float, state: Message) -> None:
        """Send what is new, and `state`."""
        # From when it was due, not from now: else steps and frames would beat.
        self._frame_due = max(self._frame_due, now - 1 / self._fps) + 1 / self._fps
        self.has_news = False
        if self.channel is None or not self._open:
            return
        message, scan = self._feed.message()
        self._frames += 1
        message |= {"n": self._frames, "note": [self._notes, self._note], **state}
        self.channel.send(message, [scan])
