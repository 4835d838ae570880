"""What the guard does when it is sent on patrol, and at the end of the hall.

A trial runs one node in a simulated world, does something to it, and records what happens. It judges nothing: that is
what checks do with the recording. All that a script can do with `stage` is in the docstrings of grader.trials.stage.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


# serves: the requirements whose checks read this trial. world: a file in worlds/, or one of the simulator's.
@trial(serves=["B1", "B2"], world="hall")
def on_and_off(stage: Stage) -> None:
    """Wait, send the guard on patrol, and call it back."""
    stage.run(1.0)  # seconds of simulated time
    stage.mark("waited")  # a check finds the time as trial.marks["waited"]
    stage.call("patrol", data=True)
    stage.run(2.0)
    stage.mark("called back")
    stage.call("patrol", data=False)
    stage.run(1.0)


@trial(serves=["B3"], world="hall")
def to_the_end(stage: Stage) -> None:
    """Send the guard on patrol until it has come to the end of the hall."""
    stage.run(0.5)
    stage.call("patrol", data=True)
    stage.run(14.0)
