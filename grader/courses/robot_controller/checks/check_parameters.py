"""I6: parameters from files, from overrides and at run time."""

import math
from typing import Any

from grader.checks.first_cause import sentence
from grader.checks.judge import Judge, NotReached

from . import motion

_FILES = {"robot_controller": "config/robot_params.yaml", "sensor_processor": "config/sensor_params.yaml"}
_TRY_CALLBACK = "register add_on_set_parameters_callback before you declare the parameters"


def test_parameter_files_load_on_both_nodes(judge: Judge) -> None:
    """The YAML files load on both nodes."""
    trials = [judge.trial(name) for name in ("file_robot_controller", "file_sensor_processor")]
    missing = [
        f"{trial.node}: {answer.name}" for trial in trials for answer in trial.parameters if answer.value is None
    ]
    first = next((answer.name for trial in trials for answer in trial.parameters if answer.value is None), "")
    judge.expect(not missing, f"not declared: {', '.join(missing)}", _try_declare(first))
    for trial in trials:
        for answer in trial.parameters:
            set_to = trial.choices.get(answer.name, answer.value)
            seen = f"{answer.name} was {set_to} in the file and {answer.value} in {trial.node}"
            faults = [fault for fault in judge.faults("parameters") if fault.path == _FILES[trial.node]]
            if faults:
                judge.expect(answer.value == set_to, f"{sentence(faults[0])}\n{seen}", faults[0].cure)
            judge.expect(answer.value == set_to, seen, "is the file's key the node's name, or /**?")


def test_overrides_change_the_behaviour(judge: Judge) -> None:
    """Overriding `max_linear_speed`, `obstacle_detection_threshold` and `fusion_frequency` changes behaviour."""
    wrong, unreached = [], []
    for override in (_slow_robot, _far_sighted_robot, _slow_fusion):
        try:
            wrong += override(judge)
        except NotReached as because:
            unreached.append(str(because))
    if len(unreached) == 3:
        raise NotReached(unreached[0])
    if wrong or unreached:
        lost = len(wrong) + len(unreached)
        seen = "; ".join([*wrong, *(f"not reached: {because}" for because in unreached)])
        judge.share(1 - lost / 3, seen, "read the parameter where you use it, not a constant")


def test_invalid_values_are_refused_at_run_time(judge: Judge) -> None:
    """A value that makes no sense (negative, zero rate) is refused by a parameter callback at run time."""
    asked, accepted = 0, []
    for name in ("senseless_settings_robot_controller", "senseless_settings_sensor_processor"):
        trial = judge.trial(name)
        for answer in trial.parameters[:-1]:
            asked += 1
            if answer.accepted is not False or answer.value == answer.wanted:
                accepted.append(f"{answer.name} := {answer.wanted}")
        good = trial.parameters[-1]
        seen = f"{good.name} := {good.wanted}, which makes sense, was refused: {good.reason}"
        undeclared = "undeclared" in good.reason or "not declared" in good.reason
        try_ = _try_declare(good.name) if undeclared else "refuse only values that make no sense"
        judge.expect(good.accepted is True, seen, try_)
    _remark_on_a_change_without_effect(judge)
    if accepted:
        try_ = "let the callback refuse, for every parameter, the values that make no sense"
        judge.share(1 - len(accepted) / asked, f"accepted: {', '.join(accepted)}", try_)


def _remark_on_a_change_without_effect(judge: Judge) -> None:
    """Say if a rate that is changed at run time is accepted, and stays what it was; the contract asks for overrides."""
    trial = judge.evidence.trials["senseless_settings_sensor_processor"]
    start = trial.marks.get("changed", math.inf) + 0.5  # a timer that is made anew takes a moment
    hertz = sum(m.t > start for m in trial.messages) / (trial.samples[-1].t - start) if math.isfinite(start) else 0.0
    if abs(hertz - 20.0) <= 2.0:
        seen = f"fusion_frequency := 10.0 was accepted at run time, and fused data still came at {hertz:.1f} Hz"
        judge.remark(
            f"{seen} (this costs no points)", "make the timer anew when its rate changes, or refuse the change"
        )


def test_invalid_values_are_refused_at_start(judge: Judge) -> None:
    """A value that makes no sense (negative, zero rate) is refused by a parameter callback at start."""
    for name, parameter, value in (
        ("senseless_start_robot_controller", "max_linear_speed", -1.0), ("senseless_start_sensor_processor", "fusion_frequency", 0.0),
    ):  # fmt: skip
        usual = "idle_robot_controller" if name == "senseless_start_robot_controller" else "idle_sensor_processor"
        judge.trial(usual, complete=False)  # a node that never starts has refused nothing
        trial = judge.started(name)
        if trial.ready:
            now: Any = trial.parameters[0].value if trial.parameters else None
            if now is None and trial.process is not None and trial.process.by == "itself":
                continue  # it was on the graph for a moment and ended: that is a refusal
            if now is None:
                raise NotReached(f"the node has no value of {parameter} to show: does it declare it?")
            judge.expect(now != value, f"the node started with {parameter} = {now}", _TRY_CALLBACK)


def _try_declare(name: str) -> str:
    defaults = {"robot_name": "'turtlebot4'"} | {
        n: f"{v:.1f}" for node in motion.COURSE.nodes.values() for n, v in node.defaults.items()
    }
    return f"self.declare_parameter('{name}', {defaults.get(name, 'its default')}), and so every one of the contract"


def _slow_robot(judge: Judge) -> list[str]:
    trial = judge.trial("slow_robot")
    refused = judge.call(trial, "set_speed", 0).response or {}
    accepted = judge.call(trial, "set_speed", 1).response or {}
    if refused["success"] is not False or accepted["success"] is not True:
        answers = f"0.375 answered {refused['success']} and 0.1875 answered {accepted['success']}"
        return [f"with max_linear_speed 0.25, set_speed {answers}"]
    return []


def _far_sighted_robot(judge: Judge) -> list[str]:
    trial = judge.trial("far_sighted_robot")
    judge.call(trial, "set_speed", 0)
    came, end = trial.marks["obstacle"], trial.marks["end"]
    before = motion.odometry_speed(trial.samples, came - 0.5, came)
    if before < 0.05:
        raise NotReached(f"the robot drove at {before:.2f} m/s before the obstacle came (F2)")
    last = motion.between(trial.commands, end - 0.3, end)  # F4 judges how soon it stops
    if any(abs(command.v) > motion.ZERO for command in last):
        seen = f"the robot drove on with an obstacle {trial.choices['distance']:g} m ahead"
        return [f"with obstacle_detection_threshold 1.0 {seen}"]
    return []


def _slow_fusion(judge: Judge) -> list[str]:
    trial, usual = judge.trial("slow_fusion"), judge.trial("fusion")
    fused = [m.t for m in usual.messages if m.topic == "sensor_fusion_data"]
    # From the first message on: F13 judges when they begin.
    start, end = max([usual.marks["scans"] + 0.4, *fused[:1]]), usual.marks["end"]
    before = sum(start < t <= end for t in fused) / max(end - start, 0.1)
    start = max([1.0, *(m.t for m in trial.messages[:1])])
    after = sum(start < m.t <= 2.5 for m in trial.messages) / max(2.5 - start, 0.1)
    if not before:
        raise NotReached("no fused data came with the default fusion_frequency (F13)")
    if 0.4 * before <= after <= 0.6 * before:
        return []
    return [f"fused data came at {before:.1f} Hz, and with half the fusion_frequency at {after:.1f} Hz"]
