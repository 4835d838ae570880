"""P1 to P3: the robot visits the places of its list, round after round, though a corridor is closed."""

from grader.checks.judge import Judge, NotReached

from .patrol_facts import visits


def test_visits_every_place(judge: Judge) -> None:
    """The robot visits the places of the list in their order."""
    trial = judge.trial("first_round", complete=False)
    places, made = len(trial.scene["goals"]), len(visits(trial))
    if made < places:
        judge.share(made / places, f"visited {made} of {places} places in {trial.samples[-1].t:.0f} s", "")


def test_begins_the_next_round(judge: Judge) -> None:
    """After the last place the robot goes on with the first."""
    trial = judge.trial("first_round", complete=False)
    places, made = len(trial.scene["goals"]), len(visits(trial))
    if made < places:
        raise NotReached("the first round was not finished", "P1")
    judge.expect(made > places, f"did not come to the first place again in {trial.samples[-1].t:.0f} s", "")


def test_visits_the_places_behind_a_closed_corridor(judge: Judge) -> None:
    """When the corridor is closed on the way to a place, the robot visits that place and those after it."""
    trial = judge.trial("closed_corridor", complete=False)
    places, times = len(trial.scene["goals"]), visits(trial)
    before = int(trial.choices["closed"])
    if len(times) < before:
        raise NotReached("the robot did not come to the place before which the corridor is closed", "P1")
    made, left = len(times) - before, places - before
    seen = f"the corridor was closed at {trial.marks['closed']:.0f} s; then visited {made} of {left} places"
    if made < left:
        judge.share(made / left, f"{seen} until {trial.samples[-1].t:.0f} s", "")
