"""A chart of what the lidar has seen, and the shortest way in it that keeps its distance. No ROS."""

from collections.abc import Iterator
import heapq
import math
from typing import Optional

import numpy as np

CELL = 0.1  # m
SIZE = 300  # cells along each side
HULL = 0.171  # m, the robot's radius
MARGIN = 0.15  # m between the hull and what the way may pass
WIDE = 0.55  # m from what has been seen: farther away all ways are equally good
NARROW_COST = 2.0  # how much dearer a metre is that is nearer than WIDE
STEPS = [(dx, dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1) if dx or dy]

Cell = tuple[int, int]
Point = tuple[float, float]


def disc(radius: float) -> list[Cell]:
    """Return the cells whose centres are within `radius` metres of that of cell (0, 0)."""
    reach = int(radius / CELL)
    span = range(-reach, reach + 1)
    return [(dx, dy) for dx in span for dy in span if math.hypot(dx, dy) * CELL <= radius]


class Chart:
    """Square cells around where the robot was at first; seen is where the lidar has hit something."""

    def __init__(self, x: float, y: float) -> None:
        self.corner = (x - SIZE * CELL / 2, y - SIZE * CELL / 2)
        self.seen = np.zeros((SIZE, SIZE), dtype=bool)
        self.closed = self.seen.copy()
        self.narrow = self.seen.copy()

    def cell(self, x: float, y: float) -> Cell:
        """Return the cell of a point."""
        return int((x - self.corner[0]) / CELL), int((y - self.corner[1]) / CELL)

    def centre(self, cell: Cell) -> Point:
        """Return the centre of a cell."""
        return self.corner[0] + (cell[0] + 0.5) * CELL, self.corner[1] + (cell[1] + 0.5) * CELL

    def add(self, x: np.ndarray, y: np.ndarray) -> bool:
        """Note points where the lidar hit something; return whether any of them is new."""
        columns = ((x - self.corner[0]) / CELL).astype(int)
        rows = ((y - self.corner[1]) / CELL).astype(int)
        inside = (columns >= 0) & (columns < SIZE) & (rows >= 0) & (rows < SIZE)
        columns, rows = columns[inside], rows[inside]
        if self.seen[columns, rows].all():
            return False
        self.seen[columns, rows] = True
        self.closed = self._widened(HULL + MARGIN)
        self.narrow = self._widened(WIDE)
        return True

    def _widened(self, radius: float) -> np.ndarray:
        wide = np.zeros_like(self.seen)
        columns, rows = np.nonzero(self.seen)
        for dx, dy in disc(radius):
            wide[np.clip(columns + dx, 0, SIZE - 1), np.clip(rows + dy, 0, SIZE - 1)] = True
        return wide

    def is_free(self, way: list[Point]) -> bool:
        """Return whether no point of a way is closed."""
        return not any(self.closed[self.cell(*point)] for point in way)

    def way(self, start: Point, end: Point) -> Optional[list[Point]]:
        """Return the way from start to end as points a cell apart, None if there is none."""
        first, last = self.cell(*start), self.cell(*end)
        cost, before = {first: 0.0}, {first: first}
        todo = [(math.dist(first, last), first)]
        done: set[Cell] = set()
        while todo:
            _, here = heapq.heappop(todo)
            if here == last:
                return [*self._back(before, last), end]
            if here in done:
                continue
            done.add(here)
            for there, length in self._around(here, last):
                found = cost[here] + length
                if found < cost.get(there, math.inf):
                    cost[there], before[there] = found, here
                    heapq.heappush(todo, (found + math.dist(there, last), there))
        return None

    def _around(self, here: Cell, last: Cell) -> Iterator[tuple[Cell, float]]:
        leaving = self.closed[here]  # a robot that stands too near may leave
        for dx, dy in STEPS:
            there = here[0] + dx, here[1] + dy
            if not (0 <= there[0] < SIZE and 0 <= there[1] < SIZE):
                continue
            if self.closed[there] and not leaving and there != last:
                continue
            yield there, math.hypot(dx, dy) * (NARROW_COST if self.narrow[there] else 1.0)

    def _back(self, before: dict[Cell, Cell], last: Cell) -> list[Point]:
        cells = [last]
        while before[cells[-1]] != cells[-1]:
            cells.append(before[cells[-1]])
        return [self.centre(cell) for cell in reversed(cells)][:-1]
