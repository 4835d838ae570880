"""Attacks of the catalogue that find no door here, with the reason."""

from __future__ import annotations

from grader.selftest.attacks.attack import Attack, attack

ATTACKS: tuple[Attack, ...] = (
    attack(
        "edits_the_database", "Edits or locks the gradebook's database.", number=18,
        no_door="the kit keeps no database: each grading is a folder of files that only the grader writes",
    ),
    attack(
        "unpickles_a_result", "Leaves a pickle for the grader to load.", number=10,
        no_door="nothing on our side unpickles anything; the tests that write pickles are run above",
    ),
)  # fmt: skip
