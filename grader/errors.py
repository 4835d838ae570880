"""The two families of errors, which decide who pays for an error, and the exit codes."""

from __future__ import annotations

from collections.abc import Sequence

EXIT_GRADED, EXIT_NOT_GRADED, EXIT_USAGE, EXIT_OUR_FAULT = 0, 1, 2, 3
"""Exit codes: graded, cannot be graded, wrong usage, an error of the kit or of its host."""

EXIT_INTERRUPTED = 130
"""As a shell reports a program that Ctrl-C has ended."""


class KitError(Exception):
    """An expected error. Its message says what happened, to what, and what to do next; `status` is the exit code."""

    status = EXIT_OUR_FAULT

    def __init__(self, what: str, advice: str = "") -> None:
        super().__init__(f"{what} {advice}".rstrip())
        self.what = what
        self.advice = advice


class SubmissionError(KitError):
    """The submission cannot be graded as it is; the student can fix it. `remarks` are what else was noticed of it."""

    status = EXIT_NOT_GRADED
    remarks: Sequence[str] = ()


class GraderError(KitError):
    """The kit or its host failed; no submission loses points by it."""


class UsageError(GraderError):
    """The command asks for what cannot be done; nothing was graded and nothing was written."""

    status = EXIT_USAGE
