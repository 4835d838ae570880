"""The topics, services and actions that the code creates under literal names."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.contract.spec import NODES
from grader.evidence import CodeInterface
from grader.quality.call_graph import Calls
from grader.quality.modules import argument, last_name, text

_CREATE = {"create_publisher": "publisher", "create_subscription": "subscription", "create_service": "service"}


def interfaces(calls: Calls) -> Iterator[CodeInterface]:
    """Yield what the nodes' modules create, and the classes elsewhere in the package that theirs inherit from."""
    for module in calls.modules:
        if module.stem in NODES:
            yield from _created(module.stem, module.tree)
            own = [name for name, (home, _) in calls.classes.items() if home is module]
            for name in sorted(set().union(*map(calls.made_of, own))):
                home, class_ = calls.classes.get(name, (module, None))
                if class_ is not None and home is not module:
                    yield from _created(module.stem, class_)


def _created(node_name: str, tree: ast.AST) -> Iterator[CodeInterface]:
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = last_name(node.func)
        if called in _CREATE:
            kind = _CREATE[called]
            type_, name = argument(node, 0, "msg_type", "srv_type"), argument(node, 1, "topic", "srv_name")
        elif called == "ActionServer":
            kind = "action"
            type_, name = argument(node, 1, "action_type"), argument(node, 2, "action_name")
        else:
            continue
        if text(name) and type_ is not None:
            yield CodeInterface(node_name, kind, text(name).lstrip("/"), last_name(type_))
