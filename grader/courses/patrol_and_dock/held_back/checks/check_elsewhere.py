"""P4: the robot visits the places of a building that students have not seen."""

from grader.checks.judge import Judge
from grader.courses.patrol_and_dock.checks.check_patrol import visits


def test_visits_every_place_of_the_stores(judge: Judge) -> None:
    """The robot visits the places of another building."""
    trial = judge.trial("round_of_the_stores", complete=False)
    places, made = len(trial.scene["goals"]), len(visits(trial))
    if made < places:
        judge.share(made / places, f"visited {made} of {places} places in {trial.samples[-1].t:.0f} s", "")
