"""The conversions as a source of evidence."""

from __future__ import annotations

from grader.conversions.ask import ask_conversions
from grader.source import Collected, Phase, Subject


class Conversions:
    """Calls the functions of utils/conversions.py."""

    name = "conversions"
    phase = Phase.RUN
    serves = frozenset({"F14"})

    def collect(self, subject: Subject) -> Collected:
        """Return the functions' answers."""
        return Collected({"conversions": ask_conversions(subject.install, subject.settings.seed, subject.ros_name)})
