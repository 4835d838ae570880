"""Public modules, classes and functions: do they have docstrings and annotations?"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath

from grader.course.model import JUDGED
from grader.evidence import Definition, Finding
from grader.python_ast import Function, last_name
from grader.quality.parsed_module import Module
from grader.sanitize import printable

# One docstring is enough for a property and its setter, and for a function and its overloads.
_SAME_THING = ("setter", "deleter", "getter", "overload")
_MAX_DOCSTRING = 500
_MAX_VIOLATIONS = 5  # of one docstring


def public_definitions(module: Module) -> Iterator[Definition]:
    """Yield what is public in a module of the package, a launch file or a script: no leading _ on the way to it."""
    parts = PurePosixPath(module.path).with_suffix("").parts
    if module.role not in JUDGED or any(part.startswith("_") and part != "__init__" for part in parts):
        return
    if module.tree.body or module.stem != "__init__":
        words = _words(module.tree)
        yield Definition(module.path, 1, "module", module.name, bool(words), words=words)
    yield from _inside(module.path, module.tree.body, "")


def _inside(path: str, body: Sequence[ast.stmt], owner: str) -> Iterator[Definition]:
    for node in body:
        if isinstance(node, ast.If | ast.Try):
            yield from _inside(path, [*node.body, *node.orelse, *getattr(node, "finalbody", [])], owner)
        elif isinstance(node, ast.ClassDef | Function) and not node.name.startswith("_") and not _is_same(node):
            words = _words(node)
            name = f"{owner}{node.name}"
            if isinstance(node, ast.ClassDef):
                yield Definition(path, node.lineno, "class", name, bool(words), words=words)
                yield from _inside(path, node.body, f"{name}.")
            else:
                missing = _unannotated(node, is_method=bool(owner))
                yield Definition(path, node.lineno, "function", name, bool(words), unannotated=missing, words=words)


def with_violations(definitions: Sequence[Definition], copies: Mapping[str, str]) -> list[Definition]:
    """Return the definitions with what their docstrings violate of ament_pep257's rules.

    `copies` are the paths of the files' copies, by the files' own.
    """
    import pydocstyle
    from ament_pep257.main import _ament_ignore

    paths = {copy: path for path, copy in copies.items()}
    # pydocstyle gives a module and a definition on its first line the same line, as we do.
    found: dict[tuple[str, int], list[Finding]] = defaultdict(list)
    for error in pydocstyle.check(list(paths), ignore=_ament_ignore, ignore_inline_noqa=True):
        if isinstance(error, pydocstyle.violations.Error):  # anything else is a file that it cannot parse
            rule, _, text = error.message.partition(": ")
            path = paths[error.definition.module.name]
            found[path, error.definition.start].append(Finding(path, error.line, rule, printable(text)))
    return [replace(item, violations=found[item.path, item.line][:_MAX_VIOLATIONS]) for item in definitions]


def _words(node: ast.Module | ast.ClassDef | Function) -> str:
    return " ".join(re.findall(r"[^\W\d_]+", (ast.get_docstring(node) or "")[:_MAX_DOCSTRING].lower()))


def _is_same(node: ast.ClassDef | Function) -> bool:
    return any(last_name(decorator) in _SAME_THING for decorator in node.decorator_list)


def _unannotated(node: Function, *, is_method: bool) -> list[str]:
    """Return the names of the parameters without a type, and "return"."""
    given = node.args
    parameters = [*given.posonlyargs, *given.args]
    if is_method and not any(last_name(decorator) == "staticmethod" for decorator in node.decorator_list):
        parameters = parameters[1:]
    rest = [item for item in (given.vararg, given.kwarg) if item is not None]
    missing = [item.arg for item in (*parameters, *given.kwonlyargs, *rest) if item.annotation is None]
    return missing + (["return"] if node.returns is None else [])
