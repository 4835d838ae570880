"""Faults that keep a node from starting: in its Python, in its imports, and in the scripts that start it."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath

from grader.course import packages, role
from grader.course.foreign_packages import NOT_BUILT, ONE_ZIP, ROS_1
from grader.evidence import Fault, SourceFile
from grader.quality.faults_of_programs import program_files
from grader.quality.manifest import optional_imports
from grader.quality.package_sources import PackageSources
from grader.quality.parsed_module import Module, absolute

_RUNS = ("module", "script")
_GENERATED = ("msg", "srv", "action")
# Of these the kit has its own, and launch files need them.
_LAUNCH = {"launch", "launch_ros"}
_MAX_IMPORTS = 2000


def start_faults(
    sources: PackageSources, modules: Sequence[Module], unreadable: Sequence[SourceFile]
) -> Iterator[Fault]:
    """Yield what keeps the nodes from starting."""
    for file in unreadable:
        if role(file.path, sources.course.package) in _RUNS:
            line = re.search(r": line (\d+): ", file.problem)
            cure = "look at that line, and at the end of the line before it"
            text = f"it {re.sub(': line [0-9]+: ', ': ', file.problem)}"
            yield Fault(file.path, int(line[1]) if line else 0, "start", text, cure)
    programs = program_files(sources)
    # A folder with Python below it may be found by whoever starts the node there.
    own = {PurePosixPath(path).parts[0] for path in sources.paths if path.endswith(".py") and "/" in path}
    own |= {module.name.partition(".")[0] for module in modules if "." in module.name} | sources.names
    for module in modules:
        if module.role == "module" or module.path in programs:
            yield from _absent_packages(sources, module, own)


def _is_known(name: str, sources: PackageSources) -> bool:
    """Return whether Python finds a module of this name here, which is not the package's. Nothing is imported.

    The assignment's package does not count: this process may have the one that the kit builds for itself.
    """
    try:
        known = name in sys.stdlib_module_names or importlib.util.find_spec(name) is not None
        return known and name != sources.course.package
    except (ImportError, ValueError):
        return False


def _imports(module: Module) -> Iterator[tuple[str, ast.Import | ast.ImportFrom]]:
    """Yield the dotted modules that a module imports, other than as an option, with the statements."""
    optional = optional_imports(module.tree)
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import) and id(node) not in optional:
            yield from ((alias.name, node) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and id(node) not in optional:
            yield absolute(module, node), node


def _absent_packages(sources: PackageSources, module: Module, own: set[str]) -> Iterator[Fault]:
    """Yield the imports of packages that are neither built with this one nor here. Of its `own`, Python says enough."""
    for name, node in list(_imports(module))[:_MAX_IMPORTS]:
        top = name.partition(".")[0]
        if top and top not in own and (words := _elsewhere(sources, top)):
            yield Fault(module.path, node.lineno, "start", *words, shown_as=[f"No module named '{top}'"])


def _elsewhere(sources: PackageSources, top: str) -> tuple[str, str] | None:
    """Return what to say of a package that is not built with this one, and not installed here either."""
    if top in sources.built | sources.known | _LAUNCH or _is_known(top, sources):
        return None
    if f"{top}.py" in {PurePosixPath(path).name for path in sources.paths}:
        text = f"it imports `{top}`, which Python finds only where it lies beside the program that runs"
        return text, f"from {sources.name} import {top}"
    if top in ROS_1:
        return f"it imports `{top}`, which is part of ROS 1", ROS_1[top]
    if top == sources.course.package:
        return f"it imports `{top}`, and this package is called `{sources.name}`", f"from {sources.name} import ..."
    if top.endswith(("_interfaces", "_msgs")):
        beside = min(sources.built - sources.names, default="")
        cure = f"the package of interfaces is called {beside}: from {beside}.srv import ..." if beside else ONE_ZIP
        return f"it imports `{top}`, {NOT_BUILT}", cure
    text = f"it imports `{top}`, which is not among the packages that this course offers"
    ask = f"ask your instructor to add it to {packages.EXTRA}"
    return f"{text}: {packages.names(sources.course)}, and those of ROS in the handout", f"do without it, or {ask}"
