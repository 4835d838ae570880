"""I8: ending on Ctrl-C."""

from grader import tracebacks
from grader.checks.judge import Judge, NotReached

from . import motion

_CONTROLLER = ("interrupted_robot_controller", "interrupted_driving", "interrupted_navigating")
_TRY_CATCH = (
    "catch KeyboardInterrupt and ExternalShutdownException around spin, then destroy the node; with a signal handler "
    "of your own, rclpy.init(signal_handler_options=SignalHandlerOptions.NO), or rclpy's shuts the context down"
)
_TRY_SOONER = "after Ctrl-C wait for nothing without a time limit: no sleep, no join, no goal that has to end first"
_TRY_SHUTDOWN = "end with rclpy.try_shutdown(): after Ctrl-C rclpy is already shut down, and rclpy.shutdown() raises"
_TRY_ZERO = "publish a zero before the context is shut down, and wait until it is sent"

_TRY_COLLECTED = "call executor.shutdown() before rclpy shuts down"


def _is_a_race_in_rclpy(output: str) -> bool:
    """Return whether the only traceback is one of rclpy's try_shutdown, which is what a node should end with.

    It asks whether the context is up and then shuts it down; in between the signal handler's thread may have done so
    (rclpy 7.1, seen once, in a node with a MultiThreadedExecutor).
    """
    ending = output.rstrip().rpartition("\n")[2]
    return (
        output.count(tracebacks.BEGIN) == 1 and "in try_shutdown" in output and "rcl_shutdown already called" in ending
    )


def test_ctrl_c_ends_each_node_cleanly(judge: Judge) -> None:
    """Ctrl-C (SIGINT) ends each node within 2 s, without a traceback, and the last `cmd_vel` is zero."""
    wrong = []  # (seen, try) of everything at once, so that a student need not fix one to learn of the next
    collected = {}
    moved = False
    for name in (*_CONTROLLER, "interrupted_sensor_processor"):
        trial = judge.trial(name)
        process = trial.process
        assert process is not None
        when = f"{trial.node}, {name.partition('_')[2]}"
        took = trial.choices.get("seconds_to_end")
        if process.by != "interrupt" or took is None or took > 2.0:
            seen = "still running 2 s after SIGINT" if took is None else f"ended {took:.2f} s after SIGINT"
            wrong.append((f"{when}: {seen}", _TRY_CATCH if took is None else _TRY_SOONER))
        output = process.output_tail
        if process.exit_code == 0 and (complaint := tracebacks.ignored(output)):
            collected[trial.node] = complaint
            output = tracebacks.without_ignored(output)
        lines = output.splitlines()
        if tracebacks.BEGIN in output and not _is_a_race_in_rclpy(output):
            uncaught = any(word in lines[-1] for word in ("KeyboardInterrupt", "ExternalShutdownException"))
            seen = f"a traceback after SIGINT, ending {lines[-1].strip()[:200]!r}"
            wrong.append((f"{when}: {seen}", _TRY_CATCH if uncaught else _TRY_SHUTDOWN))
        if trial.node == "robot_controller" and (trial.commands or name != "interrupted_robot_controller"):
            # F1 judges a robot that publishes nothing without a command.
            judge.expect(bool(trial.commands), "no cmd_vel at all", "publish in every control cycle")
            moved = moved or not all(map(motion.is_zero, trial.commands))
            last = trial.commands[-1]
            if not motion.is_zero(last):
                seen = f"the last cmd_vel was v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s"
                wrong.append((f"{when}: {seen}", _TRY_ZERO))
    tries = dict.fromkeys(try_ for _, try_ in wrong)
    judge.expect(not wrong, "; ".join(seen for seen, _ in wrong), "; ".join(tries))
    if not moved:
        raise NotReached("not tried yet: the robot stood still whenever Ctrl-C came, so there was nothing to stop")
    for node, complaint in collected.items():
        judge.remark(
            f"{node} ends well, and no point is lost; Python's garbage collection complains afterwards: {complaint}",
            _TRY_COLLECTED,
        )
