"""The conversions as a source of evidence."""

from __future__ import annotations

from grader.conversions.ask import ask_conversions
from grader.evidence import FunctionAnswer
from grader.source import Collected, Phase, Subject


class Conversions:
    """Calls the functions of utils/conversions.py."""

    name = "conversions"
    phase = Phase.RUN
    uses: frozenset[str] = frozenset()
    serves = frozenset({"F14"})

    def collect(self, subject: Subject) -> Collected:
        """Return the functions' answers."""
        decided_by = ("conversions", subject.program)
        if kept := subject.kept.find(list[FunctionAnswer], *decided_by):
            return Collected({"conversions": kept[0]}, kept={"conversions": kept[1]})
        found = ask_conversions(subject.install, subject.settings.seed, subject.ros_name)
        if not any(answer.problem for answer in found):
            subject.kept.keep(found, *decided_by)
        return Collected({"conversions": found})
