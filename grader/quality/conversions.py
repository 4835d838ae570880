"""Are the conversions in utils/, and do the nodes use them?"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from grader.contract.spec import NODES
from grader.evidence import Conversions, Finding
from grader.quality.call_graph import Calls
from grader.quality.modules import Function, Module, last_name

FUNCTIONS = ("yaw_from_quaternion", "quaternion_from_yaw", "normalize_angle", "clamp")
_ARCS = ("atan2", "arctan2", "asin", "arcsin", "acos", "arccos")


def conversions(calls: Calls) -> Conversions:
    """Return what utils/conversions.py defines, the calls of it that the nodes lead to, and work done elsewhere."""
    home = next((module for module in calls.modules if module.path.endswith("utils/conversions.py")), None)
    if home is None:
        return Conversions(elsewhere=list(_elsewhere(calls.modules)))
    defined = [node.name for node in home.tree.body if isinstance(node, Function)]
    others = [module for module in calls.modules if module is not home]
    reached = _reached_from_nodes(calls)
    return Conversions(
        defined=defined[:50],
        calls=[
            finding
            for module in others
            if module.path in reached
            for finding in _calls_of(home, defined, module, calls)
        ][:50],
        elsewhere=list(_elsewhere(others))[:50],
    )


def _reached_from_nodes(calls: Calls) -> set[str]:
    """Return the paths of the modules that the nodes import, directly or not, and of the nodes."""
    by_name = {module.name: module for module in calls.modules}
    todo = [module for module in calls.modules if module.stem in NODES]
    found: set[str] = set()
    while todo:
        module = todo.pop()
        if module.path not in found:
            found.add(module.path)
            todo += [by_name[name] for name in calls.imports[module.path].modules if name in by_name]
    return found


def _calls_of(home: Module, defined: Sequence[str], module: Module, calls: Calls) -> Iterator[Finding]:
    places = {f"{home.name}.{name}" for name in defined}
    # utils/__init__.py may hand them on, which makes `from ..utils import clamp` mean the same.
    package = home.name.rpartition(".")[0]
    init = next((other for other in calls.modules if other.name == package), None)
    if init is not None:
        handed_on = calls.imports[init.path].names.values()
        stars = {source for source, name in handed_on if name == "*"}
        places |= {
            f"{package}.{name}"
            for name in defined
            if (home.name, name) in handed_on or home.name in stars
        }  # fmt: skip
    imported = calls.imports[module.path]
    everything = ("*" in imported.names) and imported.names["*"][0] in (home.name, package)
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Call):
            bare = node.func.id if isinstance(node.func, ast.Name) else ""
            if imported.meaning(node.func) in places or (everything and bare in defined):
                yield Finding(module.path, node.lineno, "conversion", last_name(node.func))


def _elsewhere(modules: Sequence[Module]) -> Iterator[Finding]:
    for module in modules:
        for node in ast.walk(module.tree):
            words = _by_hand(node)
            if words:
                yield Finding(module.path, getattr(node, "lineno", 1), "conversion-by-hand", words)


def _by_hand(node: ast.AST) -> str:
    if isinstance(node, Function) and node.name.strip("_") in FUNCTIONS:
        return f"`{node.name}` is defined here"
    if isinstance(node, ast.Call) and last_name(node.func) in _ARCS:
        names = {last_name(part).lower() for argument in node.args for part in ast.walk(argument)}
        if any(name in ("z", "qz") for name in names) and any(name in ("w", "qw") for name in names):
            return "a yaw is computed from a quaternion by hand"
        if len(node.args) == 2 and {"sin", "cos"} <= names:
            return "an angle is normalised by hand"
    turns = isinstance(node, ast.While) and "pi" in {last_name(part) for part in ast.walk(node.test)}
    if turns and any(isinstance(part, ast.AugAssign) for part in ast.walk(node)):
        return "an angle is normalised by hand"
    return ""
