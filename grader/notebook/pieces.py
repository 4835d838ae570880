"""Put single functions into a file of the package: the cell magic `%%into FILE`, and the texts behind it."""

from __future__ import annotations

import ast
import difflib
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path

from grader import python_ast
from grader.words import mark, say

MAGIC = "into"


@dataclass(frozen=True)
class Definition:
    """A function in a text: its name ("Driver.stop"), and its lines, from `start` up to and without `end`."""

    name: str
    start: int
    end: int


def definitions(text: str) -> list[Definition]:
    """Return the functions of a module and the methods of its classes, in their order; nested functions are no part.

    Raises:
        SyntaxError: it is no valid Python; or another of python_ast.UNPARSABLE.
    """
    lines, found = text.splitlines(), []
    for node in python_ast.tree_of(text).body:
        prefix, inside = (f"{node.name}.", node.body) if isinstance(node, ast.ClassDef) else ("", [node])
        for each in (each for each in inside if isinstance(each, python_ast.Function)):
            end = _past_comments(lines, each.end_lineno or each.lineno, each.col_offset)
            found.append(Definition(prefix + each.name, python_ast.first_line(each) - 1, end))
    return found


def _past_comments(lines: list[str], end: int, column: int) -> int:
    """Return the end of a function with the comments that follow its last statement: a TODO may be one."""
    found = end
    for number, text in enumerate(map(str.lstrip, lines[end:]), end):
        if text and not (text.startswith("#") and len(lines[number]) - len(text) > column):
            break
        found = number + 1 if text else found
    return found


def merged(text: str, piece: str) -> str:
    """Return `text` with the functions of `piece` in place of those of the same name.

    A function that is new goes to the end of its class or of the module.

    Raises:
        ValueError: `piece` holds something else than functions and methods, a method of a class that `text` lacks, a
            method without its class, or a name that is nearly one of `text`.
        SyntaxError: one of the two is no valid Python; or another of python_ast.UNPARSABLE.
    """
    _refuse_all_but_functions(piece)
    wanted = {found.name: piece.splitlines()[found.start : found.end] for found in definitions(piece)}
    lines = text.splitlines()
    for found in reversed(definitions(text)):
        if found.name in wanted:
            lines[found.start : found.end] = wanted.pop(found.name)
    for name, new in wanted.items():
        _refuse_a_slip(text, name, new)
        _append(lines, name, new)
    return "\n".join(lines) + "\n"


def functions(text: str) -> dict[str, str]:
    """Return the text of each function of a module by its name.

    Raises:
        SyntaxError: it is not valid Python; or another of python_ast.UNPARSABLE.
    """
    lines = text.splitlines()
    return {found.name: "\n".join(lines[found.start : found.end]) for found in definitions(text)}


def filled(piece: str, solution: str, names: Container[str] | None = None) -> str:
    """Return `piece` with each of its functions, or those with these names, as `solution` has it."""
    there, lines = functions(solution), piece.splitlines()
    for found in reversed(definitions(piece)):
        if names is None or found.name in names:
            lines[found.start : found.end] = there[found.name].splitlines()
    return "\n".join(lines)


def _refuse_all_but_functions(piece: str) -> None:
    for node in python_ast.tree_of(piece).body:
        inner = node.body if isinstance(node, ast.ClassDef) else [node]
        if other := next((item for item in inner if not isinstance(item, python_ast.Function)), None):
            what = ast.unparse(other).splitlines()[0]
            words = mark("only functions can go in; `{what}` belongs into the cell that writes the file")
            raise ValueError(say(words, what=what))


def _refuse_a_slip(text: str, name: str, new: list[str]) -> None:
    """Refuse a new function that is a method without its class, or a name of the file with a typing error."""
    if "." not in name and any(line.startswith(("def ", "async def ")) and "(self" in line for line in new):
        words = mark("`{name}` has the argument `self`, so it is a method: put `class ...:` above it, and indent it")
        raise ValueError(say(words, name=name))
    owner, _, method = name.rpartition(".")
    beside = [last for o, _, last in (found.name.rpartition(".") for found in definitions(text)) if o == owner]
    near = difflib.get_close_matches(method, beside, n=1, cutoff=0.8)
    if near and not name.startswith("test_"):
        words = mark("the file has no function `{method}`; did you mean `{near}`?")
        raise ValueError(say(words, method=method, near=near[0]))


def _append(lines: list[str], name: str, new: list[str]) -> None:
    owner, _, method = name.rpartition(".")
    if not owner:
        lines += ["", "", *new]
        return
    classes = {node.name: node for node in python_ast.tree_of("\n".join(lines)).body if isinstance(node, ast.ClassDef)}
    if owner not in classes:
        raise ValueError(say("the file has no class {owner} for {method}", owner=owner, method=method))
    end = classes[owner].end_lineno or len(lines)
    lines[end:end] = ["", *new]


def into(line: str, cell: str) -> None:
    """Put the functions of a cell `%%into FILE` into that file, and print what is there now."""
    name = line.strip()
    path = Path(name).expanduser()
    if not path.is_file():
        words = mark("There is no {name} yet. Run the cell above that writes it, then this one again.")
        print(say(words, name=name or "file"))
        return
    try:
        before = path.read_text(encoding="utf-8")
        text = merged(before, cell)
    except SyntaxError as error:
        words = mark("Nothing was written. Line {where} of this cell: {error.msg}: {text_}")
        print(say(words, where=(error.lineno or 0) + 1, error=error, text_=(error.text or "").strip()))
        return
    except (ValueError, *python_ast.TOO_COMPLEX) as error:
        print(say("Nothing was written: {error}.", error=error))
        return
    path.write_text(text, encoding="utf-8")
    there, now = ([found.name for found in definitions(source)] for source in (before, cell))
    names = [one + ("" if one in there else say(" (added)")) for one in now]
    print(say("{name} has now: {names}", name=name, names=", ".join(names)))
