"""The package's text as a source of evidence."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import cast

from grader import building
from grader.evidence import Flag, Quality
from grader.quality.analyse import analyse_package
from grader.sandbox import untrusted
from grader.source import Collected, Phase, Source, Subject, served
from grader.words import mark

_HIDDEN_WORDS = 100  # a licence's header may be a comment


class PackageText(Source):
    """Reads the package, with linters where a requirement is about style."""

    name = "quality"
    phase = Phase.TEXT

    def collect(self, subject: Subject) -> Collected:
        """Return the facts of the package's text."""
        # The linters take most of the time, and package.xml needs none.
        settings = subject.settings
        lint = bool(settings.checked & served(settings, "linters"))
        left = cast("Mapping[str, Path]", subject.earlier.get("trials", {}))
        made = [f"{path}\0{building.content_key([], untrusted.read_text(file) or '')}" for path, file in left.items()]
        decided_by = ("text", str(lint), subject.text, *sorted(made))
        if kept := subject.kept.find(Quality, *decided_by):
            return Collected(
                {"quality": kept[0]}, tuple(hidden_flags(kept[0])), kept={mark("the package's files"): kept[1]}
            )
        submission = subject.submission
        found = analyse_package(submission.package, settings.course, submission.interfaces, left, lint=lint)
        subject.kept.keep(found, *decided_by)
        return Collected({"quality": found}, tuple(hidden_flags(found)))


def hidden_flags(quality: Quality) -> list[Flag]:
    """Return a flag where a README holds much text that no reader sees. It did not count."""
    readme = quality.readme
    if readme is None or readme.hidden < _HIDDEN_WORDS:
        return []
    words = (
        f"{readme.hidden} words are in comments or elements that a reader of the page does not see; they did not count"
    )
    return [Flag("hidden text", words, where=readme.path, concerns=["readme"])]
