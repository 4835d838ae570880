"""I8: Ctrl-C."""

from grader.checks import motion
from grader.checks.judge import Judge

_CONTROLLER = ("interrupted_idle", "interrupted_driving", "interrupted_navigating")
_TRY_CATCH = "catch KeyboardInterrupt and ExternalShutdownException around spin, then destroy the node"
_TRY_SOONER = "after Ctrl-C wait for nothing without a limit: no sleep, no join, no goal that has to end first"
_TRY_SHUTDOWN = "end with rclpy.try_shutdown(): after Ctrl-C rclpy.shutdown() is a second one and raises"
_TRY_ZERO = "publish a zero before the context is shut down, and let it get out"


def test_ctrl_c_ends_each_node_cleanly(judge: Judge) -> None:
    """Ctrl-C (SIGINT) ends each node within 2 s, without a traceback, and the last `cmd_vel` is zero."""
    wrong = []  # (what was seen, what to try): a student who mends one should not meet the next only then
    for name in (*_CONTROLLER, "interrupted_processor"):
        trial = judge.trial(name)
        process = trial.process
        assert process is not None
        when = f"{trial.node}, {name.partition('_')[2]}"
        took = trial.choices.get("seconds_to_end")
        if process.by != "interrupt" or took is None or took > 2.0:
            seen = "still running 2 s after SIGINT" if took is None else f"ended {took:.2f} s after SIGINT"
            wrong.append((f"{when}: {seen}", _TRY_CATCH if took is None else _TRY_SOONER))
        lines = process.output_tail.splitlines()
        if any("Traceback (most recent call last)" in line for line in lines):
            uncaught = any(word in lines[-1] for word in ("KeyboardInterrupt", "ExternalShutdownException"))
            seen = f"a traceback after SIGINT, ending {lines[-1].strip()[:200]!r}"
            wrong.append((f"{when}: {seen}", _TRY_CATCH if uncaught else _TRY_SHUTDOWN))
        if trial.node == "robot_controller" and (trial.commands or name != "interrupted_idle"):
            # That a robot without a command says nothing is F1's matter.
            judge.expect(bool(trial.commands), "no cmd_vel at all", "publish in every control cycle")
            last = trial.commands[-1]
            if not motion.is_zero(last):
                seen = f"the last cmd_vel was v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s"
                wrong.append((f"{when}: {seen}", _TRY_ZERO))
    tries = dict.fromkeys(try_ for _, try_ in wrong)
    judge.expect(not wrong, "; ".join(seen for seen, _ in wrong), "; ".join(tries))
