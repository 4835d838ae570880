"""Make `launch` and `launch_ros` importable in this process, unless the real ones are installed.

The table below is the list of what is supported. Every other public name of the real modules can be imported as well,
and is refused, with the line of the launch file, when it is used.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.util
import sys
from collections.abc import Iterable, Iterator, Sequence
from types import ModuleType
from typing import Any

from . import (
    actions,
    context,
    entities,
    event_handling,
    events,
    include,
    output,
    parameters,
    process,
    ros_actions,
    ros_substitutions,
    service,
    substitutions,
    typed,
)
from .api import api
from .errors import InvalidConditionExpressionError, LaunchError, SubstitutionFailure, UnsupportedError, caller


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
    """Return the supported names by the package that has them, the events apart: two of them are called as actions."""
    failures = ("InvalidLaunchFileError", "InvalidPythonLaunchFileError", "InvalidFrontendLaunchFileError")
    return {
        "launch": {
            **_classes(entities.Action, actions, event_handling, include, process),
            **_classes(entities.Substitution, substitutions),
            **_classes(entities.Condition, entities),
            **_classes(event_handling.EventHandler, event_handling),
            **_classes(include.LaunchDescriptionSource, include),
            **_pick(entities, "LaunchDescription", "LaunchDescriptionEntity", "Action", "Substitution"),
            **_pick(entities, "TextSubstitution", "SomeSubstitutionsType", "is_substitution"),
            "LaunchContext": context.LaunchContext,
            "LaunchService": service.LaunchService,
            "Event": events.Event,
            "get_logger": output.get_logger,
            **dict.fromkeys(failures, LaunchError),
            "InvalidConditionExpressionError": InvalidConditionExpressionError,
            "SubstitutionFailure": SubstitutionFailure,
            "evaluate_condition_expression": entities.truth,
            "normalize_to_list_of_substitutions": entities.substitutions,
            "perform_substitutions": entities.perform,
            "normalize_typed_substitution": typed.given,
            "perform_typed_substitution": typed.performed,
            "SomeSubstitutionsType_types_tuple": (str, entities.Substitution, Iterable),
            "SomeEntitiesType_types_tuple": (Iterable, entities.LaunchDescriptionEntity),
            **dict.fromkeys(("SomeEntitiesType", "FilePath"), Any),
        },
        "launch.events": _classes(events.Event, events),
        "launch_ros": {
            **_classes(entities.Action, ros_actions),
            "PushRosNamespace": ros_actions.PushROSNamespace,
            **_classes(entities.Substitution, ros_substitutions),
            **_pick(parameters, "ParameterFile", "ParameterValue"),
            **_pick(ros_actions, "ComposableNode"),
            **dict.fromkeys(("SomeParameters", "SomeParameterFile", "SomeParameterValue", "SomeRemapRules"), Any),
        },
    }


# What to do instead of names of the real modules that this kit lacks.
COMPOSED = "Start each node by itself, with Node(package=…, executable=…)."
STATES = "Change states from a node of your own."
_GROUP = (
    *("PushEnvironment", "PopEnvironment", "PushLaunchConfigurations", "PopLaunchConfigurations"),
    *("ResetEnvironment", "ResetLaunchConfigurations", "UnsetEnvironmentVariable", "UnsetLaunchConfiguration"),
)
INSTEAD = {
    **dict.fromkeys(("ComposableNodeContainer", "LoadComposableNodes"), COMPOSED),
    **dict.fromkeys(("RosTimer", "ROSTimer"), "Use TimerAction of launch.actions."),
    **dict.fromkeys(("LifecycleTransition", "ChangeState", "StateTransition", "matches_action"), STATES),
    "OnStateTransition": "Use OnProcessStart of launch.event_handlers.",
    "OnIncludeLaunchDescription": "Include the file with IncludeLaunchDescription of launch.actions.",
    "OpaqueCoroutine": "Use OpaqueFunction.",
    "ExecuteLocal": "Use ExecuteProcess of launch.actions.",
    **dict.fromkeys(_GROUP, "Put the actions into a GroupAction, which restores both after them."),
    "UnregisterEventHandler": "Use handle_once=True of the event handler.",
    **dict.fromkeys(("ShutdownProcess", "SignalProcess"), "Use ExecuteProcess with `kill`, or Shutdown."),
    **dict.fromkeys(("AnySubstitution", "AllSubstitution"), "Use OrSubstitution and AndSubstitution."),
    "IfElseSubstitution": "Use PythonExpression.",
    "AnonName": "Write a name of its own for each node.",
    "SetROSLogDir": "Use SetEnvironmentVariable('ROS_LOG_DIR', …) of launch.actions.",
    "Parameter": "Use a dictionary in `parameters`, and LaunchConfiguration to read a value again.",
    "get_ros_node": "Use a node of your own.",
    **dict.fromkeys(
        (
            *("FrontendLaunchDescriptionSource", "XMLLaunchDescriptionSource", "YAMLLaunchDescriptionSource"),
            *("Parser", "expose_action", "expose_substitution"),
        ),
        include.PYTHON_FILE,
    ),
}


class _Refusing(type):
    """The type of the names that this kit lacks: they can be imported, and whatever uses them is refused."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):  # Python itself, or a linter, looks whether it is there
            raise AttributeError(name)
        raise UnsupportedError(f"{cls.__name__} of {cls.__module__}", INSTEAD.get(cls.__name__, ""), caller())

    def __setattr__(cls, name: str, value: Any) -> None:
        cls.__getattr__(name)


