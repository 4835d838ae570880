"""Make `launch` and `launch_ros` importable in this process, unless the real ones are installed.

The table below is the list of what is supported: the real module path, and the names in it.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.util
import re
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from . import (
    actions,
    context,
    entities,
    event_handling,
    events,
    include,
    parameters,
    process,
    ros_actions,
    ros_substitutions,
    service,
    substitutions,
)
from .errors import SubstitutionFailure, UnsupportedError, caller


def _classes(kind: type, *modules: ModuleType) -> dict[str, Any]:
    """Return the public classes of a kind that the modules define."""
    return {
        name: value
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, kind)
        and value.__module__ == module.__name__
        and not name.startswith("_")
    }


def _pick(module: ModuleType, *names: str) -> dict[str, Any]:
    return {name: getattr(module, name) for name in names}


def table() -> dict[str, dict[str, Any]]:
    """Return the supported names by module."""
    process_events = _classes(events.RunningProcessEvent, events) | _pick(events, "ShutdownProcess")
    matchers = _pick(events, "matches_action")
    some_substitutions = _pick(entities, "SomeSubstitutionsType")
    launch_actions = _classes(entities.Action, actions, event_handling, include, process)
    del launch_actions["ContextStep"]  # ours
    return {
        "launch": {
            **_pick(entities, "LaunchDescription", "LaunchDescriptionEntity", "Action", "Substitution", "Condition"),
            **_pick(context, "LaunchContext"),
            **_pick(service, "LaunchService"),
            **_pick(include, "LaunchDescriptionSource"),
            **_pick(events, "Event"),
            **_pick(event_handling, "EventHandler"),
            **some_substitutions,
            "SomeEntitiesType": Any,
        },
        "launch.actions": launch_actions,
        "launch.substitutions": _classes(entities.Substitution, substitutions)
        | {"TextSubstitution": entities.TextSubstitution, "SubstitutionFailure": SubstitutionFailure},
        "launch.conditions": _classes(entities.Condition, entities) | {"evaluate_condition_expression": entities.truth},
        "launch.event_handlers": _classes(event_handling.EventHandler, event_handling),
        "launch.events": _pick(events, "ExecutionComplete", "Shutdown", "TimerEvent") | matchers,
        "launch.events.process": process_events | matchers,
        "launch.events.matchers": matchers,
        "launch.launch_description_sources": _classes(include.LaunchDescriptionSource, include),
        "launch.some_substitutions_type": some_substitutions,
        "launch.some_entities_type": {"SomeEntitiesType": Any},
        "launch.utilities": {
            "normalize_to_list_of_substitutions": entities.substitutions,
            "perform_substitutions": entities.perform,
        },
        "launch_ros": {},
        "launch_ros.actions": _classes(entities.Action, ros_actions)
        | {"PushRosNamespace": ros_actions.PushROSNamespace},
        "launch_ros.substitutions": _classes(entities.Substitution, ros_substitutions),
        "launch_ros.parameter_descriptions": _pick(parameters, "ParameterFile", "ParameterValue"),
        "launch_ros.descriptions": _pick(parameters, "ParameterFile", "ParameterValue"),
        "launch_ros.parameters_type": {"SomeParameters": Any, "SomeParameterFile": Any, "SomeParameterValue": Any},
        "launch_ros.remap_rule_type": {"SomeRemapRules": Any},
    }


# Features of the real modules that this kit lacks: module -> names, each with what to do instead.
COMPOSED = "Start each node by itself, with Node(package=…, executable=…)."
STATES = "Change states from a node of your own."
IN_GROUP = "Use GroupAction, which restores configurations and environment."
PER_NODE = "Use the parameters=[…] of each Node."
MISSING: dict[str, dict[str, str]] = {
    "launch_ros.actions": {
        **dict.fromkeys(("ComposableNodeContainer", "LoadComposableNodes"), COMPOSED),
        **dict.fromkeys(("RosTimer", "ROSTimer"), "Use TimerAction of launch.actions."),
        **dict.fromkeys(("LifecycleTransition", "RosLifecycleNode"), STATES),
        "SetParametersFromFile": PER_NODE,
    },
    "launch_ros.descriptions": {"ComposableNode": COMPOSED, "Parameter": PER_NODE},
    "launch_ros.parameter_descriptions": {"Parameter": PER_NODE},
    "launch_ros.events": {"lifecycle": STATES},
    "launch_ros.events.lifecycle": dict.fromkeys(("ChangeState", "StateTransition"), STATES),
    "launch_ros.event_handlers": {"OnStateTransition": "Use OnProcessStart of launch.event_handlers."},
    "launch.actions": {
        "OpaqueCoroutine": "Use OpaqueFunction.",
        "ExecuteLocal": "Use ExecuteProcess.",
        "UnregisterEventHandler": "Use handle_once=True of the handler.",
        **dict.fromkeys(("PushLaunchConfigurations", "PopLaunchConfigurations", "ResetLaunchConfigurations"), IN_GROUP),
        **dict.fromkeys(("PushEnvironment", "PopEnvironment", "ResetEnvironment"), IN_GROUP),
        **dict.fromkeys(("UnsetLaunchConfiguration", "UnsetEnvironmentVariable"), "Set another value."),
    },
    "launch.substitutions": dict.fromkeys(("AnonName", "LaunchLogDir"), "Write the name itself."),
    "launch.events.process": {"SignalProcess": "Use ShutdownProcess."},
    "launch_xml.launch_description_sources": {"XMLLaunchDescriptionSource": include.PYTHON_FILE},
    "launch_yaml.launch_description_sources": {"YAMLLaunchDescriptionSource": include.PYTHON_FILE},
    "launch.launch_description_sources": dict.fromkeys(
        ("FrontendLaunchDescriptionSource", "XMLLaunchDescriptionSource", "YAMLLaunchDescriptionSource"),
        include.PYTHON_FILE,
    ),
    "launch.frontend": dict.fromkeys(("Parser", "expose_action", "expose_substitution"), include.PYTHON_FILE),
}


def _missing(module: str, name: str, instead: str) -> type:
    """Return a class that can be imported, and that raises UnsupportedError when it is used."""

    def refuse(_self: Any, *_args: Any, **_kwargs: Any) -> None:
        raise UnsupportedError(f"{name} of {module}", instead, caller())

    return type(name, (entities.Action,), {"__init__": refuse, "__doc__": f"{name}, which is not supported."})


def real_ones_installed() -> bool:
    """Return whether the real launch and launch_ros can be imported.

    A module of that name is not enough: PyPI has an unrelated `launch`, which may be installed beside this kit.
    """
    try:
        return hasattr(importlib.import_module("launch"), "LaunchDescription") and hasattr(
            importlib.import_module("launch_ros.actions"), "Node"
        )
    except ImportError:
        return False


class _Finder:
    """Finds the modules of the table, and for each class also the module that holds it in the real package."""

    def __init__(self) -> None:
        self.modules = table()
        for module, names in MISSING.items():
            here = self.modules.setdefault(module, {})
            for name, instead in names.items():
                here.setdefault(name, _missing(module, name, instead))
        for module in list(self.modules):
            for name, value in list(self.modules[module].items()):
                if isinstance(value, type) and module.count(".") <= 1:
                    inner = f"{module}.{re.sub(r'(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])', '_', name).lower()}"
                    self.modules.setdefault(inner, {})[name] = value
        for module in list(self.modules):
            while module := module.rpartition(".")[0]:
                self.modules.setdefault(module, {})

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return a spec for a module of the table."""
        if name not in self.modules:
            return None
        # The loader is this object, by its methods.
        return importlib.machinery.ModuleSpec(name, self, origin="ros2-course-kit", is_package=True)  # type: ignore[arg-type]

    def create_module(self, _spec: importlib.machinery.ModuleSpec) -> None:
        """Have Python make a plain module."""
        return

    def exec_module(self, module: ModuleType) -> None:
        """Fill the module with its names and submodules."""
        vars(module).update(self.modules[module.__name__])
        shown = [name for name in self.modules[module.__name__] if not name.startswith("_")]
        vars(module)["__all__"] = shown
        for inner in self.modules:
            above, _, last = inner.rpartition(".")
            if above == module.__name__ and last in SUBMODULES:
                setattr(module, last, importlib.import_module(inner))


SUBMODULES = {
    *("actions", "substitutions", "conditions", "event_handlers", "events", "launch_description_sources", "utilities"),
    *("descriptions", "parameter_descriptions", "process", "matchers", "some_substitutions_type"),
}


def install() -> bool:
    """Make the names importable in this process and return True; return False if the real ones are installed."""
    if real_ones_installed():
        return False
    for name in [
        name for name in sys.modules if name.split(".")[0] in ("launch", "launch_ros", "launch_xml", "launch_yaml")
    ]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Finder())
    return True
