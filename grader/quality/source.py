"""The package's text as a source of evidence."""

from __future__ import annotations

from grader import building
from grader.evidence import Flag, Quality
from grader.processes.jobs import Job, Where
from grader.quality.analyse import analyse_package
from grader.sandbox import untrusted
from grader.source import Asked, Collected, Phase, Source, Subject, served
from grader.words import mark

_TEXT = mark("the package's files")
_HIDDEN_WORDS = 100  # a licence's header may be a comment


class PackageText(Source):
    """Reads the package, with linters where a requirement is about style."""

    name = "quality"
    phase = Phase.TEXT

    def ask(self, subject: Subject) -> Asked:
        """Return the one job of reading it all."""
        # The linters take most of the time, and package.xml needs none.
        submission, settings, left = subject.submission, subject.settings, subject.left
        lint = bool(settings.checked & served(settings, "linters"))
        made = [f"{path}\0{building.content_key([], untrusted.read_text(file) or '')}" for path, file in left.items()]
        job = Job(
            _TEXT, Where.HOST, Quality,
            lambda: analyse_package(submission.package, settings.course, submission.interfaces, left, lint=lint),
            decided_by=(str(lint), subject.handed_in, *sorted(made)), serves=self.serves(settings),
        )  # fmt: skip
        return Asked([job], lambda results: Collected({"quality": results[_TEXT]}, tuple(hidden_flags(results[_TEXT]))))


def hidden_flags(quality: Quality) -> list[Flag]:
    """Return a flag where a README holds much text that no reader sees. It did not count."""
    readme = quality.readme
    if readme is None or readme.hidden < _HIDDEN_WORDS:
        return []
    words = (
        f"{readme.hidden} words are in comments or elements that a reader of the page does not see; they did not count"
    )
    return [Flag("hidden text", words, where=readme.path, concerns=["readme"])]