def _missing(module: str, name: str) -> type:
    """Return a class that can be imported and subclassed, and that raises UnsupportedError when it is used.

    As an action with a condition it does so only when its turn comes and the condition holds.
    """

    def begin(self: Any, *_args: Any, condition: Any = None, **_kwargs: Any) -> None:
        refusal = UnsupportedError(f"{name} of {module}", INSTEAD.get(name, ""), caller())
        if condition is None:
            raise refusal
        entities.Action.__init__(self, condition=condition)
        vars(self)["refusal"] = refusal

    def execute(self: Any, _context: Any) -> None:
        raise vars(self)["refusal"]

    own = {"__init__": begin, "execute": execute, "__module__": module, "__doc__": "Not supported."}
    return _Refusing(name, (entities.Action,), own)


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


def _above(module: str) -> Iterator[str]:
    """Yield the module and those around it."""
    while module:
        yield module
        module = module.rpartition(".")[0]


class _Finder:
    """Finds the modules of the real packages, with the names in them: supported ones, and ones that refuse."""

    def __init__(self) -> None:
        self.supported = table()
        self.modules = api()
        for module in list(self.modules):
            for above in _above(module):
                self.modules.setdefault(above, [])

    def value(self, module: str, name: str) -> Any:
        """Return what a name of a module is here."""
        # The real modules define a name somewhere below the one that it is usually imported from.
        places = (self.supported.get(above, {}) for above in _above(module))
        return next((names[name] for names in places if name in names), None) or _missing(module, name)

    def find_spec(
        self, name: str, _path: Sequence[str] | None = None, _target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return a spec for a module of the real packages."""
        if name not in self.modules:
            return None
        # The loader is this object, by its methods.
        return importlib.machinery.ModuleSpec(name, self, origin="ros2-course-kit", is_package=True)  # type: ignore[arg-type]

    def create_module(self, _spec: importlib.machinery.ModuleSpec) -> None:
        return

    def exec_module(self, module: ModuleType) -> None:
        """Fill the module with its names; a submodule is imported when it is asked for, as `launch.actions` is."""
        names = self.modules[module.__name__]

        def other(name: str) -> Any:
            if (inner := f"{module.__name__}.{name}") in self.modules:
                return importlib.import_module(inner)
            if names is None and not name.startswith("_"):
                return self.value(module.__name__, name)
            raise AttributeError(f"module '{module.__name__}' has no attribute '{name}'")

        known = {name: self.value(module.__name__, name) for name in names or ()}
        vars(module).update(known, __all__=list(known), __getattr__=other)


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
