"""The topics, services and actions that the code creates under literal names."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from grader.evidence import CodeInterface
from grader.python_ast import argument, called, last_name, literal_string
from grader.quality.call_graph import CallGraph

_CREATE = {"create_publisher": "publisher", "create_subscription": "subscription", "create_service": "service"}


def created_interfaces(graph: CallGraph, nodes: Collection[str]) -> Iterator[CodeInterface]:
    """Yield what the nodes' modules create, and what the classes do that theirs inherit from elsewhere."""
    for module in graph.modules:
        if module.stem in nodes:
            yield from _created(module.stem, module.tree)
            own = [name for name, (home, _) in graph.classes.items() if home is module]
            for name in sorted(set().union(*map(graph.bases_of, own))):
                home, class_ = graph.classes.get(name, (module, None))
                if class_ is not None and home is not module:
                    yield from _created(module.stem, class_)


def _created(node_name: str, tree: ast.AST) -> Iterator[CodeInterface]:
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        if kind := _CREATE.get(called(node), ""):
            type_, name = argument(node, 0, "msg_type", "srv_type"), argument(node, 1, "topic", "srv_name")
        elif called(node) == "ActionServer":
            kind = "action"
            type_, name = argument(node, 1, "action_type"), argument(node, 2, "action_name")
        else:
            continue
        if literal_string(name) and type_ is not None:
            yield CodeInterface(node_name, kind, literal_string(name).lstrip("/"), last_name(type_))
