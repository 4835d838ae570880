"""The probe: the package with functions that do nothing but raise. A test that passes on it tests nothing of them.

Text only; nothing is run here.
"""

from __future__ import annotations

import ast

from grader.python_ast import TOO_COMPLEX, Function, first_line, is_docstring, parse

_RAISE = "_raise_in_the_probe"
# What a module of the package calls while it is imported still works, so that tests can import it.
_HELPER = f'''
def {_RAISE}():
    frame = __import__("sys")._getframe(1)
    while frame is not None:
        known = frame.f_globals
        if frame.f_code.co_name == "<module>" and "{_RAISE}" in known and known.get("__name__") != "__main__":
            return
        frame = frame.f_back
    raise type("Raised", (Exception,), {{}})("every function of the package raises in this run")
'''


def raising(text: str) -> str:
    """Return a module in which every function raises as soon as it is called, but for calls while it is imported.

    What Python cannot parse, or cannot write out, stays as it is.
    """
    tree = parse(text)
    if tree is None:
        return text
    try:
        for function in [node for node in ast.walk(tree) if isinstance(node, Function)]:
            call = ast.Expr(ast.Call(ast.Name(_RAISE, ast.Load()), [], []))
            function.body.insert(int(is_docstring(function.body[0])), call)
        tree.body[_after_future_imports(tree) : 0] = ast.parse(_HELPER).body
        return ast.unparse(ast.fix_missing_locations(tree))
    except TOO_COMPLEX:
        return text


def _after_future_imports(tree: ast.Module) -> int:
    places = [
        place
        for place, node in enumerate(tree.body, 1)
        if isinstance(node, ast.ImportFrom) and node.module == "__future__"
    ]
    return max(places, default=int(bool(tree.body) and is_docstring(tree.body[0])))


def function_lines(text: str) -> frozenset[int]:
    """Return the lines inside a module's functions, which importing it does not run."""
    tree = parse(text)
    lines = set[int]()
    for function in ast.walk(tree) if tree else ():
        if isinstance(function, Function) and function.body[0].lineno > function.lineno:
            body = function.body[int(is_docstring(function.body[0]) and len(function.body) > 1) :]
            lines.update(range(first_line(body[0]), (function.end_lineno or function.lineno) + 1))
    return frozenset(lines)
