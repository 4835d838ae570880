"""A round in a building that students have not seen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grader.courses.patrol_and_dock.trials.patrol import Tour, orders
from grader.trials.catalog import trial

if TYPE_CHECKING:
    from grader.trials.stage import Stage


@trial(serves=["P4"], world="stores", world_parameters=orders, takes_long=True)
def round_of_the_stores(stage: Stage) -> None:
    """Patrol between shelves: one round."""
    Tour(stage).until(len(stage.simulator.world.goals), 160.0)
