"""I8: ending on Ctrl-C, also while the robot drives."""

from grader.checks.check_interrupt import expect_clean_ends
from grader.checks.judge import Judge, NotReached
from grader.evidence import Kind, Reason
from grader.words import say

_TRIALS = ("interrupted_robot_controller", "interrupted_driving", "interrupted_navigating")


def test_ctrl_c_ends_each_node_cleanly(judge: Judge) -> None:
    """Ctrl-C (SIGINT) ends each node within 2 s, without a traceback, and the last `cmd_vel` is zero."""
    if not expect_clean_ends(judge, [*_TRIALS, "interrupted_sensor_processor"]):
        said = say("the robot stood still whenever Ctrl-C came, so there was nothing to stop")
        raise NotReached(Reason(Kind.UNTRIED, said=said))
