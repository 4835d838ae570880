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
launch.actions.shutdown_action: Shutdown
launch.conditions: IfCondition. InvalidConditionExpressionError. LaunchConfigurationEquals.
  LaunchConfigurationNotEquals. UnlessCondition. evaluate_condition_expression
launch.conditions.evaluate_condition_expression_impl: evaluate_condition_expression
launch.descriptions: Executable.
launch.event_handler: BaseEventHandler EventHandler
launch.event_handlers: OnExecutionComplete. OnIncludeLaunchDescription. OnProcessExit. OnProcessIO. OnProcessStart.
  OnShutdown event_named.
launch.event_handlers.on_action_event_base: OnActionEventBase
launch.event_handlers.on_shutdown: OnShutdown gen_handler
launch.events: ExecutionComplete. IncludeLaunchDescription. Shutdown. TimerEvent. matches_action
launch.events.matchers: matches_action
launch.events.process: ProcessExited. ProcessIO. ProcessStarted. ProcessStderr. ProcessStdin. ProcessStdout.
  ProcessTargetedEvent. RunningProcessEvent. ShutdownProcess. SignalProcess. matches_executable matches_name
  matches_pid
launch.events.process.process_matchers: matches_executable matches_name matches_pid
launch.frontend: Entity InvalidFrontendLaunchFileError Parser expose_action expose_substitution
launch.frontend.entity: Entity TargetType
launch.frontend.expose: expose_action expose_substitution instantiate_action instantiate_substitution
launch.frontend.parse_substitution: ExtractSubstitution get_grammar_path parse_if_substitutions parse_substitution
  replace_escaped_characters
launch.frontend.parser: InvalidFrontendLaunchFileError Parser
launch.frontend.type_utils: check_is_list_entity get_data_type_from_identifier
launch.launch_description_sources: AnyLaunchDescriptionSource. FrontendLaunchDescriptionSource.
  InvalidFrontendLaunchFileError InvalidLaunchFileError InvalidPythonLaunchFileError PythonLaunchDescriptionSource.
  get_launch_description_from_any_launch_file get_launch_description_from_frontend_launch_file
  get_launch_description_from_python_launch_file load_python_launch_file_as_module
launch.launch_description_sources.any_launch_file_utilities: get_launch_description_from_any_launch_file
launch.launch_description_sources.frontend_launch_file_utilities: get_launch_description_from_frontend_launch_file
launch.launch_description_sources.python_launch_file_utilities: InvalidPythonLaunchFileError
  get_launch_description_from_python_launch_file load_python_launch_file_as_module
launch.launch_introspector: LaunchIntrospector format_action format_entities format_event_handler
  format_substitutions indent tree_like_indent
launch.logging: get_logger get_output_loggers handlers launch_config reset
launch.some_entities_type: SomeEntitiesType SomeEntitiesType_types_tuple
launch.some_substitutions_type: SomeSubstitutionsType SomeSubstitutionsType_types_tuple
launch.substitutions: AllSubstitution AndSubstitution AnonName. AnySubstitution Command. EnvironmentVariable.
  EqualsSubstitution. FileContent. FindExecutable. IfElseSubstitution. LaunchConfiguration. LaunchLogDir.
  LocalSubstitution. NotEqualsSubstitution. NotSubstitution OrSubstitution PathJoinSubstitution. PythonExpression.
  SubstitutionFailure. TextSubstitution. ThisLaunchFile. ThisLaunchFileDir.
launch.substitutions.boolean_substitution: AllSubstitution AndSubstitution AnySubstitution NotSubstitution
  OrSubstitution
launch.utilities: AsyncSafeSignalManager ensure_argument_type is_a is_a_subclass isclassinstance
  normalize_to_list_of_entities normalize_to_list_of_substitutions perform_substitutions
  visit_all_entities_and_collect_futures
