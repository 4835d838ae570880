"""Bad habits: a bare except, print, a mutable default, sleeping in a callback.

The first three are not left to plugins of flake8: installed beside ament_flake8 these would report in the student's
own runs of it, too, and Q1 promises that those agree with the grader.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from grader.evidence import Finding
from grader.python_ast import Function, called
from grader.quality.call_graph import CallGraph, own_body
from grader.quality.parsed_module import Module

_MUTABLE = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp)
_MUTABLE_CALLS = ("list", "dict", "set", "bytearray", "defaultdict", "deque", "OrderedDict", "Counter")


def bad_habits(modules: Sequence[Module], graph: CallGraph) -> list[Finding]:
    """Return every finding outside the tests. Scripts talk to a person, so they may print."""
    found = [finding for module in modules if module.role != "test" for finding in _in_module(module)]
    return sorted([*found, *_in_callbacks(graph)], key=lambda finding: (finding.path, finding.line))


def _in_module(module: Module) -> Iterator[Finding]:
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ExceptHandler) and node.type is None:
            yield Finding(module.path, node.lineno, "bare-except", "`except:` without a type")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
            if module.role == "module":
                yield Finding(module.path, node.lineno, "print", "`print` instead of the node's logger")
        elif isinstance(node, Function | ast.Lambda):
            name = getattr(node, "name", "lambda")
            for default in [*node.args.defaults, *node.args.kw_defaults]:
                if default and (isinstance(default, _MUTABLE) or called(default) in _MUTABLE_CALLS):
                    yield Finding(module.path, default.lineno, "mutable-default", f"`{name}` has a mutable default")


def _in_callbacks(graph: CallGraph) -> Iterator[Finding]:
    """Yield what keeps a callback from returning to the executor. Loops cost nothing; they explain a deaf node."""
    for node, root in graph.in_callbacks():
        imports = graph.imports[node.module.path]
        name = node.function.name
        where = f"in the callback `{name}`" if root == name else f"in `{name}`, called from the callback `{root}`"
        for part in own_body(node.function):
            if isinstance(part, ast.Call) and imports.meaning(part.func) == "time.sleep":
                yield Finding(node.module.path, part.lineno, "sleep-in-callback", f"`time.sleep` {where}")
            elif isinstance(part, ast.While) and _holds_on(part):
                yield Finding(node.module.path, part.lineno, "loop-in-callback", f"`while` {where}")


def _holds_on(loop: ast.While) -> bool:
    """Return whether a loop may go on for as long as another callback does not run: it awaits and yields nothing.

    A loop that counts, or takes from a list until it is empty, ends by itself.
    """
    body = [part for statement in loop.body for part in ast.walk(statement)]
    if any(isinstance(part, ast.Await | ast.Yield | ast.YieldFrom) for part in body):
        return False
    if isinstance(loop.test, ast.Constant) or called(loop.test) == "ok":
        return not any(isinstance(part, ast.Break | ast.Return | ast.Raise) for part in body)
    tested = {ast.unparse(part) for part in ast.walk(loop.test) if isinstance(part, ast.Attribute)}
    changed = {ast.unparse(part) for part in body if isinstance(getattr(part, "ctx", None), ast.Store)}
    calls = [part.func for part in body if isinstance(part, ast.Call)]
    used = {ast.unparse(function.value) for function in calls if isinstance(function, ast.Attribute)}
    return bool(tested) and not tested & (changed | used)
