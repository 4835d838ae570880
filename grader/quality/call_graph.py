"""Which function of the package calls which, by name: enough to see what a callback can reach."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from grader.python_ast import Function, argument, called, last_name, literal_string
from grader.quality.parsed_module import Imports, Module, imports

# Calls that hand a function to the executor, which calls it back and does nothing else while it runs.
_REGISTER = {
    "create_subscription", "create_timer", "create_service", "ActionServer", "add_on_set_parameters_callback",
    "add_pre_set_parameters_callback", "add_post_set_parameters_callback", "add_done_callback",
    "register_handle_accepted_callback", "register_goal_callback", "register_cancel_callback",
    "register_execute_callback", "registerCallback", "Subscriber",
}  # fmt: skip


# Where they take the function: its place among the arguments, and its name.
_CALLBACKS = {
    "create_subscription": (2, "callback"), "create_timer": (1, "callback"), "create_service": (2, "callback"),
    "ActionServer": (3, "execute_callback"),
}  # fmt: skip


@dataclass(frozen=True)
class GraphNode:
    """A function of the package; `owner` is the name of its class, "" outside of one."""

    module: Module
    owner: str
    function: Function

    @property
    def key(self) -> tuple[str, str, str]:
        """Return what distinguishes it from every other function."""
        return self.module.path, self.owner, f"{self.function.name}:{self.function.lineno}"


class CallGraph:
    """The functions of the package's modules and the calls between them."""

    def __init__(self, modules: Sequence[Module]) -> None:
        self.modules = [module for module in modules if module.role == "module"]
        self.imports: dict[str, Imports] = {module.path: imports(module) for module in self.modules}
        self._nodes = [node for module in self.modules for node in _functions(module)]
        self._outside = {(node.module.name, node.function.name): node for node in self._nodes if not node.owner}
        self.classes = {
            class_.name: (module, class_)
            for module in self.modules
            for class_ in ast.walk(module.tree)
            if isinstance(class_, ast.ClassDef)
        }

    def in_callbacks(self) -> list[tuple[GraphNode, str]]:
        """Return the functions that run in a callback, each with the name of a callback that leads to it."""
        found: dict[tuple[str, str, str], tuple[GraphNode, str]] = {}
        todo = [(callback, callback.function.name) for node in self._nodes for callback in self._registered(node)]
        while todo:
            node, root = todo.pop()
            if node.key not in found:
                found[node.key] = node, root
                todo += [(callee, root) for callee in self._callees(node, own_body(node.function))]
        return list(found.values())

    def service_callbacks(self) -> list[tuple[GraphNode, str]]:
        """Return the functions that answer a service, each with the service's name, "" where that is no constant."""
        found = []
        for node in self._nodes:
            for call in own_body(node.function):
                if isinstance(call, ast.Call) and called(call) == "create_service":
                    name = literal_string(argument(call, 1, "srv_name"))
                    callback = argument(call, 2, "callback")
                    found += [(named, name) for named in self._named(node, callback)] if callback else []
        return found

    def called_callbacks(self) -> Iterator[tuple[GraphNode, ast.Call, ast.Call]]:
        """Yield each call that gets what a function without a result returns in place of a callback: `f()` for `f`."""
        for node in self._nodes:
            for call in own_body(node.function):
                if isinstance(call, ast.Call) and (where := _CALLBACKS.get(last_name(call.func))):
                    given = argument(call, *where)
                    if isinstance(given, ast.Call) and any(map(_returns_nothing, self._named(node, given.func))):
                        yield node, call, given

    def bases_of(self, owner: str) -> set[str]:
        """Return the names of a class and of all that it inherits from; the empty set for ""."""
        family: set[str] = set()
        todo = [owner] if owner else []
        while todo:
            name = todo.pop()
            if name not in family:
                family.add(name)
                _, class_ = self.classes.get(name, (None, None))
                todo += [last_name(base) for base in class_.bases] if class_ else []
        return family

    def _registered(self, node: GraphNode) -> Iterator[GraphNode]:
        """Yield the functions that `node` hands to the executor."""
        for call in own_body(node.function):
            if not isinstance(call, ast.Call) or last_name(call.func) not in _REGISTER:
                continue
            for given in [*call.args, *(keyword.value for keyword in call.keywords)]:
                if isinstance(given, ast.Lambda):
                    yield from self._callees(node, ast.walk(given))
                elif isinstance(given, ast.Call) and last_name(given.func) == "partial" and given.args:
                    yield from self._named(node, given.args[0])
                else:
                    yield from self._named(node, given)

    def _callees(self, node: GraphNode, parts: Iterable[ast.AST]) -> Iterator[GraphNode]:
        for part in parts:
            if isinstance(part, ast.Call):
                yield from self._named(node, part.func)

    def _named(self, node: GraphNode, name: ast.AST) -> Iterator[GraphNode]:
        """Yield the functions that `name` may refer to inside `node`."""
        if isinstance(name, ast.Attribute) and isinstance(name.value, ast.Name) and name.value.id in ("self", "cls"):
            yield from self._methods(name.attr, self.bases_of(node.owner) | self._made_from(node.owner))
        elif isinstance(name, ast.Attribute) and called(name.value) == "super":
            yield from self._methods(name.attr, self.bases_of(node.owner) - {node.owner})
        elif isinstance(name, ast.Name):
            same = (other for other in self._nodes if other.module is node.module and not other.owner)
            yield from (other for other in same if other.function.name == name.id)
        where, _, what = self.imports[node.module.path].meaning(name).rpartition(".")
        if (where, what) in self._outside:
            yield self._outside[where, what]

    def _methods(self, name: str, owners: set[str]) -> Iterator[GraphNode]:
        return (node for node in self._nodes if node.owner in owners and node.function.name == name)

    def _made_from(self, owner: str) -> set[str]:
        """Return the names of the classes that inherit from a class: `self` in its methods may be one of them."""
        return {name for name in self.classes if owner in self.bases_of(name)} if owner else set()


def _returns_nothing(node: GraphNode) -> bool:
    results = (ast.Yield, ast.YieldFrom)
    return not any(
        isinstance(part, results) or (isinstance(part, ast.Return) and part.value) for part in own_body(node.function)
    )


def own_body(function: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a function without those of the functions defined inside it; lambdas belong to it."""
    todo = list(ast.iter_child_nodes(function))
    while todo:
        node = todo.pop()
        yield node
        if not isinstance(node, Function | ast.ClassDef):
            todo += ast.iter_child_nodes(node)


def _functions(module: Module) -> Iterator[GraphNode]:
    todo: list[tuple[ast.AST, str]] = [(module.tree, "")]
    while todo:
        node, owner = todo.pop()
        for child in ast.iter_child_nodes(node):
            if isinstance(child, Function):
                # A function inside a method may use `self` like the method itself, and is called by its bare name.
                yield GraphNode(module, owner if isinstance(node, ast.ClassDef) else "", child)
            todo.append((child, child.name if isinstance(child, ast.ClassDef) else owner))
