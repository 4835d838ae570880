"""Read YAML that a person wrote: each mistake is named with file, line, what is allowed, and the nearest name.

Parameter files of ROS are read as rcl reads them, which is not as PyYAML does.
"""

from __future__ import annotations

import contextlib
import dataclasses
import difflib
import io
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import NoReturn, TypeVar

import yaml

from grader.errors import GraderError

T = TypeVar("T")
_LISTED = 12  # names; more are not read

# Where PyYAML has libyaml, it reads the rubric in a fifteenth of the time, and nearly every command reads the rubric.
FAST_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def compose(path: Path, text: str) -> yaml.Node:
    """Return the YAML in `text` as nodes, which know their file and line; the null of YAML if there is nothing in it.

    Raises:
        GraderError: it is not YAML.
    """
    nothing = yaml.ScalarNode("tag:yaml.org,2002:null", "", yaml.Mark(str(path), 0, 0, 0, None, 0))
    with contextlib.suppress(yaml.YAMLError):
        return yaml.compose(_File(path, text), FAST_LOADER) or nothing
    try:  # again, for an error with the right line
        return yaml.compose(_File(path, text), yaml.SafeLoader) or nothing
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


def text(path: Path, advice: str = "") -> str:
    """Return the text of a file.

    Raises:
        GraderError: it cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise GraderError(f"{path} cannot be read ({error}).", advice) from error


def read(path: Path, advice: str = "") -> yaml.Node:
    """Return the YAML in a file as nodes.

    Raises:
        GraderError: it cannot be read, or is not YAML.
    """
    return compose(path, text(path, advice))


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
    """Walks the nodes of files. Its methods raise GraderError for what is not as it should be."""

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
                name = self.one_of(key, allowed, "allowed here") if allowed else self.text(key)
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

    def record(self, kind: type[T], node: yaml.Node, what: str, **read: Callable[[yaml.Node], object]) -> T:
        """Return a dataclass, each field of the mapping's value of that name by what `read` has for it, else a text.

        Fields that have a default may be missing.
        """
        fields = dataclasses.fields(kind)  # type: ignore[arg-type]  # mypy has no name for the type of dataclasses
        optional = tuple(f.name for f in fields if f.default is not f.default_factory)  # both are MISSING without one
        needed = tuple(f.name for f in fields if f.name not in optional)
        given = self.fields(node, node, needed, what, optional)
        return kind(**{name: read.get(name, self.text)(value) for name, value in given.items()})

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

    def texts(self, node: yaml.Node) -> tuple[str, ...]:
        """Return a list of scalars as they are written."""
        return tuple(map(self.text, self.items(node)))

    def one_of(self, node: yaml.Node, known: Collection[str], what: str) -> str:
        """Return a text that is one of the `known` names."""
        self.require_known(self.text(node), node, known, what)
        return self.text(node)

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


def line_of(node: yaml.Node) -> int:
    """Return the line in which a node begins, counted from 1."""
    return int(node.start_mark.line) + 1


# -- parameter files of ROS ------------------------------------------------------------------------------------------

PARAMETERS = "ros__parameters"
_TRUE = ("Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON")
_FALSE = ("N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF")
_INT = re.compile(r"([-+]?)(?:0[xX]([0-9a-fA-F]+)|(0[0-7]*)|([1-9][0-9]*))")
_DOUBLE = re.compile(r"[-+]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|(?i:inf|infinity|nan))")
_DOTTED = {sign + word for sign in ("", "+", "-") for word in (".inf", ".Inf", ".INF")} | {".nan", ".NaN", ".NAN"}
_RUN_TOGETHER = re.compile(r"\s*([\w.]+):([^\s:/=].*)")
_DEEPEST = 100
Scalar = bool | int | float | str


class ParameterFileError(ValueError):
    """rcl refuses the file: `problem` in `line`, and what to write instead."""

    def __init__(self, line: int, problem: str, cure: str) -> None:
        super().__init__(f"line {line}: {problem}")
        self.line, self.problem, self.cure = line, problem, cure


@dataclass(frozen=True)
class ParameterBlock:
    """What is below one `ros__parameters:`. `values` has the nodes by dotted name, the last one of each name."""

    keys: tuple[str, ...]
    line: int
    values: dict[str, yaml.Node]


def scalar(text: str) -> Scalar:
    """Return a value that is written without quotation marks with the type that rcl gives it."""
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if (found := _INT.fullmatch(text)) and len(text) < 30:
        sign, hexadecimal, octal, decimal = found.groups()
        number = int(hexadecimal, 16) if hexadecimal else int(octal, 8) if octal else int(decimal)
        number = -number if sign == "-" else number
        if -(2**63) <= number < 2**63:
            return number
    if text in _DOTTED:
        return float(text.replace(".", ""))
    if _DOUBLE.fullmatch(text):
        double = float(text)
        return text if double in (float("inf"), float("-inf")) and "n" not in text.lower() else double
    return text


def scalar_of(node: yaml.ScalarNode) -> Scalar:
    """Return the value of a node with the type that rcl gives it."""
    return str(node.value) if node.style else scalar(node.value)


def parameter_blocks(text: str) -> list[ParameterBlock]:
    """Return what is below each `ros__parameters:` of a parameter file.

    Raises:
        ParameterFileError: rcl refuses the file.
    """
    try:
        trees = list(yaml.compose_all(text, FAST_LOADER))
    except yaml.YAMLError as error:
        raise _not_yaml(text, error) from error
    return [block for tree in trees if tree is not None for block in _blocks(tree, ())]


def _not_yaml(text: str, error: yaml.YAMLError) -> ParameterFileError:
    mark = getattr(error, "problem_mark", None)
    line, lines = mark.line + 1 if mark else 0, [*text.splitlines(), ""]
    for number, written in enumerate(lines[:line], 1):
        if "\t" in written[: len(written) - len(written.lstrip())]:
            return ParameterFileError(number, "it is not YAML: a tab", "indent with spaces only")
        if found := _RUN_TOGETHER.fullmatch(written):
            words = f"there is no blank after the colon behind `{found[1]}`"
            return ParameterFileError(number, words, f"{found[1]}: {found[2]}")
    problem = getattr(error, "problem", "") or "it cannot be read"
    cure = "compare the indentation and the colons with the lines above"
    return ParameterFileError(line, f"it is not YAML: {problem}", cure)


def _blocks(tree: yaml.Node, above: tuple[yaml.Node, ...]) -> Iterator[ParameterBlock]:
    """Yield the blocks of a mapping below the keys `above`."""
    if isinstance(tree, yaml.SequenceNode) and not above:
        cure = f"name: / {PARAMETERS}: / parameter: value, each further indented"
        raise ParameterFileError(line_of(tree), "it is a list", cure)
    if not isinstance(tree, yaml.MappingNode) or len(above) > _DEEPEST:
        raise _no_block(tree, above)
    for key, value in tree.value:
        name = str(key.value)
        if name == PARAMETERS and above:
            if not isinstance(value, yaml.MappingNode):
                raise _no_block(value, (*above, key))
            names = (part for node in above for part in str(node.value).split("/") if part)
            yield ParameterBlock(tuple(names), line_of(above[-1]), dict(_values(value, "")))
        elif name == PARAMETERS:
            cure = f"write the node's name above it, as `name:`, and indent `{PARAMETERS}:` and all below it"
            raise ParameterFileError(line_of(key), f"no node's name is above `{PARAMETERS}:`", cure)
        elif isinstance(value, yaml.MappingNode):
            yield from _blocks(value, (*above, key))
        else:
            raise _no_block(value, (*above, key))


def _no_block(value: yaml.Node, above: Sequence[yaml.Node]) -> ParameterFileError:
    """Return why `value`, below the keys `above`, is not what rcl expects there."""
    key = above[-1] if above else value
    if key.value == PARAMETERS or value.value == "":
        cure = "indent what belongs to it by two more spaces; `name: value` has a blank after the colon"
        return ParameterFileError(line_of(key), f"nothing with a name and a value is below `{key.value}:`", cure)
    for node in above[:-1]:
        if difflib.SequenceMatcher(None, str(node.value).lower(), PARAMETERS).ratio() > 0.8:
            words = f"`{node.value}:` has to be `{PARAMETERS}:`, with two underscores"
            return ParameterFileError(line_of(node), words, f"{PARAMETERS}:")
    words = f"`{key.value}` is not below a `{PARAMETERS}:`, so no node reads it"
    return ParameterFileError(
        line_of(key), words, f"the node's name, below it {PARAMETERS}:, below that the parameters"
    )


def _values(tree: yaml.MappingNode, above: str) -> Iterator[tuple[str, yaml.Node]]:
    """Yield the parameters of a block with their dotted names."""
    for key, value in tree.value:
        name = f"{above}{key.value}"
        if isinstance(value, yaml.MappingNode):
            yield from _values(value, f"{name}.")
            continue
        if isinstance(value, yaml.ScalarNode) and not value.value and not value.style:
            raise ParameterFileError(line_of(key), f"`{name}:` has no value", f"{name}: value, or delete the line")
        if isinstance(value, yaml.SequenceNode):
            _check_list(name, value)
        yield name, value


def _check_list(name: str, items: yaml.SequenceNode) -> None:
    kinds = []
    for item in items.value:
        if isinstance(item, yaml.SequenceNode):
            raise ParameterFileError(line_of(item), f"`{name}` is a list of lists", "write one list")
        if isinstance(item, yaml.ScalarNode):
            kinds.append(type(scalar_of(item)).__name__)
    if len(set(kinds)) > 1:
        words = f"the list `{name}` mixes types: {', '.join(dict.fromkeys(kinds))}"
        raise ParameterFileError(
            line_of(items), words, "write all of its values alike: 1.0, not 1, in a list of floats"
        )
