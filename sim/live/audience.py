"""The open views of a live robot: which ones there are, when the next frame is due, and what it contains."""

from __future__ import annotations

import math
import threading
from typing import Protocol

from sim.live.protocol import Feed, Message

# How long a view may be silent before it counts as closed: an open view sends a message every 4 s, a hidden tab once a
# minute, and while a busy cell keeps the kernel from receiving messages, silence means nothing.
LOST_S, HIDDEN_LOST_S, UNHEARD_LOST_S = 15.0, 180.0, 600.0


class Channel(Protocol):
    """Where messages go: the widget, or a list in a test."""

    def send(self, content: Message, buffers: list[bytes]) -> None:
        """Send one message to every open view."""


def patience_s(hidden: bool) -> float:
    """Return how long a view may be silent from now on, in s. Call this in the thread that received its message."""
    busy_cells_deafen = threading.current_thread() is threading.main_thread()
    patience = UNHEARD_LOST_S if busy_cells_deafen else LOST_S
    return max(patience, HIDDEN_LOST_S) if hidden else patience


class Audience:
    """The views, and the next message to them. `now` is wall time in s, on any clock.

    Attributes:
        channel: where messages go; None if there is no front end.
        has_news: whether there is something to send even though no step was made.
    """

    def __init__(self, feed: Feed, fps: float) -> None:
        self.channel: Channel | None = None
        self.has_news = True
        self._feed = feed
        self._fps = fps
        self._open_until: dict[str, float] = {}
        self._frame_due = -math.inf
        self._frames = self._notes = 0
        self._note = ""

    @property
    def is_present(self) -> bool:
        """Whether any view is open."""
        return bool(self._open_until)

    def keep(self, view: str, until: float, *, begins: bool) -> None:
        """Count a view as open until then. One that has just opened, or reappears, gets the full state."""
        if begins or view not in self._open_until:
            self._feed.restart()
            self.has_news = True
        self._open_until[view] = until

    def leave(self, view: str) -> None:
        """Remove a view that has been closed."""
        self._open_until.pop(view, None)

    def drop_silent(self, now: float) -> None:
        """Remove the views that have been silent for too long."""
        self._open_until = {view: until for view, until in self._open_until.items() if now <= until}

    def say(self, note: str) -> None:
        """Show a line of text in the views."""
        self._note, self.has_news = note, True
        self._notes += 1

    def is_due(self, now: float) -> bool:
        """Return whether it is time for the next frame of a moving robot."""
        return now >= self._frame_due

    def send(self, now: float, state: Message) -> None:
        """Send the changes, and `state`."""
        # Count from when the frame was due, not from now: otherwise steps and frames would beat against each other.
        self._frame_due = max(self._frame_due, now - 1 / self._fps) + 1 / self._fps
        self.has_news = False
        if self.channel is None or not self._open_until:
            return
        message, scan = self._feed.message()
        self._frames += 1
        message |= {"n": self._frames, "note": [self._notes, self._note], **state}
        self.channel.send(message, [scan])
