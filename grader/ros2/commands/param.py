"""`ros2 param`: read and change the parameters of running nodes."""

# mypy: disallow-untyped-calls=False
# rclpy is only partly typed, so calling its untyped functions is allowed here.

from __future__ import annotations

import argparse
import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from . import Refusal, arguments, near
from .graph import Graph, full_name, graph, spin

# By the numbers of rcl_interfaces/msg/ParameterType.
TYPES = (
    *("not set", "boolean", "integer", "double", "string"),
    *("byte array", "boolean array", "integer array", "double array", "string array"),
)
ANSWER_S = 5.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare verbs and flags."""
    add_verb = arguments.verbs(parser, "param")

    def of_node(name: str, text: str, run: Any, **rest: Any) -> argparse.ArgumentParser:
        verb = add_verb(name, text, run, graph=True)
        arguments.node_argument(verb, **rest)
        verb.add_argument("--include-hidden-nodes", action="store_true", help="Consider hidden nodes as well")
        return verb

    of_node("list", "Output a list of available parameters", show_list, nargs="?")
    of_node("get", "Get parameter", show_get).add_argument("parameter_name", help="Name of the parameter")
    set_ = of_node("set", "Set parameter", run_set)
    set_.add_argument("parameter_name", help="Name of the parameter")
    set_.add_argument("value", nargs="+", help="Value of the parameter")
    describe = of_node("describe", "Show descriptive information about declared parameters", show_describe)
    describe.add_argument("parameter_names", nargs="+", help="Name of the parameter")
    of_node("dump", "Show all of the parameters of a node in a YAML file format", show_dump)
    load = of_node("load", "Load parameter file for a node", run_load)
    load.add_argument("parameter_file", type=Path, help="Parameter file")


class Parameters:
    """The parameters of one running node."""

    def __init__(self, seen: Graph, node: str, include_hidden: bool = False) -> None:
        from rclpy.parameter_client import AsyncParameterClient

        self.node, self.name, self.seen = seen.node, full_name(node), seen
        if not seen.has_node(node, include_hidden):
            hidden = self.name in seen.nodes(hidden=True)
            hint = "\nIt is hidden: add --include-hidden-nodes" if hidden else near(self.name, seen.nodes())
            raise Refusal(f"Node not found{hint}")
        self.client = AsyncParameterClient(seen.node, self.name)
        if not self.client.wait_for_services(timeout_sec=ANSWER_S):
            raise Refusal(f"Wait for service timed out: {self.name} offers no parameter services")

    def answer(self, future: Any) -> Any:
        """Return the answer to a call."""
        if not spin(self.node, future.done, ANSWER_S):
            raise Refusal(f"{self.name} does not answer: a callback of the node may be blocking")
        if future.exception() is not None:
            raise Refusal(f"Exception while calling service of node '{self.name}': {future.exception()}")
        return future.result()

    def names(self) -> list[str]:
        """Return the names."""
        return sorted(self.answer(self.client.list_parameters([], 0)).result.names)


@contextlib.contextmanager
def parameters_of_one(args: argparse.Namespace) -> Iterator[Parameters]:
    """Yield the parameters of the node that a command line names."""
    with graph(args.spin_time) as seen:
        yield Parameters(seen, args.node_name, args.include_hidden_nodes)


def show_list(args: argparse.Namespace) -> None:
    """Print the names of the parameters of one node, or of all nodes."""
    with graph(args.spin_time) as seen:
        if args.node_name:
            nodes = [full_name(args.node_name)]
        else:
            seen.settle()
            services = dict(seen.names("service", hidden=True))
            nodes = [one for one in seen.nodes(args.include_hidden_nodes) if f"{one}/list_parameters" in services]
        for node in nodes:
            parameters = Parameters(seen, node, args.include_hidden_nodes)
            if not args.node_name:
                print(f"{node}:")
            for name in parameters.names():
                print(f"  {name}")


def show_get(args: argparse.Namespace) -> None:
    """Print a value with its type."""
    with parameters_of_one(args) as parameters:
        values = parameters.answer(parameters.client.get_parameters([args.parameter_name])).values
        hint = near(args.parameter_name, parameters.names())
    if not values or values[0].type == 0:
        raise Refusal(f"Parameter not set{hint}")
    print(shown(values[0]))


def shown(value: Any) -> str:
    """Return a value with its type, as `ros2 param get` prints it: lists as in the message."""
    kind, _, is_list = TYPES[value.type].partition(" ")
    field = f"{kind.replace('boolean', 'bool')}{'_array' if is_list else ''}_value"
    return f"{kind.capitalize()} {'values are' if is_list else 'value is'}: {getattr(value, field)}"


def run_set(args: argparse.Namespace) -> None:
    """Set a value; like the real command, report a refusal but return 0."""
    from rcl_interfaces.msg import Parameter
    from rclpy.parameter import get_parameter_value

    text = " ".join(args.value)
    with parameters_of_one(args) as parameters:
        wanted = Parameter(name=args.parameter_name, value=get_parameter_value(text))
        (result,) = parameters.answer(parameters.client.set_parameters([wanted])).results
        hint = "" if result.successful else near(args.parameter_name, parameters.names())
    said = "Set parameter successful" if result.successful else "Setting parameter failed"
    print(said + _reason(result) + hint)


def _reason(result: Any) -> str:
    return f": {result.reason}" if result.reason else ""


def show_describe(args: argparse.Namespace) -> None:
    """Print the descriptions of parameters; like the real command, return 0 also where a node has no such parameter."""
    with parameters_of_one(args) as parameters:
        found = parameters.answer(parameters.client.describe_parameters(args.parameter_names)).descriptors
        missing = [] if found else [name for name in args.parameter_names if name not in parameters.names()]
        hint = near(missing[0], parameters.names()) if missing else ""
    if missing:
        print(f"{missing[0]}: Parameter not set{hint}", file=sys.stderr)
    for one in found:
        print(described(one))


def described(one: Any) -> str:
    """Return what `describe` prints of a parameter's descriptor."""
    lines = [f"Parameter name: {one.name}", f"  Type: {TYPES[one.type]}"]
    if one.description:
        lines.append(f"  Description: {one.description}")
    lines.append("  Constraints:")
    if one.read_only:
        lines.append("    Read only: true")
    for bounds in (*one.floating_point_range, *one.integer_range):
        lines += [f"    Min value: {bounds.from_value}", f"    Max value: {bounds.to_value}"]
        if bounds.step:
            lines.append(f"    Step: {bounds.step}")
    if one.additional_constraints:
        lines.append(f"    Additional constraints: {one.additional_constraints}")
    return "\n".join(lines)


