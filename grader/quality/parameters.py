"""Are the parameters that the contract names declared and read?"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence

from grader.contract.spec import PARAMETERS
from grader.evidence import Finding, ParameterUse
from grader.quality.modules import Function, Module, argument, last_name, text

_DECLARE = ("declare_parameter", "declare_parameters")
_READ = ("get_parameter", "get_parameters", "get_parameter_or", "get_parameters_by_prefix")
_HEAR = ("add_on_set_parameters_callback", "add_pre_set_parameters_callback", "add_post_set_parameters_callback")
_MOST_LITERALS = 5
_LEAST_FIXED = 5  # letters of a formatted name that stand in the text
_MOST_PARTS = 5


def parameters(modules: Sequence[Module]) -> list[ParameterUse]:
    """Return, for each parameter of the contract, whether the package's modules declare it and read it.

    Names go through variables, tables, fields of a dataclass and helper functions: where the code declares or reads
    names that are not written in the call itself, a name counts that is written elsewhere in the modules. A callback
    that takes each new parameter's name and value reads too, for a declaration calls it.
    """
    seen = _Seen([module for module in modules if module.role == "module"])
    return [
        ParameterUse(
            node=node,
            name=name,
            declared=seen.declared(name),
            read=seen.read(name),
            literals=[] if seen.read(name) else list(_literals(seen.modules, node, default))[:_MOST_LITERALS],
        )
        for node, names in PARAMETERS.items()
        for name, default in names.items()
    ]


class _Seen:
    """What the modules say of parameters."""

    def __init__(self, modules: Sequence[Module]) -> None:
        self.modules = modules
        nodes = [node for module in modules for node in ast.walk(module.tree)]
        calls = [node for node in nodes if isinstance(node, ast.Call)]
        declarations = [call for call in calls if last_name(call.func) in _DECLARE]
        reads = [call for call in calls if last_name(call.func) in _READ]
        self._declared = {word for call in declarations for word in _names(call)}
        self._read = {word for call in reads for word in _strings(call)}
        self._declares_others = any(_goes_by_variable(call) for call in declarations)
        self._reads_others = (
            any(_goes_by_variable(call) for call in reads)
            or any(map(_compares_name, nodes))
            or _takes_what_is_set(nodes)
        )
        # `self.declare_parameter('x', 0.5).value` and `x = self.declare_parameter('x', 0.5)` read what they declare.
        kept = {id(node.value) for node in nodes if isinstance(node, ast.Attribute | ast.Assign | ast.AnnAssign)}
        self._read |= {word for call in declarations if id(call) in kept for word in _names(call)}
        in_declarations = {id(part) for call in declarations for part in ast.walk(call)}
        self._written: dict[str, int] = {}
        self._named: set[str] = set()
        fields = {id(field): field.id for node in nodes if isinstance(node, ast.ClassDef) for field in _fields(node)}
        self._fields = set(fields.values())
        # f'battery_{level}_threshold' stands for two names of the contract.
        joined = [(id(node), _pattern(node)) for node in nodes if isinstance(node, ast.JoinedStr)]
        self._declared_like = [like for where, like in joined if like and where in in_declarations]
        self._written_like = [like for where, like in joined if like and where not in in_declarations]
        for node in nodes:
            if text(node) and id(node) not in in_declarations:
                self._written[text(node)] = self._written.get(text(node), 0) + 1
            elif isinstance(node, ast.Attribute):
                self._named.add(node.attr)
            elif isinstance(node, ast.keyword | ast.arg):
                self._named.add(node.arg or "")
            elif isinstance(node, ast.Name) and id(node) not in fields:
                self._named.add(node.id)

    def declared(self, name: str) -> bool:
        if name in self._declared or any(like.fullmatch(name) for like in self._declared_like):
            return True
        return self._declares_others and (name in self._written or name in self._fields)

    def read(self, name: str) -> bool:
        if name in self._read:
            return True
        # Where a table declares the name, its entry there is no use of it.
        needed = 1 if name in self._declared else 2
        used = self._written.get(name, 0) >= needed or name in self._named
        used = used or any(like.fullmatch(name) for like in self._written_like)
        return self._reads_others and used


def _pattern(node: ast.JoinedStr) -> re.Pattern[str] | None:
    """Return what the names look like that a formatted string can make, None if it can make any."""
    parts = [text(part) for part in node.values]
    if len("".join(parts)) < _LEAST_FIXED or len(parts) > _MOST_PARTS:
        return None
    return re.compile("".join(re.escape(part) if part else r"\w+" for part in parts))


def _names(call: ast.Call) -> set[str]:
    """Return the parameter names written in a declaration: not the descriptions, not the defaults."""
    if last_name(call.func) == "declare_parameter":
        return {text(argument(call, 0, "name"))} - {""}
    table = argument(call, 1, "parameters")
    entries = table.elts if isinstance(table, ast.List | ast.Tuple) else []
    return {text(entry.elts[0]) for entry in entries if isinstance(entry, ast.Tuple | ast.List) and entry.elts} - {""}


def _strings(call: ast.Call) -> set[str]:
    return {text(part) for part in ast.walk(call)} - {""}


def _goes_by_variable(call: ast.Call) -> bool:
    first = argument(call, 1 if last_name(call.func) == "declare_parameters" else 0, "name", "names", "parameters")
    if isinstance(first, ast.List | ast.Tuple):
        return any(not _strings_in(entry) for entry in first.elts)
    return not text(first)


def _strings_in(node: ast.AST) -> bool:
    return any(text(part) for part in ast.walk(node))


def _compares_name(node: ast.AST) -> bool:
    """Return whether this is `parameter.name == 'x'`, or `.name in (...)`, as in a callback for new values."""
    return isinstance(node, ast.Compare) and last_name(node.left) == "name"


def _takes_what_is_set(nodes: Sequence[ast.AST]) -> bool:
    """Return whether a callback is told of set parameters, and their names and values are taken somewhere."""
    taken = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    return {"name", "value"} <= taken and any(
        isinstance(node, ast.Call) and last_name(node.func) in _HEAR for node in nodes
    )


def _fields(node: ast.ClassDef) -> Iterator[ast.Name]:
    """Yield the names of a class's annotated fields, as those of a dataclass or a named tuple."""
    for part in node.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            yield part.target


def _literals(modules: Sequence[Module], node: str, default: float) -> Iterator[Finding]:
    """Yield the places in a node's functions where a parameter's default stands as a number."""
    for module in modules:
        if module.stem != node:
            continue
        for function in ast.walk(module.tree):
            if isinstance(function, Function):
                for part in ast.walk(function):
                    if isinstance(part, ast.Constant) and type(part.value) is float and part.value == default:
                        yield Finding(module.path, part.lineno, "literal", f"{part.value:g}")
