"""One Python file of a package, parsed: its role, its lines of code, and what its imported names refer to."""

from __future__ import annotations

import ast
import io
import tokenize
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePosixPath

from grader.course import role
from grader.python_ast import Function, first_line, is_docstring, tree_of

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
