"""Python files of a package, parsed: role, lines of code, what imported names refer to, which function calls which."""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath

from grader.course import role
from grader.python_ast import Function, argument, called, first_line, is_docstring, last_name, literal_string, tree_of

_MAX_DEPTH = 150  # what people write stays below 30; linters walk trees recursively and break on a thousand
_NOT_CODE = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING,
    tokenize.ENDMARKER,
}  # fmt: skip
_CONSTANT_PARTS = (
    ast.Constant, ast.Name, ast.Attribute, ast.UnaryOp, ast.BinOp, ast.List, ast.Tuple, ast.Set, ast.Dict,
    ast.unaryop, ast.operator, ast.expr_context,
)  # fmt: skip


@dataclass(frozen=True)
class Module:
    """One Python file that can be parsed. `role` is "module" (of the package), "launch", "script", "test", "setup".

    `constants` is how many of its `lines` only give names to constants; `code` are the numbers of the others.
    `top` is the name under which the outermost folder is imported, where the build installs it under another name.
    """

    path: str
    tree: ast.Module
    lines: int
    role: str = field(default="")
    constants: int = 0
    code: frozenset[int] = frozenset()
    top: str = ""

    @property
    def parts(self) -> tuple[str, ...]:
        """Return the names of the packages that it is in, and its own; `src` around a package is not one of them."""
        path = PurePosixPath(self.path).with_suffix("")
        parts = path.parts[1:] if path.parts[0] == "src" and len(path.parts) > 2 else path.parts
        return (self.top, *parts[1:]) if self.top else parts

    @property
    def name(self) -> str:
        """Return the dotted name under which Python imports it."""
        parts = self.parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    @property
    def stem(self) -> str:
        """Return the file's name without its suffix."""
        return PurePosixPath(self.path).stem


def parse(path: str, data: bytes, package: str) -> Module:
    """Return the parsed file. `package` is the name of the contract's package.

    Raises:
        ValueError: it is not valid Python; the message says where and why.
    """
    try:
        tree = tree_of(data)
        _refuse_depth(tree)
        lines = _code_lines(data, tree)
        constants = lines & set(_constant_lines(tree.body))
        return Module(path, tree, len(lines), role(path, package), len(constants), frozenset(lines - constants))
    except SyntaxError as error:
        raise ValueError(f"line {error.lineno or 1}: {error.msg}") from error
    except (RecursionError, MemoryError) as error:
        raise ValueError(f"line 1: it cannot be parsed ({type(error).__name__})") from error
    except tokenize.TokenError as error:
        raise ValueError(f"line 1: {error.args[0]}") from error


def _refuse_depth(tree: ast.Module) -> None:
    level: list[ast.AST] = [tree]
    for _ in range(_MAX_DEPTH):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return
    raise ValueError(f"line {getattr(level[0], 'lineno', 1)}: it nests more than {_MAX_DEPTH} deep")


def _code_lines(data: bytes, tree: ast.Module) -> set[int]:
    """Return the lines on which code begins: not blanks, comments, docstrings or the rest of a long string."""
    starts = {token.start[0] for token in tokenize.tokenize(io.BytesIO(data).readline) if token.type not in _NOT_CODE}
    owners = (node for node in ast.walk(tree) if isinstance(node, ast.Module | ast.ClassDef | Function) and node.body)
    return starts - {owner.body[0].lineno for owner in owners if is_docstring(owner.body[0])}


def _constant_lines(body: Sequence[ast.stmt]) -> Iterator[int]:
    """Yield the lines outside functions that hold constants, or names for constants, and nothing else."""
    for node in body:
        if isinstance(node, ast.ClassDef):
            yield from _constant_lines(node.body)
        elif isinstance(node, ast.If | ast.Try | ast.With | ast.For | ast.While):
            for part in ast.iter_child_nodes(node):
                if isinstance(part, ast.stmt | ast.ExceptHandler):
                    yield from _constant_lines(part.body if isinstance(part, ast.ExceptHandler) else [part])
        elif isinstance(node, ast.Pass) or (
            isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign | ast.Expr)
            and (node.value is None or all(isinstance(part, _CONSTANT_PARTS) for part in ast.walk(node.value)))
        ):
            yield from range(node.lineno, (node.end_lineno or node.lineno) + 1)


