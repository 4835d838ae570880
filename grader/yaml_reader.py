"""Read YAML that a person wrote: each mistake is named with file, line, what is allowed, and the nearest name."""

from __future__ import annotations

import contextlib
import difflib
import io
from collections.abc import Callable, Collection, Iterator
from decimal import Decimal
from pathlib import Path
from typing import NoReturn, TypeVar

import yaml

from grader.errors import GraderError

T = TypeVar("T")
_LISTED = 12  # names; more are not read

# Where PyYAML has libyaml, it reads the rubric in a fifteenth of the time, and nearly every command reads the rubric.
FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def compose(path: Path, text: str) -> yaml.Node | None:
    """Return the YAML in `text` as nodes, which know their file and line; None if there is nothing in it.

    Raises:
        GraderError: it is not YAML.
    """
    with contextlib.suppress(yaml.YAMLError):
        return yaml.compose(_File(path, text), FAST_LOADER)
    try:  # again, for an error with the right line
        return yaml.compose(_File(path, text), yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise GraderError(f"{path}, line {line}: {error.problem}. Correct the YAML and run again.") from error
    except yaml.YAMLError as error:
        raise GraderError(f"{path} is not YAML ({error}).") from error


class _File(io.StringIO):
    """A text with the name by which PyYAML marks its nodes."""

    def __init__(self, path: Path, text: str) -> None:
        super().__init__(text)
        self.name = str(path)


def read(path: Path) -> yaml.Node | None:
    """Return the YAML in a file as nodes; None if there is nothing in it.

    Raises:
        GraderError: it cannot be read, or is not YAML.
    """
    try:
        return compose(path, path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"{path} cannot be read ({error}).") from error


@contextlib.contextmanager
def noted(mistakes: list[str]) -> Iterator[None]:
    """Add the mistake that ends the block to a list, so that what follows it is read, too."""
    try:
        yield
    except GraderError as error:
        mistakes.append(str(error))


def require_none(mistakes: list[str]) -> None:
    """Raise all mistakes that were noted as one error, a line for each; nothing if there are none."""
    if mistakes:
        raise GraderError("\n".join(mistakes))


class YamlReader:
    """Walks the nodes of one file. Its methods raise GraderError for what is not as it should be."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def mapping(self, node: yaml.Node, allowed: tuple[str, ...] = ()) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
        """Yield a mapping's keys as text, their nodes and their values; the mistakes of all keys are named at once."""
        if isinstance(node, yaml.ScalarNode) and node.value in ("", "null", "~"):
            return
        if not isinstance(node, yaml.MappingNode):
            self.fail(node, "a mapping is expected here, such as `name: value`")
        seen: set[str] = set()
        wrong: list[str] = []
        for key, _ in node.value:
            with noted(wrong):
                name = self.text(key)
                if allowed:
                    self.require_known(name, key, allowed, "allowed here")
                if name in seen:
                    self.fail(key, f"{name} is written twice; join the two")
                seen.add(name)
        require_none(wrong)
        yield from ((self.text(key), key, value) for key, value in node.value)

    def fields(
        self, node: yaml.Node, where: yaml.Node, needed: tuple[str, ...], what: str, optional: tuple[str, ...] = ()
    ) -> dict[str, yaml.Node]:
        """Return the values of a mapping that has all the `needed` keys, and maybe `optional` ones."""
        found = {key: value for key, _, value in self.mapping(node, (*needed, *optional))}
        for name in needed:
            if name not in found:
                self.fail(where, f"{name!r} is missing; {what} needs {', '.join(needed)}")
        return found

    def items(self, node: yaml.Node) -> list[yaml.Node]:
        """Return the items of a list."""
        if not isinstance(node, yaml.SequenceNode):
            self.fail(node, "a list is expected here")
        return list(node.value)

    def every(self, node: yaml.Node, make: Callable[[yaml.Node], T]) -> tuple[T, ...]:
        """Return what `make` makes of each item of a list; the mistakes of all items are named at once."""
        made: list[T] = []
        wrong: list[str] = []
        for item in self.items(node):
            with noted(wrong):
                made.append(make(item))
        require_none(wrong)
        return tuple(made)

    def text(self, node: yaml.Node) -> str:
        """Return a scalar as it is written."""
        if not isinstance(node, yaml.ScalarNode) or node.tag == "tag:yaml.org,2002:null":
            self.fail(node, "a plain text or number is expected here")
        return str(node.value)

    def points(self, node: yaml.Node, most: float | None = None, whose: str = "") -> Decimal:
        """Return a number; with `most` one from 0 to the points that `whose` is worth."""
        text = self.text(node)
        try:
            value = Decimal(text)
        except ArithmeticError:
            value = Decimal("nan")
        if not value.is_finite():
            self.fail(node, f"{text} is not a number of points")
        if most is not None and not 0 <= value <= Decimal(str(most)):
            self.fail(node, f"{whose} has {most:g} points; {text} is outside 0 to {most:g}")
        return value

    def require_known(self, name: str, node: yaml.Node, known: Collection[str], what: str) -> None:
        """Check that `name` is one of the `known` names."""
        if name not in known:
            self.fail(node, unknown(name, known, what))

    def fail(self, node: yaml.Node, problem: str) -> NoReturn:
        """Refuse the file."""
        raise GraderError(f"{node.start_mark.name}, line {line_of(node)}: {problem}")


def unknown(name: str, known: Collection[str], what: str) -> str:
    """Return in words that `name` is not one of the `known` names, and which of them is the nearest."""
    near = difflib.get_close_matches(name, known, 1, 0.4)
    hint = f" Did you mean {near[0]}?" if near else ""
    rest = ", ..." if len(known) > _LISTED else "."
    return f"{name} is not {what}.{hint} There are: {', '.join(list(known)[:_LISTED])}{rest}"


def value(node: yaml.Node | None, key: str | int) -> yaml.Node | None:
    """Return the value of a mapping's key, or an item of a list; None if there is none."""
    if isinstance(node, yaml.MappingNode):
        return next((value for name, value in node.value if name.value == key), None)
    if isinstance(node, yaml.SequenceNode) and isinstance(key, int):
        return next(iter(node.value[key : key + 1]), None)
    return None


def line_of(node: yaml.Node) -> int:
    """Return the line in which a node begins, counted from 1."""
    return int(node.start_mark.line) + 1
