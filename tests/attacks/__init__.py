"""Attacks that every host stops alike: by form, text, answers, tests, what is installed, and on the observer."""

from attacks import on_answers, on_installed_code, on_intake, on_observer, on_tests, on_text
from grader.selftest.attacks.attack import Attack

_MODULES = (on_intake, on_installed_code, on_observer, on_answers, on_tests, on_text)
ATTACKS: tuple[Attack, ...] = tuple(attack for module in _MODULES for attack in module.ATTACKS)