@dataclass(frozen=True)
class Imports:
    """What the imported names of a module refer to: local name -> (dotted module, name in it or "")."""

    names: dict[str, tuple[str, str]]
    modules: frozenset[str]

    def meaning(self, node: ast.AST) -> str:
        """Return the full dotted name of a name or attribute: "time.sleep" for `sleep` or `t.sleep`."""
        if isinstance(node, ast.Name):
            module, name = self.names.get(node.id, ("", ""))
            return f"{module}.{name}" if module and name else module
        if isinstance(node, ast.Attribute):
            before = self.meaning(node.value)
            return f"{before}.{node.attr}" if before else ""
        return ""


def functions_of(tree: ast.Module) -> list[list[int]]:
    """Return the first and last line of each function that is inside no other, its decorators included."""
    found: list[list[int]] = []
    todo: list[ast.AST] = [tree]
    while todo:
        node = todo.pop()
        if isinstance(node, Function):
            found.append([first_line(node), node.end_lineno or node.lineno])
        else:
            todo += ast.iter_child_nodes(node)
    return sorted(found)


def imports(module: Module) -> Imports:
    """Return what the module imports, anywhere in it; relative imports are made absolute."""
    names: dict[str, tuple[str, str]] = {}
    modules = set()
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                modules.add(alias.name)
                top = alias.name.partition(".")[0]
                names[alias.asname or top] = (alias.name if alias.asname else top, "")
        elif isinstance(node, ast.ImportFrom):
            source = absolute(module, node)
            modules.add(source)
            for alias in node.names:
                modules.add(f"{source}.{alias.name}")
                names[alias.asname or alias.name] = (source, alias.name)
    return Imports(names, frozenset(modules))


def installed_as(modules: Sequence[Module], package: str) -> list[Module]:
    """Return the modules of a package with the names that they have once it is built.

    CMake and setup.py can install a folder under another name, as `install(DIRECTORY src_py/ DESTINATION
    .../my_package)` does. Where no folder is called `package`, it is the one that holds what is
    imported as `package.…`.
    """
    folders = {module.parts[0] for module in modules if len(module.parts) > 1}
    if package in folders or not package:
        return list(modules)
    named = (name.split(".") for module in modules for name in imports(module).modules)
    inside = {tuple(rest) for top, *rest in named if top == package}
    found = Counter(module.parts[0] for module in modules if module.parts[1:] and module.parts[1:] in inside)
    meant = found.most_common(1)[0][0] if found else ""
    return [replace(module, top=package) if module.parts[0] == meant else module for module in modules]


def absolute(module: Module, node: ast.ImportFrom) -> str:
    """Return the dotted name of what a `from` import names; a relative one is made absolute."""
    if not node.level:
        return node.module or ""
    parts = module.parts[:-1]
    base = parts[: len(parts) - (node.level - 1)]
    return ".".join([*base, *([node.module] if node.module else [])])


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
        todo = [(callback, callback.function.name) for callback in self._registered()]
        while todo:
            node, root = todo.pop()
            if node.key not in found:
                found[node.key] = node, root
                todo += [(callee, root) for callee in self._callees(node, own_body(node.function))]
        return list(found.values())

    def service_callbacks(self) -> list[tuple[GraphNode, str]]:
        """Return the functions that answer a service, each with the service's name, "" where that is no constant."""
        return [
            (named, literal_string(argument(call, 1, "srv_name")))
            for node, call in self._calls()
            if called(call) == "create_service" and (callback := argument(call, 2, "callback"))
            for named in self._named(node, callback)
        ]

    def called_callbacks(self) -> Iterator[tuple[GraphNode, ast.Call, ast.Call]]:
        """Yield each call that gets what a function without a result returns in place of a callback: `f()` for `f`."""
        for node, call in self._calls():
            given = argument(call, *_CALLBACKS[called(call)]) if called(call) in _CALLBACKS else None
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

    def _calls(self) -> Iterator[tuple[GraphNode, ast.Call]]:
        for node in self._nodes:
            yield from ((node, part) for part in own_body(node.function) if isinstance(part, ast.Call))

    def _registered(self) -> Iterator[GraphNode]:
        """Yield the functions that are handed to the executor."""
        for node, call in self._calls():
            if called(call) not in _REGISTER:
                continue
            for given in [*call.args, *(keyword.value for keyword in call.keywords)]:
                if isinstance(given, ast.Lambda):
                    yield from self._callees(node, ast.walk(given))
                elif isinstance(given, ast.Call) and called(given) == "partial" and given.args:
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
