"""The reference gets every point that its text decides: Q1 to Q5, its report of tests, and package.xml."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.judging import Check, find
from helpers.quality_examples import judged, untouched

from grader import KIT
from grader.checks.judge import Unjudged
from grader.quality.source import PackageText
from grader.scoring import rubric
from grader.settings import Settings

DEMONSTRATION = "check_handed_in::test_demonstration_runs"  # judged by a trial
SETTINGS = Settings(rubric.load(KIT / "rubric.yaml"), Path())
FROM_TEXT = [
    check.id
    for requirement in rubric.load(KIT / "rubric.yaml").requirements
    if requirement.id in PackageText().serves(SETTINGS)
    for check in requirement.checks
    if check.id != DEMONSTRATION
]


@pytest.fixture(params=FROM_TEXT)
def check(request: pytest.FixtureRequest) -> Check:
    return find(request.param)


def test_the_reference_has_full_marks(check: Check):
    assert judged(check, untouched()).share == 1.0, judged(check, untouched()).seen


def test_text_that_was_not_read_is_an_internal_error(check: Check):
    with pytest.raises(Unjudged):
        judged(check, None)
