"""The package's text as a source of evidence."""

from __future__ import annotations

import re

from grader.evidence import Flag, Quality
from grader.quality.analyse import analyse_package
from grader.source import Collected, Phase, Subject

_WHOLE_FILE = re.compile(r"flake8[:=]\s*noqa|skip-file|ruff:\s*noqa|mypy:\s*ignore-errors", re.IGNORECASE)
_MANY = 10


class PackageText:
    """Reads the package, with linters where a requirement is about style."""

    name = "quality"
    phase = Phase.TEXT
    _without_linters = frozenset({"I2"})
    serves = frozenset({"Q1", "Q2", "Q3", "Q4", "Q5", "Q6"}) | _without_linters

    def collect(self, subject: Subject) -> Collected:
        """Return the facts of the package's text."""
        # The linters take most of the time, and package.xml needs none.
        lint = bool(subject.settings.checked & (self.serves - self._without_linters))
        found = analyse_package(subject.submission.package, subject.submission.interfaces, lint=lint)
        return Collected({"quality": found}, tuple(suppression_flags(found)))


def suppression_flags(quality: Quality) -> list[Flag]:
    """Return a flag where comments silence linters for a whole file or for many lines. They had no effect."""
    found = quality.suppressions
    whole = [finding for finding in found if _WHOLE_FILE.search(finding.text)]
    if not whole and len(found) < _MANY:
        return []
    words = f"{len(found)} comments silence linters; they had no effect"
    places = ", ".join(f"{finding.path}:{finding.line}" for finding in (whole or found)[:5])
    return [Flag("suppressions", words, where=places)]
