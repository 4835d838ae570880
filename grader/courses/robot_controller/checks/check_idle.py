"""F1: the controller without a command."""

from grader.checks.first_cause import holding_on
from grader.checks.judge import Failed, Judge
from grader.checks.wording import near_topic
from grader.words import mark, say

from . import motion

_TRY = mark(
    "publish from the control timer's callback in every cycle, moving or not; is the timer kept, and not cancelled?"
)


def test_publishes_zero_without_a_command(judge: Judge) -> None:
    """With no command, `robot_controller` publishes a zero `cmd_vel`."""
    trial = judge.trial("idle_robot_controller")
    near = near_topic(trial.graph, "cmd_vel")
    judge.expect(bool(trial.commands), say("no message on cmd_vel in 5 s{near}", near=near), _TRY)
    bad = next((command for command in trial.commands if not command.is_zero), None)
    if bad is not None:
        seen = say("v = {bad.v:.3g} m/s, omega = {bad.omega:.3g} rad/s at {bad.t:.2f} s, before any command", bad=bad)
        raise Failed(seen, say("which value does the speed start with, and where is it changed?"))
    scans = trial.marks["scans"]
    if not motion.between(trial.commands, 0.0, scans):
        seen = say("no message on cmd_vel before the first scan, in {scans:g} s", scans=scans)
        judge.share(0.5, seen, say("let the control timer publish before the first scan, too"))


def test_publishes_at_the_control_rate(judge: Judge) -> None:
    """`cmd_vel` comes at 10 Hz ± 20 % in node-clock time."""
    trial = judge.trial("idle_robot_controller")
    start, end = trial.marks["scans"] + 1.0, trial.samples[-1].t
    hertz = motion.rate(trial.commands, start, end)
    seen = say("{hertz:.1f} Hz between {start:g} and {end:g} s of simulated time", hertz=hertz, start=start, end=end)
    try_ = say("publish from one timer alone, with 1 / laser_processing_rate on the node's clock")
    judge.expect(8.0 <= hertz <= 12.0, seen, try_)
    # The simulator's clock waits for a callback that sleeps; that of a robot does not.
    hertz /= max(trial.measured.get("waited", 0.0), 1.0)
    seen = say("the control loop sleeps: on a robot cmd_vel would come at {hertz:.1f} Hz", hertz=hertz)
    judge.expect(hertz >= 8.0, seen + holding_on(judge.habits), say("let the timer set the pace, not a sleep"))
