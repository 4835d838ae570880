"""Attacks that every host stops alike: by the submission's form, its text, its answers and its own tests."""

from attacks import on_answers, on_intake, on_tests, on_text
from grader.selftest.attacks.attack import Attack

ATTACKS: tuple[Attack, ...] = (*on_intake.ATTACKS, *on_answers.ATTACKS, *on_tests.ATTACKS, *on_text.ATTACKS)
