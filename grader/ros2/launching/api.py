"""The public names of the real modules: launch 3.4.3 with its XML and YAML, and launch_ros 0.26.6."""

from __future__ import annotations

import re

# A name with a full stop has a module of its own, too: `LogInfo.` of launch.actions is in launch.actions.log_info.
_API = """
launch: Action. Condition. Event. EventHandler InvalidLaunchFileError. LaunchContext. LaunchDescription.
  LaunchDescriptionEntity. LaunchDescriptionSource. LaunchIntrospector LaunchService. SomeEntitiesType
  SomeEntitiesType_types_tuple SomeSubstitutionsType SomeSubstitutionsType_types_tuple Substitution.
launch.actions: AppendEnvironmentVariable. DeclareLaunchArgument. EmitEvent. ExecuteLocal. ExecuteProcess.
  GroupAction. IncludeLaunchDescription. LogInfo. OpaqueCoroutine. OpaqueFunction. PopEnvironment.
  PopLaunchConfigurations. PushEnvironment. PushLaunchConfigurations. RegisterEventHandler. ResetEnvironment.
  ResetLaunchConfigurations. SetEnvironmentVariable. SetLaunchConfiguration. Shutdown TimerAction.
  UnregisterEventHandler. UnsetEnvironmentVariable. UnsetLaunchConfiguration.
launch.conditions: IfCondition. InvalidConditionExpressionError. LaunchConfigurationEquals.
  LaunchConfigurationNotEquals. UnlessCondition. evaluate_condition_expression
launch.descriptions: Executable.
launch.event_handlers: OnExecutionComplete. OnIncludeLaunchDescription. OnProcessExit. OnProcessIO. OnProcessStart.
  OnShutdown event_named.
launch.events: ExecutionComplete. IncludeLaunchDescription. Shutdown. TimerEvent. matches_action
launch.events.process: ProcessExited. ProcessIO. ProcessStarted. ProcessStderr. ProcessStdin. ProcessStdout.
  ProcessTargetedEvent. RunningProcessEvent. ShutdownProcess. SignalProcess. matches_executable matches_name
  matches_pid
launch.launch_description_sources: AnyLaunchDescriptionSource. FrontendLaunchDescriptionSource.
  InvalidFrontendLaunchFileError InvalidLaunchFileError InvalidPythonLaunchFileError PythonLaunchDescriptionSource.
  get_launch_description_from_any_launch_file get_launch_description_from_frontend_launch_file
  get_launch_description_from_python_launch_file load_python_launch_file_as_module
launch.logging: get_logger get_output_loggers handlers launch_config reset
launch.some_entities_type: SomeEntitiesType SomeEntitiesType_types_tuple
launch.some_substitutions_type: SomeSubstitutionsType SomeSubstitutionsType_types_tuple
launch.substitutions: AllSubstitution AndSubstitution AnonName. AnySubstitution Command. EnvironmentVariable.
  EqualsSubstitution. FileContent. FindExecutable. IfElseSubstitution. LaunchConfiguration. LaunchLogDir.
  LocalSubstitution. NotEqualsSubstitution. NotSubstitution OrSubstitution PathJoinSubstitution. PythonExpression.
  SubstitutionFailure. TextSubstitution. ThisLaunchFile. ThisLaunchFileDir.
launch_ros:
launch_ros.actions: ComposableNodeContainer. LifecycleNode. LifecycleTransition LoadComposableNodes Node
  PushROSNamespace. PushRosNamespace ROSTimer. RosTimer SetParameter. SetParametersFromFile. SetROSLogDir. SetRemap.
  SetUseSimTime.
launch_ros.descriptions: ComposableNode. Parameter ParameterFile ParameterValue
launch_ros.event_handlers: OnStateTransition.
launch_ros.events.lifecycle: ChangeState. StateTransition. matches_node_name
launch_ros.parameter_descriptions: Parameter ParameterFile ParameterValue
launch_ros.parameters_type: SomeParameterFile SomeParameterValue SomeParameters
launch_ros.remap_rule_type: SomeRemapRules
launch_ros.substitutions: ExecutableInPackage. FindPackage FindPackagePrefix FindPackageShare Parameter.
launch_xml.launch_description_sources: XMLLaunchDescriptionSource
launch_yaml.launch_description_sources: YAMLLaunchDescriptionSource
"""
# Their inner modules. Launch files hardly use these, so their names are not listed.
_INNER = """
launch.actions.shutdown_action launch.conditions.evaluate_condition_expression_impl launch.event_handler
launch.event_handlers.on_action_event_base launch.event_handlers.on_shutdown launch.events.matchers
launch.events.process.process_matchers launch.frontend launch.frontend.entity launch.frontend.expose
launch.frontend.parse_substitution launch.frontend.parser launch.frontend.type_utils
launch.launch_description_sources.any_launch_file_utilities
launch.launch_description_sources.frontend_launch_file_utilities
launch.launch_description_sources.python_launch_file_utilities launch.launch_introspector
launch.substitutions.boolean_substitution launch.utilities launch.utilities.class_tools_impl
launch.utilities.ensure_argument_type_impl launch.utilities.normalize_to_list_of_entities_impl
launch.utilities.normalize_to_list_of_substitutions_impl launch.utilities.perform_substitutions_impl
launch.utilities.signal_management launch.utilities.type_utils launch.utilities.typing_file_path
launch.utilities.visit_all_entities_and_collect_futures_impl launch_ros.actions.lifecycle_transition
launch_ros.actions.load_composable_nodes launch_ros.actions.node launch_ros.events
launch_ros.events.lifecycle.lifecycle_node_matchers launch_ros.events.matchers
launch_ros.events.matchers.matches_node_name launch_ros.ros_adapters launch_ros.substitutions.find_package
launch_ros.utilities launch_ros.utilities.evaluate_parameters launch_ros.utilities.namespace_utils
launch_ros.utilities.normalize_parameters launch_ros.utilities.normalize_remap_rule
launch_ros.utilities.plugin_support launch_ros.utilities.to_parameters_list launch_ros.utilities.track_node_names
"""


def api() -> dict[str, list[str] | None]:
    """Return the public names of each real module, submodules not among them; None where they are not listed."""
    found: dict[str, list[str] | None] = dict.fromkeys(_INNER.split())
    module = ""
    for line in _API.strip().splitlines():
        if not line.startswith(" "):
            module, _, line = line.partition(":")
            found[module] = names = list[str]()
        for word in line.split():
            name = word.removesuffix(".")
            names.append(name)
            if word != name:
                inner = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
                found[f"{module}.{inner}"] = [name]
    return found
