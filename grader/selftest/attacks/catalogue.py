"""All attacks, by name."""

from __future__ import annotations

from grader.selftest.attacks import not_applicable, on_answers, on_build, on_intake, on_nodes, on_tests, on_text
from grader.selftest.attacks.attack import Attack

_MODULES = (on_intake, on_build, on_nodes, on_answers, on_tests, on_text, not_applicable)

ATTACKS: dict[str, Attack] = {each.name: each for module in _MODULES for each in module.ATTACKS}

KNOWN = 43
"""How many attacks on autograders the catalogue lists that we started from; each number occurs at least once here."""
