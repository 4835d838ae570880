"""The functions of the contract as a source of evidence."""

from __future__ import annotations

from grader.evidence import FunctionAnswer
from grader.functions.call import call_functions
from grader.source import Collected, Source, Subject


class FunctionCalls(Source):
    """Calls the functions of the contract with the course's cases."""

    name = "functions"

    def collect(self, subject: Subject) -> Collected:
        """Return the functions' answers."""
        decided_by = (self.name, subject.program)
        if kept := subject.kept.find(list[FunctionAnswer], *decided_by):
            return Collected({self.name: kept[0]}, kept={self.name: kept[1]})
        settings = subject.settings
        found = call_functions(subject.install, settings.seed, settings.course, subject.ros_name)
        if not any(answer.problem for answer in found):
            subject.kept.keep(found, *decided_by)
        return Collected({self.name: found})
