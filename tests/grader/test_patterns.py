"""No regular expression of the grader is slow on any text: a submission's text may be made for that."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from helpers.backtracking import slow

from grader import KIT, tracebacks
from grader.checks import build_log
from grader.courses.robot_controller.checks import check_set_speed
from grader.quality import package_sources

# They read the kit's own texts, what a student types, or /proc; `ros2` runs on a student's side.
ELSEWHERE = ("authoring", "host", "notebook", "ros2", "selftest")
METHODS = {"search", "match", "fullmatch", "sub", "subn", "split", "findall", "finditer", "compile"}
FLAGS = {"MULTILINE": re.MULTILINE, "DOTALL": re.DOTALL, "VERBOSE": re.VERBOSE, "IGNORECASE": re.IGNORECASE}

BOUNDED = {
    "causes._CUT": "a report's sentence has been cut to a few hundred characters",
    "causes._NUMBER": "as causes._CUT",
    "cells.84": "a sheet that the learning platform exported",
}
"""Patterns that would be slow on a long text and do not get one, with the reason."""


def patterns(path: Path) -> Iterator[tuple[str, str | bytes, int, str]]:
    """Yield the name or the line of each pattern in a file, the pattern, its flags, and how it is used."""
    tree = ast.parse(path.read_text())
    assigned = [node for node in tree.body if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)]
    constants = {ast.unparse(node.targets[0]): node.value for node in assigned}
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)]
    methods = defaultdict(set)
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            methods[ast.unparse(node.value)].add(node.attr)
    for node in ast.walk(tree):
        if isinstance(node, ast.For | ast.comprehension):
            methods[ast.unparse(node.iter)] |= methods[ast.unparse(node.target)]
    names = {id(call): name for name, value in constants.items() for call in ast.walk(value)}
    for call in calls:
        function = call.func
        assert isinstance(function, ast.Attribute)
        if ast.unparse(function.value) == "re" and function.attr in METHODS:
            name = names.get(id(call), "")
            pattern = text_of(call.args[0], constants)
            flags = sum(flag for word, flag in FLAGS.items() if f"re.{word}" in ast.unparse(call))
            used = (methods[name] & METHODS if name else {function.attr}) or {"search"}
            for method in used:
                yield f"{path.stem}.{name or call.lineno}", pattern, flags, method


def text_of(node: ast.expr, constants: Mapping[str, ast.expr]) -> str | bytes:
    """Return a pattern as it is written; what is put into it is escaped, and is "x" here."""
    match node:
        case ast.Constant(value=str() | bytes() as value):
            return value
        case ast.JoinedStr(values=parts):
            return "".join(str(text_of(part, constants)) for part in parts)
        case ast.FormattedValue(value=ast.Name(id=name)) | ast.Name(id=name) if name in constants:
            return text_of(constants[name], constants)
        case ast.Call(func=ast.Attribute(attr="encode", value=value)):
            return str(text_of(value, constants)).encode()
    return "x"


def files() -> list[Path]:
    return [path for path in sorted((KIT / "grader").rglob("*.py")) if path.parts[len(KIT.parts) + 1] not in ELSEWHERE]


SLOW = [
    ("(a+)+$", "search"),
    ("(?:a|aa)+c", "match"),
    ("a*a*b", "match"),
    ("a.*b.*c", "match"),
    (r"\w+@", "search"),
    (r"^\s*x", "search"),
    (r"x\[[^\]]*\]", "search"),
    (r"(?:dear|hi)\s*:?\s*(?:any|a)?\s*(?:robot|grader)\b", "search"),
    (r"in send_response\b(?:.*\n)*?\s*(?:raise )?TypeError", "search"),
    (r".*\d.*x", "fullmatch"),
]
LINEAR = [
    ("a+", "search"),
    ("a+", "fullmatch"),
    ("a*b", "match"),
    (r"(?<!\w)\w+@", "search"),
    (r"\b\w+@", "search"),
    (r"^[ \t]*x", "search"),
    (r"\bcolcon\s+build\b", "search"),
    (r"a[^b]*b[^c]*c", "match"),
    ('"[^"]*"', "match"),
]


@pytest.mark.parametrize(("pattern", "method"), SLOW)
def test_a_pattern_that_can_be_slow_is_found(pattern: str, method: str):
    assert is_slow(pattern, re.MULTILINE, method)


@pytest.mark.parametrize(("pattern", "method"), LINEAR)
def test_a_linear_pattern_is_none(pattern: str, method: str):
    assert not is_slow(pattern, re.MULTILINE, method)


def is_slow(pattern: str | bytes, flags: int, method: str) -> str:
    return slow(pattern, flags, searched=method not in ("match", "fullmatch"), complete=method == "fullmatch")


@pytest.mark.slow  # examines each pattern of the kit
def test_every_pattern_takes_linear_time():
    found = [use for path in files() for use in patterns(path)]
    found += [("build_log._KNOWN", pattern, 0, "search") for pattern, _ in build_log._KNOWN]
    assert len(found) > 100
    slow_ones = {use[0]: f"{why}: {use[1]!r}" for use in found if (why := is_slow(*use[1:]))}
    assert {where: why for where, why in slow_ones.items() if where not in BOUNDED} == {}


def test_texts_made_to_be_slow_are_read():
    """Each took minutes, or longer than anybody waits."""
    assert package_sources.commands("project(a)\n" + "#[[\n" * 100_000)[0].name == "project"
    assert tracebacks.without_ignored("Exception ignored in: x\nTraceback (most recent call last):\n" + "\t" * 500_000)
    assert not check_set_speed.states("1" * 100_000 + "x", 0.5)
