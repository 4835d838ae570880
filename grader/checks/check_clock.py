"""Simulated time: the nodes follow /clock."""

from grader.checks.judge import Judge
from grader.words import mark, say

NEEDS = ("standing_clock",)
TRY = mark("create_timer and self.get_clock() follow /clock; time.time(), time.sleep() and threading.Timer do not")


def test_timers_follow_the_clock(judge: Judge) -> None:
    """With `use_sim_time` the timers follow `/clock`."""
    expect_standing(judge)
    for node in judge.course.nodes.values():
        trial = judge.trial(f"standing_clock_{node.name}")
        seen = say("no {node.command} under simulated time", node=node)
        judge.expect(bool(trial.commands or not node.command), seen, TRY)


def expect_standing(judge: Judge) -> None:
    """Expect that every node stops publishing with the clock."""
    for name in judge.course.nodes:
        trial = judge.trial(f"standing_clock_{name}")
        held = int(trial.measured["held"])
        judge.expect(trial.pace == "lockstep", say("{name} publishes while the clock is stopped", name=name), TRY)
        words = mark("{name} published {held} messages in 1 s of wall time while the clock was stopped")
        judge.expect(held <= 1, say(words, name=name, held=held), TRY)
