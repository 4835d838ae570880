"""Find in a package's text why it will not run, where neither the build nor the run says it plainly.

Only what is certain, or nearly so, is a fault: an import that may come from elsewhere gives none.
"""

from __future__ import annotations

import difflib
import importlib.util
import itertools
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import yaml

from grader.course import Course, Node, definition, packages, role
from grader.course.packages import NOT_BUILT, ONE_ZIP, ROS_1
from grader.evidence import Fault, SourceFile
from grader.quality.manifest import needed_imports
from grader.quality.package_sources import PackageSources, read_sources
from grader.quality.parsed_module import Module
from grader.sanitize import printable
from grader.yaml_reader import PARAMETERS, ParameterFileError, line_of, parameter_blocks, scalar, scalar_of

_ORDER = ("build", "install", "start", "parameters", "interfaces")
_MAX_FAULTS = 50
_MAX_WORDS = 300
_MAX_IMPORTS = 2000
_RUNS = ("module", "script")
_LAUNCH = {"launch", "launch_ros"}
"""The kit has its own of these, and launch files need them."""
_SIM_TIME = "use_sim_time"
_TYPES: dict[type, str] = {bool: "true or false", int: "an integer", float: "a float", str: "a text"}


def find_faults(
    sources: PackageSources, interfaces: Path | None, modules: Sequence[Module], unreadable: Sequence[SourceFile]
) -> list[Fault]:
    """Return the faults of a package, the first cause first.

    `interfaces` is its package of interfaces, if it has one; `unreadable` are its Python files that cannot be parsed.
    """
    every = itertools.chain(
        _beside(interfaces, sources.course), _in_python(sources, modules, unreadable), _without_nodes(sources, modules),
        _of_the_build(sources), _first_lines(sources), _of_parameters(sources), _interface_faults(sources),
    )  # fmt: skip
    found = itertools.islice(every, 2 * _MAX_FAULTS)
    return [_printable(fault) for fault in sorted(found, key=lambda fault: _ORDER.index(fault.stops))[:_MAX_FAULTS]]


def _beside(interfaces: Path | None, course: Course) -> Iterator[Fault]:
    """Yield the faults of the package of interfaces, if there is one, with its folder in their paths."""
    if interfaces is not None:
        for fault in _interface_faults(read_sources(interfaces, None, course)):
            yield replace(fault, path=f"{interfaces.name}/{fault.path}")


def _printable(fault: Fault) -> Fault:
    return replace(
        fault,
        path=printable(fault.path),
        text=printable(fault.text)[:_MAX_WORDS],
        cure=printable(fault.cure)[:_MAX_WORDS],
        shown_as=[word[:_MAX_WORDS] for word in fault.shown_as[:_MAX_FAULTS]],
        lacks=fault.lacks[:_MAX_FAULTS],
    )


def _in_python(sources: PackageSources, modules: Sequence[Module], unreadable: Sequence[SourceFile]) -> Iterator[Fault]:
    """Yield what keeps Python from running the package: its syntax, and imports of packages that are not here."""
    for file in unreadable:
        if role(file.path, sources.course.package) in _RUNS:
            line = re.search(r": line (\d+): ", file.problem)
            cure = "look at that line, and at the end of the line before it"
            text = f"it {re.sub(': line [0-9]+: ', ': ', file.problem)}"
            yield Fault(file.path, int(line[1]) if line else 0, "start", text, cure)
    programs = sources.programs()
    # A folder with Python below it may be found by whoever starts the node there.
    own = {PurePosixPath(path).parts[0] for path in sources.paths if path.endswith(".py") and "/" in path}
    own |= {module.name.partition(".")[0] for module in modules if "." in module.name} | sources.names
    for module in (module for module in modules if module.role == "module" or module.path in programs):
        # Of the package's own modules Python says enough.
        for name, node in itertools.islice(needed_imports(module), _MAX_IMPORTS):
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
    return (
        f"{text}: {packages.names()}, and those of ROS in the handout",
        "do without it, or ask your instructor for it",
    )


def _is_known(name: str, sources: PackageSources) -> bool:
    """Return whether Python finds a module of this name here, which is not the package's. Nothing is imported.

    The assignment's package does not count: this process may have the one that the kit builds for itself.
    """
    try:
        known = name in sys.stdlib_module_names or importlib.util.find_spec(name) is not None
        return known and name != sources.course.package
    except (ImportError, ValueError):
        return False


def _without_nodes(sources: PackageSources, modules: Sequence[Module]) -> Iterator[Fault]:
    """Yield that the package lacks modules of the assignment, and which package it is."""
    course = sources.course
    there = {PurePosixPath(path).name for path in (*sources.paths, *(module.path for module in modules))}
    written = f"{sources.read('CMakeLists.txt')}\n{sources.read('setup.py')}\n{sources.read('setup.cfg')}"
    # One that is in no file of its name may be made by the build.
    missing = [node for node in course.nodes if not {node, f"{node}.py"} & there and node not in written]
    if missing:
        folders = {path.partition("/")[0] for path in sources.paths}
        folder = sources.name if sources.name in folders else course.package
        wanted = " and ".join(f"{folder}/{node}.py" for node in missing)
        which = f"this is the package `{sources.name}`, and it" if sources.name != course.package else "the package"
        text = f"{which} has no {' and no '.join(f'{node}.py' for node in missing)}"
        cure = f"write {wanted}, or hand in the package that has them"
        yield Fault("package.xml", sources.line_of("package.xml", "<name>"), "install", text, cure, lacks=missing)


