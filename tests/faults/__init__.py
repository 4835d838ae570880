"""Faults put into the kit by hand, one at a time, to see whether its tests notice them.

Chosen by somebody who had not read the tests.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """A symptom, and the text that causes it: `old` occurs once in `file` and is replaced by `new`."""

    name: str
    file: str
    old: str
    new: str


_COURSE = "grader/courses/robot_controller"

FAULTS = (
    # -- checks and trials ---------------------------------------------------------------------------------------------
    Fault(
        "a_zero_from_before_the_scan_counts_as_a_stop",
        f"{_COURSE}/checks/check_obstacle.py",
        "if c.t >= near - 1e-9 and c.is_zero)",
        "if c.is_zero)",
    ),
    Fault(
        "a_nan_distance_counts_as_true_feedback",
        f"{_COURSE}/checks/check_goals.py",
        "return any(abs(said - distance) <= _NEAR_M for",
        "return not any(abs(said - distance) > _NEAR_M for",
    ),
    Fault(
        "driving_forwards_passes_for_driving_backwards",
        f"{_COURSE}/checks/check_set_speed.py",
        "holds = abs(speed - wanted) <=",
        "holds = abs(abs(speed) - abs(wanted)) <=",
    ),
    Fault(
        "an_alarm_at_every_battery_message_passes",
        f"{_COURSE}/checks/check_fusion.py",
        "len(about) == 1,",
        "len(about) >= 1,",
    ),
    Fault(
        "a_refused_change_of_a_limit_counts",
        f"{_COURSE}/checks/check_limits.py",
        "if p.name == name and p.accepted is True]",
        "if p.name == name]",
    ),
    Fault(
        "a_program_that_cannot_be_read_costs_nothing",
        "grader/checks/judge.py",
        "min(1.0, max(0.0, fraction)) * self._weight",
        "min(1.0, max(0.0, fraction))",
    ),
    Fault(
        "a_check_that_never_reported_costs_points",
        "grader/checks/checks_run.py",
        "CheckResult(check, Outcome.ERROR,",
        "CheckResult(check, Outcome.FAILED,",
    ),
    Fault(
        "a_reading_at_range_min_is_missing_from_the_truth",
        "grader/trials/recorder.py",
        "(ranges >= scan.range_min)",
        "(ranges > scan.range_min)",
    ),
    Fault(
        "a_false_clock_under_our_own_name_is_not_flagged",
        "grader/trials/graph.py",
        "if info.node_name != observer.get_name() or own > 1:",
        "if info.node_name != observer.get_name():",
    ),
    Fault(
        "a_trial_that_broke_off_is_kept_for_the_next_grading",
        "grader/trials/source.py",
        "not (trial.ended or trial.script_error",
        "not (trial.script_error",
    ),
    # -- intake --------------------------------------------------------------------------------------------------------
    Fault(
        "a_path_climbs_out_from_a_subfolder",
        "grader/intake/copy_plan.py",
        'if ".." in parts:',
        'if parts[:1] == [".."]:',
    ),
    Fault(
        "each_archive_inside_may_fill_the_whole_limit",
        "grader/intake/submission.py",
        "            self._left = inner.left\n",
        "",
    ),
    Fault(
        "a_package_xml_with_a_doctype_is_read",
        "grader/intake/xml_reader.py",
        "ElementTree.XMLParser(target=_Builder())",
        "ElementTree.XMLParser()",
    ),
    Fault(
        "a_zip_hidden_in_front_of_a_zip_is_taken_in",
        "grader/intake/containers.py",
        "            self._require_one(archive)\n",
        "",
    ),
    Fault(
        "of_two_different_packages_the_first_is_graded",
        "grader/intake/choose.py",
        "for candidate in pool}) > 1:",
        "for candidate in pool}) > 2:",
    ),
    # -- sandbox -------------------------------------------------------------------------------------------------------
    Fault(
        "the_root_of_the_sandbox_can_be_written",
        "grader/sandbox/bwrap.py",
        '"--remount-ro", "/", "--chdir"',
        '"--chdir"',
    ),
    Fault(
        "clone3_gets_around_the_filter_of_calls",
        "grader/sandbox/syscall_filter.py",
        "        435,  # clone3: its flags are in memory, out of a filter's sight; the C library then calls clone\n",
        "",
    ),
    Fault(
        "a_command_that_computes_runs_out_of_time_early",
        "grader/sandbox/cpu_clock.py",
        "ran / (os.cpu_count() or 1)",
        "ran * (os.cpu_count() or 1)",
    ),
    Fault(
        "a_sparse_file_counts_as_no_disk_space",
        "grader/sandbox/disk_guard.py",
        "size += max(facts.st_blocks * 512, facts.st_size)",
        "size += facts.st_blocks * 512",
    ),
    Fault(
        "a_link_that_a_submission_left_is_followed",
        "grader/sandbox/untrusted.py",
        "os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK",
        "os.O_RDONLY | os.O_NONBLOCK",
    ),
    # -- classroom -----------------------------------------------------------------------------------------------------
    Fault(
        "minutes_of_grace_are_read_as_seconds",
        "grader/classroom/lateness.py",
        'grace_s=60 * int(found["grace"] or 0)',
        'grace_s=int(found["grace"] or 0)',
    ),
    Fault(
        "a_bonus_before_another_adjustment_is_cut",
        "grader/classroom/gradebook.py",
        "for each in sorted(adjustments, key=lambda adjustment: adjustment.change is Change.BONUS):",
        "for each in adjustments:",
    ),
    Fault(
        "a_moodle_number_of_another_assignment_decides_alone",
        "grader/classroom/identity.py",
        'person.lms == claim.lms == "canvas"',
        "person.lms == claim.lms",
    ),
    Fault(
        "a_team_reads_the_extension_of_one_member",
        "grader/classroom/hand_ins.py",
        "entry.people[0] if len(entry.people) == 1 else None",
        "entry.people[0] if entry.people else None",
    ),
    Fault(
        "a_grade_that_is_not_final_goes_to_canvas",
        "grader/classroom/platforms/canvas.py",
        "if row.total is None or not row.final else",
        "if row.total is None else",
    ),
    # -- notebook ------------------------------------------------------------------------------------------------------
    Fault(
        "a_cell_overwrites_work_without_a_copy",
        "grader/notebook/file_backups.py",
        "if _sum(content) == self._written(path)[0]:",
        "if _sum(content) != self._written(path)[0]:",
    ),
    Fault(
        "an_answer_of_almost_zero_is_wrong_where_zero_is_wanted",
        "grader/notebook/tables.py",
        "math.isclose(got, wanted, abs_tol=1e-6)",
        "math.isclose(got, wanted, rel_tol=1e-6)",
    ),
    Fault(
        "a_check_is_put_off_in_the_notebook_that_brings_it",
        "grader/notebook/prerequisites.py",
        'return Later(**row) if row and "" < notebook < row["notebook"]',
        'return Later(**row) if row and "" < notebook <= row["notebook"]',
    ),
    Fault(
        "the_list_of_laid_out_files_is_not_handed_in",
        "grader/notebook/packing.py",
        '_KEPT_DOTS = {course_marker.MARKER, ".flake8"',
        '_KEPT_DOTS = {".flake8"',
    ),
    Fault(
        "two_workspaces_share_a_domain",
        "grader/notebook/domain.py",
        "if held := dds_domain.claim(number, _identity(root)):",
        "if held := dds_domain.claim(number, ''):",
    ),
    # -- ros2 ----------------------------------------------------------------------------------------------------------
    Fault(
        "param_load_skips_what_is_meant_for_all_nodes",
        "grader/ros2/commands/param.py",
        'for key in sorted(blocks, key=lambda key: key != "/**"):',
        'for key in (key for key in blocks if key != "/**"):',
    ),
    Fault(
        "a_best_effort_publisher_beside_a_reliable_one_is_not_heard",
        "grader/ros2/commands/graph.py",
        "best_effort = any(",
        "best_effort = bool(offered) and all(",
    ),
    Fault(
        "a_bag_played_at_double_rate_takes_twice_as_long",
        "grader/ros2/commands/bag.py",
        "(stamp_ns - first) / 1e9 / rate",
        "(stamp_ns - first) / 1e9 * rate",
    ),
    Fault(
        "a_node_respawns_once_too_often",
        "grader/ros2/launching/process.py",
        "0 <= self.respawn_max_retries <= restarts",
        "0 <= self.respawn_max_retries < restarts",
    ),
    Fault(
        "parameters_do_not_reach_a_launched_node_in_a_namespace",
        "grader/ros2/launching/ros_actions.py",
        'self._parameter(context, one, full or "/**")',
        'self._parameter(context, one, name or "/**")',
    ),
    # -- sim -----------------------------------------------------------------------------------------------------------
    Fault(
        "what_is_too_near_for_the_lidar_reads_as_free",
        "sim/sensors.py",
        "ranges[ranges < p.range_min] = -np.inf",
        "ranges[ranges < p.range_min] = np.inf",
    ),
    Fault(
        "a_command_of_which_half_is_nan_is_taken",
        "sim/simulator.py",
        "if not (math.isfinite(v) and math.isfinite(omega)):",
        "if not (math.isfinite(v) or math.isfinite(omega)):",
    ),
    Fault(
        "a_turtlebot_stops_half_a_second_after_its_start",
        "sim/simulator.py",
        "self._command, self._command_tick = Twist(v, omega), self._tick",
        "self._command = Twist(v, omega)",
    ),
    Fault(
        "a_mirrored_world_turns_the_wrong_way",
        "sim/transform.py",
        "normalize_angle((-yaw if self.mirror else yaw) + self.rotate)",
        "normalize_angle(yaw + self.rotate)",
    ),
    Fault(
        "a_recording_can_run_code_when_it_is_loaded",
        "sim/recording.py",
        "np.load(path, allow_pickle=False)",
        "np.load(path, allow_pickle=True)",
    ),
)
