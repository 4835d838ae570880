"""B3: the guard stops at the end of the hall."""

from grader.checks.judge import Judge, NotReached


def test_stops_before_the_wall(judge: Judge) -> None:
    """The guard stands still `stop_distance` before the wall, and never touches it."""
    trial = judge.trial("to_the_end")
    judge.call(trial, "patrol", 0)
    if max(abs(command.v) for command in trial.commands) < 0.05:
        raise NotReached("the guard did not drive")
    if trial.touches:
        touch = trial.touches[0]
        judge.expect(False, f"touched {touch.obstacle} at {touch.t:.1f} s", "which beam points straight ahead?")
    last = trial.scans[-1].ahead
    judge.expect(0.45 <= last <= 0.85, f"stood {last:.2f} m before the wall", "compare with `stop_distance`")
