"""Make `launch` and `launch_ros` importable in this process.

The table below lists what is supported. Any other name can be imported as well, and is refused, with the line of the
launch file, when it is used.
"""

from __future__ import annotations

import importlib
import importlib.machinery
import importlib.util
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from ..commands import near  # noqa: TID252 - the folder has no fixed name, so there is no absolute import
from . import actions, entities, errors, events, parameters, process, ros_actions, service, substitutions
from .errors import LaunchError, UnsupportedError

# The names by the modules of launch 3.4.3 and launch_ros 0.26.6 that have them. `LogInfo` of launch.actions is in
# launch.actions.log_info, too, and so are the others.
_TABLE = """
launch: Action Condition Event EventHandler InvalidLaunchFileError LaunchContext LaunchDescription
  LaunchDescriptionEntity LaunchDescriptionSource LaunchService SomeEntitiesType SomeSubstitutionsType Substitution
launch.actions: DeclareLaunchArgument EmitEvent ExecuteProcess GroupAction IncludeLaunchDescription LogInfo
  OpaqueFunction RegisterEventHandler SetEnvironmentVariable SetLaunchConfiguration Shutdown TimerAction
launch.actions.shutdown_action: Shutdown
launch.conditions: IfCondition InvalidConditionExpressionError LaunchConfigurationEquals
  LaunchConfigurationNotEquals UnlessCondition evaluate_condition_expression
launch.event_handler: EventHandler
launch.event_handlers: OnProcessExit OnProcessStart OnShutdown
launch.events: Shutdown TimerEvent
launch.events.process: ProcessExited ProcessStarted RunningProcessEvent
launch.launch_description_sources: AnyLaunchDescriptionSource InvalidLaunchFileError InvalidPythonLaunchFileError
  PythonLaunchDescriptionSource
launch.logging:
launch.some_entities_type: SomeEntitiesType
launch.some_substitutions_type: SomeSubstitutionsType
launch.substitutions: AndSubstitution Command EnvironmentVariable EqualsSubstitution FindExecutable LaunchConfiguration
  NotEqualsSubstitution NotSubstitution OrSubstitution PathJoinSubstitution PythonExpression SubstitutionFailure
  TextSubstitution ThisLaunchFileDir
launch.utilities: normalize_to_list_of_substitutions perform_substitutions
launch_ros:
launch_ros.actions: LifecycleNode Node PushROSNamespace PushRosNamespace SetParameter
launch_ros.descriptions: ComposableNode ParameterFile ParameterValue
launch_ros.parameter_descriptions: ParameterFile ParameterValue
launch_ros.substitutions: ExecutableInPackage FindPackagePrefix FindPackageShare
launch_ros.substitutions.find_package: FindPackagePrefix FindPackageShare
"""
_INSTEAD = """
ComposableNodeContainer LoadComposableNodes: Start each node by itself, with Node(package=…, executable=…).
LifecycleTransition ChangeState StateTransition OnStateTransition: Change states from a node of your own.
RosTimer ROSTimer: Use TimerAction of launch.actions.
OpaqueCoroutine: Use OpaqueFunction.
ExecuteLocal: Use ExecuteProcess of launch.actions.
UnregisterEventHandler: Use handle_once=True of the event handler.
ShutdownProcess SignalProcess: Use ExecuteProcess with `kill`, or Shutdown.
AllSubstitution AnySubstitution IfElseSubstitution: Use PythonExpression.
AppendEnvironmentVariable: Use SetEnvironmentVariable, with EnvironmentVariable in its value.
FileContent: Use Command(['cat ', path]).
LocalSubstitution: Write a function as the reaction to the event, which it is given.
OnExecutionComplete OnProcessIO: Use OnProcessStart or OnProcessExit.
SetParametersFromFile: Write the file into `parameters` of each node.
get_logger: Use LogInfo of launch.actions, or print.
SetRemap: Write `remappings` for each node.
SetUseSimTime: Use SetParameter('use_sim_time', True).
ThisLaunchFile: Use __file__.
SetROSLogDir: Use SetEnvironmentVariable('ROS_LOG_DIR', …) of launch.actions.
Parameter: Use a dictionary in `parameters`, and LaunchConfiguration to read a value again.
FrontendLaunchDescriptionSource: Write it as a Python launch file (.launch.py) with generate_launch_description().
"""
INSTEAD = {
    name: text.strip()
    for names, _, text in (line.partition(":") for line in _INSTEAD.splitlines())
    for name in names.split()
}


