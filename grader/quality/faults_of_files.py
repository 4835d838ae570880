"""Faults of launch files, parameter files and interface files."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from typing import Any

import yaml

from grader.contract import definition
from grader.contract.spec import CONTRACT, INTERFACES, NODES, PARAMETERS
from grader.evidence import Fault
from grader.python_ast import argument, called, literal_string
from grader.quality.package_sources import PackageSources, similar
from grader.quality.parsed_module import Module

_FILES = {"config/robot_params.yaml": NODES[0], "config/sensor_params.yaml": NODES[1]}
_KEY = "ros__parameters"


def file_faults(sources: PackageSources, modules: Sequence[Module]) -> Iterator[Fault]:
    """Yield what is wrong with the launch files and the parameter files."""
    for module in modules:
        if module.role == "launch":
            yield from _in_launch(sources, module)
    for path, node in _FILES.items():
        if path in sources.paths:
            yield from _in_parameters(sources, path, node)


def _in_launch(sources: PackageSources, module: Module) -> Iterator[Fault]:
    """Yield the nodes that a launch file starts and that the package does not have."""
    for call in ast.walk(module.tree):
        if not isinstance(call, ast.Call) or called(call) != "Node":
            continue
        package = literal_string(argument(call, 99, "package"))
        executable = literal_string(argument(call, 99, "executable", "node_executable"))
        if package and package not in sources.handed_in | sources.known | sources.names:
            cure = f"package='{sources.name}'"
            yield Fault(module.path, call.lineno, "launch", f"it starts a node of `{package}`, which is not here", cure)
        elif package in sources.names and executable and executable not in NODES and similar(executable, NODES):
            cure = f"executable='{similar(executable, NODES)}'"
            yield Fault(module.path, call.lineno, "launch", f"there is no executable `{executable}`", cure)


def _in_parameters(sources: PackageSources, path: str, node: str) -> Iterator[Fault]:
    """Yield why a parameter file does not reach its node."""
    text = sources.read(path)
    try:
        if any(isinstance(token, yaml.AnchorToken) for token in yaml.scan(text)):
            return
        tree = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 0
        tab = "\t" in ([*text.splitlines(), ""][line - 1] if line else "")
        words = "a tab" if tab else (error.problem or "it cannot be read")
        cure = "indent with spaces only" if tab else "compare the indentation and the colons with the lines above"
        yield Fault(path, line, "parameters", f"it is not YAML: {words}", cure)
        return
    except (ValueError, RecursionError, yaml.YAMLError):
        return
    if not isinstance(tree, yaml.MappingNode):
        yield Fault(path, 0, "parameters", "it sets nothing", f"{node}: / {_KEY}: / name: value, each further indented")
        return
    yield from _in_blocks(path, node, tree)


def _in_blocks(path: str, node: str, tree: yaml.MappingNode) -> Iterator[Fault]:
    blocks = list(_blocks(tree, ()))
    if not blocks:
        line = tree.start_mark.line + 1
        yield Fault(path, line, "parameters", f"it has no `{_KEY}:`, so no node reads it",
                    f"{node}:, below it {_KEY}:, below that the parameters")  # fmt: skip
        return
    reached = False
    for keys, _, values in blocks:
        name = keys[-1] if keys else ""
        reached = reached or name in (node, "*", "**") or not name
        for key, _ in values.value:
            wanted = {**PARAMETERS[node], "robot_name": 0.0, "use_sim_time": 0.0}
            if key.value not in wanted and (meant := similar(str(key.value), wanted)):
                text = f"it sets `{key.value}`, and the parameter is called `{meant}`"
                yield Fault(path, key.start_mark.line + 1, "parameters", text, f"{meant}:")
    if not reached:
        keys, line, _ = blocks[0]
        yield Fault(path, line, "parameters", f"its key is `{'/'.join(keys)}`, and the node is called `{node}`",
                    f"{node}: or /**: as the key above {_KEY}")  # fmt: skip


def _blocks(tree: yaml.MappingNode, above: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], int, Any]]:
    """Yield the keys above each ros__parameters, split at slashes, with the last one's line and the block."""
    for key, value in tree.value:
        if not isinstance(value, yaml.MappingNode):
            continue
        if key.value == _KEY:
            yield above, tree.start_mark.line, value
        elif len(above) < 20:
            yield from _blocks(value, (*above, *(part for part in str(key.value).split("/") if part)))


def interface_faults(sources: PackageSources) -> Iterator[Fault]:
    """Yield how the interface files of a package, if it has any, differ from the contract's."""
    if not sources.interfaces:
        return
    for interface in INTERFACES:
        kind = interface.partition("/")[0]
        path = f"{interface}.{kind}"
        if path not in sources.paths:
            meant = similar(path, sources.interfaces)
            cure = f"{meant} should be {path}" if meant else "write it as the contract says"
            yield Fault(path, 0, "interfaces", "it is not there", cure)
            continue
        wanted = (CONTRACT / path).read_text()
        for line, words in definition.differences(kind, sources.read(path), wanted):
            yield Fault(path, line, "interfaces", words, "compare it with the contract: types, names, order")
