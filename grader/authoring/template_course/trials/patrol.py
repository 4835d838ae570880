"""What the guard does when it is sent on patrol, and at the end of the hall."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["B1", "B2"], world="hall")
def on_and_off(stage: Stage) -> None:
    """Wait, send the guard on patrol, and call it back."""
    stage.run(1.0)
    stage.mark("waited")
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
