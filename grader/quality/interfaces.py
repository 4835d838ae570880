"""The topics, services and actions that the code creates under literal names."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.evidence import CodeInterface
from grader.quality.modules import NODES, Module, argument, last_name, text

_CREATE = {"create_publisher": "publisher", "create_subscription": "subscription", "create_service": "service"}


def interfaces(module: Module) -> Iterator[CodeInterface]:
    """Yield what a node's module creates, in order."""
    if module.stem not in NODES or module.role != "module":
        return
    for node in ast.walk(module.tree):
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
            yield CodeInterface(module.stem, kind, text(name).lstrip("/"), last_name(type_))
