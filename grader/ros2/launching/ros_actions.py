"""The actions of `launch_ros.actions`: a node, and settings for all nodes after it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from ..commands import packages  # noqa: TID252 - the folder has no fixed name, so there is no absolute import
from .entities import Action, Entities, LaunchContext, SomeSubstitutionsType, perform, substitutions
from .errors import LaunchError
from .parameters import ParameterFile, Parameters, document, listed
from .process import ExecuteProcess
from .substitutions import ExecutableInPackage

PARAMETERS, NAMESPACE = "global_params", "ros_namespace"  # the configurations that hold for all nodes
RENAMED = {
    "node_executable": "executable",
    "node_name": "name",
    "node_namespace": "namespace",
    "node_args": "arguments",
}


def joined(base: str | None, name: str | None) -> str | None:
    """Return the absolute namespace `name` below `base`, which an absolute `name` ignores; None if both are None."""
    if base is None and name is None:
        return None
    parts = [part.rstrip("/") for part in (base, name) if part]
    if name and name.startswith("/"):
        parts = [name.rstrip("/")]
    return "/" + "/".join(parts).lstrip("/")


def check_namespace(name: str) -> None:
    """Raise if this is not a valid namespace."""
    if name != "/" and not re.fullmatch(r"(/[A-Za-z_]\w*)+", name, re.ASCII):
        raise LaunchError(
            f"Invalid namespace '{name}': write a name of letters, digits and _ after each /, the first one not a digit"
        )


class Node(ExecuteProcess):
    """A node of a package, run as one process."""

    def __init__(
        self,
        *,
        executable: SomeSubstitutionsType | None = None,
        package: SomeSubstitutionsType | None = None,
        name: SomeSubstitutionsType | None = None,
        namespace: SomeSubstitutionsType | None = None,
        exec_name: SomeSubstitutionsType | None = None,
        parameters: Any = None,
        remappings: Iterable[tuple[Any, Any]] | None = None,
        ros_arguments: list[SomeSubstitutionsType] | None = None,
        arguments: Iterable[SomeSubstitutionsType] | None = None,
        **rest: Any,
    ) -> None:
        for old, new in RENAMED.items():
            if old in rest:
                raise TypeError(f"Node() has no keyword '{old}': since ROS 2 Galactic it is called '{new}'")
        if executable is None:
            raise TypeError("Node() needs the keyword 'executable'")
        program = executable if package is None else ExecutableInPackage(executable, package)
        words = [] if arguments is None else list(arguments)
        rules = [] if ros_arguments is None else list[Any](["--ros-args"]) + ros_arguments
        super().__init__(cmd=[program, *words, *rules], name=exec_name, **rest)
        self.package, self.executable = package, executable
        self.node_name_given, self.namespace_given = name, namespace
        self.parameters = [] if parameters is None else listed(parameters)
        self.remappings = _rules(remappings)

    def execute(self, context: LaunchContext) -> Entities | None:
        """Start the node; one of a package that no Python index has (rviz2, tf2_ros) is left out with a warning."""
        package = "" if self.package is None else perform(context, self.package)
        if package in packages.ELSEWHERE and packages.prefix(package) is None:
            why = packages.advice(package).strip()
            context.runner.output.warn("launch_ros.actions.node", f"{self.place}: this node is not started: {why}")
            return None
        return super().execute(context)

    @property
    def node_name(self) -> str:
        """The node's full name, once it has been started."""
        return str(self.facts.get("node", "<node_name_unspecified>"))

    def command(self, context: LaunchContext) -> list[str]:
        """Return the command: executable, arguments, then after --ros-args names, parameters, remappings."""
        cmd = super().command(context)
        name = None if self.node_name_given is None else perform(context, self.node_name_given)
        given = None if self.namespace_given is None else perform(context, self.namespace_given)
        namespace = joined(context.launch_configurations.get(NAMESPACE), given)
        cmd.append("--ros-args")
        if name is not None:
            if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
                rule = "use letters, digits and _, and do not begin with a digit"
                raise LaunchError(f"Invalid node name '{name}': {rule}")
            cmd += ["-r", f"__node:={name}"]
        if namespace is not None:
            check_namespace(namespace)
            cmd += ["-r", f"__ns:={namespace}"]
        full = f"{namespace.rstrip('/')}/{name}" if name is not None and namespace is not None else None
        self.facts = {
            "package": None if self.package is None else perform(context, self.package),
            "executable": perform(context, self.executable),
            "node": full or name,
        }
        for key, value in context.launch_configurations.get(PARAMETERS, ()):
            cmd += ["-p", f"{key}:={value}"]
        for one in self.parameters:
            cmd += self._parameter(context, one, full or "/**")
        for old, new in self.remappings:
            cmd += ["-r", f"{perform(context, old)}:={perform(context, new)}"]
        return cmd

    def _parameter(self, context: LaunchContext, one: Parameters | ParameterFile, node: str) -> list[str]:
        if isinstance(one, Parameters):
            return ["--params-file", str(context.runner.parameter_file(document(one.evaluate(context), node)))]
        file = one.evaluate(context)
        if file.is_file():
            return ["--params-file", str(file)]
        context.runner.output.warn("launch_ros.actions.node", f"Parameter file path is not a file: {file}")
        return []


