"""The package's text as a source of evidence."""

from __future__ import annotations

import re

from grader import building
from grader.course import role
from grader.evidence import Flag, Quality
from grader.quality.analyse import analyse_package
from grader.quality.unreadable_code import UNREADABLE
from grader.source import Collected, Phase, Source, Subject, served
from grader.words import mark

_WHOLE_FILE = re.compile(r"flake8[:=]\s*noqa|skip-file|ruff:\s*noqa|mypy:\s*ignore-errors", re.IGNORECASE)
_MANY = 10
_HIDDEN_WORDS = 100  # a licence's header may be a comment
_MUCH = 100  # lines of code, and at least half as many as the nodes use


class PackageText(Source):
    """Reads the package, with linters where a requirement is about style."""

    name = "quality"
    phase = Phase.TEXT

    def collect(self, subject: Subject) -> Collected:
        """Return the facts of the package's text."""
        # The linters take most of the time, and package.xml needs none.
        settings = subject.settings
        lint = bool(settings.checked & served(settings, "linters"))
        install = subject.install if subject.built is not None else None
        decided_by = ("text", str(lint), subject.text, building.checksum(install) if install else "")
        if kept := subject.kept.find(Quality, *decided_by):
            flags = text_flags(kept[0], settings.course.package)
            return Collected({"quality": kept[0]}, tuple(flags), kept={mark("the package's files"): kept[1]})
        submission = subject.submission
        found = analyse_package(submission.package, settings.course, submission.interfaces, install, lint=lint)
        subject.kept.keep(found, *decided_by)
        return Collected({"quality": found}, tuple(text_flags(found, settings.course.package)))


def text_flags(quality: Quality, package: str) -> list[Flag]:
    """Return a flag for what an instructor should look at in the package's text."""
    made = [f"{found.path}:{found.line}" for found in quality.habits if found.rule == UNREADABLE]
    words = "code that is made at run time, or run in another form than as a module"
    unreadable = [Flag("unreadable code", words, where=", ".join(made[:5]))] if made else []
    return [*suppression_flags(quality), *_padding_flags(quality, package), *unreadable, *hidden_flags(quality)]


def _padding_flags(quality: Quality, package: str) -> list[Flag]:
    """Return a flag where most of the code is used by nothing but tests. It was left out of every average."""
    reached = quality.reached
    idle = reached.idle if reached and reached.nodes else {}
    used = sum(reached.lines[path] for path in reached.lines if role(path, package) == "module") if reached else 0
    if sum(idle.values()) < max(_MUCH, used / 2):
        return []
    words = f"{sum(idle.values())} lines of code that no node uses, beside {used} that one does: they earned nothing"
    most = sorted(idle, key=lambda path: (-idle[path], path))[:5]
    return [Flag("padding", words, where=", ".join(most))]


def hidden_flags(quality: Quality) -> list[Flag]:
    """Return a flag where a README holds much text that no reader sees. It did not count."""
    readme = quality.readme
    if readme is None or readme.hidden < _HIDDEN_WORDS:
        return []
    words = (
        f"{readme.hidden} words are in comments or elements that a reader of the page does not see; they did not count"
    )
    return [Flag("hidden text", words, where=readme.path, concerns=["readme"])]


def suppression_flags(quality: Quality) -> list[Flag]:
    """Return a flag where comments silence linters for a whole file or for many lines. They had no effect."""
    found = quality.suppressions
    whole = [finding for finding in found if _WHOLE_FILE.search(finding.text)]
    if not whole and len(found) < _MANY:
        return []
    words = f"{len(found)} comments silence linters; they had no effect"
    places = ", ".join(f"{finding.path}:{finding.line}" for finding in (whole or found)[:5])
    return [Flag("suppressions", words, where=places)]
