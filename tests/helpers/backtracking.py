"""Can a regular expression take more than linear time? Decided from its structure, not by trying.

A pattern is read as an automaton of its characters: which may come after which. It is slow where two repetitions in it,
or one and the search for where a match begins, can share a stretch of text in as many ways as the stretch is long, and
what comes after them can fail. (Weber and Seidl, "On the degree of ambiguity of finite automata".) Repetitions with an
upper limit count as none; conditions on what is around a place count as met, except before the first character.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from re import _compiler, _constants, _parser  # type: ignore[attr-defined]
from typing import Any

_ALPHABET = [chr(code) for code in range(128)] + ["é", "\u00a0", "\u2028", "٣"]
_ALL = (1 << len(_ALPHABET)) - 1
_REPEATS = (_constants.MAX_REPEAT, _constants.MIN_REPEAT, _constants.POSSESSIVE_REPEAT)
_START = -1  # stands for the place before the first character


@dataclass
class _Part:
    """A part of a pattern: the characters that it can begin and end with, and whether it can be empty."""

    first: set[int] = field(default_factory=set)
    last: set[int] = field(default_factory=set)
    empty: bool = True


class _Automaton:
    def __init__(self, items: Iterable[Any], state: Any, is_bytes: bool) -> None:
        self.state = state
        self.bytes = is_bytes
        self.masks: list[int] = []
        self.follow: Counter[tuple[int, int]] = Counter()
        self.conditional = False
        self.before = _ALL  # the characters that may be before a match
        self.anchored = False
        self.whole = self._sequence(items)

    def _sequence(self, items: Iterable[Any]) -> _Part:
        whole = _Part()
        for item in items:
            whole = self._joined(whole, self._part(*item))
        return whole

    def _joined(self, one: _Part, other: _Part) -> _Part:
        self._link(one.last, other.first)
        return _Part(
            one.first | (other.first if one.empty else set()),
            other.last | (one.last if other.empty else set()),
            one.empty and other.empty,
        )

    def _link(self, ends: set[int], begins: set[int]) -> None:
        self.follow.update((end, begin) for end in ends for begin in begins)

    def _part(self, op: Any, argument: Any) -> _Part:
        if op in _REPEATS:
            least, most, inside = argument
            part = self._sequence(inside)
            if most == _constants.MAXREPEAT:
                self._link(part.last, part.first)
            return _Part(part.first, part.last, part.empty or not least)
        if op is _constants.SUBPATTERN:
            return self._sequence(argument[3])
        if op is _constants.ATOMIC_GROUP:
            return self._sequence(argument)
        if op is _constants.BRANCH:
            parts = [self._sequence(branch) for branch in argument[1]]
            return _Part(
                set().union(*(part.first for part in parts)),
                set().union(*(part.last for part in parts)),
                any(part.empty for part in parts),
            )
        if op in (_constants.AT, _constants.ASSERT, _constants.ASSERT_NOT):
            self._condition(op, argument)
            return _Part()
        if op is _constants.GROUPREF:
            return self._character(_ALL)
        if op is _constants.GROUPREF_EXISTS:
            return self._sequence([*argument[1], *(argument[2] or ())])
        return self._character(self._mask((op, argument)))

    def _character(self, mask: int) -> _Part:
        self.masks.append(mask)
        return _Part({len(self.masks) - 1}, {len(self.masks) - 1}, empty=False)

    def _condition(self, op: Any, argument: Any) -> None:
        if self.masks:
            self.conditional = True
        elif op is _constants.AT and argument in (_constants.AT_BEGINNING, _constants.AT_BEGINNING_STRING):
            if argument is _constants.AT_BEGINNING and self.state.flags & re.MULTILINE:
                self.before = 1 << _ALPHABET.index("\n")
            else:
                self.anchored = True
        elif op is _constants.AT and argument is _constants.AT_BOUNDARY:
            self.before = 0  # decided when the first characters are known
        elif op is not _constants.AT and argument[0] < 0 and len(argument[1]) == 1:
            mask = self._mask(argument[1][0])
            self.before = mask if op is _constants.ASSERT else _ALL & ~mask

    def _mask(self, item: Any) -> int:
        one = _compiler.compile(_parser.SubPattern(self.state, [item]), self.state.flags)
        found = 0
        for number, char in enumerate(_ALPHABET):
            text = char.encode("latin-1", "replace") if self.bytes else char
            found |= bool(one.fullmatch(text)) << number
        return found

    def successors(self) -> dict[int, list[int]]:
        found: dict[int, list[int]] = {number: [] for number in range(len(self.masks))}
        for end, begin in self.follow:
            found[end].append(begin)
        return found


def slow(pattern: str | bytes, flags: int = 0, *, searched: bool = True, complete: bool = False) -> str:
    """Return why a pattern may take more than linear time, "" if it takes linear time at most.

    `searched`: a match may begin anywhere (search, sub, finditer). `complete`: it has to reach the end (fullmatch).
    """
    parsed = _parser.parse(pattern, flags)
    items = list(parsed)
    branches = items[0][1][1] if len(items) == 1 and items[0][0] is _constants.BRANCH else [items]
    automata = (_Automaton(branch, parsed.state, isinstance(pattern, bytes)) for branch in branches)
    return next(filter(None, (_slow(automaton, searched, complete) for automaton in automata)), "")


def _slow(automaton: _Automaton, searched: bool, complete: bool) -> str:
    after = automaton.successors()
    reach = {number: _reached(number, after) for number in after}
    for (end, begin), ways in automaton.follow.items():
        if ways > 1 and end in reach[begin]:
            return "a repetition in a repetition can share its text in exponentially many ways"
    loops = [number for number in after if number in reach[number]]
    for number in loops:
        takes_all = not complete or automaton.masks[number] == _ALL
        if number in automaton.whole.last and takes_all and not automaton.conditional:
            continue  # nothing can fail after it
        for other in loops:
            if other != number and number in reach[other] and _shared(automaton, after, other, number):
                return "two repetitions can share a stretch of text"
        if searched and not automaton.anchored and _from_anywhere(automaton, after, number):
            return "each place in a stretch of text can be the start of a match that fails"
    return ""


def _reached(start: int, after: dict[int, list[int]]) -> set[int]:
    found: set[int] = set()
    todo = list(after[start])
    while todo:
        if (number := todo.pop()) not in found:
            found.add(number)
            todo += after[number]
    return found


def _shared(automaton: _Automaton, after: dict[int, list[int]], one: int, other: int) -> bool:
    """Return whether some text leads from `one` to itself, from `one` to `other`, and from `other` to itself."""
    masks = automaton.masks
    seen = {(one, one, other)}
    todo = [(one, one, other)]
    while todo:
        a, b, c = todo.pop()
        for x in after[a]:
            for y in after[b]:
                if not (both := masks[x] & masks[y]):
                    continue
                for z in after[c]:
                    if both & masks[z]:
                        if (x, y, z) == (one, other, other):
                            return True
                        if (x, y, z) not in seen:
                            seen.add((x, y, z))
                            todo.append((x, y, z))
    return False


def _from_anywhere(automaton: _Automaton, after: dict[int, list[int]], loop: int) -> bool:
    """Return whether some text leads from `loop` to itself, and also holds the way from the start of a match to it."""
    masks, first = automaton.masks, sorted(automaton.whole.first)
    word = sum(1 << number for number, char in enumerate(_ALPHABET) if char.isalnum() or char == "_")

    def before(begin: int) -> int:
        if automaton.before:
            return automaton.before
        return (0 if masks[begin] & ~word else _ALL & ~word) | (0 if masks[begin] & word else word) or _ALL

    # (where the match is, where the loop is): not begun; just before its first character; at a character.
    todo: list[tuple[int, int, int]] = [(_START, masks[loop], loop)]
    seen = set(todo)
    while todo:
        here, last, round_ = todo.pop()
        for z in after[round_]:
            if here == _START:
                # One more character before the match, which is what may be before it ...
                steps = [(_START, masks[z], z)]
                # ... or its first one.
                steps += [(begin, 0, z) for begin in first if masks[begin] & masks[z] and last & before(begin)]
            else:
                steps = [(x, 0, z) for x in after[here] if masks[x] & masks[z]]
            for step in steps:
                if step[0] == loop and step[2] == loop:
                    return True
                if step not in seen:
                    seen.add(step)
                    todo.append(step)
    return False