def _rules(remappings: Any) -> list[tuple[Any, Any]]:
    rules = []
    for rule in remappings or ():
        if not isinstance(rule, tuple):
            raise TypeError(
                f"Expected 'remap_rule' to be one of [<class 'tuple'>], but got '{rule}' of type '{type(rule)}': "
                "remappings is a list of pairs (from, to), in round brackets"
            )
        if len(rule) != 2:
            raise TypeError(f"remap_rule must be a tuple of length 2, got length {len(rule)}")
        rules.append((substitutions(rule[0]), substitutions(rule[1])))
    return rules


class LifecycleNode(Node):
    """A lifecycle node, started as a plain node: only its own code changes its state."""

    def __init__(self, *, name: SomeSubstitutionsType, namespace: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(name=name, namespace=namespace, **rest)

    def execute(self, context: LaunchContext) -> Entities | None:
        context.runner.output.warn(
            "launch_ros.actions", f"{self.place}: a LifecycleNode is started as a plain node; nothing changes its state"
        )
        return super().execute(context)


class ComposableNode:
    """A node that a container loads. This kit has no containers, and refuses the action that would load it."""

    def __init__(self, *, package: SomeSubstitutionsType, plugin: SomeSubstitutionsType, **rest: Any) -> None:
        self.package, self.plugin, self.rest = package, plugin, rest


class PushROSNamespace(Action):
    """Puts the nodes that follow into a namespace."""

    def __init__(self, namespace: SomeSubstitutionsType, **rest: Any) -> None:
        super().__init__(**rest)
        self.namespace = substitutions(namespace)

    def execute(self, context: LaunchContext) -> None:
        """Enter the namespace; an empty one changes nothing."""
        inner = joined(context.launch_configurations.get(NAMESPACE), perform(context, self.namespace))
        if inner is not None:
            check_namespace(inner)
            context.launch_configurations[NAMESPACE] = inner


class SetParameter(Action):
    """Sets a parameter of all nodes that follow."""

    def __init__(self, name: SomeSubstitutionsType, value: Any, **rest: Any) -> None:
        super().__init__(**rest)
        self.parameters = Parameters({tuple(substitutions(name)): value})

    def execute(self, context: LaunchContext) -> None:
        """Set it. A list becomes text in round brackets, which no node reads as a list: the real one does the same."""
        for name, value in self.parameters.evaluate(context).items():
            setting = (name, tuple(value) if isinstance(value, list) else value)
            # A group restores which list there is, not what is in it: so it is in the real one.
            context.launch_configurations.setdefault(PARAMETERS, []).append(setting)
