"""A World: the obstacles, where the robot starts and its goals. Values only; nothing moves here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath
from typing import Any

from sim import worldfile
from sim.geometry import Point, Pose
from sim.obstacles import Obstacle
from sim.transform import Transform
from sim.validation import WorldError

__all__ = ["World", "WorldError", "load_world", "world_names"]

WORLDS = FilePath(__file__).parent / "worlds"


@dataclass(frozen=True)
class World:
    """The geometry and start of a run, in the map frame. Every obstacle has a unique name.

    >>> from sim import Box
    >>> World("wall ahead", obstacles=(Box((2.0, 0.0), (0.1, 2.0)),)).obstacles[0].name
    'box 1'

    Attributes:
        name: short, for file names and titles.
        obstacles: walls, boxes, circles, polygons, grid maps; those without a name are given one ("box 1").
        start: where the robot's centre is at time 0.
        goals: places for the robot to visit, in the file's order.
        seed: of all noise, unless the simulator is given another seed.
        title: one line of description.
    """

    name: str = "world"
    obstacles: tuple[Obstacle, ...] = ()
    start: Pose = field(default_factory=Pose)
    goals: tuple[Pose, ...] = ()
    seed: int = 0
    title: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", _named(self.obstacles))
        object.__setattr__(self, "goals", tuple(self.goals))
        if self.seed < 0:
            raise ValueError(f"world {self.name!r}: seed must be 0 or more, got {self.seed}")

    def transformed(
        self, *, rotate: float = 0.0, mirror: bool = False, shift: Point = (0.0, 0.0), seed: int | None = None
    ) -> World:
        """Return the same world elsewhere: mirrored at the x axis, then rotated by `rotate` rad, then shifted (m).

        Start, goals and the paths of moving obstacles are transformed too, so a controller without hard-coded positions
        behaves the same in either world. `seed` replaces the world's seed.
        """
        to = Transform(rotate, mirror, shift)
        return replace(
            self,
            obstacles=tuple(to.obstacle(obstacle) for obstacle in self.obstacles),
            start=to.pose(self.start),
            goals=tuple(to.pose(goal) for goal in self.goals),
            seed=self.seed if seed is None else seed,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the world as plain data, in the schema of the world files."""
        return worldfile.to_document(vars(self))

    @classmethod
    def from_dict(cls, document: Any, where: str = "world") -> World:
        """Return the world that plain data describe; `where` names the file in messages.

        Raises:
            WorldError: a key is missing or unknown, or its value is invalid.
        """
        return cls(**worldfile.parse(document, where))


def _named(obstacles: Iterable[Obstacle]) -> tuple[Obstacle, ...]:
    """Return the obstacles, those without a name called "box 1", "box 2" and so on.

    Raises:
        ValueError: two obstacles have the same name.
    """
    taken: set[str] = set()
    result = []
    given = list(obstacles)
    for obstacle in given:
        if obstacle.name in taken:
            raise ValueError(f"two obstacles are named {obstacle.name!r}; give each its own name")
        if obstacle.name:
            taken.add(obstacle.name)
    numbers = Counter[str]()
    for obstacle in given:
        if not obstacle.name:
            kind = type(obstacle).__name__.lower()
            obstacle = replace(obstacle, name=free_name(kind, taken, numbers[kind] + 1))
            numbers[kind] = int(obstacle.name.rsplit(" ", 1)[1])
            taken.add(obstacle.name)
        result.append(obstacle)
    return tuple(result)


def free_name(kind: str, taken: Collection[str], number: int = 1) -> str:
    """Return "kind N" with the smallest N from `number` up that is not taken."""
    while f"{kind} {number}" in taken:
        number += 1
    return f"{kind} {number}"


def world_names() -> tuple[str, ...]:
    """Return the names of the worlds that come with the simulator, sorted."""
    return tuple(sorted(p.stem for p in WORLDS.glob("*.yaml")))


def load_world(name_or_path: str | FilePath) -> World:
    """Return a world by its name in `sim/worlds`, or from a file.

    Raises:
        WorldError: there is no such world, or the file has a mistake; the message names file, key and fix.
    """
    path = FilePath(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        path = WORLDS / f"{name_or_path}.yaml"
        if not path.is_file():
            raise WorldError(
                f"There is no world named {str(name_or_path)!r}. "
                f"Choose one of {', '.join(world_names())}, or give the path of a .yaml file."
            )
    return World(**worldfile.read(path))
