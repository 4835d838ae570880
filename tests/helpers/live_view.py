"""A live view without a browser and without its thread, for the tests of sim.live."""

from __future__ import annotations

from typing import Any

from sim import Box, Seen, Simulator, Twist, Wall, World
from sim.live import Live
from sim.live.protocol import Message

BOX = Box((2.0, 1.0), (0.4, 0.4), name="crate")
ROOM = World(name="room", obstacles=(Wall((3.0, -2.0), (3.0, 2.0), name="wall"), BOX))


def ahead(_: Seen) -> Twist:
    return Twist(0.4, 0.0)


class Browser:
    """A stand-in for a browser's view: it applies the messages as view.js does."""

    def __init__(self, live: Live, view: str = "a") -> None:
        self.live, self.view = live, view
        self.messages: list[Message] = []
        self.scans: list[bytes] = []
        self.obstacles: dict[str, Any] = {}
        self.path: list[float] = []
        live._audience.channel = self
        live.receive({"kind": "hello", "view": view})

    def send(self, content: Message, buffers: list[bytes]) -> None:
        self.messages.append(content)
        self.scans.append(buffers[0])
        if "scene" in content:
            self.obstacles, self.path = {}, []
        self.obstacles |= {o["name"]: o for o in content.get("new", ())}
        for name, at in content.get("moved", {}).items():
            self.obstacles[name]["at"] = at
        for name in content.get("gone", ()):
            del self.obstacles[name]
        if "path" in content:
            begin, *points = content["path"]
            self.path[2 * begin :] = points

    def order(self, kind: str, **values: object) -> None:
        self.live.receive({"kind": kind, **values})

    @property
    def last(self) -> Message:
        return self.messages[-1]


class Desk:
    """A live view without its thread, with a clock that the test advances."""

    def __init__(self, live: Live) -> None:
        self.live, self.now = live, 1000.0
        self.browser = Browser(live)

    def go(self, seconds: float) -> None:
        """Let wall time pass as the thread would, sleeping exactly until the next step is due."""
        end = self.now + seconds
        while self.now <= end + 1e-9:
            wait = self.live.cycle(self.now)
            if wait is None or self.now + wait > end + 1e-9:
                break
            self.now += max(wait, 1e-4)  # a step takes some time
        self.now = end


def desk(world: World = ROOM, **options: Any) -> Desk:
    options.setdefault("driver", ahead)
    return Desk(Live(Simulator(world, noise=False), **options))
