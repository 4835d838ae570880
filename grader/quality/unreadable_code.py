"""Code that no reader of a package can see: made at run time, loaded from what is no module, or another program.

Such a place is named to a person, and costs nothing: honest packages have some, too.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

from grader.evidence import Finding
from grader.python_ast import Function, called, last_name, literal_string
from grader.quality.parsed_module import Imports, Module, absolute, imports

UNREADABLE = "unreadable-code"
_MAKES_CODE = {"exec", "eval", "compile", "__import__"}
_BUILTINS = {"builtins", "__builtins__"}
# Modules whose job is to load code that is no module, or to make some.
_LOADERS = {"runpy", "zipimport", "marshal", "code", "codeop", "imp", "ctypes", "cffi", "pty", "importlib.machinery"}
_INSIDES = {"__globals__", "__subclasses__", "__code__", "__builtins__"}
_CODE_TYPES = {"FunctionType", "LambdaType", "CodeType"}
_PROCESSES = {"os.system", "os.popen"}
_PROCESS_FAMILIES = ("os.exec", "os.spawn", "os.posix_spawn", "subprocess.", "asyncio.create_subprocess")
# Starting one of these may run any code; another command of the system, such as `aplay`, runs its own.
_INTERPRETERS = ("python", "sh", "bash", "dash", "env", "perl", "exec", "xargs")


def unreadable_code(modules: Sequence[Module], demonstration: str) -> Iterator[Finding]:
    """Yield each place of the package's modules and programs, but the demonstration, that runs what cannot be read."""
    names = {module.name for module in modules}
    for module in modules:
        if module.role == "module" or (module.role == "script" and module.stem != PurePosixPath(demonstration).stem):
            for line, what in sorted(set(_in_module(module, names))):
                yield Finding(module.path, line, UNREADABLE, what)


def _in_module(module: Module, names: set[str]) -> Iterator[tuple[int, str]]:
    imported = imports(module)
    plain = {id(node.func) for node in ast.walk(module.tree) if isinstance(node, ast.Call) and _is_import(node)}
    unread = _LOADERS | _BUILTINS
    if _runs_own_modules_alone(module, imported, names):
        unread = unread - {"runpy"}
    makes_code = _MAKES_CODE - imported.names.keys() - _own_names(module.tree)
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            before = absolute(module, node) if isinstance(node, ast.ImportFrom) else ""
            named = [before, *(f"{before}.{alias.name}".strip(".") for alias in node.names)]
            yield from ((node.lineno, f"`import {name}`") for name in named if name in unread)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            if node.id in _BUILTINS or (node.id in makes_code and id(node) not in plain):
                yield node.lineno, f"`{node.id}`"
        elif isinstance(node, ast.Attribute) and node.attr in _INSIDES:
            yield node.lineno, f"`{node.attr}`"
        elif isinstance(node, ast.Constant) and node.value in (_BUILTINS | _INSIDES):
            yield node.lineno, f"`{node.value}`"
        elif isinstance(node, ast.Call) and (called(node) in _CODE_TYPES or _runs_other_code(node, imported, names)):
            yield node.lineno, f"`{last_name(node.func)}(…)`"


def _own_names(tree: ast.AST) -> set[str]:
    """Return what a module calls things of its own: `exec = Executor()`, `def compile():`; not `compile = compile`."""
    own, kept = set[str](), set[str]()
    for node in ast.walk(tree):
        if isinstance(node, Function | ast.ClassDef):
            own.add(node.name)
        elif isinstance(node, ast.arg):
            own.add(node.arg)
        elif isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr):
            names = [part for part in ast.walk(node) if isinstance(part, ast.Name)]
            bound = {name.id for name in names if isinstance(name.ctx, ast.Store)}
            own |= bound
            kept |= bound & {name.id for name in names if isinstance(name.ctx, ast.Load)}
    return own - kept


def _runs_own_modules_alone(module: Module, imported: Imports, names: set[str]) -> bool:
    """Return whether runpy is used for nothing but modules that are read: `runpy.run_module('package.module')`."""
    calls = [node for node in ast.walk(module.tree) if isinstance(node, ast.Call)]
    own = [call for call in calls if imported.meaning(call.func) == "runpy.run_module"]
    own = [call for call in own if call.args and literal_string(call.args[0]) in names]
    seen = {id(part) for call in own for part in ast.walk(call.func)}
    named = (node for node in ast.walk(module.tree) if isinstance(node, ast.Name | ast.Attribute))
    return bool(own) and all(id(node) in seen for node in named if imported.meaning(node).startswith("runpy"))


def _is_import(call: ast.Call) -> bool:
    """Return whether a call imports an ordinary module by its name: `__import__('pkgutil')`."""
    name = literal_string(call.args[0]) if call.args else ""
    return called(call) == "__import__" and bool(name) and name not in _LOADERS | _BUILTINS


def _runs_other_code(call: ast.Call, imported: Imports, names: set[str]) -> bool:
    """Return whether a call starts a program other than a command of the system or a module of the package."""
    meaning = imported.meaning(call.func)
    if meaning not in _PROCESSES and not meaning.startswith(_PROCESS_FAMILIES):
        return False
    words = [word for part in ast.walk(call) for word in literal_string(part).split()]
    if "-m" in words[:-1] and words[words.index("-m") + 1] in names:
        return False
    return not words or words[0].startswith((*_INTERPRETERS, "/", "."))
