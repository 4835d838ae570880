"""Faults of parameter files, which keep their values from a node or end it as it starts."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from dataclasses import replace

import yaml

from grader.course import Node
from grader.evidence import Fault
from grader.quality.package_sources import PackageSources
from grader.yaml_reader import (
    PARAMETERS,
    ParameterFileError,
    line_of,
    parameter_blocks,
    scalar,
    scalar_of,
)

_SIM_TIME = "use_sim_time"
_TYPES: dict[type, str] = {bool: "true or false", int: "an integer", float: "a float", str: "a text"}


def parameter_faults(sources: PackageSources) -> Iterator[Fault]:
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
