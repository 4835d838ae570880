"""What a node's messages tell of how it keeps time. No ROS: the bridge's own tests let real nodes run."""

import pytest

from sim.pace import Answers, Doubts, Probe


def test_a_period_is_learnt_from_two_equal_gaps_and_forgotten_when_it_is_missed() -> None:
    answers = Answers()
    for tick in (1, 3, 5):
        answers.note(tick)
    assert [answers.due(tick) for tick in (6, 7, 8)] == [False, True, True]
    answers.missed()
    assert not answers.due(9)


@pytest.mark.parametrize(
    ("late", "prompt", "ticks", "verdict"),
    [
        (0, 3, 6, "lockstep"),  # answers with every second tick, none beside
        (2, 0, 3, "real time"),  # two while the clock stood still
        (0, 1, 6, ""),  # too seldom to tell
        (1, 12, 24, "lockstep"),  # one late message in many may be chance
    ],
)
def test_a_suspect_is_judged_by_when_it_speaks(late: int, prompt: int, ticks: int, verdict: str) -> None:
    assert Probe(of_feedback=False, ticks=ticks, prompt=prompt, late=late).verdict() == verdict


def test_two_odd_messages_raise_no_doubt_the_third_does() -> None:
    """A cancel that is sent between two ticks may be answered at once, by a node with one thread too."""
    assert Doubts(unprompted=2).sentence() == ""
    assert Doubts(unprompted=3).sentence().startswith("Perhaps not repeatable: 3 messages came after")


def test_real_time_is_the_reason_that_leaves_nothing_open() -> None:
    assert (
        Doubts(real_time=True, unprompted=9, overslept=1).sentence().startswith("Not repeatable: the node goes by wall")
    )
