"""The list of trials."""

from __future__ import annotations

import pytest

from grader.trials import catalog


@pytest.mark.parametrize("plan", catalog.trials().values(), ids=lambda plan: plan.name)
def test_each_trial_says_in_a_short_sentence_what_happens(plan):
    """It is shown as progress, behind the trial's name."""
    assert plan.sentence.endswith(".")
    assert len(plan.sentence) <= 100


def test_two_trials_of_one_name_are_refused():
    def idle(stage: object) -> None: ...

    catalog.trials()
    with pytest.raises(ValueError, match="two trials are called idle"):
        catalog.trial(serves=["F1"])(idle)


def test_only_the_demonstration_sees_what_is_not_installed():
    """A node could run an archive or a data file from the source folder, which no check of the build has seen."""
    assert [name for name, plan in catalog.trials().items() if plan.shows_source] == ["demo"]
