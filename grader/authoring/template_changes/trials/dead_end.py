"""X1: into a dead end. All that a script can do with `stage` is in docs/own-course-reference.md of the kit."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


# serves: the requirements whose checks read this trial. world: a file in worlds/, of the kit's course or the simulator.
@trial(serves=["X1"], world="dead_end")
def into_the_dead_end(stage: Stage) -> None:
    """Drive into a dead end at full speed."""
    stage.run(0.5)
    stage.call("set_speed", speed=0.5)
    stage.run(8.0)
