"""Find blocks of code that occur more than once in the package."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from grader.course.model import JUDGED
from grader.evidence import Copy
from grader.python_ast import BODIES, Function, inner, is_docstring, last_name
from grader.quality.parsed_module import Module

BLOCK = 6  # lines, each with a statement of its own or the head of one
_MAX_PLACES = 20
_MAX_COPIES = 50


@dataclass(frozen=True)
class _Line:
    path: str
    first: int
    last: int
    code: str


def duplicated_blocks(modules: Sequence[Module]) -> list[Copy]:
    """Return the blocks of six or more lines that occur more than once, the longest first.

    Spaces, comments and line breaks make no difference. Imports, docstrings, tests and the end of every ROS node
    (`main` and the lines that call it) do not count.
    """
    runs = [list(_lines(module)) for module in modules if module.role in JUDGED]
    places: dict[tuple[str, ...], list[tuple[int, int]]] = defaultdict(list)
    for number, run in enumerate(runs):
        for start in range(len(run) - BLOCK + 1):
            places[_block(run, start)].append((number, start))
    found = []
    seen: set[tuple[int, int]] = set()
    for number, run in enumerate(runs):
        for start in range(len(run) - BLOCK + 1):
            here = (number, start)
            if here in seen:
                continue
            candidates = [place for place in places[_block(run, start)] if place > here and place not in seen]
            lengths = {place: _common(runs, here, place) for place in candidates[:_MAX_PLACES]}
            others = [place for place, length in lengths.items() if length >= BLOCK]
            if not others:
                continue
            length = min(lengths[place] for place in others)
            group = [here, *others]
            seen |= {(n, s + step) for n, s in group for step in range(length - BLOCK + 1)}
            found.append(Copy(length, [_place(runs[n][s : s + length]) for n, s in group[:5]]))
    return sorted(found, key=lambda copy: -copy.lines)[:_MAX_COPIES]


def copied_lines(originals: Iterable[Module], module: Module) -> int:
    """Return how many lines of a module stand in the originals, too, in blocks as `duplicated_blocks` compares them."""
    known = {block for original in originals for block in _blocks(list(_lines(original)))}
    blocks = _blocks(list(_lines(module)))
    return len({start + step for start, block in enumerate(blocks) if block in known for step in range(BLOCK)})


def _blocks(run: Sequence[_Line]) -> list[tuple[str, ...]]:
    return [_block(run, start) for start in range(len(run) - BLOCK + 1)]


def _block(run: Sequence[_Line], start: int) -> tuple[str, ...]:
    return tuple(line.code for line in run[start : start + BLOCK])


def _common(runs: Sequence[Sequence[_Line]], a: tuple[int, int], b: tuple[int, int]) -> int:
    """Return how many lines two places have in common; a block does not run into its own copy."""
    (run_a, start_a), (run_b, start_b) = a, b
    most = min(len(runs[run_a]) - start_a, len(runs[run_b]) - start_b)
    if run_a == run_b:
        most = min(most, start_b - start_a)
    length = 0
    while length < most and runs[run_a][start_a + length].code == runs[run_b][start_b + length].code:
        length += 1
    return length


def _place(lines: Sequence[_Line]) -> str:
    return f"{lines[0].path}:{lines[0].first}-{lines[-1].last}"


def _lines(module: Module) -> Iterator[_Line]:
    """Yield the module's code in order, a line for each simple statement and for each head of a compound one."""
    todo: list[ast.AST] = list(reversed(module.tree.body))
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Import | ast.ImportFrom) or is_docstring(node) or _is_ending(node):
            continue
        inside = inner(node)
        first = getattr(node, "lineno", 0)
        last = getattr(node, "end_lineno", first) if not inside else first
        yield _Line(module.path, first, last, _code(node))
        todo += reversed(inside)


def _is_ending(node: ast.AST) -> bool:
    """Return whether this is `def main` or `if __name__ == '__main__'`."""
    if isinstance(node, Function):
        return node.name == "main"
    return isinstance(node, ast.If) and "__name__" in {last_name(part) for part in ast.walk(node.test)}


def _code(node: ast.AST) -> str:
    """Return a statement's structure as text; for a compound statement, only its head's."""
    parts = [type(node).__name__]
    for name, value in ast.iter_fields(node):
        if name not in (*BODIES, "type_comment"):
            for part in value if isinstance(value, list) else [value]:
                parts.append(ast.dump(part) if isinstance(part, ast.AST) else repr(part))
    return " ".join(parts)