def _of_the_build(sources: PackageSources) -> Iterator[Fault]:
    """Yield why a build that ends well leaves nothing of the package."""
    if not sources.has_cmake:
        return
    course = sources.course
    if sources.xml.build_type == "ament_python":
        line = sources.line_of("package.xml", "<build_type>")
        text = "it says `ament_python`, so colcon ignores CMakeLists.txt and all that it makes and installs"
        stops = "install" if "setup.py" in sources.paths else "build"
        cure = "<build_type>ament_cmake</build_type>: that of a package with a CMakeLists.txt"
        lost = [*course.nodes, *(path for path in course.shared if path in sources.paths), *sources.interfaces]
        yield Fault("package.xml", line, stops, text, cure, shown_as=["can't open file 'setup.py'"], lacks=lost)
    elif not re.search(r"ament(_auto)?_package", sources.read("CMakeLists.txt")):
        text = "it does not end with `ament_package()`, so ROS cannot find the package"
        yield Fault("CMakeLists.txt", 0, "build", text, "write ament_package() as its last line")


def _first_lines(sources: PackageSources) -> Iterator[Fault]:
    """Yield what is wrong with the first line of the programs that CMakeLists.txt installs, the nodes first."""
    nodes = sources.course.nodes
    for path in sorted(sources.programs(), key=lambda path: (PurePosixPath(path).stem not in nodes, path)):
        first, _, _ = sources.read(path).partition("\n")
        if not first.startswith("#!"):
            text = "its first line does not say which program runs it, so the system cannot start it"
            cure = "write `#!/usr/bin/env python3` as its first line"
            yield Fault(path, 1, "start", text, cure, shown_as=["Exec format error"])
        elif first.endswith("\r"):
            text = "its lines end as on Windows, so the system looks for a program called `python3\\r`"
            cure = f"save it with Unix line ends (LF): sed -i 's/\\r$//' {path}"
            yield Fault(path, 1, "start", text, cure, shown_as=["python3\\r", "python3\r"])


def _of_parameters(sources: PackageSources) -> Iterator[Fault]:
    """Yield what is wrong with the parameter files."""
    for node in sources.course.nodes.values():
        if node.config in sources.paths:
            for fault in _in_parameters(sources, node.config, node):
                yield fault if fault.shown_as else replace(fault, shown_as=[node.config])


def _in_parameters(sources: PackageSources, path: str, node: Node) -> Iterator[Fault]:
    """Yield why a parameter file does not reach its node: rcl refuses it, or its key, names or types are others."""
    try:
        blocks = parameter_blocks(sources.read(path))
    except ParameterFileError as error:
        yield Fault(path, error.line, "parameters", error.problem, error.cure)
        return
    except (ValueError, RecursionError):
        return
    if not blocks:
        cure = f"{node.name}: / {PARAMETERS}: / name: value, each further indented"
        yield Fault(path, 0, "parameters", "it sets nothing", cure)
    reached = [block for block in blocks if not block.keys or block.keys[-1] in (node.name, "*", "**")]
    for block in blocks:
        absent = {*node.parameters, _SIM_TIME} - block.values.keys()
        for name, value in block.values.items():
            near = difflib.get_close_matches(name.lower(), sorted(absent), 1, 0.75)
            if near and name not in {*node.parameters, _SIM_TIME}:
                text = f"it sets `{name}`, and the parameter is called `{near[0]}`"
                yield Fault(path, line_of(value), "parameters", text, f"{near[0]}:")
            elif block in reached and isinstance(value, yaml.ScalarNode):
                yield from _other_type(path, line_of(value), node, name, scalar_of(value))
    if blocks and not reached:
        text = f"its key is `{'/'.join(blocks[0].keys)}`, and the node is called `{node.name}`"
        cure = f"{node.name}: or /**: as the key above {PARAMETERS}"
        yield Fault(path, blocks[0].line, "parameters", text, cure)


def _other_type(path: str, line: int, node: Node, name: str, value: object) -> Iterator[Fault]:
    """Yield that a parameter's value has another type than the node declares, which ends the node as it starts."""
    usual: object = False if name == _SIM_TIME else node.parameters[name].default if name in node.parameters else None
    if usual is None or type(value) is type(usual) or type(value) not in _TYPES:
        return
    meant = scalar(value.replace(",", ".")) if isinstance(value, str) else value
    if isinstance(usual, float) and isinstance(meant, int) and not isinstance(meant, bool):
        meant = float(meant)
    meant = meant if type(meant) is type(usual) else usual
    said = f"'{value}'" if isinstance(value, str) else f"{value}"
    right = str(meant) if path.endswith(".py") else str(meant).lower()
    cure = f"write {right}" + " without quotation marks" * isinstance(value, str)
    text = f"`{name}` is {said}, {_TYPES[type(value)]}, and the node declares {_TYPES[type(usual)]}"
    yield Fault(path, line, "parameters", text, cure, shown_as=[f"Trying to set parameter '{name}'"])


def _interface_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield how the interface files of a package, if it has any, differ from the contract's."""
    course = sources.course
    for interface in course.interfaces if sources.interfaces else ():
        kind, path = interface.partition("/")[0], course.interface_file(interface)
        if path not in sources.paths:
            yield Fault(path, 0, "interfaces", "it is not there", "write it as the contract says")
            continue
        wanted = (course.contract / path).read_text()
        for line, words in definition.differences(kind, sources.read(path), wanted):
            yield Fault(path, line, "interfaces", words, "compare it with the contract: types, names, order")
