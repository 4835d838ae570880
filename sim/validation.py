"""Read one value of a world file after the other; an error names the file, the key and the fix."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable
from typing import Any, NoReturn, cast

from sim.geometry import Point, Pose
from sim.obstacles import When


class WorldError(Exception):
    """A world file is not usable; the message names the file, the key and what to write instead."""


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number; True and False are not numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class Item:
    """A mapping or value in a world file, with its position in the file.

    The methods return the checked value of a key, or raise a WorldError that names file, key and fix. A key that is
    absent or null takes the default, if there is one.
    """

    def __init__(self, value: Any, where: str, key: str) -> None:
        self.value = value
        self.where = where
        self.key = key
        self._known: set[str] = set()

    def fail(self, key: str, problem: str, fix: str) -> NoReturn:
        """Raise a WorldError about a key of this item."""
        raise WorldError(f"{self.where}: {self._path(key) or 'the file'}: {problem}. Fix: {fix}.")

    def _path(self, key: str) -> str:
        return ".".join(part for part in (self.key, key) if part)

    def _mapping(self) -> dict[str, Any]:
        if not isinstance(self.value, dict):
            self.fail("", f"expected keys with values, got {self.value!r}", "write one `key: value` per line")
        return self.value

    def has(self, key: str) -> bool:
        """Return whether a key is given and not null."""
        self._known.add(key)
        return self._mapping().get(key) is not None

    def _get(self, key: str, kind: str, example: str, accept: Callable[[Any], bool], default: Any = ...) -> Any:
        if not self.has(key):
            if default is ...:
                typos = difflib.get_close_matches(key, [str(other) for other in self._mapping()], n=1, cutoff=0.8)
                if typos and typos[0] != key:
                    self.fail(key, f"is missing, but there is {typos[0]!r}", f"write {key!r} if that is what you mean")
                self.fail(key, "is missing", f"add {kind}, for example `{key}: {example}`")
            return default
        value = self._mapping()[key]
        if not accept(value):
            self.fail(key, f"expected {kind}, got {value!r}", f"write for example `{key}: {example}`")
        return value

    def refuse_other_keys(self) -> None:
        """Raise a WorldError about a key that has not been asked for: it is most likely a typo."""
        for key in self._mapping():
            if key not in self._known:
                near = difflib.get_close_matches(str(key), sorted(self._known), n=1)
                fix = (
                    f"write {near[0]!r} if that is what you mean"
                    if near
                    else f"remove it; the keys here are {', '.join(sorted(self._known))}"
                )
                self.fail(str(key), "unknown key", fix)

    def child(self, key: str) -> Item:
        """Return the value of a key that is given, as an item."""
        self._known.add(key)
        return Item(self._mapping()[key], self.where, self._path(key))

    def items(self, key: str) -> list[Item]:
        """Return the entries of a list, none if the key is absent."""
        if not self.has(key):
            return []
        value = self._mapping()[key]
        if not isinstance(value, list):
            self.fail(key, f"expected a list, got {value!r}", f"begin each entry of {key} with `- `")
        return [Item(entry, self.where, f"{self._path(key)}[{i}]") for i, entry in enumerate(value)]

    def text(self, key: str, default: Any = ...) -> str:
        """Return a text."""
        return str(self._get(key, "a text", "a few words", lambda v: isinstance(v, str), default))

    def integer(self, key: str) -> int:
        """Return an integer of 0 or more."""

        def accept(v: Any) -> bool:
            return isinstance(v, int) and not isinstance(v, bool) and v >= 0

        return int(self._get(key, "a whole number, 0 or more", "7", accept))

    def number(self, key: str, default: Any = ...) -> float:
        """Return a finite number."""
        return float(self._get(key, "a number", "1.57", is_number, default))

    def positive(self, key: str, default: Any = ...) -> Any:
        """Return a number above 0, or None if that is the default."""
        value = self._get(key, "a number above 0", "0.5", lambda v: is_number(v) and v > 0, default)
        return None if value is None else float(value)

    def non_negative(self, key: str, default: Any = ...) -> float:
        """Return a number of 0 or more."""
        return float(self._get(key, "a number, 0 or more", "0.1", lambda v: is_number(v) and v >= 0, default))

    def choice(self, key: str, options: tuple[str, ...], default: str) -> str:
        """Return one of the options."""
        return str(self._get(key, f"one of {', '.join(options)}", options[0], lambda v: v in options, default))

    def when(self, key: str, default: Any) -> When | None:
        """Return a time in s, or the name of an event."""

        def accept(v: Any) -> bool:
            return (isinstance(v, str) and v != "") or (is_number(v) and v >= 0)

        value = self._get(key, "a time in seconds or the name of an event", "5.0", accept, default)
        return float(value) if is_number(value) else cast(When | None, value)

    def point(self, key: str) -> Point:
        """Return a point in m."""
        value = self._get(key, "two numbers in metres", "[1.0, 2.0]", _is_point)
        return float(value[0]), float(value[1])

    def size(self, key: str) -> tuple[float, float]:
        """Return two lengths above 0, in m."""
        value = self._get(key, "two numbers above 0, in metres", "[0.4, 0.3]", lambda v: _is_point(v) and min(v) > 0)
        return float(value[0]), float(value[1])

    def points(self, key: str) -> tuple[Point, ...]:
        """Return one point or more, in m."""

        def accept(v: Any) -> bool:
            return isinstance(v, list) and len(v) > 0 and all(_is_point(p) for p in v)

        value = self._get(key, "a list of points in metres", "[[1.0, 0.0], [2.0, 0.5]]", accept)
        return tuple((float(p[0]), float(p[1])) for p in value)

    def pose(self, key: str) -> Pose:
        """Return a pose."""
        self._get(key, "a pose", "{x: 1.0, y: 2.0, yaw: 0.0}", lambda _: True)
        return self.child(key).as_pose()

    def as_pose(self) -> Pose:
        """Return this item, {x, y, yaw}, as a pose: metres, and radians (0 if absent)."""
        pose = Pose(self.number("x"), self.number("y"), self.number("yaw", 0.0))
        self.refuse_other_keys()
        return pose


def _is_point(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(is_number(v) for v in value)