launch.utilities.class_tools_impl: is_a is_a_subclass isclassinstance
launch.utilities.ensure_argument_type_impl: ensure_argument_type
launch.utilities.normalize_to_list_of_entities_impl: normalize_to_list_of_entities
launch.utilities.normalize_to_list_of_substitutions_impl: normalize_to_list_of_substitutions
launch.utilities.perform_substitutions_impl: perform_substitutions
launch.utilities.signal_management: AsyncSafeSignalManager
launch.utilities.type_utils: coerce_list coerce_to_type extract_type get_typed_value is_instance_of
  is_instance_of_valid_type is_normalized_substitution is_substitution is_typing_list is_valid_scalar_type
  normalize_typed_substitution perform_typed_substitution
launch.utilities.typing_file_path: FilePath
launch.utilities.visit_all_entities_and_collect_futures_impl: visit_all_entities_and_collect_futures
launch_ros:
launch_ros.actions: ComposableNodeContainer. LifecycleNode. LifecycleTransition LoadComposableNodes Node
  PushROSNamespace. PushRosNamespace ROSTimer. RosTimer SetParameter. SetParametersFromFile. SetROSLogDir. SetRemap.
  SetUseSimTime.
launch_ros.actions.lifecycle_transition: LifecycleTransition match_node_name_goal match_node_name_start_goal
launch_ros.actions.load_composable_nodes: LoadComposableNodes get_composable_node_load_request
launch_ros.actions.node: Node NodeActionExtension get_extensions instantiate_extension
launch_ros.descriptions: ComposableNode. Parameter ParameterFile ParameterValue
launch_ros.event_handlers: OnStateTransition.
launch_ros.events: matches_node_name
launch_ros.events.lifecycle: ChangeState. StateTransition. matches_node_name
launch_ros.events.lifecycle.lifecycle_node_matchers: matches_node_name
launch_ros.events.matchers: matches_node_name.
launch_ros.parameter_descriptions: Parameter ParameterFile ParameterValue
launch_ros.parameters_type: SomeParameterFile SomeParameterValue SomeParameters
launch_ros.remap_rule_type: SomeRemapRules
launch_ros.ros_adapters: ROSAdapter get_ros_adapter get_ros_node
launch_ros.substitutions: ExecutableInPackage. FindPackage FindPackagePrefix FindPackageShare Parameter.
launch_ros.substitutions.find_package: FindPackage FindPackagePrefix FindPackageShare
launch_ros.utilities: add_node_name evaluate_parameters evaluate_parameters_dict get_node_name_count
  is_namespace_absolute is_root_namespace make_namespace_absolute normalize_parameters normalize_parameters_dict
  normalize_remap_rule normalize_remap_rules prefix_namespace to_parameters_list.
launch_ros.utilities.evaluate_parameters: evaluate_parameter_dict evaluate_parameters
launch_ros.utilities.namespace_utils: OptionalText is_namespace_absolute is_root_namespace make_namespace_absolute
  prefix_namespace
launch_ros.utilities.normalize_parameters: normalize_parameter_dict normalize_parameters
launch_ros.utilities.normalize_remap_rule: normalize_remap_rule normalize_remap_rules
launch_ros.utilities.plugin_support: PluginException get_upper_bound_caret_version satisfies_version
launch_ros.utilities.track_node_names: add_node_name get_node_name_count
launch_xml.launch_description_sources: XMLLaunchDescriptionSource
launch_yaml.launch_description_sources: YAMLLaunchDescriptionSource
"""


def api() -> dict[str, list[str]]:
    """Return the public names of each real module, submodules not among them."""
    found: dict[str, list[str]] = {}
    module = ""
    for line in _API.strip().splitlines():
        if not line.startswith(" "):
            module, _, line = line.partition(":")
            found[module] = []
        for word in line.split():
            name = word.removesuffix(".")
            found[module].append(name)
            if word != name:
                inner = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()
                found[f"{module}.{inner}"] = [name]
    return found
