"""All attacks whose success depends on the host, by name; the others are run by the kit's own tests."""

from __future__ import annotations

from grader.selftest.attacks import on_build, on_host, on_nodes
from grader.selftest.attacks.attack import Attack, attack

_NOT_APPLICABLE = (
    attack(
        "edits_the_database", "Edits or locks the gradebook's database.", number=18,
        not_applicable="the kit has no database: each grading is a folder of files that only the grader writes",
    ),
    attack(
        "unpickles_a_result", "Leaves a pickle for the grader to load.", number=10,
        not_applicable="the grader never unpickles anything; tests that write pickles are among the kit's own tests",
    ),
    attack(
        "says_what_it_sees",
        "Its answers, names and log lines say in words where the obstacles of a trial are that is held back.",
        not_applicable="the kit's own course holds nothing back; one that does is among the kit's own tests",
    ),
    attack(
        "poses_as_a_number", "Its name and its file's look like another person's number in Canvas or Moodle.",
        not_applicable="a single grading has no people; exports with such names are among the kit's own tests",
    ),
)  # fmt: skip
ATTACKS: dict[str, Attack] = {
    each.name: each for each in (*on_build.ATTACKS, *on_nodes.ATTACKS, *on_host.ATTACKS, *_NOT_APPLICABLE)
}
