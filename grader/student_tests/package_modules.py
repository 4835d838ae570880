"""The package's own Python modules: their texts, where they are in the sandbox that runs the tests, and the probe.

The probe is the package with functions that do nothing but raise: a test that passes on it tests nothing of them.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from pathlib import Path

from grader import building
from grader.host import ros_env
from grader.python_ast import TOO_COMPLEX, Function, first_line, is_docstring, parse
from grader.sandbox import untrusted

PACKAGE = Path("/ws/package")
"""The source folder, inside the sandbox."""
MODULES = building.INSTALL / ros_env.SITE_IN_PREFIX
"""The folder of the installed modules, inside the sandbox: that of the package itself and any other Python package."""
# Every Python package may have such folders with its types; the build makes sure that they hold nothing else.
_GENERATED = ("msg", "srv", "action")
_TESTS = ("test", "tests")
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


def texts(package: Path, install: Path) -> dict[str, str | None]:
    """Return the text of each of the package's Python modules by its path below the folder of all installed modules.

    All that is installed counts, in whichever Python package; if nothing is, the modules of the source folder do.
    Generated modules and tests are left out. The text is None where `untrusted.read_python` cannot read it.
    """
    site = install / ros_env.SITE_IN_PREFIX
    paths = [path for path in site.rglob("*.py") if _is_own(path.relative_to(site))]
    if not paths:
        folders = [path.parent for path in package.glob("*/__init__.py") if path.parent.name not in _TESTS]
        site, paths = package, [path for folder in folders for path in folder.rglob("*.py")]
    regular = (path for path in sorted(paths) if path.is_file() and not path.is_symlink())
    return {str(path.relative_to(site)): untrusted.read_python(path) for path in regular}


def _is_own(path: Path) -> bool:
    return path.parts[0] not in _TESTS and not (len(path.parts) > 2 and path.parts[1] in _GENERATED)


def source_folders(package: Path, install: Path) -> list[str]:
    """Return where in the sandbox the source folders of the package's modules are."""
    names = sorted({Path(path).parts[0] for path in texts(package, install)})
    return [str(PACKAGE / name) for name in names if (package / name).is_dir()]


def copies(package: Path, install: Path, names: Iterable[str]) -> dict[str, str]:
    """Return the texts of these modules by their paths in the sandbox: installed, and in the source folder."""
    roots = ((install / ros_env.SITE_IN_PREFIX, MODULES), (package, PACKAGE))
    paths = {str(inside / name): host / name for name in names for host, inside in roots}
    return {inside: text for inside, path in paths.items() if (text := untrusted.read_python(path)) is not None}


def handed_in(package: Path, modules: Mapping[str, str | None]) -> dict[str, str]:
    """Return where in the package each module is that the build installs from another place, by its installed path."""
    elsewhere = {name for name in modules if not (package / name).is_file()}
    same: dict[str | None, list[Path]] = {}
    for path in (path.relative_to(package) for path in sorted(package.rglob("*.py")) if elsewhere):
        if path.parts[0] not in _TESTS:
            same.setdefault(untrusted.read_python(package / path), []).append(path)
    found = {
        name: sorted(same.get(modules[name], ()), key=lambda path: path.name != Path(name).name) for name in elsewhere
    }
    return {name: str(paths[0]) if paths else name for name, paths in found.items()}


def relative(path: Path) -> str | None:
    """Return the path of a module in the sandbox relative to the package, None for any other file."""
    root = next((root for root in (MODULES, PACKAGE) if path.is_relative_to(root)), None)
    return None if root is None else str(path.relative_to(root))


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