def show_dump(args: argparse.Namespace) -> None:
    """Print all values in the form of a parameter file."""
    from rclpy.parameter import parameter_value_to_python

    with parameters_of_one(args) as parameters:
        names = parameters.names()
        found = parameters.answer(parameters.client.get_parameters(names)).values if names else []
    values = dict(zip(names, map(parameter_value_to_python, found), strict=True))
    nested: dict[str, Any] = {}
    for name, value in values.items():
        *above, last = name.split(".")
        inner = nested
        for part in above:
            inner = inner.setdefault(part, {})
        inner[last] = value
    document = {full_name(args.node_name): {"ros__parameters": nested}}
    print(yaml.safe_dump(document, default_flow_style=False, allow_unicode=True))


def run_load(args: argparse.Namespace) -> None:
    """Set the values that a parameter file holds for a node."""
    from rclpy.parameter import Parameter

    try:
        values = values_of(yaml.safe_load(args.parameter_file.read_text()))
        wanted = [Parameter(name, value=value) for name, value in values.items()]
    except (OSError, yaml.YAMLError) as error:
        raise Refusal(f"Cannot read {args.parameter_file}: {error}") from error
    except (TypeError, ValueError) as error:
        raise Refusal(f"A parameter cannot hold such a value: {error}") from error
    with parameters_of_one(args) as parameters:
        results = parameters.answer(parameters.client.set_parameters(wanted)).results
        for name, result in zip(values, results, strict=True):
            print(f"Set parameter {name} {'successful' if result.successful else 'failed'}{_reason(result)}")


def values_of(document: Any) -> dict[str, Any]:
    """Return the values of a parameter file, whatever node their keys name, as Jazzy does; those of /** come first.

    Raises:
        Refusal: it is not a parameter file.
    """
    blocks = document if isinstance(document, dict) else {}
    for key, body in blocks.items():
        if not isinstance(body, dict) or not isinstance(body.get("ros__parameters"), dict):
            raise Refusal(f"YAML file is not a valid ROS parameter file for node {key}")
    if not blocks:
        raise Refusal("Param file does not contain selected parameters")
    found: dict[str, Any] = {}
    for key in sorted(blocks, key=lambda key: key != "/**"):
        found.update(_flat(blocks[key]["ros__parameters"]))
    return found


def _flat(values: dict[str, Any], above: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in values.items():
        found |= _flat(value, f"{above}{name}.") if isinstance(value, dict) else {f"{above}{name}": value}
    return found
