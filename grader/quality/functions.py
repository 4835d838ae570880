"""Are the contract's functions in their module, and do the nodes use them?"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from grader.course import Functions
from grader.evidence import Finding, FunctionUse
from grader.python_ast import Function, called, last_name
from grader.quality.call_graph import CallGraph
from grader.quality.parsed_module import Module

_ARCS = ("atan2", "arctan2", "asin", "arcsin", "acos", "arccos")
_MAX_ENTRIES = 50


def function_use(graph: CallGraph, functions: Functions | None) -> FunctionUse:
    """Return which of the functions their module defines, the calls of it in other modules, and work done elsewhere."""
    if functions is None:
        return FunctionUse()
    inside = functions.module.partition("/")[2]
    home = next((module for module in graph.modules if module.path.endswith(inside)), None)
    elsewhere = [
        finding for module in graph.modules if module is not home for finding in _by_hand(module, functions.names)
    ]
    if home is None:
        return FunctionUse(elsewhere=elsewhere)
    defined = [node.name for node in home.tree.body if isinstance(node, Function)]
    users = [module for module in graph.modules if module is not home]
    calls = [finding for module in users for finding in _calls_of(home, defined, module, graph)]
    return FunctionUse(defined[:_MAX_ENTRIES], calls[:_MAX_ENTRIES], elsewhere[:_MAX_ENTRIES])


def _calls_of(home: Module, defined: Sequence[str], module: Module, graph: CallGraph) -> Iterator[Finding]:
    names = {f"{home.name}.{name}" for name in defined}
    # utils/__init__.py may re-export them: `from ..utils import clamp` then means the same.
    package = home.name.rpartition(".")[0]
    init = next((other for other in graph.modules if other.name == package), None)
    if init is not None:
        exported = graph.imports[init.path].names.values()
        whole = (home.name, "*") in exported
        names |= {f"{package}.{name}" for name in defined if whole or (home.name, name) in exported}
    imported = graph.imports[module.path]
    star = imported.names.get("*", ("", ""))[0] in (home.name, package)
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            bare = node.func.id if isinstance(node.func, ast.Name) else ""
            if imported.meaning(node.func) in names or (star and bare in defined):
                yield Finding(module.path, node.lineno, "conversion", last_name(node.func))


def _by_hand(module: Module, names: Sequence[str]) -> Iterator[Finding]:
    for node in ast.walk(module.tree):
        if words := _conversion(node, names):
            yield Finding(module.path, getattr(node, "lineno", 1), "conversion-by-hand", words)


def _conversion(node: ast.AST, names_of_functions: Sequence[str]) -> str:
    """Return which conversion a node makes itself, in words; "" if none."""
    if isinstance(node, Function) and node.name.strip("_") in names_of_functions:
        return f"`{node.name}` is defined here"
    if isinstance(node, ast.Call) and called(node) in _ARCS:
        names = {last_name(part).lower() for argument in node.args for part in ast.walk(argument)}
        if names & {"z", "qz"} and names & {"w", "qw"}:
            return "a yaw is computed from a quaternion by hand"
        if len(node.args) == 2 and {"sin", "cos"} <= names:
            return "an angle is normalised by hand"
    turns = isinstance(node, ast.While) and "pi" in {last_name(part) for part in ast.walk(node.test)}
    if turns and any(isinstance(part, ast.AugAssign) for part in ast.walk(node)):
        return "an angle is normalised by hand"
    return ""
