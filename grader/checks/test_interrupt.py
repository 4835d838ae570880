"""I8: Ctrl-C."""

from grader.checks import motion
from grader.checks.judge import Judge

_CONTROLLER = ("interrupted_idle", "interrupted_driving", "interrupted_navigating")


def test_ctrl_c_ends_each_node_cleanly(judge: Judge) -> None:
    """Ctrl-C (SIGINT) ends each node within 2 s, without a traceback, and the last `cmd_vel` is zero."""
    for name in (*_CONTROLLER, "interrupted_processor"):
        trial = judge.trial(name)
        process = trial.process
        assert process is not None
        when = f"{trial.node}, {name.partition('_')[2]}"
        took = trial.choices.get("seconds_to_end")
        judge.expect(
            process.by == "interrupt" and took is not None and took <= 2.0,
            f"{when}: still running 2 s after SIGINT" if took is None else f"{when}: ended {took:.2f} s after SIGINT",
            "catch KeyboardInterrupt and ExternalShutdownException around spin, then destroy the node",
        )
        lines = process.output_tail.splitlines()
        judge.expect(
            not any("Traceback (most recent call last)" in line for line in lines),
            f"{when}: a traceback after SIGINT, ending {lines[-1].strip()[:200] if lines else ''!r}",
            "end with rclpy.try_shutdown(): after Ctrl-C rclpy.shutdown() is a second one and raises",
        )
    for name in _CONTROLLER:
        trial = judge.trial(name)
        judge.expect(bool(trial.commands), "no cmd_vel at all", "publish in every control cycle")
        last = trial.commands[-1]
        seen = f"{name.partition('_')[2]}: the last cmd_vel was v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s"
        judge.expect(motion.is_zero(last), seen, "publish a zero before the context is shut down, and let it get out")
