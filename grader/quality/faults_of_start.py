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
from grader.quality.faults_of_programs import defined, installed, program_files, program_folders
from grader.quality.manifest import optional_imports
from grader.quality.package_sources import INTERFACE_SUFFIXES, PackageSources, similar
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
    yield from _shadows(sources)
    names = _Names(sources, modules)
    programs = program_files(sources)
    for module in modules:
        if module.role == "module" or module.path in programs:
            yield from names.missing(module)


def _shadows(sources: PackageSources) -> Iterator[Fault]:
    """Yield the files that hide a module of Python or of ROS.

    A node finds the modules beside its executable first. Modules inside the Python package hide nothing, but they
    share it with the generated msg, srv and action.
    """
    own = {PurePosixPath(path).parts[0] for path in sources.course.modules} | sources.names
    for path in sources.paths:
        parts = PurePosixPath(path).parts
        if not path.endswith(".py") or not 2 <= len(parts) <= 3 or parts[0] not in own or not sources.interfaces:
            continue
        inside = parts[1].removesuffix(".py")
        if inside in _GENERATED:
            where = f"{parts[0]}.{inside}"
            what = (
                f"is installed over the generated {where}" if len(parts) == 3 else f"is hidden by the generated {where}"
            )
            yield Fault(path, 0, "start", f"it {what}", "give it another name: rosidl makes that module")
    commands = sources.cmake.named("install") if sources.by_cmake else []
    for path, place in sorted({pair for command in commands for pair in installed(sources, command)}):
        module = place.parent if place.name == "__init__.py" else place.with_suffix("")
        hides = place.suffix == ".py" and module.parent in program_folders(sources) and module.name not in own
        if hides and _is_known(module.name, sources):
            text = f"it is installed beside the executables, where it hides the module `{module.name}` of Python or ROS"
            yield Fault(path, 0, "start", text, "give it another name, or install it elsewhere")


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


class _Names:
    """The modules of the package, and what each defines."""

    def __init__(self, sources: PackageSources, modules: Sequence[Module]) -> None:
        self._sources = sources
        self.defined = {module.name: defined(module.tree) for module in modules}
        self._folders = {
            ".".join(parent.parts)
            for path in sources.paths if path.endswith(".py")
            for parent in PurePosixPath(path).parents
        }  # fmt: skip
        self._tops = {name.partition(".")[0] for name in self.defined if "." in name} | sources.names
        self._unparsed = {path.removesuffix(".py").replace("/", ".") for path in sources.paths if path.endswith(".py")}
        self._types = {path.rpartition("/")[2].partition(".")[0] for path in sources.interfaces}

    def missing(self, module: Module) -> Iterator[Fault]:
        """Yield the imports of a module that find nothing."""
        for name, node in list(_imports(module))[:_MAX_IMPORTS]:
            if missing := self._missing(name, node):
                text, cure, shown = missing
                yield Fault(module.path, node.lineno, "start", text, cure, shown_as=[shown])

    def _missing(self, name: str, node: ast.Import | ast.ImportFrom) -> tuple[str, str, str] | None:
        """Return what an import does not find, what to do, and what Python says of it; None if it finds all."""
        top, _, rest = name.partition(".")
        if not top:
            return None
        absent = f"No module named '{name}'"
        if top not in self._tops:
            words = self._elsewhere(top)
            return (*words, f"No module named '{top}'") if words else None
        if rest in _GENERATED:
            return self._missing_types(name, rest, node)
        if rest and name not in self._unparsed | self._folders:
            meant = similar(name, [*self.defined, *self._folders])
            cure = f"is {meant} meant?" if meant else f"write {name.replace('.', '/')}.py"
            return f"it imports `{name}`, which is not in the package", cure, absent
        defined = self.defined.get(name)
        if defined is None or "*" in defined or not isinstance(node, ast.ImportFrom):
            return None
        inside = {other.removeprefix(f"{name}.") for other in self._unparsed | self._folders}
        for alias in node.names:
            if alias.name != "*" and alias.name not in defined | inside | set(_GENERATED):
                meant = similar(alias.name, defined)
                cure = f"is {meant} meant?" if meant else f"define {alias.name} there, or correct the import"
                text = f"it imports `{alias.name}` from {name}, which does not define it"
                return text, cure, f"cannot import name '{alias.name}' from '{name}'"
        return None

    def _missing_types(self, name: str, kind: str, node: ast.Import | ast.ImportFrom) -> tuple[str, str, str] | None:
        """Return what to say of types that are imported from the package's interfaces and that it does not have."""
        if not any(path.endswith(INTERFACE_SUFFIXES) for path in self._sources.paths):
            text = f"it imports from {name}, and the package has no interface file in {kind}/"
            return text, self._beside(kind), f"No module named '{name}'"
        for alias in node.names if isinstance(node, ast.ImportFrom) else ():
            if alias.name not in self._types | {"*"} and not alias.name.startswith("_"):
                meant = similar(alias.name, self._types)
                cure = f"is {meant} meant?" if meant else f"write {kind}/{alias.name}.{kind}"
                text = f"it imports `{alias.name}` from {name}, and there is no {kind}/{alias.name}.{kind}"
                return text, cure, f"cannot import name '{alias.name}' from '{name}'"
        return None

    def _elsewhere(self, top: str) -> tuple[str, str] | None:
        """Return what to say of a package that is not built with this one, and not installed here either."""
        sources = self._sources
        if top in sources.built | sources.known | _LAUNCH or _is_known(top, sources) or top in self._folders:
            return None
        if f"{top}.py" in {PurePosixPath(path).name for path in sources.paths}:
            text = f"it imports `{top}`, which Python finds only where it lies beside the program that runs"
            return text, f"from {sources.name} import {top}"
        if top in ROS_1:
            return f"it imports `{top}`, which is part of ROS 1", ROS_1[top]
        if top == sources.course.package:
            return f"it imports `{top}`, and this package is called `{sources.name}`", f"from {sources.name} import ..."
        if top.endswith(("_interfaces", "_msgs")):
            return f"it imports `{top}`, {NOT_BUILT}", self._beside("srv")
        text = f"it imports `{top}`, which is not among the packages that this course offers"
        ask = f"ask your instructor to add it to {packages.EXTRA}"
        return f"{text}: {packages.names(sources.course)}, and those of ROS in the handout", f"do without it, or {ask}"

    def _beside(self, kind: str) -> str:
        """Return from where to import interfaces: from the package of interfaces, if one is built with this one."""
        beside = min(self._sources.built - self._sources.names, default="")
        return f"the package of interfaces is called {beside}: from {beside}.{kind} import ..." if beside else ONE_ZIP
