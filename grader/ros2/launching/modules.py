"""Make `launch` and `launch_ros` importable in this process, where the real ones are not there.

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
    conditions,
    context,
    entities,
    event_actions,
    events,
    handlers,
    parameters,
    process,
    ros_actions,
    ros_substitutions,
    service,
    sources,
    state_actions,
    substitutions,
)
from .errors import SubstitutionFailure, UnsupportedError, caller


def _classes(*modules: ModuleType) -> dict[str, Any]:
    """Return the public classes that the modules define."""
    return {
        name: value
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__ and not name.startswith("_")
    }


def _pick(module: ModuleType, *names: str) -> dict[str, Any]:
    return {name: getattr(module, name) for name in names}


def table() -> dict[str, dict[str, Any]]:
    """Return the names by module."""
    core = _pick(entities, "LaunchDescription", "LaunchDescriptionEntity", "Action", "Substitution")
    core |= {
        "LaunchContext": context.LaunchContext,
        "LaunchService": service.LaunchService,
        "LaunchDescriptionSource": sources.LaunchDescriptionSource,
        "Condition": conditions.Condition,
        "Event": events.Event,
        "EventHandler": handlers.EventHandler,
        "SomeSubstitutionsType": entities.SomeSubstitutionsType,
        "SomeEntitiesType": Any,
    }
    subs = _classes(substitutions) | {
        "TextSubstitution": entities.TextSubstitution,
        "SubstitutionFailure": SubstitutionFailure,
    }
    process_events = _pick(
        events,
        *("ProcessExited", "ProcessIO", "ProcessStarted", "ProcessStderr", "ProcessStdout", "RunningProcessEvent"),
        *("ProcessTargetedEvent", "ShutdownProcess", "SignalProcess"),
    )
    matchers = _pick(events, "matches_action", "matches_executable", "matches_name", "matches_pid")
    ros_acts = _classes(ros_actions) | {"PushRosNamespace": ros_actions.PushROSNamespace}
    descriptions = _pick(parameters, "Parameter", "ParameterFile", "ParameterValue")
    launch_sources = _pick(sources, "AnyLaunchDescriptionSource", "PythonLaunchDescriptionSource")
    return {
        "launch": core,
        "launch.actions": _classes(actions, state_actions, event_actions, process),
        "launch.substitutions": subs,
        "launch.conditions": _classes(conditions) | {"evaluate_condition_expression": conditions.truth},
        "launch.event_handlers": _classes(handlers),
        "launch.events": _pick(events, "ExecutionComplete", "Shutdown", "TimerEvent") | matchers,
        "launch.events.process": process_events | matchers,
        "launch.events.matchers": matchers,
        "launch.launch_description_sources": launch_sources
        | {"LaunchDescriptionSource": sources.LaunchDescriptionSource},
        "launch.some_substitutions_type": {"SomeSubstitutionsType": entities.SomeSubstitutionsType},
        "launch.some_entities_type": {"SomeEntitiesType": Any},
        "launch.utilities": {
            "normalize_to_list_of_substitutions": entities.substitutions,
            "perform_substitutions": entities.perform,
        },
        "launch_ros": {},
        "launch_ros.actions": ros_acts,
        "launch_ros.substitutions": _classes(ros_substitutions),
        "launch_ros.parameter_descriptions": descriptions,
        "launch_ros.descriptions": descriptions,
        "launch_ros.parameters_type": {"SomeParameters": Any, "SomeParameterFile": Any, "SomeParameterValue": Any},
        "launch_ros.remap_rule_type": {"SomeRemapRules": Any},
    }


# Features of the real modules that are not here: module -> names, each with what to do instead.
COMPOSED = "Start each node by itself, with Node(package=…, executable=…)."
PYTHON_FILE = "Write it as a Python launch file (.launch.py) with generate_launch_description()."
MISSING: dict[str, dict[str, str]] = {
    "launch_ros.actions": {
        **dict.fromkeys(("ComposableNodeContainer", "LoadComposableNodes"), COMPOSED),
        **dict.fromkeys(("RosTimer", "ROSTimer"), "Use TimerAction of launch.actions."),
        **dict.fromkeys(("LifecycleTransition", "RosLifecycleNode"), "Change states from a node of your own."),
    },
    "launch_ros.descriptions": {"ComposableNode": COMPOSED},
    "launch_ros.events": {"lifecycle": "Change states from a node of your own."},
    "launch_ros.events.lifecycle": dict.fromkeys(
        ("ChangeState", "StateTransition"), "Change states from a node of your own."
    ),
    "launch_ros.event_handlers": {"OnStateTransition": "Use OnProcessStart of launch.event_handlers."},
    "launch.actions": {"OpaqueCoroutine": "Use OpaqueFunction."},
    "launch_xml.launch_description_sources": {"XMLLaunchDescriptionSource": PYTHON_FILE},
    "launch_yaml.launch_description_sources": {"YAMLLaunchDescriptionSource": PYTHON_FILE},
    "launch.launch_description_sources": dict.fromkeys(
        ("FrontendLaunchDescriptionSource", "XMLLaunchDescriptionSource", "YAMLLaunchDescriptionSource"), PYTHON_FILE
    ),
    "launch.frontend": dict.fromkeys(("Parser", "expose_action", "expose_substitution"), PYTHON_FILE),
}


def _missing(module: str, name: str, instead: str) -> type:
    """Return a class that can be imported, and says when it is used that it is not supported."""

    def refuse(_self: Any, *_args: Any, **_kwargs: Any) -> None:
        raise UnsupportedError(f"{name} of {module}", instead, caller())

    return type(name, (entities.Action,), {"__init__": refuse, "__doc__": f"{name}, which is not supported."})


def real_ones_there() -> bool:
    """Say whether the real launch and launch_ros can be imported.

    A module of that name is not enough: PyPI has an unrelated `launch`, and it may be installed beside this kit.
    """
    try:
        return hasattr(importlib.import_module("launch"), "LaunchDescription") and hasattr(
            importlib.import_module("launch_ros.actions"), "Node"
        )
    except ImportError:
        return False


class _Finder:
    """Finds the modules of the table, and for each class in them the module that the real one lies in."""

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
        """Take a plain module."""
        return

    def exec_module(self, module: ModuleType) -> None:
        """Fill it with its names and its modules."""
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
    """Make the names importable in this process and return True; leave the real ones, return False."""
    if real_ones_there():
        return False
    for name in [
        name for name in sys.modules if name.split(".")[0] in ("launch", "launch_ros", "launch_xml", "launch_yaml")
    ]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Finder())
    return True
