"""Habits that hurt: a bare except, print, a mutable default, sleeping in a callback."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from grader.evidence import Finding
from grader.quality.call_graph import Calls, own_body
from grader.quality.modules import Function, Module, last_name

_MUTABLE = (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.SetComp)
_MUTABLE_CALLS = ("list", "dict", "set", "bytearray", "defaultdict", "deque", "OrderedDict", "Counter")


def habits(modules: Sequence[Module], calls: Calls) -> list[Finding]:
    """Return every such place. Tests are left out, and scripts, which talk to a person, may print."""
    found = [finding for module in modules if module.role != "test" for finding in _in_module(module)]
    return sorted([*found, *_sleeps(calls)], key=lambda finding: (finding.path, finding.line))


def _in_module(module: Module) -> Iterator[Finding]:
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ExceptHandler) and node.type is None:
            yield Finding(module.path, node.lineno, "bare-except", "`except:` without a type")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
            if module.role == "module":
                yield Finding(module.path, node.lineno, "print", "`print` instead of the node's logger")
        elif isinstance(node, Function | ast.Lambda):
            for default in [*node.args.defaults, *node.args.kw_defaults]:
                if isinstance(default, _MUTABLE) or (
                    isinstance(default, ast.Call) and last_name(default.func) in _MUTABLE_CALLS
                ):
                    name = getattr(node, "name", "lambda")
                    yield Finding(module.path, default.lineno, "mutable-default", f"a default of `{name}` can change")


def _sleeps(calls: Calls) -> Iterator[Finding]:
    for node, root in calls.in_callbacks():
        for part in own_body(node.tree):
            if isinstance(part, ast.Call) and calls.imports[node.module.path].meaning(part.func) == "time.sleep":
                name = node.tree.name
                words = f"`time.sleep` in the callback `{name}`"
                if root != name:
                    words = f"`time.sleep` in `{name}`, called from the callback `{root}`"
                yield Finding(node.module.path, part.lineno, "sleep-in-callback", words)
