"""B3: the guard stops at the end of the hall.

A check passes unless it fails; its docstring is the sentence that students read. `judge.trial` gives what a trial has
recorded. All that a check can ask of `judge` is in the docstrings of grader.checks.judge.
"""

from grader.checks.judge import Judge, NotReached


def test_stops_before_the_wall(judge: Judge) -> None:
    """The guard stands still `stop_distance` before the wall, and never touches it."""
    trial = judge.trial("to_the_end")
    judge.call(trial, "patrol", 0)
    # What does not drive cannot stop: that has its own points, and costs none here.
    if max((abs(command.v) for command in trial.commands), default=0.0) < 0.05:
        raise NotReached("the guard did not drive")
    if trial.touches:
        touch = trial.touches[0]
        judge.expect(False, f"touched {touch.obstacle} at {touch.t:.1f} s", "which beam points straight ahead?")
    # What holds, what was seen if it does not, and what to try.
    last = trial.scans[-1].ahead  # the closest reading ahead in the last scan, m
    judge.expect(0.45 <= last <= 0.85, f"stood {last:.2f} m before the wall", "compare with `stop_distance`")