def table() -> dict[str, dict[str, Any]]:
    """Return the supported names by the modules that have them."""
    places = (actions, entities, errors, events, parameters, process, ros_actions, service, substitutions)
    known: dict[str, Any] = {name: value for place in places for name, value in vars(place).items()}
    known |= {
        "PushRosNamespace": ros_actions.PushROSNamespace,
        "SomeEntitiesType": Any,
        "evaluate_condition_expression": entities.truth,
        "normalize_to_list_of_substitutions": entities.substitutions,
        "perform_substitutions": entities.perform,
        **dict.fromkeys(("InvalidLaunchFileError", "InvalidPythonLaunchFileError"), LaunchError),
    }
    found: dict[str, dict[str, Any]] = {}
    for line in _TABLE.strip().replace("\n  ", " ").splitlines():
        module, _, names = line.partition(":")
        # One event is called as an action is.
        values = known | {"Shutdown": events.ShutdownEvent} if module.startswith("launch.events") else known
        found[module] = {name: values[name] for name in names.split()}
    return found


class _Refusing(type):
    """The type of the names that this kit lacks: they can be imported, and whatever uses them is refused."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):  # Python itself, or a linter, looks whether it is there
            raise AttributeError(name)
        raise _refusal(cls.__module__, cls.__name__)

    def __setattr__(cls, name: str, value: Any) -> None:
        cls.__getattr__(name)


def _refusal(module: str, name: str) -> UnsupportedError:
    known = {one for names in table().values() for one in names}
    return UnsupportedError(f"{name} of {module}", INSTEAD.get(name) or near(name, known).strip())


def _missing(module: str, name: str) -> type:
    """Return a class that can be imported and subclassed, and that raises UnsupportedError when it is used.

    As an action with a condition it does so only when its turn comes and the condition holds.
    """

    def begin(self: Any, *_args: Any, condition: Any = None, **_kwargs: Any) -> None:
        refusal = _refusal(module, name)
        if condition is None:
            raise refusal
        entities.Action.__init__(self, condition=condition)
        vars(self)["refusal"] = refusal

    def execute(self: Any, _context: Any) -> None:
        raise vars(self)["refusal"]

    own = {"__init__": begin, "execute": execute, "__module__": module, "__doc__": "Not supported."}
    return _Refusing(name, (entities.Action,), own)


class _Finder:
    """Finds the modules of the real packages, with the names in them: supported ones, and ones that refuse."""

    def __init__(self) -> None:
        self.modules = table()
        for module, names in list(self.modules.items()):
            for name, value in names.items():
                self.modules.setdefault(f"{module}.{_snake(name)}", {name: value})

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

        def other(name: str) -> Any:
            if (inner := f"{module.__name__}.{name}") in self.modules:
                return importlib.import_module(inner)
            if name.startswith("_"):
                raise AttributeError(name)
            return _missing(module.__name__, name)

        names = self.modules[module.__name__]
        vars(module).update(names, __all__=list(names), __getattr__=other)


def _snake(name: str) -> str:
    """Return `path_join` for `PathJoin`, as the real packages name the module of a class."""
    return "".join(
        f"_{letter}" if letter.isupper() and i and not name[i - 1].isupper() else letter
        for i, letter in enumerate(name)
    ).lower()


def install() -> None:
    """Make the names importable in this process, whatever is installed under them: PyPI has an unrelated `launch`."""
    for name in [name for name in sys.modules if name.split(".")[0] in ("launch", "launch_ros")]:
        del sys.modules[name]
    sys.meta_path.insert(0, _Finder())
