"""Which obstacles are present: when they appear, vanish and are moved. It knows nothing of the robot."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from sim.movers import Mover
from sim.obstacles import Obstacle, When
from sim.scene import Scene
from sim.transform import moved_to


@dataclass(frozen=True)
class Event:
    """Something that happened apart from the robot's own motion: simulated time in s, kind, and name of the subject."""

    time: float
    kind: str
    subject: str = ""


@dataclass(frozen=True)
class Presence:
    """An obstacle was present from `since` to `until`, simulated time in s; inf if it still is."""

    obstacle: Obstacle
    since: float
    until: float = math.inf


class Inventory:
    """The obstacles of a run. `now` is simulated time in s; every change is appended to `events`.

    Attributes:
        scene: the obstacles that are present, at their current positions.
        movers: those of them that move by themselves, by name.
        waiting: those that have not appeared yet, by name.
        moved: the names of those that `move` has put elsewhere.
        presences: every obstacle so far, as it was added, and from when to when it was present.
    """

    def __init__(self, obstacles: Iterable[Obstacle], events: list[Event]) -> None:
        self.scene = Scene()
        self.movers: dict[str, Mover] = {}
        self.waiting: dict[str, Obstacle] = {}
        self.moved: frozenset[str] = frozenset()
        self.presences: list[Presence] = []
        self._vanishing: dict[str, When] = {}
        self._events = events
        for obstacle in obstacles:
            self.introduce(obstacle, 0.0)

    def introduce(self, obstacle: Obstacle, now: float) -> None:
        """Add an obstacle, now or when it is due to appear.

        Raises:
            ValueError: an obstacle of that name is present or waiting.
        """
        name = obstacle.name
        if name in self.waiting:
            raise ValueError(f"an obstacle named {name!r} is about to appear; choose another name")
        if name in self.scene:
            raise ValueError(f"an obstacle named {name!r} is there already; remove it or choose another name")
        if obstacle.appears is None or obstacle.appears == 0.0:
            self._put(obstacle, now)
        else:
            self.waiting[name] = obstacle

    def withdraw(self, name: str, now: float) -> None:
        """Remove an obstacle, even one that has not appeared yet.

        Raises:
            KeyError: there is no obstacle of that name.
        """
        if self.waiting.pop(name, None) is not None:
            return
        self.scene.remove(name)
        for i, presence in enumerate(self.presences):
            if presence.obstacle.name == name and presence.until == math.inf:
                self.presences[i] = replace(presence, until=now)
        self.movers.pop(name, None)
        self._vanishing.pop(name, None)
        self.moved -= {name}
        self._events.append(Event(now, "vanishes", name))

    def move(self, name: str, x: float, y: float, now: float) -> None:
        """Put the centre of an obstacle at x, y (m, map frame).

        Raises:
            KeyError: there is no obstacle of that name.
        """
        if name in self.waiting:
            self.waiting[name] = moved_to(self.waiting[name], (x, y))
            return
        moved = moved_to(self.scene.remove(name), (x, y))
        self.scene.add(moved)
        if moved.motion is not None:
            self.movers[name] = Mover(moved, moved.motion, self.movers[name].has_started)
        self.moved |= {name}
        self._events.append(Event(now, "moved", name))

    @property
    def has_timetable(self) -> bool:
        """Whether any obstacle is still to appear or vanish."""
        return bool(self.waiting or self._vanishing)

    def follow_timetable(self, now: float) -> bool:
        """Let the obstacles that are due appear and vanish; return whether there were any."""
        due = [n for n, o in self.waiting.items() if isinstance(o.appears, float | int) and o.appears <= now]
        gone = [n for n, when in self._vanishing.items() if isinstance(when, float | int) and when <= now]
        for name in due:
            self._appear(name, now)
        for name in gone:
            self.withdraw(name, now)
        return bool(due or gone)

    def hear(self, event: str, now: float) -> None:
        """Let the obstacles that wait for an event appear, vanish or start to move."""
        for name in [n for n, o in self.waiting.items() if o.appears == event]:
            self._appear(name, now)
        for name in [n for n, when in self._vanishing.items() if when == event]:
            self.withdraw(name, now)
        for mover in self.movers.values():
            mover.hear(event)

    def _appear(self, name: str, now: float) -> None:
        self._put(replace(self.waiting.pop(name), appears=None), now)
        self._events.append(Event(now, "appears", name))

    def _put(self, obstacle: Obstacle, now: float) -> None:
        self.scene.add(obstacle)
        self.presences.append(Presence(obstacle, now))
        if obstacle.motion is not None:
            self.movers[obstacle.name] = Mover(obstacle, obstacle.motion)
        if obstacle.vanishes is not None:
            self._vanishing[obstacle.name] = obstacle.vanishes
