"""How a node keeps time, judged by its messages. No ROS here; the bridge's own tests run real nodes."""

import pytest

from sim.pace import Answers, Probe, Repeatability


def test_two_equal_gaps_make_a_period_and_a_missed_answer_clears_it() -> None:
    answers = Answers()
    for tick in (1, 3, 5):
        answers.note(tick)
    assert [answers.due(tick) for tick in (6, 7, 8)] == [False, True, True]
    answers.missed()
    assert not answers.due(9)


@pytest.mark.parametrize(
    ("late", "prompt", "ticks", "verdict"),
    [
        (0, 3, 6, "lockstep"),  # an answer every second tick, no others
        (2, 0, 3, "real time"),  # two while the clock stood still
        (0, 1, 6, ""),  # too few to tell
        (1, 12, 24, "lockstep"),  # one late message among many may be chance
    ],
)
def test_late_messages_tell_real_time_from_lockstep(late: int, prompt: int, ticks: int, verdict: str) -> None:
    assert Probe(expects_feedback=False, ticks=ticks, prompt=prompt, late=late).verdict() == verdict


@pytest.mark.parametrize(
    ("prompt", "prompt_s", "late_s", "verdict"),
    [
        (3, 0.06, 0.3, "lockstep"),  # an idle machine: the clock stood still most of the time, and no message came then
        (2, 0.3, 0.3, ""),  # a busy one: half of all messages would be prompt, whatever they go by
        (3, 0.3, 0.3, ""),
        (6, 0.3, 0.3, "lockstep"),
    ],
)
def test_messages_that_may_be_prompt_by_chance_prove_nothing(
    prompt: int, prompt_s: float, late_s: float, verdict: str
) -> None:
    """A loop that slept 0.4 s of wall time was taken for one in lockstep, beside a build."""
    probe = Probe(expects_feedback=True, ticks=6, prompt=prompt, prompt_s=prompt_s, late_s=late_s)
    assert probe.verdict() == verdict


def test_two_unprompted_messages_are_tolerated_three_are_reported() -> None:
    """Even a node with one thread may answer at once to a cancel that is sent between two ticks."""
    assert Repeatability(unprompted=2).caveat() == ""
    assert Repeatability(unprompted=3).caveat().startswith("Perhaps not repeatable: 3 messages came after")


def test_real_time_outweighs_every_other_reason() -> None:
    caveat = Repeatability(real_time=True, unprompted=9, unanswered=1).caveat()
    assert caveat.startswith("Not repeatable: the node runs on wall time")


@pytest.mark.parametrize(("late", "caveat"), [(0, "Perhaps not repeatable: the node sent no feedback"), (2, "Not rep")])
def test_a_node_without_feedback_is_not_said_to_run_on_wall_time(late: int, caveat: str) -> None:
    """Notebook 07's node drives to its first goal before it sends feedback."""
    probe = Probe(expects_feedback=True, ticks=24, late=late)
    assert probe.verdict() == "real time"
    assert Repeatability(real_time=True, without_feedback=probe.silent).caveat().startswith(caveat)
