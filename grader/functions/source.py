"""The functions of the contract as a source of evidence."""

from __future__ import annotations

from grader.evidence import FunctionAnswer
from grader.functions.call import call_functions
from grader.processes.jobs import Job, Where
from grader.source import Asked, Collected, Source, Subject


class FunctionCalls(Source):
    """Calls the functions of the contract with the course's cases."""

    name = "functions"

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of calling them all."""
        settings = subject.settings
        job = Job(
            self.name, Where.SANDBOX, list[FunctionAnswer],
            lambda: call_functions(subject.install, settings.seed, settings.course, subject.ros_name),
            decided_by=(subject.seen_by_nodes,),
            lasting=lambda answers: not any(answer.problem for answer in answers),
            serves=self.serves(settings),
        )  # fmt: skip
        return Asked([job], lambda results: Collected({self.name: results[self.name]}))
