"""Ending on Ctrl-C."""

from collections.abc import Iterable

from grader import tracebacks
from grader.checks.judge import Judge
from grader.words import mark, say

NEEDS = ("interrupted",)
_TRY_CATCH = mark(
    "catch KeyboardInterrupt and ExternalShutdownException around spin, then destroy the node; with a signal handler "
    "of your own, rclpy.init(signal_handler_options=SignalHandlerOptions.NO), or rclpy's shuts the context down"
)
_TRY_SOONER = mark(
    "after Ctrl-C wait for nothing without a time limit: no sleep, no join, no goal that has to end first"
)
_TRY_FINISH = mark(
    "once rclpy is shut down, nothing can be published or answered: first end what still runs, a goal or a thread"
)
_CURES = {
    "KeyboardInterrupt": _TRY_CATCH,
    "ExternalShutdownException": _TRY_CATCH,
    "rcl_shutdown already called": mark(
        "end with rclpy.try_shutdown(): after Ctrl-C rclpy is already shut down, and rclpy.shutdown() raises"
    ),
}
_TRY_ZERO = mark("publish a zero before the context is shut down, and wait until it is sent")
_TRY_COLLECTED = mark("call executor.shutdown() before rclpy shuts down")


def is_a_race_in_rclpy(output: str) -> bool:
    """Return whether the only traceback is one of rclpy's try_shutdown, which is what a node should end with.

    It asks whether the context is up and then shuts it down; in between the signal handler's thread may have done so
    (rclpy 7.1, seen once, in a node with a MultiThreadedExecutor).
    """
    ending = output.rstrip().rpartition("\n")[2]
    return (
        output.count(tracebacks.BEGIN) == 1 and "in try_shutdown" in output and "rcl_shutdown already called" in ending
    )


def test_ctrl_c_ends_each_node_cleanly(judge: Judge) -> None:
    """Ctrl-C (SIGINT) ends each node within 2 s, without a traceback, and its last velocity command is zero."""
    expect_clean_ends(judge, [f"interrupted_{name}" for name in judge.course.nodes])


def expect_clean_ends(judge: Judge, names: Iterable[str]) -> bool:
    """Expect that in these trials Ctrl-C ended the node as it should; return whether any was moving the robot."""
    wrong = []  # (seen, try) of everything at once, so that a student need not fix one to learn of the next
    collected = {}
    moved = False
    for name in names:
        trial = judge.trial(name)
        node, process = judge.course.nodes[trial.node], trial.process
        assert process is not None
        idle = name == f"interrupted_{node.name}"
        when = f"{node.name}, {name.partition('_')[2] if not idle else say('idle')}"
        took = trial.measured.get("seconds_to_end")
        if took is None:
            wrong.append((say("{when}: still running 2 s after SIGINT", when=when), _TRY_CATCH))
        elif process.by != "interrupt" or took > 2.0:
            wrong.append((say("{when}: ended {took:.2f} s after SIGINT", when=when, took=took), _TRY_SOONER))
        output = process.output_tail
        if process.exit_code == 0 and (complaint := tracebacks.ignored(output)):
            collected[trial.node] = complaint
            output = tracebacks.without_ignored(output)
        if tracebacks.BEGIN in output and not is_a_race_in_rclpy(output):
            said, place = tracebacks.raised(output)
            line = (f"{said} ({place})" if place else said) or output.rstrip().rpartition("\n")[2].strip()[:200]
            seen = say("{when}: a traceback after SIGINT, ending {line!r}", when=when, line=line)
            cures = (cure for words, cure in _CURES.items() if words in line)
            wrong.append((seen, next(cures, _TRY_FINISH)))
        # Another check judges a robot that publishes nothing without a command.
        if node.command and (trial.commands or not idle):
            seen = say("no {node.command} at all", node=node)
            judge.expect(bool(trial.commands), seen, say("publish in every control cycle"))
            moved = moved or not all(command.is_zero for command in trial.commands)
            last = trial.commands[-1]
            if not last.is_zero:
                words = mark("the last {node.command} was v = {last.v:.2f} m/s, omega = {last.omega:.2f} rad/s")
                wrong.append((f"{when}: {say(words, node=node, last=last)}", _TRY_ZERO))
    tries = dict.fromkeys(say(try_) for _, try_ in wrong)
    judge.expect(not wrong, "; ".join(seen for seen, _ in wrong), "; ".join(tries))
    words = mark(
        "{name} ends well, and no point is lost; Python's garbage collection complains afterwards: {complaint}"
    )
    for name, complaint in collected.items():
        judge.remark(say(words, name=name, complaint=complaint), _TRY_COLLECTED)
    return moved
