"""Faults of launch files, parameter files and interface files."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any

import yaml

from grader.course import Node, definition
from grader.evidence import Fault
from grader.python_ast import argument, called, literal_string
from grader.quality.faults_of_programs import programs
from grader.quality.package_sources import PackageSources, similar
from grader.quality.parsed_module import Module

_KEY = "ros__parameters"


def file_faults(sources: PackageSources, modules: Sequence[Module]) -> Iterator[Fault]:
    """Yield what is wrong with the launch files and the parameter files."""
    for module in modules:
        if module.role == "launch":
            yield from _in_launch(sources, module)
    for node in sources.course.nodes.values():
        if node.config in sources.paths:
            yield from (replace(fault, shown_as=[node.config]) for fault in _in_parameters(sources, node.config, node))


def _in_launch(sources: PackageSources, module: Module) -> Iterator[Fault]:
    """Yield what a launch file asks for and what is not there: packages, executables, parameter files."""
    own = programs(sources)
    values = {
        target.id: literal_string(node.value)
        for node in ast.walk(module.tree) if isinstance(node, ast.Assign)
        for target in node.targets if isinstance(target, ast.Name)
    }  # fmt: skip
    for call in ast.walk(module.tree):
        if not isinstance(call, ast.Call) or called(call) not in ("Node", "LifecycleNode"):
            continue
        package, executable = (
            values.get(part.id, "") if isinstance(part, ast.Name) else literal_string(part)
            for part in (argument(call, 99, "package"), argument(call, 99, "executable", "node_executable"))
        )
        if package and package not in sources.built | sources.known | sources.names:
            mine = executable in (*sources.course.nodes, *(own or ()))
            cure = f"package='{sources.name}'" if mine else "start only nodes that are handed in, or part of this ROS"
            text = f"it starts a node of `{package}`, which is not here"
            yield Fault(module.path, call.lineno, "launch", text, cure, shown_as=[f"'{package}'"])
        elif package in sources.names and executable and own is not None and executable not in own:
            meant = similar(executable, own)
            cure = f"executable='{meant}'" if meant else f"the package installs {', '.join(sorted(own)) or 'none'}"
            text = f"there is no executable `{executable}`"
            shown = [f"'{executable}'"]
            yield Fault(module.path, call.lineno, "launch", text, cure, shown_as=shown, lacks=[executable])
        yield from _relative_files(sources, module, call, values)


def _relative_files(
    sources: PackageSources, module: Module, call: ast.Call, values: Mapping[str, str]
) -> Iterator[Fault]:
    """Yield the parameter files that a launch file looks for in the folder where somebody happens to start it."""
    parameters = argument(call, 99, "parameters")
    for part in parameters.elts if isinstance(parameters, ast.List | ast.Tuple) else ():
        path = values.get(part.id, "") if isinstance(part, ast.Name) else literal_string(part)
        if path.endswith((".yaml", ".yml")) and not path.startswith("/"):
            text = f"`{path}` is looked for where `ros2 launch` is started, not in the package"
            folders = ", ".join(repr(folder) for folder in PurePosixPath(path.removeprefix("./")).parts)
            cure = f"os.path.join(get_package_share_directory('{sources.name}'), {folders})"
            yield Fault(module.path, part.lineno, "parameters", text, cure, shown_as=[path])


def _in_parameters(sources: PackageSources, path: str, node: Node) -> Iterator[Fault]:
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
        yield Fault(
            path, 0, "parameters", "it sets nothing", f"{node.name}: / {_KEY}: / name: value, each further indented"
        )
        return
    yield from _in_blocks(path, node, tree)


def _in_blocks(path: str, node: Node, tree: yaml.MappingNode) -> Iterator[Fault]:
    blocks = list(_blocks(tree, ()))
    if not blocks:
        line = tree.start_mark.line + 1
        yield Fault(path, line, "parameters", f"it has no `{_KEY}:`, so no node reads it",
                    f"{node.name}:, below it {_KEY}:, below that the parameters")  # fmt: skip
        return
    reached = False
    for keys, _, values in blocks:
        name = keys[-1] if keys else ""
        reached = reached or name in (node.name, "*", "**") or not name
        wanted = {*node.parameters, "use_sim_time"}
        absent = wanted - {key.value for key, _ in values.value}
        for key, _ in values.value:
            if key.value not in wanted and (meant := similar(str(key.value), absent)):
                text = f"it sets `{key.value}`, and the parameter is called `{meant}`"
                yield Fault(path, key.start_mark.line + 1, "parameters", text, f"{meant}:")
    if not reached:
        keys, line, _ = blocks[0]
        yield Fault(path, line, "parameters", f"its key is `{'/'.join(keys)}`, and the node is called `{node.name}`",
                    f"{node.name}: or /**: as the key above {_KEY}")  # fmt: skip


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
    course = sources.course
    for interface in course.interfaces:
        kind, path = interface.partition("/")[0], course.interface_file(interface)
        if path not in sources.paths:
            meant = similar(path, sources.interfaces)
            cure = f"{meant} should be {path}" if meant else "write it as the contract says"
            yield Fault(path, 0, "interfaces", "it is not there", cure)
            continue
        wanted = (course.contract / path).read_text()
        for line, words in definition.differences(kind, sources.read(path), wanted):
            yield Fault(path, line, "interfaces", words, "compare it with the contract: types, names, order")
