"""What the code uses of the contract: its functions, the numbers that are parameters, and its interfaces by name."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import TypeGuard

from grader.course import Functions, Node
from grader.evidence import CodeInterface, Finding, FunctionUse, ParameterUse
from grader.python_ast import Function, argument, called, last_name, literal_string
from grader.quality.parsed_module import CallGraph, Module

_ARCS = ("atan2", "arctan2", "asin", "arcsin", "acos", "arccos")
_MAX_ENTRIES = 50
_DECLARE = ("declare_parameter", "declare_parameters")
_READ = ("get_parameter", "get_parameters", "get_parameter_or", "get_parameters_by_prefix")
_ON_SET = ("add_on_set_parameters_callback", "add_pre_set_parameters_callback", "add_post_set_parameters_callback")
_BY_ANY_NAME = {"getattr", "vars", "attrgetter", "__dict__", "__getattribute__"}
_TAKES = {*_READ, *_DECLARE, "float", "int", "abs", "round", "min", "max"}
_MIN_FIXED = 5  # letters of a formatted name that are written in the code
_MAX_PARTS = 5
_CREATE = {"create_publisher": "publisher", "create_subscription": "subscription", "create_service": "service"}


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


def parameter_use(modules: Sequence[Module], nodes: Iterable[Node]) -> list[ParameterUse]:
    """Return for each numeric parameter of the contract's `nodes` whether the package's modules declare and read it.

    Names go through variables, tables, fields of a dataclass and helper functions: where the code declares or reads
    names that are not written in the call itself, a name counts that is written elsewhere in the modules. A callback
    that takes each new parameter's name and value also reads it, because declaring a parameter calls it. A value that
    is only kept in an attribute at which nothing looks is not read, nor is a name of which the code only asks whether
    it is `in` something.
    """
    names = _Names([module for module in modules if module.role == "module"])
    return [
        ParameterUse(node.name, name, names.declares(name), names.reads(name))
        for node in nodes
        for name in node.defaults
    ]


class _Names:
    """The names that the modules declare, read and mention."""

    def __init__(self, modules: Sequence[Module]) -> None:
        nodes = [node for module in modules for node in ast.walk(module.tree)]
        calls = [node for node in nodes if isinstance(node, ast.Call)]
        declarations = [call for call in calls if called(call) in _DECLARE]
        idle = set(map(id, _never_used(nodes)))
        reads = [call for call in calls if called(call) in _READ and id(call) not in idle]
        self._declared = {word for call in declarations for word in _declared_names(call)}
        self._read = {word for call in reads for word in _strings(call)}
        # `self.declare_parameter('x', 0.5).value` and `x = self.declare_parameter('x', 0.5)` read what they declare.
        kept = {id(node.value) for node in nodes if isinstance(node, ast.Attribute | ast.Assign | ast.AnnAssign)} - idle
        self._read |= {word for call in declarations if id(call) in kept for word in _declared_names(call)}
        self._declares_others = any(_goes_by_variable(call) for call in declarations)
        self._reads_others = (
            any(_goes_by_variable(call) for call in reads)
            or any(map(_compares_name, nodes))
            or _takes_set_parameters(nodes)
        )
        fields = {id(field): field.id for node in nodes if isinstance(node, ast.ClassDef) for field in _fields(node)}
        self._fields = set(fields.values())
        in_declarations = {id(part) for call in declarations for part in ast.walk(call)}
        # f'battery_{level}_threshold' matches two names of the contract.
        patterns = [(id(node), _pattern(node)) for node in nodes if isinstance(node, ast.JoinedStr)]
        self._declared_patterns = [pattern for where, pattern in patterns if pattern and where in in_declarations]
        self._other_patterns = [pattern for where, pattern in patterns if pattern and where not in in_declarations]
        aside = in_declarations | idle | {id(node.left) for node in nodes if _looks_for(node)}
        self._written = Counter(literal_string(node) for node in nodes if id(node) not in aside)
        stored = {id(node) for node in nodes if isinstance(getattr(node, "ctx", None), ast.Store)}
        self._mentioned = {_identifier(node) for node in nodes if id(node) not in fields.keys() | stored}

    def declares(self, name: str) -> bool:
        if name in self._declared or any(pattern.fullmatch(name) for pattern in self._declared_patterns):
            return True
        return self._declares_others and (name in self._written or name in self._fields)

    def reads(self, name: str) -> bool:
        if name in self._read:
            return True
        # The entry of a table that declares the name is not a use of it.
        needed = 1 if name in self._declared else 2
        used = self._written[name] >= needed or name in self._mentioned
        return self._reads_others and (used or any(pattern.fullmatch(name) for pattern in self._other_patterns))


def _identifier(node: ast.AST) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    if isinstance(node, ast.keyword | ast.arg):
        return node.arg or ""
    return node.id if isinstance(node, ast.Name) else ""


def _pattern(node: ast.JoinedStr) -> re.Pattern[str] | None:
    """Return a pattern of the names that a formatted string can make, None if it can make any."""
    parts = [literal_string(part) for part in node.values]
    if len("".join(parts)) < _MIN_FIXED or len(parts) > _MAX_PARTS:
        return None
    return re.compile("".join(re.escape(part) if part else r"\w+" for part in parts))


def _declared_names(call: ast.Call) -> set[str]:
    """Return the parameter names written in a declaration: not the descriptions, not the defaults."""
    if called(call) == "declare_parameter":
        return {literal_string(argument(call, 0, "name"))} - {""}
    table = argument(call, 1, "parameters")
    entries = table.elts if isinstance(table, ast.List | ast.Tuple) else []
    rows = [entry.elts for entry in entries if isinstance(entry, ast.Tuple | ast.List) and entry.elts]
    return {literal_string(row[0]) for row in rows} - {""}


def _strings(node: ast.AST) -> set[str]:
    return {literal_string(part) for part in ast.walk(node)} - {""}


def _goes_by_variable(call: ast.Call) -> bool:
    first = argument(call, 1 if called(call) == "declare_parameters" else 0, "name", "names", "parameters")
    if isinstance(first, ast.List | ast.Tuple):
        return any(not _strings(entry) for entry in first.elts)
    return not literal_string(first)


def _looks_for(node: ast.AST) -> TypeGuard[ast.Compare]:
    """Return whether this is `'x' in changed`, which takes no value from `changed`."""
    return isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.In | ast.NotIn)


def _never_used(nodes: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Yield what is assigned to an attribute that nothing looks at."""
    used = {_identifier(node) for node in nodes if isinstance(getattr(node, "ctx", None), ast.Load)}
    if used & _BY_ANY_NAME:
        return
    for node in nodes:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            if all(isinstance(target, ast.Attribute) and target.attr not in used for target in targets):
                yield from _taken_as_it_is(node.value)


def _taken_as_it_is(value: ast.AST) -> Iterator[ast.AST]:
    """Yield the parts of a value, without what is handed to a call that may use it: `create_timer(1.0 / rate, ...)`."""
    yield value
    if isinstance(value, ast.Call) and called(value) not in _TAKES:
        yield from _taken_as_it_is(value.func)
    else:
        for part in ast.iter_child_nodes(value):
            yield from _taken_as_it_is(part)


def _compares_name(node: ast.AST) -> bool:
    """Return whether this is `parameter.name == 'x'`, or `.name in (...)`, as in a callback for new values."""
    return isinstance(node, ast.Compare) and last_name(node.left) == "name"


def _takes_set_parameters(nodes: Sequence[ast.AST]) -> bool:
    """Return whether a callback for set parameters is added, and names and values are taken from something."""
    taken = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    return {"name", "value"} <= taken and any(called(node) in _ON_SET for node in nodes)


def _fields(node: ast.ClassDef) -> Iterator[ast.Name]:
    """Yield the names of a class's annotated fields, as those of a dataclass or a named tuple."""
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            yield part.target


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
