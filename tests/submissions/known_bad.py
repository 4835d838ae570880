"""Which known-bad submission fails which check. Each name is that of an edit in submissions/edits.py.

The evidence of these submissions is recorded in tests/evidence (`python -m submissions.record`).
"""

from __future__ import annotations

FAILS_ON = {
    # F1: Zero command when idle
    "check_idle::test_publishes_zero_without_a_command": "silent_when_idle",
    "check_idle::test_publishes_at_the_control_rate": "half_the_rate",
    # F2: Drives at the set speed
    "check_set_speed::test_accepts_a_speed_within_the_limit": "refuses_the_limit_itself",
    "check_set_speed::test_drives_at_the_set_speed": "drives_too_slowly",
    "check_set_speed::test_drives_backwards_at_a_negative_speed": "never_backwards",
    # F3: Refuses a bad speed
    "check_set_speed::test_refuses_a_speed_above_the_limit": "ignores_the_limit",
    "check_set_speed::test_refuses_a_speed_that_is_not_finite": "accepts_nan_as_a_speed",
    "check_set_speed::test_a_refusal_states_the_limit": "refuses_without_the_limit",
    "check_set_speed::test_a_refusal_leaves_the_speed_in_force": "stops_when_it_refuses",
    # F4: Stops before an obstacle
    "check_obstacle::test_never_touches_the_obstacle": "drives_into_the_wall",
    "check_obstacle::test_stops_within_three_tenths_of_a_second": "stops_late",
    "check_obstacle::test_commands_zero_in_an_emergency": "turns_on_in_an_emergency",
    # F5: Drives on when the way is free
    "check_obstacle::test_drives_on_when_the_obstacle_goes_away": "never_forgets_an_obstacle",
    "check_obstacle::test_drives_forward_with_an_obstacle_behind": "looks_all_around",
    # F6: Bad readings do no harm
    "check_readings::test_bad_readings_are_not_an_obstacle": "believes_every_reading",
    "check_readings::test_bad_readings_do_not_crash_the_node": "crashes_on_an_empty_scan",
    "check_readings::test_a_real_obstacle_among_bad_readings_is_seen": "keeps_the_last_valid_scan",
    # F7: Reports its status
    "check_status::test_status_gives_the_speed_in_force": "speed_without_a_sign",
    "check_status::test_status_reports_an_obstacle": "status_never_clears_the_obstacle",
    "check_status::test_status_gives_the_pose_from_odometry": "never_reports_the_pose",
    "check_status::test_status_is_active_or_obstacle_detected": "status_is_ok",
    # F8: Reaches a target
    "check_navigation::test_reaches_a_target_ahead": "stops_short",
    "check_navigation::test_reaches_a_target_beside": "goals_are_relative",
    "check_navigation::test_reaches_a_target_behind": "forgets_to_say_success",
    "check_navigation::test_final_pose_agrees_with_odometry": "copies_the_target_as_final_pose",
    "check_navigation::test_stands_still_after_arrival": "rolls_on_after_arrival",
    # F9: Feedback on the way
    "check_goals::test_feedback_comes_at_two_hertz": "feedback_too_rarely",
    "check_goals::test_feedback_is_the_true_distance": "feedback_along_x",
    # F10: Cancels a goal
    "check_goals::test_a_cancelled_goal_ends_as_canceled": "a_cancel_counts_as_success",
    "check_goals::test_stands_still_after_a_cancel": "resumes_its_speed_after_a_goal",
    # F11: Blocked ways and limits
    "check_goals::test_a_blocked_goal_never_ends_in_a_collision": "drives_into_the_wall",
    "check_goals::test_a_blocked_goal_is_completed_once_the_way_is_free": "gives_up_when_blocked",
    "check_limits::test_limits_hold_throughout": "jumps_to_the_speed",
    # F12: Fuses the sensors
    "check_fusion::test_fuses_the_closest_valid_reading": "publishes_nothing_when_nothing_is_near",
    "check_fusion::test_fuses_the_battery_in_percent": "battery_as_a_ratio",
    "check_fusion::test_fuses_the_latest_imu_message": "keeps_the_first_imu_message",
    "check_fusion::test_battery_alarms_are_logged_once": "logs_the_alarm_at_every_message",
    # F13: Fused data in time
    "check_fusion::test_publishes_at_the_fusion_frequency": "fuses_at_half_the_rate",
    "check_fusion::test_publishes_nothing_before_the_first_scan": "publishes_before_the_first_scan",
    # F14: Conversions at their edges
    "check_functions::test_functions_are_right_at_their_edges": "minus_pi_stays",
    # Q1: Style
    "check_style::test_ament_flake8_finds_nothing": "leaves_an_import_behind",
    # Q2: Docstrings
    "check_docstrings::test_public_things_have_docstrings": "does_not_document_its_settings",
    "check_docstrings::test_docstrings_follow_ament_pep257": "breaks_the_docstring_rules",
    # Q3: Structure
    "check_structure::test_layout_matches_the_contract": "forgets_the_test_results",
    "check_structure::test_no_function_is_too_complex": "decides_everything_in_one_function",
    "check_structure::test_conversions_are_in_utils_and_used": "wraps_an_angle_by_hand",
    "check_structure::test_no_block_is_repeated": "copies_a_block",
    # Q4: Safe habits
    "check_habits::test_no_bare_except_print_or_mutable_default": "prints_its_answers",
    "check_habits::test_callbacks_do_not_sleep": "sleeps_in_a_callback",
    "check_habits::test_contract_numbers_are_parameters": "hard_codes_the_emergency_distance",
    "check_habits::test_public_functions_are_annotated": "leaves_the_types_out",
    # Q5: README
    "check_readme::test_readme_says_what_and_how": "does_not_say_how_to_test_it",
    "check_readme::test_interface_table_agrees": "lists_an_old_type",
    # Q6: Demonstration and test results
    "check_handed_in::test_demonstration_runs": "demonstrates_no_goal",
    "check_handed_in::test_test_results_match_the_tests": "forgets_the_test_results",
    # I1: Builds and installs
    "check_build::test_colcon_build_succeeds": "does_not_compile",
    "check_build::test_executables_are_installed": "forgets_an_executable",
    "check_build::test_shared_files_are_installed": "forgets_the_config",
    # I2: A correct package.xml
    "check_package_xml::test_package_xml_is_valid_format_3": "has_a_package_xml_of_format_2",
    "check_package_xml::test_licence_has_its_spdx_name": "writes_out_its_licence",
    "check_package_xml::test_build_type_matches_the_package": "calls_itself_ament_python",
    "check_package_xml::test_every_package_used_is_declared": "does_not_declare_nav_msgs",
    # I3: The contract's types
    "check_interfaces::test_type_hashes_match_the_contract": "exchanges_two_fields",
    "check_interfaces::test_nodes_use_the_contracts_types": "renames_the_package",
    # I4: The contract's graph
    "check_graph::test_controller_shows_the_contracts_interfaces": "misnames_set_speed",
    "check_graph::test_processor_shows_the_contracts_interfaces": "publishes_another_topic",
    "check_graph::test_sensor_subscriptions_match_best_effort": "deaf_to_best_effort",
    # I5: Launch files
    "check_launch::test_the_launch_files_start_the_nodes": "launches_two_controllers",
    "check_launch::test_each_launch_file_takes_use_sim_time": "does_not_declare_use_sim_time",
    "check_launch::test_parameters_come_from_the_yaml_files": "sets_the_parameters_in_the_launch_file",
    "check_launch::test_a_remapping_in_a_launch_file_works": "pins_a_topic_name",
    # I6: Parameters
    "check_parameters::test_parameter_files_load": "names_another_node_in_the_file",
    "check_parameters::test_overrides_change_the_behaviour": "ignores_the_threshold",
    "check_parameters::test_invalid_values_are_refused_at_start": "checks_after_declaring",
    "check_parameters::test_invalid_values_are_refused_at_run_time": "accepts_a_negative_threshold",
    # I7: Simulated time
    "check_clock::test_timers_and_stamps_follow_the_clock": "uses_wall_time",
    # I8: Ends on Ctrl-C
    "check_interrupt::test_ctrl_c_ends_each_node_cleanly": "drives_on_after_ctrl_c",
    # T1: Tests for both nodes
    "check_student_tests::test_both_nodes_have_tests": "tests_its_conversions_only",
    "check_student_tests::test_every_test_asserts_something": "tests_without_asserting",
    "check_student_tests::test_own_tests_pass": "has_a_failing_test",
    # T2: Coverage
    "check_student_tests::test_coverage_of_lines_and_branches": "tests_its_conversions_only",
    # T3: Tests that notice mutants
    "check_mutation::test_mutants_are_noticed": "tests_its_conversions_only",
    "check_mutation::test_most_mutants_are_noticed": "tests_its_conversions_only",
}
"""Check id -> the known-bad submission that does not get all its points."""
