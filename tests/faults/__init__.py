"""Faults put into the kit by hand, one at a time, to see whether its tests notice them.

Chosen by somebody who had not read the tests.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """A symptom, and the text that causes it: `old` occurs once in `file` and is replaced by `new`.

    `seen_by` is the test that noticed it the last time, which `faults.table` tries first.
    """

    name: str
    file: str
    old: str
    new: str
    seen_by: str


_COURSE = "grader/courses/robot_controller"

FAULTS = (
    # -- checks and trials ---------------------------------------------------------------------------------------------
    Fault(
        "a_zero_from_before_the_scan_counts_as_a_stop",
        f"{_COURSE}/checks/check_obstacle.py",
        "if c.t >= near - 1e-9 and c.is_zero)",
        "if c.is_zero)",
        "tests/grader/checks/test_every_check.py::test_a_known_bad_submission_does_not_get_all_its_points",
    ),
    Fault(
        "a_nan_distance_counts_as_true_feedback",
        f"{_COURSE}/checks/check_goals.py",
        "return any(abs(said - distance) <= _NEAR_M for",
        "return not any(abs(said - distance) > _NEAR_M for",
        "tests/grader/checks/test_check_goals.py::test_a_message_of_a_node_on_wall_time_may_come_late",
    ),
    Fault(
        "driving_forwards_passes_for_driving_backwards",
        f"{_COURSE}/checks/check_set_speed.py",
        "holds = abs(speed - wanted) <=",
        "holds = abs(abs(speed) - abs(wanted)) <=",
        "tests/grader/checks/test_every_check.py::test_a_known_bad_submission_does_not_get_all_its_points",
    ),
    Fault(
        "an_alarm_at_every_battery_message_passes",
        f"{_COURSE}/checks/check_fusion.py",
        "len(about) == 1,",
        "len(about) >= 1,",
        "tests/grader/checks/test_every_check.py::test_a_known_bad_submission_does_not_get_all_its_points",
    ),
    Fault(
        "a_refused_change_of_a_limit_counts",
        f"{_COURSE}/checks/check_limits.py",
        "if p.name == name and p.accepted is True]",
        "if p.name == name]",
        "tests/grader/checks/test_check_limits.py::test_a_limit_that_was_lowered_holds_from_the_next_cycle_on",
    ),
    Fault(
        "a_program_that_cannot_be_read_costs_nothing",
        "grader/checks/judge.py",
        "min(1.0, max(0.0, fraction)) * self._weight",
        "min(1.0, max(0.0, fraction))",
        "tests/grader/checks/test_measured.py::test_what_a_check_gives_counts_for_the_nodes_that_are_there",
    ),
    Fault(
        "a_check_that_never_reported_costs_points",
        "grader/checks/checks_run.py",
        "CheckResult(check, Outcome.ERROR,",
        "CheckResult(check, Outcome.FAILED,",
        "tests/grader/checks/test_checks_run.py::test_a_check_that_ends_the_process_is_named_and_what_was_judged_before_counts",
    ),
    Fault(
        "a_reading_at_range_min_is_missing_from_the_truth",
        "grader/trials/recorder.py",
        "(ranges >= scan.range_min)",
        "(ranges > scan.range_min)",
        "tests/grader/trials/test_graph.py::test_readings_at_both_ends_of_the_range_are_valid_and_those_beyond_are_not",
    ),
    Fault(
        "a_false_clock_under_our_own_name_is_not_flagged",
        "grader/trials/graph.py",
        "if info.node_name != observer.get_name() or own > 1:",
        "if info.node_name != observer.get_name():",
        "tests/grader/trials/test_graph.py::test_a_second_publisher_under_the_observers_own_name_is_foreign",
    ),
    Fault(
        "a_trial_that_broke_off_is_kept_for_the_next_grading",
        "grader/trials/source.py",
        "not (trial.ended or trial.script_error",
        "not (trial.script_error",
        "tests/grader/trials/test_source.py::test_a_trial_that_went_wrong_is_tried_again",
    ),
    # -- intake --------------------------------------------------------------------------------------------------------
    Fault(
        "a_path_climbs_out_from_a_subfolder",
        "grader/intake/copy_plan.py",
        'if ".." in parts:',
        'if parts[:1] == [".."]:',
        "tests/grader/intake/test_copy_plan.py::test_an_unsafe_name_is_left_out_and_flagged",
    ),
    Fault(
        "each_archive_inside_may_fill_the_whole_limit",
        "grader/intake/submission.py",
        "            self._left = inner.left\n",
        "",
        "tests/grader/intake/test_copy_plan.py::test_an_archive_inside_counts_against_the_same_limits",
    ),
    Fault(
        "a_package_xml_with_a_doctype_is_read",
        "grader/intake/package_xml.py",
        "ElementTree.XMLParser(target=_Builder())",
        "ElementTree.XMLParser()",
        "tests/grader/intake/test_package_xml.py::test_entities_are_refused_rather_than_expanded",
    ),
    Fault(
        "a_zip_hidden_in_front_of_a_zip_is_taken_in",
        "grader/intake/containers.py",
        "        _require_one_zip(path, archive)\n",
        "",
        "tests/grader/intake/test_two_archives.py::test_a_zip_behind_a_zip",
    ),
    Fault(
        "of_two_different_packages_the_first_is_graded",
        "grader/intake/choose.py",
        "if len(pool) > 1:",
        "if len(pool) > 2:",
        "tests/grader/intake/test_choose.py::test_of_several_none_is_guessed",
    ),
    # -- sandbox -------------------------------------------------------------------------------------------------------
    Fault(
        "the_root_of_the_sandbox_can_be_written",
        "grader/sandbox/bwrap.py",
        '"--remount-ro", "/", "--chdir"',
        '"--chdir"',
        "tests/grader/sandbox/test_sandbox.py::test_the_system_and_read_only_mounts_cannot_be_written",
    ),
    Fault(
        "clone3_gets_around_the_filter_of_calls",
        "grader/sandbox/syscall_filter.py",
        "        435,  # clone3: its flags are in memory, out of a filter's sight; the C library then calls clone\n",
        "",
        "tests/grader/sandbox/test_sandbox.py::test_a_command_cannot_become_root_of_a_namespace",
    ),
    Fault(
        "a_command_that_computes_runs_out_of_time_early",
        "grader/sandbox/cpu_clock.py",
        "ran / (os.cpu_count() or 1)",
        "ran * (os.cpu_count() or 1)",
        "tests/grader/sandbox/test_sandbox.py::test_a_build_that_keeps_the_cores_busy_itself_waits_for_nobody",
    ),
    Fault(
        "a_sparse_file_counts_as_no_disk_space",
        "grader/sandbox/disk_guard.py",
        "size += max(facts.st_blocks * 512, facts.st_size)",
        "size += facts.st_blocks * 512",
        "tests/grader/sandbox/test_limits.py::test_a_file_with_holes_counts_by_its_size",
    ),
    Fault(
        "a_link_that_a_submission_left_is_followed",
        "grader/sandbox/untrusted.py",
        "os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK",
        "os.O_RDONLY | os.O_NONBLOCK",
        "tests/grader/sandbox/test_untrusted.py::test_links_pipes_folders_and_long_files_are_not_read",
    ),
    # -- classroom -----------------------------------------------------------------------------------------------------
    Fault(
        "minutes_of_grace_are_read_as_seconds",
        "grader/classroom/lateness.py",
        'grace_s=60 * int(found["grace"] or 0)',
        'grace_s=int(found["grace"] or 0)',
        "tests/grader/classroom/test_lateness.py::test_grace_costs_nothing_and_then_counts_from_its_end",
    ),
    Fault(
        "a_bonus_before_another_adjustment_is_cut",
        "grader/classroom/gradebook.py",
        "for each in sorted(adjustments, key=lambda adjustment: adjustment.change is Change.BONUS):",
        "for each in adjustments:",
        "tests/grader/classroom/test_gradebook.py::test_people_decide",
    ),
    Fault(
        "a_moodle_number_of_another_assignment_decides_alone",
        "grader/classroom/identity.py",
        'person.lms == claim.lms == "canvas"',
        "person.lms == claim.lms",
        "tests/grader/classroom/test_identity.py::test_a_groups_number_is_not_a_participants",
    ),
    Fault(
        "a_team_reads_the_extension_of_one_member",
        "grader/classroom/hand_ins.py",
        "entry.people[0] if len(entry.people) == 1 else None",
        "entry.people[0] if entry.people else None",
        "tests/grader/classroom/test_hand_ins.py::test_a_members_extension_is_a_figure_of_their_own_and_no_reason_on_the_teams_page",
    ),
    Fault(
        "a_grade_that_is_not_final_goes_to_canvas",
        "grader/classroom/platforms/canvas.py",
        "if row.total is None or not row.final else",
        "if row.total is None else",
        "tests/grader/classroom/test_exports.py::test_a_row_that_is_not_final_keeps_its_cells",
    ),
    # -- notebook ------------------------------------------------------------------------------------------------------
    Fault(
        "a_cell_overwrites_work_without_a_copy",
        "grader/notebook/file_backups.py",
        "or self._writers(path):",
        "or not self._writers(path):",
        "tests/grader/notebook/test_file_backups.py::test_a_cell_that_overwrites_an_edit_backs_it_up_and_says_where",
    ),
    Fault(
        "an_answer_of_almost_zero_is_wrong_where_zero_is_wanted",
        "grader/notebook/tables.py",
        "math.isclose(got, wanted, abs_tol=1e-6)",
        "math.isclose(got, wanted, rel_tol=1e-6)",
        "tests/grader/notebook/test_pieces.py::test_values_are_equal_as_a_reader_would_say",
    ),
    Fault(
        "a_check_is_put_off_in_the_notebook_that_brings_it",
        "grader/notebook/prerequisites.py",
        'return row if row and "" < notebook < row["notebook"]',
        'return row if row and "" < notebook <= row["notebook"]',
        "tests/grader/notebook/test_prerequisites.py::test_a_check_waits_before_the_notebook_that_brings_what_it_needs_and_not_in_it_or_outside_of_notebooks",
    ),
    Fault(
        "the_list_of_laid_out_files_is_not_handed_in",
        "grader/notebook/packing.py",
        '_KEPT_DOTS = {course_marker.MARKER, ".flake8"',
        '_KEPT_DOTS = {".flake8"',
        "tests/grader/notebook/test_packing.py::test_files_laid_out_by_the_course_are_named",
    ),
    Fault(
        "two_workspaces_share_a_domain",
        "grader/notebook/domain.py",
        "if held := dds_domain.claim(number, _identity(root)):",
        "if held := dds_domain.claim(number, ''):",
        "tests/grader/notebook/test_domain.py::test_thirty_kernels_that_start_at_the_same_moment_have_thirty_domains",
    ),
    # -- ros2 ----------------------------------------------------------------------------------------------------------
    Fault(
        "param_load_skips_what_is_meant_for_all_nodes",
        "grader/ros2/commands/param.py",
        'for key in sorted(blocks, key=lambda key: key != "/**"):',
        'for key in (key for key in blocks if key != "/**"):',
        "tests/grader/ros2/test_refusals.py::test_a_parameter_file_is_loaded_whatever_node_its_keys_name",
    ),
    Fault(
        "a_best_effort_publisher_beside_a_reliable_one_is_not_heard",
        "grader/ros2/commands/graph.py",
        "best_effort = any(",
        "best_effort = bool(offered) and all(",
        "tests/grader/ros2/test_refusals.py::test_one_best_effort_publisher_among_reliable_ones_is_heard_too",
    ),
    Fault(
        "a_bag_played_at_double_rate_takes_twice_as_long",
        "grader/ros2/commands/bag.py",
        "(stamp_ns - first) / 1e9 / rate",
        "(stamp_ns - first) / 1e9 * rate",
        "tests/grader/ros2/test_refusals.py::test_a_bag_at_twice_its_rate_takes_half_its_time",
    ),
    Fault(
        "a_node_respawns_once_too_often",
        "grader/ros2/launching/process.py",
        "0 <= self.respawn_max_retries <= restarts",
        "0 <= self.respawn_max_retries < restarts",
        "tests/grader/ros2/test_launch_files.py::test_a_process_respawns_and_a_required_one_ends_the_launch",
    ),
    Fault(
        "parameters_do_not_reach_a_launched_node_in_a_namespace",
        "grader/ros2/launching/ros_actions.py",
        'self._parameter(context, one, full or "/**")',
        'self._parameter(context, one, name or "/**")',
        "tests/grader/ros2/test_launch_names.py::test_parameter_values_get_their_types",
    ),
    # -- sim -----------------------------------------------------------------------------------------------------------
    Fault(
        "what_is_too_near_for_the_lidar_reads_as_free",
        "sim/sensors.py",
        "ranges[ranges < p.range_min] = -np.inf",
        "ranges[ranges < p.range_min] = np.inf",
        "tests/sim/test_sensors.py::test_nothing_in_range_reads_plus_infinity_and_too_close_minus_infinity",
    ),
    Fault(
        "a_command_of_which_half_is_nan_is_taken",
        "sim/simulator.py",
        "if not (math.isfinite(v) and math.isfinite(omega)):",
        "if not (math.isfinite(v) or math.isfinite(omega)):",
        "tests/sim/test_simulator.py::test_a_command_that_is_not_finite_is_refused_and_the_old_one_stays_in_force",
    ),
    Fault(
        "a_turtlebot_stops_half_a_second_after_its_start",
        "sim/simulator.py",
        "self._command, self._command_tick = Twist(v, omega), self._tick",
        "self._command = Twist(v, omega)",
        "tests/sim/test_sensors.py::test_the_tb4_scales_v_and_omega_together",
    ),
    Fault(
        "a_mirrored_world_turns_the_wrong_way",
        "sim/transform.py",
        "normalize_angle((-yaw if self.mirror else yaw) + self.rotate)",
        "normalize_angle(yaw + self.rotate)",
        "tests/sim/test_world.py::test_a_world_is_mirrored_rotated_and_shifted_in_this_order",
    ),
    Fault(
        "a_robot_that_is_put_back_keeps_the_seed_it_had",
        "sim/simulator.py",
        "            self._seed = seed\n",
        "            pass\n",
        "tests/sim/test_recording.py::test_after_a_reset_the_run_repeats",
    ),
)
