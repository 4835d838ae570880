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
    return sorted([*found, *_sleeps(graph)], key=lambda finding: (finding.path, finding.line))


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


def _sleeps(graph: CallGraph) -> Iterator[Finding]:
    for node, root in graph.in_callbacks():
        imports = graph.imports[node.module.path]
        name = node.function.name
        where = f"in the callback `{name}`" if root == name else f"in `{name}`, called from the callback `{root}`"
        for part in own_body(node.function):
            if isinstance(part, ast.Call) and imports.meaning(part.func) == "time.sleep":
                yield Finding(node.module.path, part.lineno, "sleep-in-callback", f"`time.sleep` {where}")
